"""Loading of descriptions as validated models, completely or without their wrong keys."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from vdyn_cli.description.spec_errors import explained, location_of
from vdyn_cli.description.yaml_source import Location, YamlSource, load_yaml
from vdyn_cli.quantities.errors import Finding, InputError, close_names

S = TypeVar("S", bound=BaseModel)
MARK = "?"  # written by 'vdyn init' for a value, or the unit behind a number, that the user must decide
_KEYS = "write keys with values, such as 'test: coastdown', at the left margin"
MOST_ROUNDS = 5  # of removing wrong keys: validation checks a whole only after all its parts are valid


def load_spec(path: Path, model: type[S]) -> tuple[S, YamlSource]:
    """Read a description and validate it with its model.

    ``vehicle: vehicle.yaml`` is replaced by that file's content.

    Raises
    ------
    InputError : lists every problem of the file with its line.
    """
    source = with_vehicle_file(load_yaml(path))
    return validate(source, model), source


@dataclass(frozen=True)
class PartialSpec(Generic[S]):
    """A description without its wrong keys, so that its logs can be checked together with it.

    Parameters
    ----------
    spec : without the wrong keys; None if it is not valid without them.
    problems : of the description. dropped : locations of the removed keys.
    """

    spec: S | None
    source: YamlSource
    problems: tuple[Finding, ...] = ()
    dropped: frozenset[Location] = frozenset()


def load_partial(path: Path, model: type[S]) -> PartialSpec[S]:
    """Read a description and remove its wrong keys.

    Raises
    ------
    InputError : the file is not a YAML mapping.
    """
    source, problems = load_yaml(path), list[Finding]()
    data = source.data
    try:
        source = with_vehicle_file(source)
        data = source.data
    except InputError as error:
        problems += error.findings
        data = {n: v for n, v in data.items() if n != "vehicle"}
    dropped: set[Location] = {("vehicle",)} if problems else set()
    for _ in range(MOST_ROUNDS):
        try:
            spec = validate(replace(source, data=data), model)
        except InvalidSpecError as error:
            problems += [f for at, f in error.places if not any(_follows(at, f, d) for d in dropped)]
            wrong = {_droppable(data, at) for at, _ in error.places}
            if () in wrong:
                break
            data = _without(data, wrong)
            dropped |= wrong
        else:
            return PartialSpec(spec, source, tuple(dict.fromkeys(problems)), frozenset(dropped))
    return PartialSpec(None, source, tuple(dict.fromkeys(problems)), frozenset(dropped))


def _follows(at: Location, finding: Finding, dropped: Location) -> bool:
    """Whether an error may only follow from a removed key: it is within the key, or concerns a mapping that had it.

    An error of the whole description concerns the keys that it names.
    """
    if at:
        return at[: len(dropped)] == dropped or dropped[: len(at)] == at
    return bool(dropped) and f"'{dropped[0]}'" in finding.what


def _droppable(data: Any, at: Location) -> Location:
    """Location of the smallest part around a wrong value that can be removed; () for the whole description.

    For a missing key it is the mapping that lacks it; for an entry of a list it is the list, so that the indices of
    other entries do not change.
    """
    there: Any = data
    for depth, part in enumerate(at):
        known = part in there if isinstance(there, dict) else isinstance(there, list) and isinstance(part, int)
        if not known:
            return _droppable(data, at[:depth])
        there = there[part]
    return at[:-1] if at and isinstance(at[-1], int) else at


def _without(data: Any, places: Collection[Location]) -> Any:
    """The data without the values at some locations."""
    if isinstance(data, dict):
        inner = {n: {at[1:] for at in places if at[:1] == (n,)} for n in data}
        return {n: _without(v, inner[n]) for n, v in data.items() if () not in inner[n]}
    if isinstance(data, list):
        return [_without(v, {at[1:] for at in places if at[:1] == (i,)}) for i, v in enumerate(data)]
    return data


class InvalidSpecError(InputError):
    """A description that does not follow its model.

    Parameters
    ----------
    places : location and finding of each error.
    """

    def __init__(self, places: Sequence[tuple[Location, Finding]]) -> None:
        super().__init__(*dict.fromkeys(finding for _, finding in places))
        self.places = tuple(places)


def validate(source: YamlSource, model: type[S]) -> S:
    """Validate a loaded description with a pydantic model.

    Raises
    ------
    InputError : not a mapping. InvalidSpecError : lists all errors.
    """
    if not isinstance(source.data, dict):
        got = type(source.data).__name__
        raise InputError(Finding(source.path.name, "must be a mapping of keys to values", got, _KEYS))
    marks = [(at, _undecided(at, source)) for at in dict.fromkeys(_marked(source.data))]
    try:
        spec = model.model_validate(source.data)
    except ValidationError as error:
        details = error.errors(include_url=False)
        within = {location_of(d)[:k] for d in details for k in range(len(location_of(d)))}
        reported = [d for d in details if not (isinstance(d["input"], list) and location_of(d) in within)]
        reported = [d for d in reported if not any(location_of(d)[: len(at)] == at for at, _ in marks)]
        # For a union of text and number, only the error about the number is reported.
        other = {location_of(d) for d in reported if d["type"] != "string_type"}
        reported = [d for d in reported if d["type"] != "string_type" or location_of(d) not in other]
        raise InvalidSpecError([*marks, *_located(reported, source, model)]) from None
    if marks:
        raise InvalidSpecError(marks)
    return spec


def _located(
    reported: Sequence[ErrorDetails], source: YamlSource, model: type[BaseModel]
) -> Iterator[tuple[Location, Finding]]:
    """Location and finding of each error; that of a missing key is the one of its misspelled name, if there is one."""
    unknown = {location_of(d): explained(d, source, model) for d in reported if d["type"] == "extra_forbidden"}
    for detail in reported:
        at = location_of(detail)
        beside = [k for k in unknown if detail["type"] == "missing" and k[:-1] == at[:-1]]
        misspelled = [unknown[k] for k in beside if close_names(str(k[-1]).lower(), [str(at[-1])])]
        yield at, misspelled[0] if misspelled else explained(detail, source, model)


def _marked(data: Any, at: Location = ()) -> Iterator[Location]:
    """Locations of the mark of ``vdyn init``; for a channel's column or unit, the location of the channel."""
    if data == MARK or (isinstance(data, str) and data.endswith(f" {MARK}")):
        yield at[:-1] if at[-1] in ("column", "unit") else at
    for part, value in data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ():
        yield from _marked(value, (*at, part))


def _undecided(at: Location, source: YamlSource) -> Finding:
    what = f"'{'.'.join(map(str, at))}' is not decided: it still has the \"{MARK}\" from 'vdyn init'"
    remedy = f'write the value (behind a number, its unit) in place of "{MARK}", or remove the line if there is none'
    return Finding(source.where(at), what, remedy=remedy)


def with_vehicle_file(source: YamlSource) -> YamlSource:
    """Replace the name of a vehicle file under ``vehicle`` by the file's content.

    Raises
    ------
    InputError : the vehicle file cannot be read, or describes a test.
    """
    if not isinstance(source.data, dict) or not isinstance(source.data.get("vehicle"), str):
        return source
    name = source.data["vehicle"]
    try:
        vehicle = load_yaml(source.path.parent / name)
    except InputError as error:
        raise InputError(*(_from(f, source.where(("vehicle",))) for f in error.findings)) from None
    if isinstance(vehicle.data, dict) and "test" in vehicle.data:
        remedy = "name the file of the vehicle's parameters, or write them under 'vehicle'"
        raise InputError(Finding(source.where(("vehicle",)), f"{name} describes a test, not a vehicle", "", remedy))
    lines = {("vehicle", *location): place for location, place in vehicle.lines.items()}
    data = {**source.data, "vehicle": vehicle.data}
    digests = {**source.digests, **vehicle.digests}
    return YamlSource(source.path, data, {**source.lines, **lines}, (*source.included, vehicle.path), digests)


def _from(finding: Finding, where: str) -> Finding:
    return Finding(where, f"{finding.where} {finding.what}", finding.got, finding.remedy)
