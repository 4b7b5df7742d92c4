"""The published part at fault: its curve, its share, the sentence about it, and its figure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from vdyn_cli.diagnosis.part.learned_law import Learned
from vdyn_cli.diagnosis.part.part_curve import Curve
from vdyn_cli.diagnosis.part.part_finding import LawWithin, PartFinding
from vdyn_cli.diagnosis.part.part_judgment import PartJudgment, label_of
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.verdict_text import is_plural
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.diagnosis import CurvePoint, Diagnosis, FaultyPart, LearnedLaw, PartLaw
from vdyn_cli.quantities.number_text import decimals
from vdyn_cli.quantities.result import Figure, Series
from vdyn_cli.steps.free_part import Part
from vdyn_cli.steps.learned_effect import LAW_FORMS

WHOLE = "nothing; it is the whole law, including the baseline's"
ADDITION = "a constant and what the fitted parameters absorb; it is an addition to the model"
ERROR = "a gain and a zero, which the fitted parameters absorb; it is the sensor's error"
GAIN = "a constant gain, which the fitted parameters absorb; it is the sensor's relative error"
MOST_FORMS = 3  # equally good forms that a sentence names


def with_published_part(diagnosis: Diagnosis, found: PartJudgment) -> Diagnosis:
    """The diagnosis with the part at fault, and with the sentence about that part added to its sentence."""
    finding = found.finding
    if finding is None or not finding.curves:
        return diagnosis
    part = _faulty_part(finding, found.law)
    learned = _learned(finding, found.learned, diagnosis) if found.learned is not None else None
    acting = _acting(finding, diagnosis)
    if acting == () and part.law is None and learned is None:
        sentence = elsewhere(part, finding.parts[0].over)
    else:
        sentence = f"{_lies_in(finding, part)}; {law_clause(part, learned, acting)}. {finding.parts[0].resembles}"
    sentence = sentence if finding.explains else ""
    text = f"{diagnosis.sentence} {sentence}".strip()
    return diagnosis.model_copy(update={"part": part, "learned": learned, "sentence": text})


def _faulty_part(finding: PartFinding, law: LawWithin | None) -> FaultyPart:
    first = finding.parts[0]
    return FaultyPart(
        element=finding.name,
        label=label_of(finding.parts),
        coordinate=first.coordinate,
        coordinate_unit=first.coordinate_unit,
        unit=first.unit,
        curve=tuple(p for c, v in zip(finding.curves, _followed(finding, law), strict=True) for p in points_of(c, v)),
        baseline=tuple(float(v) for c in finding.curves for v in c.baseline),
        gauge=_gauge(first),
        share_of_rms=finding.share_of_rms,
        explains=finding.explains,
        rivals=finding.rivals,
        law=None if law is None else _law(finding, law),
    )


def _gauge(part: Part) -> str:
    """What the curve of a part does not determine."""
    if part.sensor:
        return GAIN if part.factor else ERROR
    return WHOLE if part.law is not None else ADDITION


def _followed(finding: PartFinding, law: LawWithin | None) -> tuple[Array | None, ...]:
    """Values of the law for each curve if it follows the curves; None otherwise."""
    return law.values if law is not None and law.follows and law.values else (None,) * len(finding.curves)


def points_of(curve: Curve, law: Array | None) -> tuple[CurvePoint, ...]:
    """The points of a curve with their intervals.

    half' = sqrt(half^2 + (value - law)^2)

    Parameters
    ----------
    law : (n,), a law of the catalog that follows the curve. The band includes it, since the free curve is too smooth
        for sharp bends.
    """
    half = curve.half if law is None else np.hypot(curve.half, curve.value - law)
    return tuple(
        CurvePoint(at=x, value=v, interval95=(v - h, v + h), place=curve.part.place)
        for x, v, h in zip(curve.at.tolist(), curve.value.tolist(), half.tolist(), strict=True)
    )


def _law(finding: PartFinding, law: LawWithin) -> PartLaw:
    label = finding.search.strategy.model.setup.candidates[law.effect].label
    return PartLaw(
        effect=law.effect,
        label=label,
        share_of_curve=law.share_of_curve,
        share_of_rms=law.share_of_rms,
        values=tuple(float(v) for values in law.values for v in values),
    )


def _learned(finding: PartFinding, law: Learned, diagnosis: Diagnosis) -> LearnedLaw:
    """The learned law with its coefficients, as the extended model or the diagnosis fitted them."""
    unknowns = next((c.unknowns for c in diagnosis.causes if c.effect == law.name), {})
    formula = "sum of the shapes in the table" if law.form == "table" else LAW_FORMS[law.form].text
    base = finding.search.start.values
    shown = (replace(c, value=c.unabsorbed(c.value, base)) for c in finding.curves)
    return LearnedLaw(
        effect=law.name,
        element=finding.name,
        form=law.form,
        formula=formula,
        coefficients=unknowns,
        indistinguishable=law.indistinguishable,
        table=tuple(p for c in shown for p in points_of(c, None)),
    )


def _lies_in(finding: PartFinding, part: FaultyPart) -> str:
    what = f"The error is in {part.label}; curve over {finding.parts[0].over} with 95 % band"
    rivals = " and ".join(name.replace("_", " ") for name in part.rivals)
    return what + (f"; these data cannot discriminate it from an error of {rivals}" if rivals else "")


def _acting(finding: PartFinding, diagnosis: Diagnosis) -> tuple[str, ...] | None:
    """Labels of the effects that the verdict names and that act on the part; None where it names no effect."""
    if diagnosis.verdict not in ("named", "ambiguous"):
        return None
    joined = (*(c.effect for c in diagnosis.causes), *(e for one in diagnosis.ambiguous for e in one))
    candidates = finding.search.strategy.model.setup.candidates
    named = [candidates[n] for one in joined for n in one.split("+") if n in candidates]
    return tuple(dict.fromkeys(e.label for e in named if finding.parts[0].concerns(e)))


def elsewhere(part: FaultyPart, over: str) -> str:
    """The sentence about a part on which no named effect acts; ``over``: its coordinate, in words."""
    return f"A free curve of {part.label} over {over} would also explain the error; no named effect acts on that part."


def law_clause(part: FaultyPart, learned: LearnedLaw | None, acting: Sequence[str] | None) -> str:
    """The end of the sentence about the part: the law of its curve.

    Parameters
    ----------
    learned : the law learned from the curve. acting : labels of the effects that the verdict names and that act on
        the part; None where it names no effect.
    """
    if learned is not None:
        like = [form.replace("_", " ") for form in learned.indistinguishable[:MOST_FORMS]]
        others = f" ({' or '.join(like)} would fit equally well)" if like else ""
        form = "a table" if learned.form == "table" else f"{learned.form.replace('_', ' ')}: {learned.formula}"
        return f"no law of the catalog follows the curve, and its law is learned as {form}{others}"
    if part.law is None and acting is None:
        return f"no law of the catalog follows the curve{_deviation(part)}"
    if part.law is None:
        return f"of the named effects, these act on it: {', '.join(acting or ())}"
    label = part.law.label
    # A law that does not follow the whole curve may still explain all of the misfit, if few samples cover the rest.
    if not part.law.share_of_curve >= POLICY.law_share:
        share = f"{100 * part.law.share_of_rms:.0f} % of the rms error that the free curve explains"
    else:
        share = f"{100 * part.law.share_of_curve:.0f} % of the curve's rms deviation from the model's law"
    return f"{label} {'explain' if is_plural(label) else 'explains'} {share}"


def _deviation(part: FaultyPart) -> str:
    """The largest significant deviations of the curve from the model's law, one of each sign; empty without any."""
    found = []
    for sign in (1.0, -1.0) if part.curve else ():
        each = [
            (sign * (c.value - b), 0.5 * (c.interval95[1] - c.interval95[0]), c.at)
            for c, b in zip(part.curve, part.baseline, strict=True)
        ]
        size, half, at = max(each, key=lambda one: one[0] - one[1])
        if size > half:
            places = decimals(half, 12)
            value = f"{sign * size:+.{places}f} +- {half:.{places}f} {part.unit}".rstrip()
            found.append(f"{value} at {at:.3g} {part.coordinate_unit}".rstrip())
    return f", which deviates from the model's refitted law by {' and '.join(found)}" if found else ""


def part_figure(part: FaultyPart) -> Figure:
    """The part's law with its band over the range that the data cover, the baseline's law, and the named law."""
    series = []
    first = 0
    laws = part.law.values if part.law is not None and len(part.law.values) == len(part.curve) else ()
    for place, group in groupby(part.curve, key=lambda p: p.place):
        points = tuple(group)
        rows = slice(first, first + len(points))
        first += len(points)
        x = np.array([p.at for p in points])
        low, high = np.array([p.interval95 for p in points]).T
        of = f", {place}" if place else ""
        value = np.array([p.value for p in points])
        series.append(Series(f"95 % band{of}", x, low, "band", role="simulated", y2=high))
        series.append(Series(f"free curve{of}", x, value, "line", role="simulated"))
        series.append(Series(f"model's law{of}", x, np.array(part.baseline[rows]), "line", role="baseline"))
        if laws and part.law is not None:
            series.append(Series(f"{part.law.label}{of}", x, np.array(laws[rows]), "line", role="reference"))
    unit = f" in {part.unit}" if part.unit else ""
    over = part.coordinate.replace("_", " ")
    caption = (
        f"Where the error lies: {part.label}, estimated as a free curve over the range that the runs cover. Good: the "
        "named law runs inside the band. Bad: it leaves the band (another law), or the band is as wide as the curve is "
        f"high (too few data). Curve defined up to: {part.gauge}."
    )
    x_label = f"{over} in {part.coordinate_unit}" if part.coordinate_unit else over
    return Figure("part", "The part at fault", caption, x_label, f"{part.label}{unit}", tuple(series))
