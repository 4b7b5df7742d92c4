"""Self-contained pages of a step, published or refused, and of a pipeline; the same input gives the same bytes."""

from __future__ import annotations

from dataclasses import dataclass

from vdyn_cli.project.result_document import StepRecord
from vdyn_cli.report.canvas import style
from vdyn_cli.report.pipeline_page import render_pipeline
from vdyn_cli.report.step_page import step_page
from vdyn_cli.report.template import fill

__all__ = ["RenderedStep", "render", "render_pipeline"]


@dataclass(frozen=True)
class RenderedStep:
    """HTML text of one step: its ``page``, and its ``section`` of the pipeline's page."""

    page: str
    section: str


def render(record: StepRecord) -> RenderedStep:
    """The HTML of one step; the same record gives the same bytes."""
    with style():
        shown = step_page(record)
    title = f"{shown.title or shown.step}: {shown.sentence}"
    page = fill("page.html", title=title, name=shown.step, nav=shown.nav, body=shown.section(level=1))
    return RenderedStep(page, str(shown.section(level=2)))
