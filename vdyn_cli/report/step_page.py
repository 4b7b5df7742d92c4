"""The content of a step's page as one typed object, for its own page and for the pipeline's page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vdyn_cli.project.result_document import StepRecord
from vdyn_cli.quantities.errors import BEFORE_REMEDY, merge_similar
from vdyn_cli.report import comparison, residual_map, typography
from vdyn_cli.report.chips import Chip, chips
from vdyn_cli.report.clock_table import clock_table
from vdyn_cli.report.cut_table import cut_sentence, cut_table
from vdyn_cli.report.diagnosis_view import DiagnosisSection, diagnosis_section
from vdyn_cli.report.figures import figure_svg
from vdyn_cli.report.panels import ChannelTraces, channel_traces
from vdyn_cli.report.parameter_table import (
    CorrelationCell,
    MissingRow,
    ParameterRow,
    correlation,
    missing_row,
    parameter_rows,
    strongest,
    widths,
)
from vdyn_cli.report.provenance_view import ProvenanceView, finding_texts, provenance_view
from vdyn_cli.report.template import fill, markup, slug
from vdyn_cli.report.text_table import TextTable, run_table, text_table

if TYPE_CHECKING:
    from markupsafe import Markup

_MAPS = 4  # channels with a residual map; more would repeat the same pattern


@dataclass(frozen=True)
class Plot:
    """A drawn figure with its caption."""

    title: str
    caption: str
    svg: Markup
    runs: TextTable | None = None


@dataclass(frozen=True)
class StepPage:
    """The content of a step's page: texts, tables and drawn figures.

    Parameters
    ----------
    slug : prefix of every id of the page.
    about : short description of the step.
    refused : reasons why there is no result; empty for a published one.
    warnings : fact and remedy of each; the remedy may be empty.
    withheld : parameters that the data do not determine.
    """

    slug: str
    step: str
    title: str
    about: str
    sentence: str
    diagnosis: DiagnosisSection | None
    chips: tuple[Chip, ...]
    parameters: tuple[ParameterRow, ...]
    refused: tuple[Mapping[str, str], ...]
    withheld: tuple[MissingRow, ...]
    warnings: tuple[tuple[str, str], ...]
    comparisons: tuple[Plot, ...]
    maps: tuple[Plot, ...]
    figures: tuple[Plot, ...]
    tables: tuple[TextTable, ...]
    findings: tuple[Mapping[str, str], ...]
    cut: str
    clocks: TextTable | None
    cuts: TextTable | None
    methods: tuple[str, ...]
    correlation: tuple[tuple[str, tuple[CorrelationCell, ...]], ...]
    strongest: str
    provenance: ProvenanceView

    @property
    def widths(self) -> Mapping[str, int]:
        """Characters before and after the decimal point of each column of the parameters."""
        return widths(self.parameters)

    @property
    def moved(self) -> bool:
        """Whether an extension of the model changed a parameter."""
        return any(r.before for r in self.parameters)

    @property
    def where_title(self) -> str:
        """The heading of the residual maps and the largest errors."""
        good = self.diagnosis is not None and self.diagnosis.mood == "good" and not self.diagnosis.worst
        return "Measured minus simulated, run by run" if good else "Where the model is wrong"

    @property
    def nav(self) -> list[tuple[str, str]]:
        """Links to the sections of this page: (id, text)."""
        parts = (
            ("fit", "Fit", self.comparisons),
            ("where", self.where_title, self.maps or (self.diagnosis and self.diagnosis.worst)),
            ("diagnosis", "Diagnosis", self.diagnosis),
            ("detail", "Results", self.figures or self.tables),
            ("data", "Data", self.findings or self.cuts),
            ("methods", "Methods", self.methods or self.correlation),
            ("provenance", "Provenance", True),
        )
        return [(f"{self.slug}-{part}", text) for part, text, there in parts if there]

    def section(self, level: int) -> Markup:
        """The content as HTML.

        Parameters
        ----------
        level : level of its first heading: 1 on the step's own page, 2 on the pipeline's page.
        """
        return markup(fill("step.html", page=self, level=level))


def step_page(record: StepRecord) -> StepPage:
    """The page of a step's record, which also holds what the JSON does not: figures, tables and methods."""
    result = record.result
    name = slug(result.step)
    grouped = channel_traces(result.comparisons, result.fit.noise_floor, result.fit.unit)
    findings = merge_similar(result.findings)
    section = diagnosis_section(result.diagnosis, result.parameters)
    figures = [
        Plot(typography.prose(f.title), typography.prose(f.caption), markup(figure_svg(f, f"{name}-fig{i}")))
        for i, f in enumerate(result.figures)
    ]
    return StepPage(
        slug=name,
        step=typography.clean(result.step),
        title=typography.prose(record.title),
        about=_about(result.step),
        sentence=typography.prose(result.sentence),
        diagnosis=section,
        chips=chips(
            result.fit,
            sum(not (f.minor or f.doubt) for f in findings),
            name,
            gained=bool(section and section.gain and section.gain.held_out),
            doubted=bool(section and section.incomplete) or bool(result.fit.warnings),
        ),
        parameters=parameter_rows(result.parameters),
        refused=tuple(finding_texts(f) for f in result.refused),
        withheld=tuple(missing_row(name, why, "") for name, why in result.withheld.items()),
        warnings=tuple(_warning(w) for w in result.fit.warnings),
        comparisons=tuple(_comparison(c, f"{name}-run{i}") for i, c in enumerate(grouped)),
        maps=_maps(grouped, name),
        figures=tuple(figures),
        tables=tuple(text_table(t) for t in result.tables),
        findings=tuple(finding_texts(f) for f in findings),
        cut=cut_sentence(result.quality.ledger),
        clocks=clock_table(result.quality.clocks),
        cuts=cut_table(result.quality.ledger, dict(result.parameters.estimates)),
        methods=tuple(typography.prose(p) for p in result.methods.split("\n\n") if p.strip()),
        correlation=correlation(result.parameters.correlation),
        strongest=strongest(result.parameters.correlation),
        provenance=provenance_view(record.provenance),
    )


def _warning(text: str) -> tuple[str, str]:
    """The fact and the remedy of a warning; an empty remedy if it states none."""
    fact, _, remedy = text.partition(BEFORE_REMEDY)
    return typography.prose(fact), typography.prose(remedy)


def _about(step: str) -> str:
    from vdyn_cli.steps import names, summary

    return typography.prose(summary(step)) if step in names() else ""


def _comparison(channel: ChannelTraces, name: str) -> Plot:
    return Plot(
        f"{typography.title(channel.name)}, measured and simulated",
        typography.prose(comparison.caption(channel)),
        markup(comparison.comparison_svg(channel, name)),
        run_table(channel),
    )


def _maps(grouped: Sequence[ChannelTraces], name: str) -> tuple[Plot, ...]:
    """Residual maps; for an extended model also one before the extension, with the same color scale."""
    mapped = [c for c in grouped if residual_map.has_map(c)][:_MAPS]
    found = []
    for i, channel in enumerate(mapped):
        before = channel.before() if channel.extended else None
        what = f"{typography.title(channel.name)}: measured minus simulated, run by run"
        limit = 0.0 if before is None else residual_map.limit(before)
        if before is not None:
            svg = residual_map.map_svg(before, f"{name}-map{i}-before", limit)
            caption = typography.prose(residual_map.caption(before))
            found.append(Plot(f"{what}, before the extension", caption, markup(svg)))
        caption = residual_map.caption(channel) if before is None else "The same color scale as before the extension."
        title = what if before is None else f"{what}, after the extension"
        svg = residual_map.map_svg(channel, f"{name}-map{i}", limit)
        found.append(Plot(title, typography.prose(caption), markup(svg)))
    return tuple(found)
