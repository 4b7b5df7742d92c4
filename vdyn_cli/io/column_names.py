"""Search for a file's columns by name: exact, the n-th of equal names, and the closest names for a message."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from vdyn_cli.io.file_units import BRACKET
from vdyn_cli.quantities.errors import Finding, close_names

_NTH = re.compile(r"(.*)#(\d+)")


@dataclass(frozen=True)
class MissingColumn(Finding):
    """The finding that a file lacks the column of ``channel``."""

    channel: str = field(default="", compare=False)


def positions(names: Sequence[str], wanted: str) -> list[int]:
    """The indices of ``wanted`` in ``names``; ``Name#2`` is the second of several equal names."""
    at = [i for i, cell in enumerate(names) if cell == wanted]
    if at or (nth := _NTH.fullmatch(wanted)) is None:
        return at
    same = [i for i, cell in enumerate(names) if cell == nth[1].rstrip()]
    return same[int(nth[2]) - 1 :][:1] if int(nth[2]) > 0 else []


def closest_names(names: Sequence[str], wanted: str) -> str:
    """The remedy if ``wanted`` is not in ``names``: those that differ only in case, blanks or unit, or close ones.

    Names are suggested as a description writes them: equal names as ``Name#1`` and so on.
    """
    named = [cell for cell in _written(names) if cell]
    bare: dict[str, list[str]] = {}
    for cell in named:
        bare.setdefault(_bare(cell), []).append(cell)
    near = bare.get(_bare(wanted)) or [cell for b in close_names(_bare(wanted), bare) for cell in bare[b]]
    if near:
        return "did you mean " + " or ".join(f"'{cell[:100]}'" for cell in near[:3]) + "?"
    shown = ", ".join(f"'{cell[:60]}'" for cell in named[:12])
    return f"its columns are {shown}" + (f" and {len(named) - 12} more" if len(named) > 12 else "")


def _written(names: Sequence[str]) -> list[str]:
    count = Counter(names)
    return [f"{name}#{n + 1}" if count[name] > 1 else name for name in count for n in range(count[name])]


def _bare(name: str) -> str:
    nth = _NTH.fullmatch(name)
    plain = nth[1] if nth else name
    return re.sub(r"[\W_]+", "", BRACKET.sub("", plain).casefold()) or plain
