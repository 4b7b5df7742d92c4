"""Numbers as text, rounded according to their uncertainty; lists of names and the capital of a sentence."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite


def capitalized(text: str) -> str:
    """The text with its first letter as a capital and all others as they are."""
    return text[:1].upper() + text[1:]


def listed(names: Sequence[str], word: str = "and") -> str:
    """Names as a list in a sentence, with ``word`` before the last: ``a, b and c``."""
    return f"{', '.join(names[:-1])} {word} {names[-1]}" if len(names) > 1 else names[0]


def magnitude(value: float, digits: int) -> int:
    """The power of ten of the leading digit of a value rounded to ``digits`` significant digits.

    Rounding comes first: 9.97 rounded to two digits is 10, of magnitude 1.
    """
    return int(f"{abs(value):.{digits - 1}e}".partition("e")[2])


def decimals(uncertainty: float, most: int = 8) -> int:
    """Number of decimals that shows two significant digits of an uncertainty: 1 - magnitude, from 0 to ``most``."""
    if not isfinite(uncertainty) or uncertainty <= 0:
        return most
    return min(max(1 - magnitude(uncertainty, 2), 0), most)


def two_digits(uncertainty: float) -> str:
    """An uncertainty with two significant digits: plain from 1e-4 to 1e6, else as ``1.2e-05``; ``"0"`` for none."""
    if uncertainty and not 1e-4 <= abs(uncertainty) < 1e6:
        return f"{uncertainty:.2g}"
    return f"{uncertainty:.{decimals(abs(uncertainty))}f}" if uncertainty else "0"


def number(value: float, half: float) -> str:
    """A value rounded according to its half-width; to five significant digits where that is not known."""
    if not isfinite(half) or half <= 0:
        return f"{value:.5g}"
    return f"{value:.{decimals(half)}f}"


def moment(time: float) -> str:
    """A time of a log, s, for messages; to the millisecond if it is counted from 1970 or from midnight."""
    return f"{time:.6g}" if abs(time) < 1e4 else f"{time:.3f}".rstrip("0").rstrip(".")
