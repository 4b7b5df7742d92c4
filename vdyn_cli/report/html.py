"""Self-contained pages of a step, of a failure and of a pipeline: same input, same bytes, nothing fetched."""

from __future__ import annotations

from collections.abc import Sequence

from vdyn_cli.project.result_document import StepRecord
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.report import typography
from vdyn_cli.report.pipeline_page import render_pipeline
from vdyn_cli.report.provenance_view import finding_texts
from vdyn_cli.report.step_page import step_page
from vdyn_cli.report.template import fill, markup

__all__ = ["render", "render_failure", "render_pipeline"]


def render(record: StepRecord) -> str:
    """The page of one step, as HTML text; the same record gives the same bytes."""
    page = step_page(record)
    title = f"{page.title or page.step}: {page.sentence}"
    return fill("page.html", title=title, name=page.step, nav=page.nav, body=page.section(level=1))


def render_failure(name: str, findings: Sequence[Finding]) -> str:
    """The page of a step whose result cannot be published: every reason with its remedy, and no parameters.

    Parameters
    ----------
    name : of the step.
    """
    shown = typography.clean(name)
    body = markup(fill("failure.html", name=shown, findings=[finding_texts(f) for f in findings]))
    return fill("page.html", title=f"{shown}: no result", name=shown, nav=(), body=body)
