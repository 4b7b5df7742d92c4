"""Test descriptions: the strict YAML that says which logs, which channels, which vehicle, which settings."""

from __future__ import annotations

import math
import typing
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Generic, Literal, TypeVar

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    Tag,
    ValidationError,
    ValidationInfo,
    create_model,
    field_validator,
    model_validator,
)
from pydantic_core import ErrorDetails, PydanticCustomError, core_schema

from vdyn_cli.description.yaml_source import Location, YamlSource, load_yaml
from vdyn_cli.quantities.errors import Finding, InputError, did_you_mean
from vdyn_cli.quantities.quantity import Given, Quantity, UnitError, parse
from vdyn_cli.quantities.vocabulary import CHANNELS, PARAMETERS


class Strict(BaseModel):
    """A part of a description: frozen, and an unknown key is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True, allow_inf_nan=False)


@dataclass(frozen=True)
class Si:
    """Marks a field as a quantity: ``Annotated[Given, Si("m/s")]`` reads ``70 km/h`` and holds SI.

    ``lower`` and ``upper`` bound the SI value.
    """

    unit: str
    lower: float = float("-inf")
    upper: float = float("inf")

    def _read(self, value: Any) -> Given:
        if isinstance(value, Given):
            return value
        if not isinstance(value, (str, int, float)) or isinstance(value, bool):
            what = "is not a number with a unit, such as '1 {unit}'"
            raise PydanticCustomError("quantity", what, {"unit": self.unit})
        try:
            given = parse(value, self.unit)
        except UnitError as error:
            raise PydanticCustomError("unit", "{why}", {"why": str(error), "unit": self.unit}) from None
        if not (self.lower <= given.value <= self.upper):
            span = f"{self.lower:g} to {self.upper:g} {self.unit}".strip()
            form = f"; a plain number is in K: write '{value} degC'" if self.unit == "K" and _plain(value) else ""
            what = "is outside the physical range ({span}){form}"
            raise PydanticCustomError("range", what, {"span": span, "form": form})
        return given

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(
            self._read, serialization=core_schema.plain_serializer_function_ser_schema(_written)
        )

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        example = f"1 {self.unit}".strip()
        return {"type": ["number", "string"], "description": f"a quantity, such as '{example}'; plain numbers are SI"}


def _plain(value: Any) -> bool:
    """Whether a value of a description is a number without a unit."""
    try:
        return math.isfinite(float(value))
    except (TypeError, ValueError):
        return False


def _written(given: Given) -> Any:
    return given.value if given.std == 0 else [given.value, given.std]


def si(quantity: Quantity) -> Si:
    """The marker for a quantity of the vocabulary, with its unit and physical range."""
    return Si(quantity.unit, quantity.lower, quantity.upper)


def described(quantity: Quantity) -> str:
    """Meaning and unit of a quantity, the description of its key: ``"vehicle mass as tested, kg"``."""
    return f"{quantity.meaning}, {quantity.unit or 'dimensionless'}"


class VehicleBase(Strict):
    """What the user knows of the vehicle before the test."""

    def items(self) -> Iterator[tuple[str, Given]]:
        """The quantities that were given."""
        for name in sorted(self.model_fields_set):
            value = getattr(self, name)
            if value is not None:
                yield name, value


if typing.TYPE_CHECKING:
    Vehicle = VehicleBase
else:
    Vehicle = create_model(
        "Vehicle",
        __base__=VehicleBase,
        **{
            name: (Annotated[Given, si(quantity)] | None, Field(None, description=described(quantity)))
            for name, quantity in PARAMETERS.items()
            if name not in ("temperature", "pressure")
        },
    )


class Environment(Strict):
    """The air on the day; dry air unless the density is given."""

    temperature: Annotated[Given, si(PARAMETERS["temperature"])] | None = Field(None, description="air temperature, K")
    pressure: Annotated[Given, si(PARAMETERS["pressure"])] | None = Field(None, description="air pressure, Pa")
    humidity: Annotated[Given, Si("", 0, 1)] | None = Field(None, description="relative humidity, 0 to 1")


class Channel(Strict):
    """Where one of our channels stands in a log: its column, unit, and sign convention."""

    column: str = Field(description="name of the column in the log's header")
    unit: str = Field(description="unit of the column, such as km/h; write 1 for a dimensionless column")
    sign: Literal[1, -1] = Field(1, description="-1 where the logger's sign convention is the opposite of vdyn's")
    scale: float = Field(
        1.0, gt=0, description="factor that corrects the sensor's gain: the column's values are multiplied by it, 1"
    )
    group: str = Field(
        "",
        description="group of the column where a file has several of its name; of time: the group that gives the clock",
    )
    source: str = Field("", description="device or bus of the column where a file has several of this name")

    @field_validator("unit", mode="before")
    @classmethod
    def _one(cls, value: Any) -> Any:
        """The number 1 as a unit: dimensionless."""
        return "1" if value == 1 and not isinstance(value, bool) else value


class KnownChannel(Strict):
    """One of our channels that no logger recorded, since its value is known and the same throughout."""

    constant: str | float = Field(description="value of the channel throughout, with its unit, such as 0 N")


LOGGED, KNOWN = "logged channel", "known channel"  # the branches of a channel's source, in pydantic's locations


def _branch(value: Any) -> str:
    known = "constant" in value if isinstance(value, dict) else isinstance(value, KnownChannel)
    return KNOWN if known else LOGGED


ChannelSource = Annotated[Annotated[Channel, Tag(LOGGED)] | Annotated[KnownChannel, Tag(KNOWN)], Discriminator(_branch)]


def _grouped(levels: Any) -> Any:
    """A single group of levels as a list of groups."""
    return [levels] if isinstance(levels, list) and levels and not isinstance(levels[0], list) else levels


class Reading(Strict):
    """How a log file is written, where guessing is not wanted; ``clock: drop`` drops rows that step back."""

    delimiter: str | None = Field(None, description="character between columns; detected if not given")
    decimal: Literal[".", ","] | None = Field(None, description="decimal separator; detected if not given")
    encoding: str | None = Field(None, description="text encoding, such as latin-1; detected if not given")
    header_row: Annotated[int, Field(ge=1)] | None = Field(
        None, description="line of the header, counted from 1; detected if not given"
    )
    clock: Literal["strict", "drop"] = Field(
        "strict", description="strict: a time that steps back is an error; drop: its rows are dropped and reported"
    )
    split_times: Literal["elapsed", "intervals"] | None = Field(
        None,
        description="the logs are tables of speed levels and split times. elapsed: time since the first level; "
        "intervals: time from the level of the row above",
    )
    split_runs: Literal["columns", "rows"] = Field(
        "columns",
        description="rows: each run is a row of the table. The header holds the speed levels; its first cell is the "
        "name of the speed's column. 'columns: {time: NAME}' of a run names the first cell of its row",
    )
    levels: Annotated[list[list[Annotated[Given, Si("m/s", 0.0)]]], BeforeValidator(_grouped)] = Field(
        [],
        description="speed levels of a coast-down report that does not state them, m/s, such as [100 km/h, 90 km/h]; "
        "groups of successive levels where runs passed different ones",
    )


LONGEST_TEST = 1e7  # s, four months: more than a test with one set of tires and one load


class Logger(Strict):
    """One of several loggers that recorded the same run on clocks of their own."""

    channels: dict[str, ChannelSource] = Field(
        description="vdyn's channel name: column and unit of this logger's log, or a constant"
    )
    reading: Reading = Field(Reading(), description="how this logger's files are written")
    delay: Annotated[Given, Si("s", -LONGEST_TEST, LONGEST_TEST)] | None = Field(
        None,
        description="what this logger's clock shows less what the first logger's shows, s, where it is known (0 s: one "
        "clock); left out: it is estimated",
    )


class Segment(Strict):
    """A segment of a channel of one log."""

    model_config = ConfigDict(serialize_by_alias=True)

    channel: str = Field("all", description="vdyn's channel name; all: every channel")
    start: Annotated[Given, Si("s")] = Field(alias="from", description="time of the log at which it begins, s")
    stop: Annotated[Given, Si("s")] = Field(alias="to", description="time of the log at which it ends, s")


class Run(Strict):
    """One run: its log (or one log per logger), direction, and start since the first run."""

    log: str | None = Field(None, description="path of the log, from the folder of this description")
    logs: list[str] | None = Field(None, description="paths of one log per logger, in the order of 'loggers'")
    signs: dict[str, Literal[1, -1]] = Field(
        {}, description="channel: -1 where its sign in this run is the opposite of that in the other runs"
    )
    columns: dict[str, str] = Field(
        {}, description="channel: its column in this run, where several runs stand in one table, such as {time: t2}"
    )
    direction: Literal["out", "back"] | None = Field(None, description="direction of travel on the test track")
    start: Annotated[Given, Si("s", -LONGEST_TEST, LONGEST_TEST)] | None = Field(
        None, description="start time of this log after the start of the first log, s"
    )
    temperature: Annotated[Given, si(PARAMETERS["temperature"])] | None = Field(
        None, description="air temperature during this run where it differs from the environment's, K"
    )
    wind_speed: Annotated[Given, si(CHANNELS["wind_speed"])] | None = Field(
        None, description="mean wind against the motion during this run, measured beside the track, m/s"
    )
    crosswind: Annotated[Given, Si("m/s", 0, 60)] | None = Field(
        None, description="mean wind across the road during this run, measured beside the track, m/s"
    )
    from_time: Annotated[Given, Si("s")] | None = Field(None, description="samples from this time on are used, s")
    to_time: Annotated[Given, Si("s")] | None = Field(None, description="samples up to this time are used, s")
    cuts: Literal["automatic", "none"] | list[Segment] = Field(
        "automatic",
        description="samples to leave out. automatic: those that fail a quality test; none; or a list of segments, "
        "such as [{channel: speed, from: 12 s, to: 15 s}], which are cut instead of those that fail a test",
    )
    keep: list[Segment] = Field(
        [], description="segments that are not cut although they fail a quality test, as a list like that of 'cuts'"
    )

    @model_validator(mode="after")
    def _one_kind_of_log(self) -> Run:
        if (self.log is None) == (self.logs is None):
            raise PydanticCustomError("log", "a run has either 'log' or 'logs'")
        return self

    @field_validator("cuts", mode="before")
    @classmethod
    def _cut_list(cls, value: Any) -> Any:
        if isinstance(value, str) and value not in ("automatic", "none"):
            raise PydanticCustomError(
                "list", "takes automatic, none, or a list such as [{{channel: speed, from: 12 s, to: 15 s}}]"
            )
        return value


class Diagnose(Strict):
    """Which candidate effects to test, and whether the model may be extended by the effects that are named."""

    effects: Literal["all", "none"] | list[str] = Field(
        "all", description="candidate effects to test: all, none, or a list such as [headwind]"
    )
    extend: Literal["never", "named", "learned"] | list[str] = Field(
        "named",
        description="effects to add to the model: never any; named: those of the catalogue that are named, and a law "
        "learned from the data where the logs contradict the fit without one; learned: also other learned laws; or a "
        "list of requested effects",
    )
    matters: dict[str, str | float] = Field(
        {},
        description="what matters, by name: the main output in its unit (rms change) and parameters in their unit or "
        "in % of their value, such as {speed: 0.05 m/s, rolling_resistance: 1 %}. A finding that changes all of them "
        "by less is a note, and the verdict is adequate. Default: a tenth of the output's noise floor and of each "
        "parameter's half interval",
    )

    @field_validator("effects", "extend", mode="before")
    @classmethod
    def _several(cls, value: Any, info: ValidationInfo) -> Any:
        words = {"effects": "all, none", "extend": "never, named, learned"}[info.field_name or ""]
        if isinstance(value, str) and value not in words.split(", "):
            raise PydanticCustomError("list", "takes {words}, or a list such as [headwind]", {"words": words})
        return value

    @model_validator(mode="after")
    def _something_to_test(self) -> Diagnose:
        if self.effects == []:
            raise PydanticCustomError(
                "effects", "'effects' is an empty list. Write all, none, or a list such as [headwind]"
            )
        if self.extend == []:
            raise PydanticCustomError(
                "extend", "'extend' is an empty list. Write never, named, learned, or a list such as [headwind]"
            )
        if self.effects == "none" and isinstance(self.extend, list):
            raise PydanticCustomError(
                "extend",
                "'extend' requests effects, but 'effects' is none. Write extend: never, or the effects to test",
            )
        return self


class TestSpec(Strict):
    """What every test description has; a step adds its own settings by deriving from it."""

    test: str = Field(description="the step that evaluates this test")
    title: str = Field("", description="title of the report")
    vehicle: Vehicle = Field(Vehicle(), description="known parameters of the vehicle, or a YAML file of them")
    environment: Environment = Field(Environment(), description="the air during the test")
    reading: Reading = Field(Reading(), description="how the log files are written, where detection fails")
    channels: dict[str, ChannelSource] = Field(
        {}, description="vdyn's channel name: column and unit of the logs, or a constant such as {constant: 0 N}"
    )
    loggers: list[Logger] = Field([], description="several loggers of the same runs, each with its channels and clock")
    align_on: str | Annotated[list[str], Field(min_length=2, max_length=2)] | None = Field(
        None,
        description="what aligns the loggers' clocks: a channel of all loggers, or a list of the first logger's "
        "channel and the other's, such as [speed, acceleration]; left out: the pair that tells the clocks best",
    )
    runs: list[Run] = Field([], description="the runs, one entry each")
    diagnose: Diagnose = Field(Diagnose(), description="which model errors to test, and whether to extend the model")
    plan: dict[str, str | float] = Field(
        {},
        description="what 'vdyn plan' assumes of a day without logs, such as {speed_noise: 0.05 m/s, rate: 10 Hz}; "
        "'vdyn plan' lists every key with its value",
    )


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
        within = {_location(d)[:k] for d in details for k in range(len(_location(d)))}
        told = [d for d in details if not (isinstance(d["input"], list) and _location(d) in within)]
        told = [d for d in told if not any(_location(d)[: len(at)] == at for at, _ in marks)]
        other = {_location(d) for d in told if d["type"] != "string_type"}  # of a union what is said of its numbers
        told = [d for d in told if d["type"] != "string_type" or _location(d) not in other]
        raise InvalidSpecError([*marks, *((_location(d), _explain(d, source, model)) for d in told)]) from None
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


RUN: Location = ("runs", 0)
HOMES: tuple[Location, ...] = (("vehicle",), ("environment",), ("settings",), RUN, ("diagnose",), ())


def _explain(detail: ErrorDetails, source: YamlSource, model: type[BaseModel]) -> Finding:
    location = _location(detail)
    key = ".".join(str(p) for p in location) or "the description"
    where = source.where(location)
    kind = detail["type"]
    got = repr(detail["input"])
    got = got if len(got) <= 60 else got[:57] + "..."
    if kind == "extra_forbidden":
        name, known = str(location[-1]), fields_at(model, location[:-1])
        top = fields_at(model, ())
        homes = [home for home in HOMES if (not home or home[0] in top) and name in fields_at(model, home)]
        remedy = f"move it to {_place(homes[0])}" if homes else _closest(name, known)
        return Finding(where, f"unknown key '{name}'", remedy=remedy)
    if kind == "missing":
        return Finding(where, f"'{key}' is missing", remedy=f"add the key '{location[-1]}'")
    if kind in ("model_type", "dict_type"):
        remedy = "write its keys, or remove it"
        if isinstance(detail["input"], str) and location[:-1] == ("runs",):
            remedy = f"write '{{log: {detail['input'][:60]}}}'"
        return Finding(where, f"'{key}' must be a mapping of keys to values", got, remedy)
    message = detail["msg"]
    message = message[0].lower() + message[1:]
    unit = str(detail.get("ctx", {}).get("unit", "")) if kind == "unit" else ""
    remedy = f"write a number with its unit, such as '1 {unit}'" if unit and "write" not in message else ""
    what = f"'{key}' {message}" if kind in ("unit", "range", "quantity") else f"'{key}': {message}"
    return Finding(where, what, got, remedy)


def _location(detail: ErrorDetails) -> Location:
    return tuple(part for part in detail["loc"] if not _is_branch(part))


def _is_branch(part: str | int) -> bool:
    """Pydantic puts the names of union branches into an error's location."""
    return isinstance(part, str) and (
        part.startswith(("literal[", "list[", "dict[", "function-", "nullable"))
        or part in ("str", "float", "int", LOGGED, KNOWN)
    )


def _place(home: Location) -> str:
    return "every run" if home == RUN else f"'{home[0]}'" if home else "the top level"


def _closest(name: str, known: list[str]) -> str:
    few = 0 < len(known) <= 12
    return did_you_mean(name, known, f"known keys: {', '.join(known)}" if few else "remove it, or see 'vdyn explain'")


def fields_at(model: Any, location: Location) -> list[str]:
    """The keys that the model knows at a place in the description."""
    for part in location:
        models = [m for m in _models(model) if isinstance(part, int) or part in m.model_fields]
        if isinstance(part, int):
            model = models[0] if models else None
        elif models:
            model = models[0].model_fields[part].annotation
        else:
            inner = _models(model)
            model = inner[0] if inner else None
    found = _models(model)
    return list(found[0].model_fields) if found else []


def _models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [m for argument in typing.get_args(annotation) for m in _models(argument)]


def check_channels(
    channels: Iterable[str], known: Mapping[str, Quantity], source: YamlSource, at: Location
) -> list[Finding]:
    """Findings for channels that the step does not know; units are checked where the log is read."""
    return [
        Finding(source.where((*at, name)), f"unknown channel '{name}'", remedy=_closest(name, list(known)))
        for name in channels
        if name not in known
    ]
