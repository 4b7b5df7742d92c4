"""Reading of parameter files: JSON of a step, the pipeline or a user, with checks of units, ranges and finiteness."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from vdyn_cli.quantities.errors import Finding, InputError, raise_all
from vdyn_cli.quantities.input_file import read_regular, unreadable
from vdyn_cli.quantities.law_definition import LawDefinition
from vdyn_cli.quantities.parameters import FORMAT, Estimate, Parameters
from vdyn_cli.quantities.quantity import Quantity, UnitError, to_si
from vdyn_cli.quantities.vocabulary import PARAMETERS

MOST_BYTES = 64 << 20  # of a parameter file; those of 300 runs have some 1 MB
ROUNDING = 1e-9  # by which the magnitude of a correlation may exceed 1
_TEXT = {"unit": 60, "meaning": 200, "source": 40}  # longest texts of an entry, characters
_AGAIN = "run the step that wrote the file again, or correct the number"
_WRITTEN = "give a JSON that a vdyn step or pipeline wrote, such as out/parameters.json"


@dataclass(frozen=True)
class ParameterDocument:
    """Content of a parameter file.

    Parameters
    ----------
    content : the JSON document.
    parameters : its estimates, correlations and extensions, in SI.
    digest : sha256 of the file.
    """

    content: Mapping[str, Any]
    parameters: Parameters
    digest: str


def read_document(path: Path) -> ParameterDocument:
    """Read a parameter JSON.

    Every number must be finite, a standard deviation not negative, and an interval's ends in order. A parameter of the
    vocabulary is converted to its SI unit and must lie in its physical range.

    Raises
    ------
    InputError : missing or unreadable file, another format, a refused result, a wrong entry (all at once).
    """
    data = _bytes(path)
    try:
        document = json.loads(data.decode("utf-8"))
    except (UnicodeDecodeError, ValueError, RecursionError) as error:
        whole = isinstance(error, json.JSONDecodeError) and error.pos == 0  # it does not begin as JSON
        what, got = ("is not JSON", "") if whole else ("is not JSON, or only a part of it", str(error)[:80])
        raise InputError(Finding(str(path), what, got, _WRITTEN)) from None
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        got = repr(document.get("format"))[:60] if isinstance(document, dict) else type(document).__name__
        if isinstance(document, dict) and "format" not in document:
            raise InputError(Finding(str(path), "has no key 'format': not written by vdyn", remedy=_WRITTEN))
        raise InputError(Finding(str(path), f"is not a parameter file of format {FORMAT}", got, _WRITTEN))
    if document.get("refused"):
        raise InputError(_of_refused(path, document))
    problems: list[Finding] = []
    estimates = _estimates(document.get("parameters"), f"{path}, parameter", problems, PARAMETERS)
    entries = _mapping(document, "extensions", path, problems)
    extensions = {
        str(effect): _estimates(unknowns, f"{path}, extension '{_shown(effect)}',", problems, {})
        for effect, unknowns in entries.items()
    }
    correlation = _correlation(_mapping(document, "correlation", path, problems), str(path), problems)
    laws = _laws(_mapping(document, "laws", path, problems), f"{path}, learned law", problems)
    raise_all(problems)
    return ParameterDocument(document, Parameters(estimates, correlation, extensions, laws), sha256(data).hexdigest())


def _laws(entries: Mapping[str, Any], where: str, problems: list[Finding]) -> dict[str, LawDefinition]:
    """Definitions of learned laws by name."""
    found = {}
    for name, entry in entries.items():
        try:
            found[str(name)] = LawDefinition.model_validate(entry)
        except ValidationError as error:
            place = ".".join(map(str, error.errors()[0]["loc"]))
            problems.append(Finding(f"{where} '{_shown(name)}'", "is not a definition of a law", place, _AGAIN))
    return found


def _of_refused(path: Path, document: Mapping[str, Any]) -> Finding:
    """The message for the JSON of a step whose result was not published."""
    step = _shown(document.get("step"))
    why = one_line(str(document.get("sentence"))[:200])
    report = path.with_suffix(".html").name
    remedy = (
        f"its report, {report}, says what the test lacked: run 'vdyn {step}' with better data, or leave this file out"
    )
    return Finding(str(path), f"contains no parameters: the result of '{step}' was not published", why, remedy)


def one_line(text: str) -> str:
    """The text with every unprintable character, such as a line end, replaced by a blank."""
    return "".join(letter if letter.isprintable() else " " for letter in text)


def _bytes(path: Path) -> bytes:
    try:
        return read_regular(path, MOST_BYTES)
    except FileNotFoundError:
        raise InputError(Finding(str(path), "does not exist", remedy=_WRITTEN)) from None
    except OSError as error:
        raise unreadable(path, error) from None


def _mapping(document: Mapping[str, Any], key: str, path: Path, problems: list[Finding]) -> Mapping[str, Any]:
    entries = document.get(key)
    if entries is None or isinstance(entries, dict):
        return entries or {}
    problems.append(Finding(str(path), f"'{key}' is not a mapping", _shown(entries), _AGAIN))
    return {}


def _shown(value: object) -> str:
    return one_line(str(value)[:40])


def _estimates(entries: Any, where: str, problems: list[Finding], known: Mapping[str, Quantity]) -> dict[str, Estimate]:
    """The entries in SI; wrong ones are left out and added to ``problems``."""
    if entries is None:
        return {}
    if not isinstance(entries, dict):
        place = f"{where[:-1] if where.endswith(',') else where}s"
        problems.append(Finding(place, "are not a mapping of names", remedy=_AGAIN))
        return {}
    found = {}
    for name, entry in entries.items():
        place = f"{where} '{_shown(name)}'"
        try:
            estimate = _entry(name, entry)
            quantity = known.get(name)
            found[name] = estimate if quantity is None else in_si(estimate, quantity)
        except UnitError as error:
            problems.append(Finding(place, str(error), remedy="correct the unit, or the value and the unit"))
        except (KeyError, TypeError, ValueError, AttributeError):
            problems.append(Finding(place, _misshapen(name, entry), remedy=_AGAIN))
        else:
            problems += _wrong_numbers(found[name], known.get(name), place)
    return found


def _misshapen(name: str, entry: Any) -> str:
    """Why an entry is not an estimate."""
    if not name.isidentifier():
        return "has an invalid name"
    keys = ("value", "std", "interval95", *_TEXT)
    missing = [key for key in keys if key not in entry] if isinstance(entry, dict) else keys
    if missing:
        return f"lacks {', '.join(missing)}"
    wrong = [key for key in ("value", "std") if not isinstance(entry[key], int | float)]
    return f"has no number as {' and '.join(wrong)}" if wrong else "has an entry of a wrong type"


def _entry(name: str, entry: Any) -> Estimate:
    if not name.isidentifier():
        raise ValueError(name)
    low, high = entry["interval95"]
    baseline = entry.get("baseline")
    unit, meaning, source = (one_line(str(entry[key]))[:longest] for key, longest in _TEXT.items())
    return Estimate(
        _number(entry["value"]),
        _number(entry["std"]),
        (_number(low), _number(high)),
        unit,
        meaning,
        source,
        None if baseline is None else _number(baseline),
        tuple(one_line(str(name))[:200] for name in entry.get("spans") or ()),
    )


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError(value)
    try:
        return float(value)
    except OverflowError:  # an integer of more than 308 digits
        return math.inf


def in_si(estimate: Estimate, quantity: Quantity) -> Estimate:
    """The estimate in the quantity's SI unit.

    Raises
    ------
    UnitError : unknown unit, or another dimension.
    """

    def si(value: float) -> float:
        return float(to_si(value, estimate.unit, quantity.unit))

    low, high = estimate.interval95
    return Estimate(
        si(estimate.value),
        si(estimate.std) - si(0.0),  # without the offset of the unit: a deviation of 5 degC is 5 K
        (si(low), si(high)),
        quantity.unit,
        estimate.meaning,
        estimate.source,
        None if estimate.baseline is None else si(estimate.baseline),
        estimate.spans,
    )


def _wrong_numbers(estimate: Estimate, quantity: Quantity | None, place: str) -> Iterator[Finding]:
    low, high = estimate.interval95
    numbers = (estimate.value, estimate.std, low, high, estimate.baseline or 0.0)
    if not all(map(math.isfinite, numbers)):
        yield Finding(place, "has a number that is not finite", ", ".join(f"{n:g}" for n in numbers[:4]), _AGAIN)
    elif estimate.std < 0.0:
        yield Finding(place, "has a negative standard deviation", f"{estimate.std:g}", _AGAIN)
    elif low > high:
        yield Finding(place, "has an interval whose lower end lies above the upper one", f"{low:g} to {high:g}", _AGAIN)
    elif quantity is not None and not quantity.allows(estimate.value):
        yield Finding(place, f"lies outside {quantity.range_text}", f"{estimate.value:g}", _AGAIN)


def _correlation(rows: Mapping[str, Any], where: str, problems: list[Finding]) -> dict[str, dict[str, float]]:
    """Correlations from -1 to 1; null entries, of parameters without scatter, are left out."""
    found: dict[str, dict[str, float]] = {}
    for name, row in rows.items():
        try:
            found[name] = {str(other): _number(value) for other, value in row.items() if value is not None}
        except (TypeError, AttributeError):
            problems.append(
                Finding(f"{where}, correlation of '{_shown(name)}'", "is not a mapping of numbers", remedy=_AGAIN)
            )
            continue
        if not all(abs(value) <= 1.0 + ROUNDING for value in found[name].values()):
            problems.append(Finding(f"{where}, correlation of '{_shown(name)}'", "lies outside -1 to 1", remedy=_AGAIN))
    return found
