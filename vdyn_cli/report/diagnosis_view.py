"""The diagnosis as a section of a page: verdict, gain, sentences and tables."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.verdict_text import remainder_sentence
from vdyn_cli.quantities.diagnosis import Diagnosis, Gain
from vdyn_cli.quantities.number_text import capitalized, listed
from vdyn_cli.quantities.parameters import Estimate, wider_than_value
from vdyn_cli.report import diagnosis_tables as tables
from vdyn_cli.report import effect_labels, typography
from vdyn_cli.report.text_table import TextTable

# verdict: (label, mood)
VERDICTS: Mapping[str, tuple[str, str]] = {
    "adequate": ("adequate", "good"),
    "named": ("effect identified", "good"),
    "ambiguous": ("ambiguous", "fair"),
    "unknown": ("unmodeled effect", "bad"),
    "not_testable": ("not testable", "fair"),
    "data_fault": ("data fault", "bad"),
}
_UNEXPLAINED = ("ambiguous", "unknown")
_EXPLAINED = ("named", "data_fault")


@dataclass(frozen=True)
class GainBars:
    """The error before and after the extension, as texts and as percentages of the larger one."""

    metric: str
    unit: str
    before: str
    after: str
    before_share: float
    after_share: float
    percent: str
    interval: str
    explained: str
    held_out: bool


@dataclass(frozen=True)
class DiagnosisSection:
    """The content of the diagnosis section.

    Parameters
    ----------
    mood : good, fair or bad: the color of the label.
    notes : sentences on the evidence for the verdict and on the extension of the model.
    worst : the segments in which the baseline has its largest errors.
    incomplete : an effect is present that is not in the model.
    """

    label: str
    mood: str
    sentence: str
    gain: GainBars | None
    notes: tuple[str, ...]
    tables: tuple[TextTable, ...]
    worst: TextTable | None
    incomplete: bool


def diagnosis_section(
    source: Diagnosis | None, parameters: Mapping[str, Estimate] = MappingProxyType({})
) -> DiagnosisSection | None:
    """The section for a diagnosis, None without one.

    Parameters
    ----------
    parameters : of the result, for biases in percent; one wider than its value makes a good verdict only fair, with
        the words "in doubt", as any other doubt does.
    """
    if source is None:
        return None
    label, mood = VERDICTS[source.verdict]
    if mood == "good" and (source.doubt or any(wider_than_value(n, e) for n, e in parameters.items())):
        label, mood = f"{label}, in doubt", "fair"  # an identified effect does not make such a parameter usable
    known = {n: e.value for n, e in parameters.items()}
    shown = (
        tables.identified(source.causes, known),
        tables.sizes(source),
        tables.next_tests(source.next_test, answered=source.verdict in ("adequate", *_EXPLAINED)),
        tables.ranking(source.ranking),
        tables.detectable(source.detectable, known),
        tables.not_testable(source.not_testable, known),
    )
    return DiagnosisSection(
        label=label,
        mood=mood,
        sentence=typography.prose(source.sentence),
        gain=_gain_bars(source.gain) if source.gain else None,
        notes=tuple(
            note for note in (_evidence(source), _ambiguous(source), _remainder(source), _extended(source)) if note
        ),
        tables=tuple(t for t in shown if t is not None),
        worst=tables.worst_segments(source.where),
        incomplete=source.verdict in _UNEXPLAINED or (source.verdict in _EXPLAINED and not source.extended),
    )


def _gain_bars(gain: Gain) -> GainBars | None:
    """The gain with its bars, None if the error before or after is unknown."""
    before, after = gain.before, gain.after
    if not (math.isfinite(before) and math.isfinite(after)):
        return None
    largest = max(before, after) or 1.0
    low, high = gain.interval95
    metric, unit = typography.prose(gain.metric), typography.unit(gain.unit)
    doubt = "" if gain.certain else ", not significant"
    share = typography.fixed(100 * gain.share_of_explainable, 0)
    return GainBars(
        metric=metric,
        unit=unit,
        before=typography.significant(before, 2),
        after=typography.significant(after, 2),
        before_share=round(100 * before / largest, 1),
        after_share=round(100 * after / largest, 1),
        percent=_change(before, after),
        interval=f"{typography.significant(low, 2)} to {typography.significant(high, 2)} {unit}".strip(),
        explained=f"{share}{typography.NARROW}% of the rms error above the noise floor{doubt}"
        if math.isfinite(gain.share_of_explainable)
        else "",
        held_out=gain.held_out,
    )


def _change(before: float, after: float) -> str:
    if not before > 0:
        return ""
    percent = typography.fixed(abs(100 * (after - before) / before), 0)
    return "unchanged" if percent == "0" else f"{percent}{typography.NARROW}% {'less' if after < before else 'more'}"


def _evidence(source: Diagnosis) -> str:
    """The evidence for the verdict, in a sentence."""
    evidence = source.evidence
    if evidence is None:
        return ""
    kind = "block" if evidence.unit == "block" else "run"
    text = f"The test uses {typography.count(evidence.units - evidence.stated, kind)}"
    text += f" and {typography.count(evidence.stated, 'prior')}" if evidence.stated else ""
    if math.isfinite(evidence.worth):
        text += f" as independent units (effective number {typography.fixed(evidence.worth, 0)})"
    if source.p_value is not None:
        p = tables.p_value(source.p_value)
        text += f". Probability of a statistic at least this large without a model error: p {_equals(p)}"
    if math.isfinite(evidence.smallest_p):
        text += f"; the smallest possible p with these units is {tables.p_value(evidence.smallest_p)}"
    return f"{text}."


def _equals(p: str) -> str:
    return p if p.startswith("<") else f"= {p}"


def _remainder(source: Diagnosis) -> str:
    """A sentence on the residual that remains with the identified effects; empty if it is noise."""
    left = source.remainder
    if left is None or left.p_value > POLICY.rest_level or not math.isfinite(left.share_of_rms) or not source.causes:
        return ""
    like = f", most like {effect_labels.label(left.mostly)}" if left.mostly else ""
    return remainder_sentence(left.share_of_rms, like)


def _extended(source: Diagnosis) -> str:
    """Sentences on the extension: the effects in the model, and which of them belong to the vehicle."""
    causes = {c.effect: c for c in source.causes}
    if not source.extended:
        why = typography.prose(source.not_extended)
        if why or not causes:
            return f"{capitalized(why)}." if why else ""
        if source.learned is not None:
            return "The model was not extended by the learned law; write 'extend: learned' under diagnose to add it."
        return "The model was not extended, as the description requests (extend: never)."
    labels = {n: typography.prose(causes[n].label) if n in causes else effect_labels.label(n) for n in source.extended}
    text = f"The parameters above are those of the model with {' and '.join(labels.values())}."
    lasting = [labels[n] for n in source.extended if n in causes and causes[n].lasts]
    passing = [labels[n] for n in source.extended if n in causes and not causes[n].lasts]
    if lasting:
        text += f" Later steps and exports keep {' and '.join(lasting)} as part of the vehicle."
    if passing:
        belong = "belong" if len(passing) > 1 else "belongs"
        text += f" {capitalized(' and '.join(passing))} {belong} to this test, not to the vehicle."
    return text


def _ambiguous(source: Diagnosis) -> str:
    """A sentence on the effects that these data cannot discriminate; one of each set is present."""
    sets = [[effect_labels.combined(n) for n in one] for one in source.ambiguous if one]
    if not any(len(one) > 1 for one in sets):
        return ""
    requested = source.verdict == "ambiguous" and source.extended
    extended = "extended only by what the description requests" if requested else "not extended"
    return (
        f"With {', and '.join(listed(one, 'or') for one in sets)} in the model, the remaining residual is noise: these "
        f"data do not discriminate between them. The model was {extended}; the next test decides."
    )
