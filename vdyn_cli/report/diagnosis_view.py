"""The diagnosis of a result's JSON as words and tables; whatever of it is absent is left out, nothing is demanded."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from vdyn_cli.report import words
from vdyn_cli.report.views import Cells, signed
from vdyn_cli.vocabulary import PARAMETERS

# verdict: (label, mood)
VERDICTS: Mapping[str, tuple[str, str]] = {
    "adequate": ("adequate", "good"),
    "named": ("cause named", "good"),
    "ambiguous": ("ambiguous", "fair"),
    "unknown": ("cause unknown", "bad"),
    "not_testable": ("not testable", "fair"),
    "data_fault": ("data fault", "bad"),
}


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
    """The diagnosis as its page section shows it."""

    label: str
    mood: str
    sentence: str
    gain: Gain | None
    tables: tuple[Cells, ...]
    where: Cells | None


def diagnosis(source: Mapping[str, Any] | None) -> Diagnosis | None:
    """Read the diagnosis of a document, None where there is none."""
    if not isinstance(source, Mapping) or not source:
        return None
    verdict = str(source.get("verdict", ""))
    label, mood = VERDICTS.get(verdict, (words.name(verdict) or "diagnosed", ""))
    tables = (
        _causes(_maps(source.get("causes"))),
        _ambiguous(source.get("ambiguous")),
        _not_testable(_maps(source.get("not_testable"))),
        _next_tests(_maps(source.get("next_test"))),
    )
    return Diagnosis(
        label,
        mood,
        words.prose(source.get("sentence", "")),
        gain(source.get("gain")),
        tuple(t for t in tables if t is not None),
        _where(_maps(source.get("where"))),
    )


def gain(source: Any) -> Gain | None:
    """The gain with its bars, None where before and after are not both known."""
    if not isinstance(source, Mapping):
        return None
    before, after = _number(source.get("before")), _number(source.get("after"))
    if not (math.isfinite(before) and math.isfinite(after)):
        return None
    largest = max(before, after) or 1.0
    interval = source.get("interval95")
    bounds = [_number(v) for v in interval] if isinstance(interval, Sequence) and len(interval) == 2 else []
    share = _number(source.get("share_of_explainable"))
    unit = words.unit(str(source.get("unit") or ""))
    return Gain(
        words.prose(source.get("metric", "error")),
        unit,
        words.significant(before, 2),
        words.significant(after, 2),
        round(100 * before / largest, 1),
        round(100 * after / largest, 1),
        f"{words.fixed(100 * (after - before) / before, 0)}{words.NARROW}%" if before > 0 else "",
        f"{words.significant(bounds[0], 2)} to {words.significant(bounds[1], 2)} {unit}".strip() if bounds else "",
        f"{words.fixed(100 * share, 0)}{words.NARROW}%" if math.isfinite(share) else "",
        bool(source.get("held_out")),
    )


def _causes(causes: Sequence[Mapping[str, Any]]) -> Cells | None:
    rows = [
        (
            words.name(str(c.get("effect", ""))),
            "; ".join(_size(str(k), v) for k, v in _items(c.get("unknowns"))),
            _p_value(c.get("p_value")),
            words.plain(c.get("visibility")),
            _biases(c.get("biased")),
        )
        for c in causes
    ]
    columns = ("cause", "size, 95 %", "p", "visibility", "had biased")
    caption = (
        "Visibility is the share of a cause's trace that the other unknowns can't imitate: near 1 it stands out,"
        " below 0.1 these data hardly show it."
    )
    return _table("Causes found", caption, columns, rows, (False, False, True, True, False))


def _size(name: str, value: Any) -> str:
    if not isinstance(value, Mapping):
        return f"{words.name(name)} {words.plain(value)}"
    low, high = [*_list(value.get("interval95")), math.nan, math.nan][:2]
    r = words.reading(_number(value.get("value")), _number(low), _number(high))
    power = f" × 10{words.superscript(r.exponent)}" if r.exponent else ""
    spread = f" ± {r.plus}" if r.plus and r.symmetric else f" +{r.plus} −{r.minus}" if r.plus else ""
    return f"{words.name(name)} {r.value}{spread}{power} {words.unit(str(value.get('unit') or ''))}".strip()


def _ambiguous(sets: Any) -> Cells | None:
    rows = [(" or ".join(_names(one)),) for one in _list(sets) if _names(one)]
    caption = "Each line's causes leave the same trace in these data; the next test below would tell them apart."
    return _table("Can't be told apart", caption, ("any of",), rows, (False,))


def _not_testable(entries: Sequence[Mapping[str, Any]]) -> Cells | None:
    rows = [
        (words.name(str(e.get("effect", ""))), words.plain(e.get("because")), _biases(e.get("would_bias")))
        for e in entries
    ]
    return _table(
        "Not testable with these data",
        "Were such a cause there, nobody could see it here, and it would shift the parameters of the last column.",
        ("cause", "because", "would bias"),
        rows,
        (False, False, False),
    )


def _next_tests(entries: Sequence[Mapping[str, Any]]) -> Cells | None:
    rows = [
        (
            words.plain(e.get("manoeuvre")),
            " from ".join(_names(e.get("separates"))),
            words.plain(e.get("runs")),
            words.plain(e.get("expected_t")),
        )
        for e in entries
    ]
    caption = "Expected t is how many standard errors apart the causes would then be: 6 is safe, 2 is a guess."
    columns = ("manoeuvre", "tells apart", "runs", "expected t")
    return _table("The next test to drive", caption, columns, rows, (False, False, True, True))


def _where(entries: Sequence[Mapping[str, Any]]) -> Cells | None:
    keys = list(dict.fromkeys(str(k) for e in entries for k in e))
    rows = [tuple("" if e.get(k) is None else words.plain(e[k]) for k in keys) for e in entries]
    numeric = tuple(all(isinstance(e.get(k), (int, float, type(None))) for e in entries) for k in keys)
    return _table("Largest errors", "", tuple(words.name(k) for k in keys), rows, numeric)


def _table(
    title: str, caption: str, columns: tuple[str, ...], rows: Sequence[tuple[str, ...]], numeric: tuple[bool, ...]
) -> Cells | None:
    return Cells(title, caption, columns, tuple(rows), numeric) if rows else None


def _biases(source: Any) -> str:
    parts = []
    for name, value in _items(source):
        quantity = PARAMETERS.get(str(name))
        unit = words.unit(quantity.unit) if quantity else ""
        parts.append(f"{words.name(str(name))} {signed(_number(value), 2)} {unit}".strip())
    return "; ".join(parts)


def _p_value(value: Any) -> str:
    p = _number(value)
    return words.DASH if not math.isfinite(p) else "< 0.0001" if p < 1e-4 else words.significant(p, 2)


def _number(value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan


def _list(value: Any) -> list[Any]:
    return list(value) if isinstance(value, (list, tuple)) else []


def _names(value: Any) -> list[str]:
    return [words.name(str(n)) for n in _list(value)]


def _maps(value: Any) -> list[Mapping[str, Any]]:
    return [v for v in _list(value) if isinstance(v, Mapping)]


def _items(value: Any) -> list[tuple[Any, Any]]:
    return list(value.items()) if isinstance(value, Mapping) else []
