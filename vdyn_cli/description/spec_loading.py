"""Descriptions as checked models, whole or as far as they are right."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, ValidationError

from vdyn_cli.description.spec_errors import explained, location_of
from vdyn_cli.description.yaml_source import Location, YamlSource, load_yaml
from vdyn_cli.quantities.errors import Finding, InputError

S = TypeVar("S", bound=BaseModel)
MARK = "?"  # of what 'vdyn init' leaves to the user
MOST_ROUNDS = 5  # of leaving wrong keys out: a check of the whole sees only what is right in its parts


def load_spec(path: Path, model: type[S]) -> tuple[S, YamlSource]:
    """Read a description and check it against its model, naming file and line of everything that is wrong.

    ``vehicle: vehicle.yaml`` is replaced by that file's content.

    Raises
    ------
    InputError : with every problem of the file.
    """
    source = with_vehicle_file(load_yaml(path))
    return validate(source, model), source


@dataclass(frozen=True)
class PartialSpec(Generic[S]):
    """A description as far as it is right, so that its logs can be checked in the same round as the description.

    Parameters
    ----------
    spec : without the keys that are wrong; None where it makes no description without them.
    problems : of the description. dropped : places of the keys that are left out.
    """

    spec: S | None
    source: YamlSource
    problems: tuple[Finding, ...] = ()
    dropped: frozenset[Location] = frozenset()


def load_partial(path: Path, model: type[S]) -> PartialSpec[S]:
    """Read a description, leaving out what is wrong in it.

    Raises
    ------
    InputError : the file is no YAML mapping.
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
            problems += [f for at, f in error.places if not any(at[: len(d)] == d for d in dropped)]
            wrong = {_droppable(data, at) for at, _ in error.places}
            if () in wrong:
                break
            data = _without(data, wrong)
            dropped |= wrong
        else:
            return PartialSpec(spec, source, tuple(dict.fromkeys(problems)), frozenset(dropped))
    return PartialSpec(None, source, tuple(dict.fromkeys(problems)), frozenset(dropped))


def _droppable(data: Any, at: Location) -> Location:
    """The smallest part around a wrong place that can be left out; nothing where that is the whole description.

    What is missing is left out with what lacks it, an entry of a list with its list, so that other entries keep their
    places.
    """
    there: Any = data
    for depth, part in enumerate(at):
        known = part in there if isinstance(there, dict) else isinstance(there, list) and isinstance(part, int)
        if not known:
            return _droppable(data, at[:depth])
        there = there[part]
    return at[:-1] if at and isinstance(at[-1], int) else at


def _without(data: Any, places: Collection[Location]) -> Any:
    """The data without the values at some places."""
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
    places : location and finding of everything that is wrong.
    """

    def __init__(self, places: Sequence[tuple[Location, Finding]]) -> None:
        super().__init__(*dict.fromkeys(finding for _, finding in places))
        self.places = tuple(places)


def validate(source: YamlSource, model: type[S]) -> S:
    """Check a loaded description against a model.

    Raises
    ------
    InputError : no mapping. InvalidSpecError : with everything that is wrong.
    """
    if not isinstance(source.data, dict):
        got = type(source.data).__name__
        raise InputError(Finding(source.path.name, "must be a mapping of keys to values", got))
    marks = [(at, _undecided(at, source)) for at in dict.fromkeys(_marked(source.data))]
    try:
        spec = model.model_validate(source.data)
    except ValidationError as error:
        details = error.errors(include_url=False)
        within = {location_of(d)[:k] for d in details for k in range(len(location_of(d)))}
        told = [d for d in details if not (isinstance(d["input"], list) and location_of(d) in within)]
        told = [d for d in told if not any(location_of(d)[: len(at)] == at for at, _ in marks)]
        other = {location_of(d) for d in told if d["type"] != "string_type"}  # of a union what is said of its numbers
        told = [d for d in told if d["type"] != "string_type" or location_of(d) not in other]
        raise InvalidSpecError([*marks, *((location_of(d), explained(d, source, model)) for d in told)]) from None
    if marks:
        raise InvalidSpecError(marks)
    return spec


def _marked(data: Any, at: Location = ()) -> Iterator[Location]:
    """Where the mark of ``vdyn init`` stands; of a channel's column or unit, the place of the channel."""
    if data == MARK:
        yield at[:-1] if at[-1] in ("column", "unit") else at
    for part, value in data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ():
        yield from _marked(value, (*at, part))


def _undecided(at: Location, source: YamlSource) -> Finding:
    what = f"'{'.'.join(map(str, at))}' is not decided: it holds the \"{MARK}\" that 'vdyn init' writes"
    remedy = f'write the value in place of "{MARK}", or remove the line if the test has no such value'
    return Finding(source.where(at), what, remedy=remedy)


def with_vehicle_file(source: YamlSource) -> YamlSource:
    """Put the content of the vehicle's own file in the place of its name."""
    if not isinstance(source.data, dict) or not isinstance(source.data.get("vehicle"), str):
        return source
    name = source.data["vehicle"]
    try:
        vehicle = load_yaml(source.path.parent / name)
    except InputError as error:
        raise InputError(*(_from(f, source.where(("vehicle",))) for f in error.findings)) from None
    lines = {("vehicle", *location): place for location, place in vehicle.lines.items()}
    data = {**source.data, "vehicle": vehicle.data}
    digests = {**source.digests, **vehicle.digests}
    return YamlSource(source.path, data, {**source.lines, **lines}, (*source.included, vehicle.path), digests)


def _from(finding: Finding, where: str) -> Finding:
    return Finding(where, f"{finding.where} {finding.what}", finding.got, finding.remedy)
