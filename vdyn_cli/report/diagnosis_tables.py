"""The tables of a diagnosis: what was found, how causes compare, what can't be shown, where it is wrong, what next."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.report import causes, words
from vdyn_cli.report.loose import items, listed, number
from vdyn_cli.report.views import Cells, signed

_UNKNOWNS = 3  # of one cause that are told one by one
_ENOUGH = 0.02  # chance of what is left, above which it passes for noise
_BIASES = 4  # parameters in one cell
_NOTICED = 5e-4  # share of a parameter that is worth a word
_FOLLOWS = {  # parameters that only repeat another one's shift
    "drag_coefficient": "drag_area",
    "road_load_f0": "rolling_resistance",
    "road_load_f2": "drag_area",
}

_TRACE = "Its own trace: the share of what it does to the data that no parameter imitates; below 10 % it hardly shows."

Entries = Sequence[Mapping[str, Any]]


def found(entries: Entries, known: Mapping[str, float]) -> Cells | None:
    rows = [
        (
            causes.bare(causes.told(c)) + (" (a sensor)" if c.get("sensor") is True else ""),
            sizes(items(c.get("unknowns"))),
            p_value(c.get("p_value")),
            _share(c.get("visibility")),
            _biases(c.get("biased"), known),
        )
        for c in entries
    ]
    columns = ("cause", "size, 95 %", "p", "its own trace", "without it, off by")
    caption = (
        f"p: how often chance alone would look as bad. {_TRACE} The last column is the error that the parameters had"
        " for want of the cause."
    )
    return _table("What was found", caption, columns, rows, (False, False, True, True, False))


def extensions(source: Any) -> Cells | None:
    """The causes that a parameter set carries, as part of the vehicle."""
    rows = [(causes.bare(causes.label(str(effect))), sizes(items(unknowns))) for effect, unknowns in items(source)]
    caption = (
        "Named by a test, and part of the vehicle since: validation, later tests and exports use them beside the"
        " parameters above."
    )
    return _table("Causes in the model", caption, ("cause", "size, 95 %"), rows, (False, False))


def sizes(unknowns: Sequence[tuple[Any, Any]]) -> str:
    """Each unknown with its interval; of many (a profile's knots) only how many there are, and the largest."""
    if len(unknowns) <= _UNKNOWNS:
        alone = len(unknowns) == 1
        return "; ".join(_size("" if alone else str(k), v) for k, v in unknowns)
    largest = max(unknowns, key=lambda kv: abs(number(kv[1].get("value") if isinstance(kv[1], Mapping) else kv[1])))
    return f"{len(unknowns)} values, the largest {_size('', largest[1])}"


def _size(name: str, value: Any) -> str:
    if not isinstance(value, Mapping):
        return f"{words.name(name)} {words.plain(value)}".strip()
    low, high = [*listed(value.get("interval95")), math.nan, math.nan][:2]
    r = words.reading(number(value.get("value")), number(low), number(high))
    power = f" × 10{words.superscript(r.exponent)}" if r.exponent else ""
    spread = f" ± {r.plus}" if r.plus and r.symmetric else f" +{r.plus} −{r.minus}" if r.plus else ""
    shown = f"({r.value}{spread}){power}" if power and spread else f"{r.value}{spread}{power}"
    return f"{words.name(name)} {shown} {words.unit(str(value.get('unit') or ''))}".strip()


def ranking(entries: Entries) -> Cells | None:
    """Every cause that would show, by what it explains alone; and where it was tried as the answer, what it leaves."""
    tried = any(math.isfinite(number(e.get("left_p"))) for e in entries)
    rows = []
    for e in entries:
        t = number(e.get("explains_t"))
        row = (causes.bare(causes.told(e)), words.fixed(t, 1) if math.isfinite(t) else "", _share(e.get("visibility")))
        rows.append((*row, *((*_left(e), sizes(items(e.get("unknowns")))) if tried else ())))
    caption = (
        f"Explains: by how many standard errors the cause stands out when it is tried alone. {_TRACE} A large number is"
        " no proof, since causes resemble each other."
    )
    if tried:
        caption += (
            " What counts is what is left once the cause is in the model. Left: how often pure noise would leave as"
            f" much. Above {_ENOUGH:g} the cause is enough; below, something else is in the data, and the column after"
            " it says what that looks like."
        )
    more = ("left", "what is left looks like", "its size then, 95 %") if tried else ()
    columns = ("cause", "explains", "its own trace", *more)
    right = (False, True, True, True, False, False)[: len(columns)]
    return _table("Causes that these data could show, strongest first", caption, columns, rows, right)


def _left(entry: Mapping[str, Any]) -> tuple[str, str]:
    p = number(entry.get("left_p"))
    if not math.isfinite(p):
        return "not tried", ""
    if p > _ENOUGH:
        return p_value(p), "noise"
    return p_value(p), causes.bare(causes.label(str(entry.get("left_mostly") or "")))


def not_testable(entries: Entries, known: Mapping[str, float]) -> Cells | None:
    reasons = {words.prose(e.get("because") or "") for e in entries}
    shared = len(reasons) == 1 and len(entries) > 1
    rows = []
    for e in entries:
        effect = str(e.get("effect", ""))
        row = [causes.bare(causes.label(effect)), causes.size(effect, number(e.get("size")))]
        row += [] if shared else [words.prose(e.get("because") or "")]
        rows.append((*row, _biases(e.get("would_bias"), known) or "no parameter noticeably"))
    caption = "Were such a cause there, nobody could see it here, and the parameters of the last column would be off."
    if shared and (reason := reasons.pop()):
        caption += f" All for one reason: {reason}."
    columns = ("cause", "if there were") + (() if shared else ("it could not be seen:",)) + ("it would shift",)
    return _table("What these data can't show", caption, columns, rows, (False,) * len(columns))


def next_tests(entries: Entries, answered: bool = False) -> Cells | None:
    """What to drive; where the question is ``answered``, what would show the causes that these data can't."""
    rows = [
        (
            words.prose(e.get("manoeuvre") or ""),
            _told_apart([causes.combined(n) for n in listed(e.get("separates"))]),
            words.plain(e.get("runs")) if e.get("runs") is not None else "",
            words.plain(e.get("expected_t")) if e.get("expected_t") is not None else "",
        )
        for e in entries
    ]
    columns = ("what to do", "to tell", "runs", "expected t")
    keep = [i for i in range(4) if i < 1 or any(row[i] for row in rows)]
    caption = "These would show the causes that the data here can't." if answered else ""
    if 3 in keep:
        apart = "a cause of the size below would stand out by" if answered else "apart the causes would then be"
        caption += f" Expected t is how many standard errors {apart}: 6 is safe, 2 is a guess."
    return _table(
        "What to test next" if answered else "The next test to drive",
        caption.strip(),
        tuple(columns[i] for i in keep),
        [tuple(row[i] for i in keep) for row in rows],
        tuple(i > 1 for i in keep),
    )


def _told_apart(named: Sequence[str]) -> str:
    """One cause from another, or from several others."""
    if len(named) < 3:
        return " from ".join(named)
    return f"{named[0]} from {', '.join(named[1:-1])} or {named[-1]}"


_PLACE = re.compile(
    r"(?P<what>[^\[\],]+?)(?:\s*\[(?P<unit>[^\]]+)\]|,\s*(?P<plain>\S+))?\s+(?P<span>[-\d.e+]+ to [-\d.e+]+)"
)


def where(entries: Entries) -> Cells | None:
    rows = []
    for e in entries:
        size, noise = number(e.get("size")), number(e.get("over_noise"))
        rows.append(
            (
                words.run_name(words.prose(e.get("run") or "")),
                words.name(str(e.get("channel") or "")),
                _place(e.get("segment", e.get("bin")) or ""),
                _error(size, str(e.get("unit") or "")) if math.isfinite(size) else "",
                words.significant(abs(noise), 2) if math.isfinite(noise) else "",
            )
        )
    columns = ("run", "channel", "where", "measured − simulated", "× noise")
    keep = [i for i in range(5) if any(row[i] for row in rows)]
    return _table(
        "Where the error was largest, before anything was mended",
        "The worst piece of each run; the last column counts the levels of the sensor's noise.",
        tuple(columns[i] for i in keep),
        [tuple(row[i] for i in keep) for row in rows if any(row)],
        tuple(i > 2 for i in keep),
    )


def _place(text: Any) -> str:
    """ "time in the run [s] 12 to 40" as "time in the run 12 to 40 s"."""
    found = _PLACE.fullmatch(words.prose(text))
    if found is None:
        return words.prose(text)
    return f"{found['what']} {found['span']} {words.unit(found['unit'] or found['plain'] or '')}".strip()


def _error(size: float, unit: str) -> str:
    shown, factor = words.everyday(unit) or (unit, 1.0)
    return f"{signed(size * factor, 2)} {words.unit(shown)}".strip()


def _share(value: Any) -> str:
    share = 100 * number(value)
    if not math.isfinite(share):
        return words.DASH
    return f"{'< 0.1' if 0 <= share < 0.1 else words.fixed(share, 0 if share >= 10 else 1)}{words.NARROW}%"


def _table(
    title: str, caption: str, columns: tuple[str, ...], rows: Sequence[tuple[str, ...]], numeric: tuple[bool, ...]
) -> Cells | None:
    return Cells(title, caption, columns, tuple(rows), numeric) if rows else None


def _biases(source: Any, known: Mapping[str, float]) -> str:
    """The largest shifts of parameters, in per cent of those whose value is known."""
    parts = []
    told = {key for key, _ in items(source)}
    for key, value in items(source):
        name, shift = str(key), number(value)
        if _FOLLOWS.get(name) in told:
            continue
        now = known.get(name, 0.0)
        if math.isfinite(now) and now and abs(shift / now) < 10:
            if abs(shift / now) >= _NOTICED:
                parts.append((abs(shift / now), f"{words.name(name)} {signed(100 * shift / now, 2)}{words.NARROW}%"))
            continue
        quantity = PARAMETERS.get(name)
        unit = words.unit(quantity.unit) if quantity else ""
        parts.append((0.0, f"{words.name(name)} {signed(shift, 2)} {unit}".strip()))
    parts.sort(key=lambda p: -p[0])
    more = f"; {len(parts) - _BIASES} more" if len(parts) > _BIASES else ""
    return "; ".join(text for _, text in parts[:_BIASES]) + more


def p_value(value: Any) -> str:
    p = number(value)
    return words.DASH if not math.isfinite(p) else "< 0.0001" if p < 1e-4 else _short(words.significant(p, 2))


def _short(text: str) -> str:
    """A decimal without the zeros at its end."""
    return text.rstrip("0").rstrip(".") if "." in text else text
