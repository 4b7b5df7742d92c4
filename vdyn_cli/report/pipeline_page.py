"""The page of a pipeline: outcome of every step, the full parameter set, then the section of each step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from vdyn_cli.project.pipeline import ParameterSet, StepOutcome
from vdyn_cli.quantities.parameters import ESTIMATED_BY
from vdyn_cli.report import typography
from vdyn_cli.report.diagnosis_tables import extensions
from vdyn_cli.report.diagnosis_view import DiagnosisSection, diagnosis_section
from vdyn_cli.report.parameter_table import missing_row, parameter_rows, widths
from vdyn_cli.report.provenance_view import finding_texts, provenance_view
from vdyn_cli.report.template import fill, markup, slug

if TYPE_CHECKING:
    from markupsafe import Markup


@dataclass(frozen=True)
class StepRow:
    """Outcome of one step, a row of the first table; ``section`` is the HTML of its result, empty without one."""

    name: str
    slug: str
    status: str
    sentence: str
    diagnosis: DiagnosisSection | None
    findings: tuple[dict[str, str], ...]
    section: Markup


def render_pipeline(found: ParameterSet) -> str:
    """The page of a pipeline as HTML text.

    Each step's section was rendered when the step ran, so a reused step gives the same bytes.
    """
    rows = [_step_row(o) for o in found.outcomes]
    parameters = parameter_rows(found.parameters)
    missing = [missing_row(name, why, ESTIMATED_BY.get(name, "")) for name, why in found.missing.items()]
    good = sum(o.good for o in found.outcomes)
    warned = sum(bool(o.findings) for o in found.outcomes if o.good)
    title = typography.prose(found.title) or "Test day"
    body = fill(
        "pipeline.html",
        title=title,
        steps=rows,
        verdict=_verdict(found, good),
        status=_status(found, good, warned),
        mood="bad" if good < len(rows) else "fair" if warned else "good",
        parameters=parameters,
        widths=widths(parameters),
        moved=any(r.before for r in parameters),
        missing=missing,
        extensions=extensions(found.parameters.extensions),
        linked={r.name: r.slug for r in rows if r.section},
        provenance=provenance_view(found.provenance),
    )
    nav = [("parameters", "Parameter set"), *((f"step-{r.slug}", r.name) for r in rows if r.section)]
    return fill("page.html", title=f"{title}: parameter set", name="pipeline", nav=nav, body=markup(body))


def _step_row(outcome: StepOutcome) -> StepRow:
    return StepRow(
        name=typography.clean(outcome.name),
        slug=slug(outcome.name),
        status="done" if outcome.good else outcome.status,
        sentence=typography.prose(outcome.sentence),
        diagnosis=diagnosis_section(outcome.diagnosis),
        findings=tuple(finding_texts(f) for f in outcome.findings),
        section=markup(outcome.section),
    )


def _verdict(found: ParameterSet, good: int) -> str:
    of_steps = f"{good} of {typography.count(len(found.outcomes), 'step')} done"
    missing = len(found.missing)
    whole = "the parameter set is complete" if not missing else f"{typography.count(missing, 'parameter')} missing"
    return f"{typography.count(len(found.parameters), 'parameter')} known, {whole}; {of_steps}."


def _status(found: ParameterSet, good: int, warned: int) -> str:
    if good < len(found.outcomes):
        return "not all steps done"
    return "all steps done" + (f", {typography.count(warned, 'step')} with warnings" if warned else "")
