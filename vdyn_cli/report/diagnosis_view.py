"""The diagnosis of a result's JSON as words and tables; whatever of it is absent is left out, nothing is demanded."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.report import causes, words
from vdyn_cli.report import diagnosis_tables as tables
from vdyn_cli.report.loose import listed, maps, number
from vdyn_cli.report.views import Cells

# verdict: (label, mood)
VERDICTS: Mapping[str, tuple[str, str]] = {
    "adequate": ("adequate", "good"),
    "named": ("cause named", "good"),
    "ambiguous": ("ambiguous", "fair"),
    "unknown": ("cause unknown", "bad"),
    "not_testable": ("not testable", "fair"),
    "data_fault": ("data fault", "bad"),
}
_DOUBTED = ("ambiguous", "unknown")
_MENDED = ("named", "data_fault")


@dataclass(frozen=True)
class Gain:
    """What the extension mended: error before and after, as texts and as shares of the larger."""

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
class Diagnosis:
    """The diagnosis as its page section shows it.

    Parameters
    ----------
    notes : how it was judged, and what became of the model, in sentences.
    where : the pieces of the runs in which the baseline was most wrong.
    doubted : something is wrong that is not in the model.
    """

    label: str
    mood: str
    sentence: str
    gain: Gain | None
    notes: tuple[str, ...]
    tables: tuple[Cells, ...]
    where: Cells | None
    doubted: bool


def diagnosis(source: Mapping[str, Any] | None, parameters: Mapping[str, Estimate] | None = None) -> Diagnosis | None:
    """Read the diagnosis of a document, None where there is none.

    Parameters
    ----------
    parameters : against whose values a bias is told in per cent.
    """
    if not isinstance(source, Mapping) or not source:
        return None
    verdict = str(source.get("verdict", ""))
    label, mood = VERDICTS.get(verdict, (words.name(verdict) or "diagnosed", ""))
    mood = "fair" if mood == "good" and source.get("doubt") else mood
    known = {n: e.value for n, e in (parameters or {}).items()}
    shown = (
        tables.found(maps(source.get("causes")), known),
        tables.next_tests(maps(source.get("next_test")), answered=verdict in ("adequate", *_MENDED)),
        tables.ranking(maps(source.get("ranking"))),
        tables.not_testable(maps(source.get("not_testable")), known),
    )
    return Diagnosis(
        label,
        mood,
        words.prose(source.get("sentence", "")),
        gain(source.get("gain")),
        tuple(n for n in (_evidence(source), _ambiguous(source), _extended(source)) if n),
        tuple(t for t in shown if t is not None),
        tables.where(maps(source.get("where"))),
        verdict in _DOUBTED or (verdict in _MENDED and not listed(source.get("extended")) and "extended" in source),
    )


def gain(source: Any) -> Gain | None:
    """The gain with its bars, None where before and after are not both known."""
    if not isinstance(source, Mapping):
        return None
    before, after = number(source.get("before")), number(source.get("after"))
    if not (math.isfinite(before) and math.isfinite(after)):
        return None
    largest = max(before, after) or 1.0
    interval = source.get("interval95")
    bounds = [number(v) for v in interval] if isinstance(interval, Sequence) and len(interval) == 2 else []
    share = number(source.get("share_of_explainable"))
    metric = words.prose(source.get("metric", "error"))
    sure = "" if source.get("certain", True) else ", though not for certain"
    if not sure and bounds and bounds[0] <= 0:
        sure = f", though of the {metric} alone that is not certain"
    unit = words.unit(str(source.get("unit") or ""))
    return Gain(
        metric,
        unit,
        words.significant(before, 2),
        words.significant(after, 2),
        round(100 * before / largest, 1),
        round(100 * after / largest, 1),
        _change(before, after),
        f"{words.significant(bounds[0], 2)} to {words.significant(bounds[1], 2)} {unit}".strip() if bounds else "",
        f"{words.fixed(100 * share, 0)}{words.NARROW}% of what was above the noise, all channels together{sure}"
        if math.isfinite(share)
        else "",
        bool(source.get("held_out")),
    )


def _change(before: float, after: float) -> str:
    if not before > 0:
        return ""
    percent = words.fixed(abs(100 * (after - before) / before), 0)
    return "unchanged" if percent == "0" else f"{percent}{words.NARROW}% {'less' if after < before else 'more'}"


def _evidence(source: Mapping[str, Any]) -> str:
    """What the verdict rests on, in a sentence or two."""
    evidence = source.get("evidence")
    told = evidence if isinstance(evidence, Mapping) else {}
    units, worth, smallest = (number(told.get(k)) for k in ("units", "worth", "smallest_p"))
    if not math.isfinite(units):
        return ""
    kind = "pieces of runs" if told.get("unit") == "block" else "whole runs"
    stated = number(told.get("stated", 0))
    text = f"Judged by {words.fixed(units - stated, 0)} {kind}"
    text += f" and {words.count(int(stated), 'stated value')}" if stated > 0 else ""
    text += " as independent evidence"
    text += f", worth {words.fixed(worth, 0)} equal ones" if math.isfinite(worth) else ""
    p = tables.p_value(source.get("p_value"))
    text += f". Were nothing wrong, chance alone would show as much with p = {p}" if p != words.DASH else ""
    text += f"; the least that so many pieces can give is {tables.p_value(smallest)}" if math.isfinite(smallest) else ""
    return text.replace("= <", "<") + "."


def _extended(source: Mapping[str, Any]) -> str:
    """What became of the model: which causes are in it now, and whether they go with the vehicle."""
    taken = [str(n) for n in listed(source.get("extended"))]
    found = {str(c.get("effect")): c for c in maps(source.get("causes"))}
    if not taken:
        why = str(source.get("not_extended") or "")
        asked = "The model was left as it was, as the description asks (extend: never)." if found else ""
        return f"{_sentence(why)}." if why else asked
    named = {n: causes.told(found.get(n, {"effect": n})) for n in taken}
    text = f"The parameters above are those of the model with {causes.joined(list(named.values()))} in it."
    lasting = [named[n] for n in taken if found.get(n, {}).get("lasts")]
    passing = [named[n] for n in taken if n in found and not found[n].get("lasts")]
    if lasting:
        text += f" Later steps and exports keep {causes.joined(lasting)} as part of the vehicle."
    if passing:
        stay = "stay" if len(passing) > 1 else "stays"
        text += f" {_sentence(causes.joined(passing))} {stay} with this test, as no part of the vehicle."
    return text


def _ambiguous(source: Any) -> str:
    """Which causes these data can't tell apart: one out of each set makes the answer."""
    every = [[causes.combined(n) for n in listed(one)] for one in listed(source.get("ambiguous")) if listed(one)]
    if not any(len(one) > 1 for one in every):
        return ""
    named = [_either(one) if len(one) > 1 else one[0] for one in every]
    asked = source.get("verdict") == "ambiguous" and listed(source.get("extended"))
    said = "extended by what was asked for" if asked else "not extended"
    return (
        f"With {', and '.join(named)} in the model, what is left is noise: these data can't tell which it is. The model"
        f" was {said}; the next test would tell."
    )


def _either(named: Sequence[str]) -> str:
    return " or ".join([", ".join(named[:-1]), named[-1]])


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]
