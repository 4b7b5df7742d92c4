"""Numbers, units and names for a page: rounding by the interval, superscripts, minus signs."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vdyn_cli.quantities.number_text import capitalized, magnitude

if TYPE_CHECKING:
    from vdyn_cli.quantities.parameters import Estimate

MINUS = "\N{MINUS SIGN}"
NARROW = "\N{NARROW NO-BREAK SPACE}"
NO_BREAK = "\N{NO-BREAK SPACE}"
DASH = "\N{EN DASH}"

_SUPERSCRIPT = str.maketrans("0123456789-+.", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺·")
_GREEK = {"sigma": "σ", "rho": "ρ", "eta": "η", "om": "ω", "phi": "φ", "th": "θ", "mu": "μ", "tau": "τ", "alpha": "α"}
_UNITS = {"deg": "°", "degree": "°", "degC": "°C", "degF": "°F", "um": "µm", "us": "µs", "ohm": "Ω", "percent": "%"}

# Units kept on one line with the number before them.
_SHORT_UNITS = r"kg|N|kN|Nm|m|mm|km/h|m/s|s|ms|Hz|rad|°C|°|m²|N·m|kg·m²|kN/m|N/m"

# Everyday units of test engineers: SI unit -> (unit, factor).
_EVERYDAY = {"m/s": ("km/h", 3.6), "rad": ("°", 180 / math.pi)}


_NOTHING = 1e-280  # doubles near the underflow limit have fewer digits and count as zero


@dataclass(frozen=True)
class RoundedEstimate:
    """A value with its 95 % interval as texts, rounded according to the interval.

    ``plus`` and ``minus`` are the half-widths, the same text if they differ by less than a tenth, empty without an
    interval. ``exponent`` is the common power of ten, or 0.
    """

    value: str
    plus: str = ""
    minus: str = ""
    low: str = ""
    high: str = ""
    exponent: int = 0

    @property
    def symmetric(self) -> bool:
        """Whether both half-widths are the same text."""
        return self.plus == self.minus


def clean(text: object) -> str:
    """Text without characters that HTML forbids: control characters become spaces, lone surrogates question marks."""
    plain = str(text).encode("utf-8", "replace").decode("utf-8")
    return "".join(" " if (ord(c) < 32 and c != "\n") or 127 <= ord(c) < 160 else c for c in plain)


def fixed(value: float, decimals: int) -> str:
    """A number with ``decimals`` decimals (negative: rounded to tens, hundreds ...), never "-0"."""
    text = f"{round(value, decimals):.{max(decimals, 0)}f}"
    return text.lstrip("-") if float(text) == 0 else text.replace("-", MINUS)


def significant(value: float, digits: int) -> str:
    """A number with ``digits`` significant digits; with a power of ten below 1e-4 and from 1e7."""
    if not math.isfinite(value):
        return DASH
    if abs(value) < _NOTHING:
        return "0"
    power = magnitude(value, digits)
    if -4 <= power < 7:
        return fixed(value, digits - 1 - power)
    return f"{fixed(value / 10.0**power, digits - 1)}{NARROW}×{NARROW}10{superscript(power)}"


def signed(value: float, digits: int) -> str:
    """A number with ``digits`` significant digits and its sign."""
    text = significant(value, digits)
    return f"+{text}" if value > 0 and text != "0" else text


def superscript(power: int) -> str:
    """An integer in superscript digits."""
    return str(power).translate(_SUPERSCRIPT)


def rounded(value: float, low: float = math.nan, high: float = math.nan) -> RoundedEstimate:
    """A value and its interval, rounded to two significant digits of the narrower half-width, or three of the wider."""
    if not math.isfinite(value):
        return RoundedEstimate(DASH)
    above, below = high - value, value - low
    halves = [h for h in (above, below) if math.isfinite(h) and h > _NOTHING]
    if not halves:
        return _exact(value)
    if len(halves) == 2 and max(halves) <= 1.1 * min(halves):
        above = below = 0.5 * (above + below)
    largest = max(abs(value), max(halves))
    exponent = _exponent(largest)
    scale = 10.0**-exponent
    # More than nine significant digits would show rounding errors.
    finest = max(min(halves), 0.1 * max(halves), largest * 1e-9)
    decimals = 1 - magnitude(finest * scale, 2)

    def shown(x: float) -> str:
        return fixed(x * scale, decimals) if math.isfinite(x) else DASH

    return RoundedEstimate(shown(value), shown(above), shown(below), shown(low), shown(high), exponent)


def _exact(value: float) -> RoundedEstimate:
    exponent = _exponent(abs(value))
    text = f"{value * 10.0**-exponent:.6g}"
    if "e" in text:
        return RoundedEstimate(significant(value, 6))
    return RoundedEstimate(text.replace("-", MINUS), exponent=exponent)


def _exponent(size: float) -> int:
    if size < _NOTHING or 1e-4 <= size < 1e7:
        return 0
    return math.floor(math.log10(size))


def estimate_text(estimate: Estimate) -> str:
    """One line for the terminal: ``0.560 ± 0.013 m²  (2.4 %)``."""
    r = rounded(estimate.value, *estimate.interval95)
    power = f"{NARROW}×{NARROW}10{superscript(r.exponent)}" if r.exponent else ""
    shown = unit(estimate.unit)
    if not r.plus:
        return f"{r.value}{power} {shown}".rstrip() + ("  (assumed)" if estimate.assumed else "")
    spread = f"± {r.plus}" if r.symmetric else f"+{r.plus} {MINUS}{r.minus}"
    number = f"({r.value} {spread}){power}" if power else f"{r.value} {spread}"
    share = relative(estimate.value, *estimate.interval95)
    return f"{number} {shown}".rstrip() + ("" if share == DASH else f"  ({share} %)")


def relative(value: float, low: float, high: float) -> str:
    """The interval's half-width as a percentage of the value, or a dash where either is unknown or zero."""
    half = 0.5 * (high - low)
    if not (math.isfinite(half) and math.isfinite(value)) or value == 0 or half <= 0:
        return DASH
    percent = 100 * half / abs(value)
    return significant(percent, 2) if percent < 1000 else ">\N{NARROW NO-BREAK SPACE}1000"


def unit(text: str) -> str:
    """``N s^2/m^2`` as N·s²/m²."""
    shown = re.sub(r"\s*(?:\*\*|\^)\s*\(?(-?\d+(?:\.\d+)?)\)?", lambda m: m[1].translate(_SUPERSCRIPT), clean(text))
    shown = re.sub(r"\s*/\s*", "/", shown.strip())
    shown = re.sub(r"(?<=\w)\s*[*·]\s*(?=\w)|(?<=[^\W\d])[ ](?=[^\W\d])|(?<=[⁰¹²³⁴⁵⁶⁷⁸⁹])[ ](?=\w)", "·", shown)
    return re.sub(r"[A-Za-z]+", lambda m: _UNITS.get(m[0], m[0]), shown)


def quantity(value: float, unit_text: str, digits: int) -> str:
    """A number with its unit: ``0.0312 m/s``.

    Parameters
    ----------
    unit_text : as in the JSON, such as ``m/s^2``. digits : significant ones.
    """
    shown = unit(unit_text)
    return significant(value, digits) + ("" if not shown else NARROW + shown)


def everyday(unit_text: str) -> tuple[str, float] | None:
    """The everyday unit and the factor to it: km/h for m/s, degrees for radians; None for other units."""
    return _EVERYDAY.get(unit_text.strip())


def name(identifier: str) -> str:
    """``cg_height`` as "CG height"."""
    text = clean(identifier).replace("_", " ").strip()
    return re.sub(r"\b(cg|epa|gps|imu|wltp|rms)\b", lambda m: m[1].upper(), text)


_SEGMENT = re.compile(r"(.+), (\S+ to \S+ s)")
_LOG = re.compile(
    r"(?:(?:.*[/\\])?([^/\\]+)[/\\])?([^/\\]+?)"
    r"\.(?:csv|tsv|txt|dat|asc|ascii|log|msl|mf4|mdf|vbo|lvm|mat|tdms|jsonl?|parquet)(?:\.gz)?( \([^/\\]*\))?",
    re.IGNORECASE,
)


def run_name(text: str) -> str:
    """The file name of a log's path without suffix, with the column of a table in brackets; other texts unchanged.

    The times of a segment (", 20 to 60 s") stay. A name without a number, such as an app writes in the folder of each
    recording, has its numbered folder before it.
    """
    if segment := _SEGMENT.fullmatch(text.strip()):
        return f"{run_name(segment[1])}, {segment[2]}"
    match = _LOG.fullmatch(text.strip())
    if not match:
        return text
    numbered = re.search(r"\d", match[1] or "") and not re.search(r"\d", match[2])
    return (f"{match[1]}/" if numbered else "") + match[2] + (match[3] or "")


def title(identifier: str) -> str:
    """``cg_height`` as "CG height", with a capital first letter."""
    return capitalized(name(identifier))


def symbol(text: str) -> tuple[tuple[str, str], ...]:
    """A textbook symbol as (base, subscript) pairs: ``Cd A`` is ((C, d), (A, "")), ``frr`` is ((f, rr),)."""
    return tuple(_part(word) for word in clean(text).split())


def _part(word: str) -> tuple[str, str]:
    if word in _GREEK:
        return _GREEK[word], ""
    match = re.fullmatch(r"([A-Za-z])([a-z]{1,3}|\d)", word)
    return (match[1], match[2]) if match else (word, "")


def prose(text: object) -> str:
    """A sentence with typographic signs: +- as ±, m^2 as m², a hyphen before digits as minus."""
    shown = re.sub(r"\s*(?:\+-|\+/-)\s*", " ± ", clean(text))
    shown = shown.replace("( ± ", "(± ")
    shown = re.sub(r"(?<=[A-Za-z])\^(-?\d+)", lambda m: m[1].translate(_SUPERSCRIPT), shown)
    shown = re.sub(r"(?<![\w.)\]%])-(?=\d)", MINUS, shown)
    return re.sub(rf"(?<=\d) (?=[%±])|(?<=\d) (?=(?:{_SHORT_UNITS})(?![\w-]))", NO_BREAK, shown).strip()


def shortest(value: float) -> str:
    """A number with three significant digits, without zeros at its end."""
    text = significant(value, 3)
    if "." not in text:
        return text
    return re.sub(r"(\.\d*?)0+(?!\d)", r"\1", text).replace(f".{NARROW}", NARROW).rstrip(".")


def count(number: int, noun: str) -> str:
    """``1 run``, ``8 runs``."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def shortened(text: str, length: int) -> str:
    """Text of at most ``length`` characters, cut in the middle, because the ends of run names differ."""
    if len(text) <= length:
        return text
    head = max((length - 1) // 2, 0)
    tail = max(length - 1 - head, 0)
    return text[:head] + "…" + (text[-tail:] if tail else "")
