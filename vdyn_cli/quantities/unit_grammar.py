"""Check of unit texts before they reach the unit parser, which would evaluate powers of powers."""

from __future__ import annotations

import re

LONGEST_UNIT = 40  # characters; "kilogram * meter ** 2 / second ** 2" has 35
MOST_EXPONENTS = 200.0  # product of all exponents: kg^2 m^4/s^6 has 48, and 1e9 to the 200th is done in microseconds
DEEPEST = 3  # nested brackets

_RAISED = str.maketrans({raised: f"**{plain}" for raised, plain in zip("⁰¹²³⁴⁵⁶⁷⁸⁹", "0123456789", strict=True)})
_TOKEN = re.compile(
    r"\s*(?:(?P<power>\*\*|\^)\s*(?P<exponent>\(\s*[+-]?\d(?:\.\d\d?)?\s*\)|[+-]?\d(?:\.\d\d?)?(?![\d.]))"
    r"|(?P<name>[^\W\d][^\W]*|[°%′″'\"]+[^\W\d]*|Δ°[CF])"
    r"|(?P<number>\d{1,9}(?:\.\d{0,9})?(?:[eE][+-]?\d{1,2})?)"
    r"|(?P<operator>[*/·])|(?P<opens>\()|(?P<closes>\)))"
)

# Ambiguous unit names, and what to write instead.
AMBIGUOUS = {
    name: "t or kg for the metric ton of 1000 kg, short_ton for the US ton of 907 kg" for name in ("ton", "tons", "TON")
} | {"NM": "nmi for the nautical mile, N m for a torque"}


def plain_powers(text: str) -> str:
    """The text with superscript digits written as powers: ``m²`` as ``m**2``, ``s⁻²`` as ``s**-2``."""
    for minus in ("⁻", "¯"):
        text = text.replace(minus, "**-")
    return re.sub(r"\*\*-\*\*", "**-", text.translate(_RAISED))


def written_powers(text: str) -> str:
    """The text with digits after a name written as powers: ``m/s2`` as ``m/s**2``, ``kg/m3`` as ``kg/m**3``."""
    return re.sub(r"(?<=[A-Za-z)])([2-4])(?=$|[\s*/·)])", r"**\1", text)


def written_products(text: str) -> str:
    """The text with hyphens and dots between letters written as products: ``N-m`` and ``N.m`` as ``N*m``."""
    return re.sub(r"(?<=[^\W\d])[-.](?=[^\W\d])", "*", text)


def why_no_unit(text: str) -> str:
    """Why a text cannot be a unit; empty for a product of names and small powers, ``kg m^2/s``.

    Accepts names, numbers of up to nine digits as factors, ``*``, ``/`` and brackets, and one-digit exponents of names
    and brackets whose product is at most 200. Everything else is refused without being evaluated.
    """
    if len(text) > LONGEST_UNIT:
        return f"is not a unit: it has more than {LONGEST_UNIT} characters"
    text = plain_powers(text)
    at, depth, exponents, before = 0, 0, 1.0, ""
    while text[at:].strip():
        token = _TOKEN.match(text, at)
        if token is None:
            return "is not a unit"
        kind = str(token.lastgroup)
        if (kind == "exponent" and before not in ("name", "closes")) or (kind == before == "operator"):
            return "is not a unit"
        if kind == "exponent":
            exponents *= max(abs(float(token["exponent"].strip("() \t"))), 1.0)
        depth += (kind == "opens") - (kind == "closes")
        if not 0 <= depth <= DEEPEST:
            return "is not a unit"
        if kind == "name" and token["name"] in AMBIGUOUS:
            return f"is ambiguous: write {AMBIGUOUS[token['name']]}"
        at, before = token.end(), kind
    return "is not a unit" if depth or exponents > MOST_EXPONENTS else ""
