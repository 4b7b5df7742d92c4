"""Self-contained pages of a step, of a failure and of a pipeline: same input, same bytes, nothing fetched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from vdyn_cli.project.result_document import StepRecord
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.report import typography
from vdyn_cli.report.pipeline_page import render_pipeline
from vdyn_cli.report.provenance_view import finding_texts
from vdyn_cli.report.step_page import step_page
from vdyn_cli.report.template import fill, markup

__all__ = ["RenderedStep", "render", "render_failure", "render_pipeline"]


@dataclass(frozen=True)
class RenderedStep:
    """HTML text of one step: its own ``page``, and its ``section`` of the pipeline's page."""

    page: str
    section: str


def render(record: StepRecord) -> RenderedStep:
    """The HTML of one step; the same record gives the same bytes."""
    shown = step_page(record)
    title = f"{shown.title or shown.step}: {shown.sentence}"
    page = fill("page.html", title=title, name=shown.step, nav=shown.nav, body=shown.section(level=1))
    return RenderedStep(page, str(shown.section(level=2)))


def render_failure(name: str, findings: Sequence[Finding]) -> str:
    """The page of a step whose result cannot be published: every reason with its remedy, and no parameters.

    Parameters
    ----------
    name : of the step.
    """
    shown = typography.clean(name)
    body = markup(fill("failure.html", name=shown, findings=[finding_texts(f) for f in findings]))
    return fill("page.html", title=f"{shown}: no result", name=shown, nav=(), body=body)
