"""The rows of a parameter table, and the table of correlations."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from string import ascii_lowercase

from vdyn_cli.quantities.number_text import listed
from vdyn_cli.quantities.parameters import BASELINE, UNEXPLAINED, Estimate, wider_than_value
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.report import effect_labels, typography

# Entries of ``Estimate.spans`` that are not effects, in words; the verdict is then undecided.
OPEN = {BASELINE: "the baseline", UNEXPLAINED: "a bias that no effect explains"}
Symbol = tuple[tuple[str, str], ...]  # base and subscript of each part


@dataclass(frozen=True)
class ParameterRow:
    """One line of a parameter table; ``before`` is empty if no extension changed the value.

    ``spans``: the other explanations whose values the interval includes; ``mark``: letter of the note that lists them;
    ``doubtful``: the diagnosis is undecided between them, or a part of the residual is unexplained; ``wide``: the
    half-width exceeds the value; ``without_interval``: the reason why there is none.
    """

    key: str
    name: str
    symbol: Symbol
    rounded: typography.RoundedEstimate
    without_interval: str
    unit: str
    relative: str
    meaning: str
    source: str
    before: str
    shift: str
    spans: str
    mark: str
    doubtful: bool
    wide: bool


def parameter_rows(estimates: Mapping[str, Estimate]) -> tuple[ParameterRow, ...]:
    """The rows of estimates in SI units, each rounded according to its interval."""
    spans = list(dict.fromkeys(e.spans for e in estimates.values() if e.spans))
    marks = dict(zip(spans, ascii_lowercase, strict=False))
    return tuple(_parameter_row(key, e, marks.get(e.spans, "")) for key, e in estimates.items())


def _parameter_row(key: str, e: Estimate, mark: str) -> ParameterRow:
    rounded = typography.rounded(e.value, *e.interval95)
    quantity = PARAMETERS.get(key)
    before, shift = _shift(e, rounded)
    return ParameterRow(
        key=key,
        name=typography.title(key),
        symbol=shown_symbol(key, quantity.symbol if quantity else ""),
        rounded=rounded,
        without_interval=_without_interval(e),
        unit=typography.unit(e.unit),
        relative=typography.relative(e.value, *e.interval95) if rounded.plus else "",
        meaning=typography.prose(e.meaning),
        source=typography.clean(e.source),
        before=before,
        shift=shift,
        spans=spans_text(e.spans),
        mark=mark,
        doubtful=any(one in OPEN for one in e.spans),
        wide=wider_than_value(key, e),
    )


def _without_interval(e: Estimate) -> str:
    if e.interval95 != (e.value, e.value):
        return "not known"
    return "assumed" if e.assumed else "exact"


def spans_text(spans: Sequence[str]) -> str:
    """The other explanations, in words, whose values an interval includes."""
    return listed([_answer(one) for one in spans], "or") if spans else ""


def _answer(name: str) -> str:
    if name in OPEN:
        return OPEN[name]
    return effect_labels.combined(name.replace(" + ", "+"))


def shown_symbol(key: str, text: str) -> Symbol:
    """The textbook symbol; empty if the name ends with it ("tire B")."""
    return () if text and typography.name(key).endswith(f" {text}") else typography.symbol(text)


@dataclass(frozen=True)
class MissingRow:
    """A parameter without a value: why, and which step estimates it."""

    name: str
    symbol: Symbol
    unit: str
    meaning: str
    why: str
    giver: str


def missing_row(name: str, why: str, giver: str) -> MissingRow:
    """The row of a parameter of the vocabulary without a value.

    Parameters
    ----------
    why : why it has no value. giver : the step that estimates it; empty to omit it.
    """
    quantity = PARAMETERS[name]
    return MissingRow(
        name=typography.title(name),
        symbol=shown_symbol(name, quantity.symbol),
        unit=typography.unit(quantity.unit),
        meaning=typography.prose(quantity.meaning),
        why=typography.prose(why),
        giver=giver,
    )


def _shift(e: Estimate, rounded: typography.RoundedEstimate) -> tuple[str, str]:
    """The value before the extension, with as many digits as the value after it, and the relative change."""
    if e.baseline is None or not math.isfinite(e.baseline) or not math.isfinite(e.value):
        return "", ""
    decimals = len(rounded.value.partition(".")[2])
    scale = 10.0**-rounded.exponent
    before = typography.fixed(e.baseline * scale, decimals)
    if before == rounded.value or abs(e.baseline - e.value) <= 1e-9 * abs(e.value):
        return "", ""
    moved = 100 * (e.value - e.baseline) / abs(e.baseline) if e.baseline else math.nan
    share = (
        "" if not math.isfinite(moved) or abs(moved) >= 1000 else f"{typography.signed(moved, 2)}{typography.NARROW}%"
    )
    return before, share


def widths(rows: Sequence[ParameterRow]) -> dict[str, int]:
    """Number of characters before and after the decimal point of each column, to align numbers at their points.

    Returns
    -------
    ``value_whole``, ``value_rest``, ``half_whole`` and ``half_rest``.
    """
    out = {}
    for key, texts in {
        "value": [r.rounded.value for r in rows],
        "half": [t for r in rows for t in (r.rounded.plus, r.rounded.minus)],
    }.items():
        parts = [t.partition(".") for t in texts] or [("", "", "")]
        out[f"{key}_whole"] = max(len(whole) for whole, _, _ in parts)
        out[f"{key}_rest"] = max(len(rest) + len(point) for _, point, rest in parts)
    return out


@dataclass(frozen=True)
class CorrelationCell:
    """A cell of the correlation table: its text, background color, and whether the text is white."""

    text: str
    color: str
    light: bool


def correlation(table: Mapping[str, Mapping[str, float]]) -> tuple[tuple[str, tuple[CorrelationCell, ...]], ...]:
    """The correlation table: name and cells of every row, without parameters that have no correlation with others."""
    names = [a for a in table if any(b != a for b in table[a])]
    return tuple((typography.name(a), tuple(_heat(table[a].get(b, math.nan), a == b) for b in names)) for a in names)


def _heat(value: float, own: bool) -> CorrelationCell:
    if own:
        return CorrelationCell("1", "#e3e3e3", False)
    if not math.isfinite(value):
        return CorrelationCell(typography.DASH, "#ffffff", False)
    strength = min(abs(value), 1.0) ** 1.5
    full = (0, 90, 150) if value < 0 else (190, 75, 0)
    red, green, blue = (round(255 + (c - 255) * strength) for c in full)
    return CorrelationCell(typography.fixed(value, 2), f"#{red:02x}{green:02x}{blue:02x}", strength > 0.55)


def strongest(table: Mapping[str, Mapping[str, float]]) -> str:
    """A sentence on the most correlated pair of a correlation table, empty if no magnitude exceeds 0.9."""
    pairs = [(abs(r), a, b, r) for a in table for b, r in table[a].items() if a < b and isinstance(r, float)]
    if not pairs or max(pairs)[0] < 0.9:
        return ""
    _, a, b, r = max(pairs)
    return (
        f"{typography.title(a)} and {typography.name(b)} are nearly collinear ({typography.fixed(r, 2)}): the data"
        " determine their combination better than each of them."
    )
