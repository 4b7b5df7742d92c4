"""The tables of a diagnosis: identified effects and their size, ranking, effects not testable, next tests."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.quantities.diagnosis import (
    Amplitude,
    Cause,
    Detectable,
    Diagnosis,
    NextTest,
    NotTestable,
    Ranked,
    Size,
    WorstSegment,
)
from vdyn_cli.quantities.parameters import Estimate, Extensions
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.report import effect_labels, typography
from vdyn_cli.report.text_table import TextTable

_UNKNOWNS = 3  # unknowns of one effect that are listed: three fit on one line; a free profile has up to twelve
_BIASES = 4  # biases or shifts of parameters in one cell: they fit into two lines of the column
_NOTICEABLE = 5e-4  # relative bias below which a parameter is omitted: it would show as 0.0 %
_FOLLOWS = {  # parameters computed from another one, whose bias they would repeat
    "drag_coefficient": "drag_area",
    "road_load_f0": "rolling_resistance",
    "road_load_f2": "drag_area",
}

_COLLINEAR = (
    "Own sensitivity: share of the effect's sensitivity that is not collinear with other parameters; below 10 % the"
    " data hardly show the effect."
)


def identified(causes: Sequence[Cause], known: Mapping[str, float]) -> TextTable | None:
    """The identified effects, with their estimates and the bias of the parameters in a model without them.

    Parameters
    ----------
    known : values of the parameters, SI; biases are stated in percent of them.
    """
    rows = [
        (
            effect_labels.bare(typography.prose(c.label) or effect_labels.label(c.effect))
            + (" (sensor)" if c.sensor else ""),
            estimates(c.unknowns),
            p_value(c.p_value),
            _percent(c.visibility),
            _biases(c.biased, known),
        )
        for c in causes
    ]
    columns = ("effect", "estimate, 95 %", "p", "own sensitivity", "bias without it")
    caption = (
        f"p: probability of a test statistic at least this large without the effect. {_COLLINEAR} Bias: error of the"
        " parameters while the model lacks the effect."
    )
    return _table("Identified effects", caption, columns, rows, (False, False, True, True, False))


def sizes(source: Diagnosis) -> TextTable | None:
    """The size of each identified effect, else of the finding as a whole; None without a significant finding."""
    rows = [(effect_labels.row_label(c.effect), *_size_row(c.size)) for c in source.causes if c.size is not None]
    if not rows and source.size is not None:
        rows = [("closest candidate" if source.verdict == "unknown" else "the finding", *_size_row(source.size))]
    caption = (
        "Change of the output: with the effect minus without it, rms over all runs, with the noise floor for"
        " comparison. At: in the run with the largest change, at the start, at its maximum and at the end. Share of"
        " rms: (error before − after) / (error before − noise floor), by rms. A finding below a tenth of the noise"
        " floor and of the half-width of every parameter's interval, or below the limits under 'matters' in the"
        " description, is only a note."
    )
    columns = ("finding", "change of the output", "at", "shift of parameters, std", "share of rms")
    return _table("Size of the finding", caption, columns, rows, (False, False, False, False, True))


def _size_row(size: Size) -> tuple[str, str, str, str]:
    unit = typography.unit(size.unit)
    floor = f" (noise {typography.significant(size.noise_floor, 2)})" if math.isfinite(size.noise_floor) else ""
    change = f"{typography.name(size.output)} {typography.significant(size.change, 2)}{floor} {unit}".strip()
    points = "; ".join(f"{typography.prose(p.at)}: {typography.signed(p.change, 2)}" for p in size.points)
    run = f"{typography.run_name(typography.prose(size.points[0].run))}: " if size.points else ""
    shifts = sorted(size.shifts_in_std.items(), key=lambda item: -abs(item[1]))
    more = f"; {len(shifts) - _BIASES} more" if len(shifts) > _BIASES else ""
    moved = "; ".join(f"{typography.name(n)} {typography.signed(t, 2)}" for n, t in shifts[:_BIASES]) + more
    share = f"{typography.fixed(100 * size.share_of_rms, 0)}{typography.NARROW}%"
    return change, f"{run}{points}", moved, share


def extensions(source: Extensions) -> TextTable | None:
    """The effects that belong to the vehicle of a parameter set."""
    rows = [(effect_labels.row_label(effect), estimates(unknowns)) for effect, unknowns in source.items()]
    caption = (
        "Identified by a test and part of the vehicle since then: later steps, validation and exports apply them"
        " together with the parameters above."
    )
    return _table("Effects in the model", caption, ("effect", "estimate, 95 %"), rows, (False, False))


def estimates(unknowns: Mapping[str, Amplitude] | Mapping[str, Estimate]) -> str:
    """Each unknown with its interval; for many unknowns (a free profile) their number and the largest."""
    if len(unknowns) <= _UNKNOWNS:
        alone = len(unknowns) == 1
        return "; ".join(_estimate("" if alone else name, one) for name, one in unknowns.items())
    values: list[Amplitude | Estimate] = list(unknowns.values())
    largest = max(values, key=lambda one: abs(one.value))
    return f"{len(unknowns)} values, largest {_estimate('', largest)}"


def _estimate(name: str, one: Amplitude | Estimate) -> str:
    r = typography.rounded(one.value, *one.interval95)
    power = f" × 10{typography.superscript(r.exponent)}" if r.exponent else ""
    spread = f" ± {r.plus}" if r.plus and r.symmetric else f" +{r.plus} −{r.minus}" if r.plus else ""
    shown = f"({r.value}{spread}){power}" if power and spread else f"{r.value}{spread}{power}"
    return f"{typography.name(name)} {shown} {typography.unit(one.unit)}".strip()


def ranking(entries: Sequence[Ranked]) -> TextTable | None:
    """Every candidate effect with its score test; if it was fitted, also the residual that remains with it."""
    fitted = any(e.left_p is not None for e in entries)
    rows = []
    for e in entries:
        t = typography.fixed(e.explains_t, 1) if math.isfinite(e.explains_t) else ""
        row = (effect_labels.row_label(e.effect), t, _percent(e.visibility))
        rows.append((*row, *((*_remainder(e), estimates(e.unknowns)) if fitted else ())))
    caption = (
        f"Score test, in standard errors, each candidate alone. {_COLLINEAR} A large score is not a proof, because"
        " candidates resemble each other."
    )
    if fitted:
        caption += (
            " The further columns come from a fit with the candidate in the model. p of the remainder: probability of"
            f" a residual at least this large from noise alone. Above {POLICY.rest_level:g} it is sufficient; below,"
            " another effect is present, and the remainder resembles the candidate in the next column."
        )
    more = ("p of the remainder", "remainder resembles", "estimate, 95 %") if fitted else ()
    columns = ("candidate effect", "score test", "own sensitivity", *more)
    numeric = (False, True, True, True, False, False)[: len(columns)]
    return _table("Candidate effects, strongest first", caption, columns, rows, numeric)


def _remainder(entry: Ranked) -> tuple[str, str]:
    if entry.left_p is None:
        return "not fitted", ""
    if entry.left_p > POLICY.rest_level:
        return p_value(entry.left_p), "noise"
    return p_value(entry.left_p), effect_labels.row_label(entry.left_mostly or "")


def detectable(entries: Sequence[Detectable], known: Mapping[str, float]) -> TextTable | None:
    """The smallest amplitude of each candidate effect that these data would reveal, with the parameters' bias by it.

    Parameters
    ----------
    known : values of the parameters, SI; biases are stated in percent of them.
    """
    rows = [
        (
            effect_labels.bare(typography.prose(e.label)),
            effect_labels.amplitude(e.effect, e.amplitude),
            _biases(e.would_bias, known) or "negligible",
        )
        for e in entries
    ]
    caption = (
        "The test finds an effect of this amplitude in nine of ten such data sets. Smaller effects remain possible: up"
        " to this amplitude, one that is present and not in the model biases the parameters by up to the last column."
    )
    columns = ("effect", "amplitude", "parameter bias")
    return _filled("Smallest effects these data could reveal", caption, columns, rows, (False, True, False))


def not_testable(entries: Sequence[NotTestable], known: Mapping[str, float]) -> TextTable | None:
    """The effects that the data cannot detect, and the bias of the parameters if they are present.

    Parameters
    ----------
    known : values of the parameters, SI; biases are stated in percent of them.
    """
    reasons = {typography.prose(e.because) for e in entries}
    shared = len(reasons) == 1 and len(entries) > 1
    rows = []
    for e in entries:
        row = [effect_labels.row_label(e.effect), effect_labels.amplitude(e.effect, e.size)]
        row += [] if shared else [typography.prose(e.because)]
        rows.append(
            (*row, _biases(e.would_bias, known) or ("negligible" if math.isfinite(e.size) else "not evaluated"))
        )
    caption = (
        "These data cannot reveal such an effect. If it is present with the assumed amplitude, the parameters have the"
        " bias in the last column."
    )
    if shared:
        caption += f" Reason for all of them: {reasons.pop()}."
    columns = ("effect", "assumed amplitude") + (() if shared else ("reason",)) + ("parameter bias",)
    return _table("Effects not testable with these data", caption, columns, rows, (False,) * len(columns))


def next_tests(entries: Sequence[NextTest], answered: bool) -> TextTable | None:
    """The recommended next tests: one row for each, and none for an effect that a test with an expected t separates.

    Parameters
    ----------
    answered : the verdict is clear, so that the tests are for effects that these data cannot detect.
    """
    planned = [e.separates for e in entries if e.expected_t is not None]
    rows: dict[tuple[str, str, str], list[str]] = {}
    for e in entries:
        if e.expected_t is None and e.separates in planned:
            continue
        runs = "" if e.runs is None else str(e.runs)
        t = "" if e.expected_t is None else typography.shortest(e.expected_t)
        effects = _separated([effect_labels.combined(n) for n in e.separates])
        rows.setdefault((typography.prose(e.manoeuvre), runs, t), []).append(effects)
    shown = [(what, "; ".join(effects), runs, t) for (what, runs, t), effects in rows.items()]
    caption = "These tests reveal the effects that the present data cannot reveal." if answered else ""
    if planned:
        apart = "the effect, with the amplitude assumed below, differs from zero" if answered else "the effects differ"
        caption += f" Expected t: by how many standard errors {apart}; 6 is safe, 2 is not."
    title = "Tests for the remaining effects" if answered else "Next test"
    separates = "separates" if any(len(e.separates) > 1 for e in entries) else "effect"
    columns = ("what to do", separates, "runs", "expected t")
    return _filled(title, caption.strip(), columns, shown, (False, False, True, True))


def _separated(labels: Sequence[str]) -> str:
    """The effects as "A from B", or "A from B, C or D"."""
    if len(labels) < 3:
        return " from ".join(labels)
    return f"{labels[0]} from {', '.join(labels[1:-1])} or {labels[-1]}"


_SEGMENT = re.compile(
    r"(?P<what>[^\[\],]+?)(?:\s*\[(?P<unit>[^\]]+)\]|,\s*(?P<plain>\S+))?\s+(?P<span>[-\d.e+]+ to [-\d.e+]+)"
)


def worst_segments(entries: Sequence[WorstSegment]) -> TextTable | None:
    """The segment of each run in which the baseline has its largest error."""
    rows = [
        (
            typography.run_name(typography.prose(e.run)),
            typography.name(e.channel),
            _segment(e.segment),
            _error(e.size, e.unit) if math.isfinite(e.size) else "",
            typography.significant(abs(e.over_noise), 2) if math.isfinite(e.over_noise) else "",
        )
        for e in entries
    ]
    return _filled(
        "Largest errors before any extension of the model",
        "The worst segment of each run. × noise: ratio to the noise level of the sensor.",
        ("run", "channel", "segment", "measured − simulated", "× noise"),
        rows,
        (False, False, False, True, True),
    )


def _segment(text: str) -> str:
    """``time in the run [s] 12 to 40`` as "time in the run 12 to 40 s"."""
    found = _SEGMENT.fullmatch(typography.prose(text))
    if found is None:
        return typography.prose(text)
    return f"{found['what']} {found['span']} {typography.unit(found['unit'] or found['plain'] or '')}".strip()


def _error(size: float, unit: str) -> str:
    shown, factor = typography.everyday(unit) or (unit, 1.0)
    return f"{typography.signed(size * factor, 2)} {typography.unit(shown)}".strip()


def _percent(share: float) -> str:
    percent = 100 * share
    if not math.isfinite(percent):
        return typography.DASH
    shown = "< 0.1" if 0 <= percent < 0.1 else typography.fixed(percent, 0 if percent >= 10 else 1)
    return f"{shown}{typography.NARROW}%"


def _table(
    title: str, caption: str, columns: tuple[str, ...], rows: Sequence[tuple[str, ...]], numeric: tuple[bool, ...]
) -> TextTable | None:
    return TextTable(title, caption, columns, tuple(rows), numeric) if rows else None


def _filled(
    title: str, caption: str, columns: tuple[str, ...], rows: Sequence[tuple[str, ...]], numeric: tuple[bool, ...]
) -> TextTable | None:
    """The table without columns that are empty in all rows."""
    keep = [i for i in range(len(columns)) if any(row[i] for row in rows)]
    cells = [tuple(row[i] for i in keep) for row in rows]
    return _table(title, caption, tuple(columns[i] for i in keep), cells, tuple(numeric[i] for i in keep))


def _biases(biases: Mapping[str, float], known: Mapping[str, float]) -> str:
    """The largest biases, in percent of parameters whose value is known, else in their unit."""
    parts = []
    for name, bias in biases.items():
        if _FOLLOWS.get(name) in biases:
            continue
        value = known.get(name, 0.0)
        if math.isfinite(value) and value and abs(bias / value) < 10:
            if abs(bias / value) >= _NOTICEABLE:
                percent = f"{typography.signed(100 * bias / value, 2)}{typography.NARROW}%"
                parts.append((abs(bias / value), f"{typography.name(name)} {percent}"))
            continue
        quantity = PARAMETERS.get(name)
        unit = typography.unit(quantity.unit) if quantity else ""
        parts.append((0.0, f"{typography.name(name)} {typography.signed(bias, 2)} {unit}".strip()))
    parts.sort(key=lambda p: -p[0])
    more = f"; {len(parts) - _BIASES} more" if len(parts) > _BIASES else ""
    return "; ".join(text for _, text in parts[:_BIASES]) + more


def p_value(p: float | None) -> str:
    """A p value with two digits; "< 0.0001" for smaller ones, a dash for None."""
    if p is None or not math.isfinite(p):
        return typography.DASH
    text = typography.significant(p, 2)
    return "< 0.0001" if p < 1e-4 else text.rstrip("0").rstrip(".") if "." in text else text
