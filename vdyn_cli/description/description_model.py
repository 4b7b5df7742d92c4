"""Model of test descriptions: strict YAML that states logs, channels, vehicle and settings."""

from __future__ import annotations

import typing
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, TypeVar

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationInfo,
    create_model,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from vdyn_cli.description.quantity_field import Si, Strict, described, si
from vdyn_cli.description.start_times import seconds_after_first
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.vocabulary import CHANNELS, PARAMETERS


class VehicleBase(Strict):
    """Parameters of the vehicle that the user states."""

    def items(self) -> Iterator[tuple[str, Given]]:
        """Name and value of each stated quantity, SI."""
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
    """The air during the test; dry air if neither humidity nor density is stated."""

    temperature: Annotated[Given, si(PARAMETERS["temperature"])] | None = Field(None, description="air temperature, K")
    pressure: Annotated[Given, si(PARAMETERS["pressure"])] | None = Field(None, description="air pressure, Pa")
    humidity: Annotated[Given, Si("", 0, 1)] | None = Field(None, description="relative humidity, 0 to 1")


class Channel(Strict):
    """Source of a channel in a log: column, unit, and sign convention."""

    column: str = Field(description="name of the column in the log's header")
    unit: str = Field(description="unit of the column, such as km/h; write 1 for a dimensionless column")
    sign: Literal[1, -1] = Field(1, description="-1 if the logger's sign convention is opposite to vdyn's")
    scale: float = Field(
        1.0, gt=0, description="factor that corrects the sensor's gain: the column's values are multiplied by it, 1"
    )
    group: str = Field(
        "",
        description="group of the column if a file has several of this name; for time: the group with the clock",
    )
    source: str = Field("", description="device or bus of the column if a file has several of this name")

    @field_validator("unit", mode="before")
    @classmethod
    def _one(cls, value: Any) -> Any:
        """The number 1 as a unit: dimensionless."""
        return "1" if value == 1 and not isinstance(value, bool) else value


class KnownChannel(Strict):
    """A channel that was not recorded, because its value is known and constant."""

    constant: str | float = Field(description="constant value of the channel with its unit, such as 0 N")


LOGGED, KNOWN = "logged channel", "known channel"  # the branches of a channel's source, in pydantic's locations


def _branch(value: Any) -> str:
    known = "constant" in value if isinstance(value, dict) else isinstance(value, KnownChannel)
    return KNOWN if known else LOGGED


ChannelSource = Annotated[Annotated[Channel, Tag(LOGGED)] | Annotated[KnownChannel, Tag(KNOWN)], Discriminator(_branch)]


def _grouped(levels: Any) -> Any:
    """A list of groups of levels; a single group is put into a list."""
    return [levels] if isinstance(levels, list) and levels and not isinstance(levels[0], list) else levels


class Reading(Strict):
    """Format of a log file, where detection fails; ``clock: drop`` drops rows whose time steps back."""

    delimiter: str | None = Field(None, description="character between columns; detected if not given")
    decimal: Literal[".", ","] | None = Field(None, description="decimal separator; detected if not given")
    encoding: str | None = Field(None, description="text encoding, such as latin-1; detected if not given")
    header_row: Annotated[int, Field(ge=1)] | None = Field(
        None, description="line of the header, counted from 1; detected if not given"
    )
    clock: Literal["strict", "drop"] = Field(
        "strict", description="strict: a time that steps back is an error; drop: its rows are dropped and reported"
    )
    rate: Annotated[Given, Si("Hz", 1e-3, 1e6)] | None = Field(
        None,
        description="sampling rate of a log without a column of time, such as 1 Hz: its rows are equally spaced, "
        "and 'time' is not mapped",
    )
    split_times: Literal["elapsed", "intervals"] | None = Field(
        None,
        description="the logs are tables of speed levels and split times. elapsed: time since the first level; "
        "intervals: time since the level of the row above",
    )
    split_runs: Literal["columns", "rows"] = Field(
        "columns",
        description="rows: each run is a row of the table. The header states the speed levels; its first cell is the "
        "name of the speed's column. 'columns: {time: NAME}' of a run names the first cell of its row",
    )
    levels: Annotated[list[list[Annotated[Given, Si("m/s", 0.0)]]], BeforeValidator(_grouped)] = Field(
        [],
        description="speed levels of a coast-down report that does not state them, m/s, such as [100 km/h, 90 km/h]; "
        "a list of groups if runs have different levels",
    )

    @field_validator("rate")
    @classmethod
    def _exact(cls, rate: Given | None) -> Given | None:
        if rate is not None and rate.std:
            raise PydanticCustomError("rate", "takes a number without an uncertainty, such as 10 Hz")
        return rate


LONGEST_TEST = 1e7  # s, four months: more than a test with one set of tires and one load


class Logger(Strict):
    """One of several loggers that recorded the same run, each with its own clock."""

    channels: dict[str, ChannelSource] = Field(
        description="vdyn's channel name: column and unit of this logger's log, or a constant"
    )
    reading: Reading = Field(Reading(), description="how this logger's files are written")
    delay: Annotated[Given, Si("s", -LONGEST_TEST, LONGEST_TEST)] | None = Field(
        None,
        description="time of this logger's clock minus that of the first logger's, s, if known (0 s: same clock; "
        "times of day are compared as such, other times as the files state them); if not given, it is estimated",
    )


class Segment(Strict):
    """A segment of a channel of one log."""

    model_config = ConfigDict(serialize_by_alias=True)

    channel: str = Field("all", description="vdyn's channel name; all: every channel")
    start: Annotated[Given, Si("s")] = Field(alias="from", description="time of the log at which it begins, s")
    stop: Annotated[Given, Si("s")] = Field(alias="to", description="time of the log at which it ends, s")


# By direction, the sign of forces that turn with the vehicle; 0: not stated.
HEADING: Mapping[str | None, float] = {"out": 1.0, "back": -1.0, None: 0.0}


RecordingNumber = Annotated[int, Field(ge=1)]
ALL_LOGS, EACH_LOG = "all logs", "each log"  # the branches of what a run states of its channels
_Stated = TypeVar("_Stated")


def _list_or_mapping(value: Any) -> str:
    return EACH_LOG if isinstance(value, list) else ALL_LOGS


OwnKeys = Annotated[
    Annotated[dict[str, _Stated], Tag(ALL_LOGS)] | Annotated[list[dict[str, _Stated] | None], Tag(EACH_LOG)],
    Discriminator(_list_or_mapping),
]
OwnKey = Literal["columns", "signs", "units"]
OWN: tuple[OwnKey, ...] = ("columns", "signs", "units")


class Run(Strict):
    """One run: its log (or one log per logger), direction, and start since the first run."""

    log: str | None = Field(None, description="path of the log, from the folder of this description")
    logs: list[str] | None = Field(None, description="paths of one log per logger, in the order of 'loggers'")
    signs: OwnKeys[Literal[1, -1]] = Field(
        {},
        description="channel: -1 if its sign in this run is opposite to that in the other runs. With 'logs': a list "
        "with such a mapping, or null, for each log",
    )
    columns: OwnKeys[str] = Field(
        {},
        description="channel: its column in this run, if one table has several runs, such as {time: t2}. With "
        "'logs': also a list, as for 'signs'",
    )
    units: OwnKeys[str] = Field(
        {},
        description="channel: its unit in this run, where its log is in another unit than those of the other runs. "
        "With 'logs': also a list, as for 'signs', such as [{speed: mph}, null]",
    )
    recording: RecordingNumber | list[RecordingNumber | None] | None = Field(
        None,
        description="number of the recording, counted from 1, if the log has several, one after another, and its clock "
        "restarts with each; 'vdyn channels' lists them. With 'logs': a list with the number, or null, for each log",
    )
    direction: Literal["out", "back"] | None = Field(None, description="direction of travel on the test track")
    start: Annotated[Given, Si("s", -LONGEST_TEST, LONGEST_TEST)] | None = Field(
        None,
        description="start of this log after the start of the first log, s, or in every run its time of day, such as "
        "10:08:14; if not given in any run: from the logs' "
        "times if they are from one clock, else the runs are assumed to follow each other in this order without a "
        "pause (logs of more than 10 min: separate trips)",
    )
    temperature: Annotated[Given, si(PARAMETERS["temperature"])] | None = Field(
        None, description="air temperature during this run if it differs from the environment's, K"
    )
    wind_speed: Annotated[Given, si(CHANNELS["wind_speed"])] | None = Field(
        None, description="mean headwind during this run, measured beside the track, m/s"
    )
    crosswind: Annotated[Given, Si("m/s", 0, 60)] | None = Field(
        None, description="mean crosswind during this run, measured beside the track, m/s"
    )
    from_time: Annotated[Given, Si("s")] | None = Field(None, description="samples from this time on are used, s")
    to_time: Annotated[Given, Si("s")] | None = Field(None, description="samples up to this time are used, s")
    cuts: Literal["automatic", "none"] | list[Segment] = Field(
        "automatic",
        description="samples to leave out. automatic: those that fail a quality test; none; or a list of segments, "
        "such as [{channel: speed, from: 12 s, to: 15 s}], which replaces the automatic cuts",
    )
    keep: list[Segment] = Field(
        [], description="segments that are not cut although they fail a quality test; a list as for 'cuts'"
    )

    @property
    def heading(self) -> float:
        """+1 out, -1 back, 0 where the direction is not stated."""
        return HEADING[self.direction]

    @property
    def recordings(self) -> tuple[int | None, ...]:
        """The number of the recording in each log; None for a log with a single one."""
        return tuple(self.recording) if isinstance(self.recording, list) else (self.recording,) * self._count

    def own(self, key: OwnKey) -> tuple[Mapping[str, Any], ...]:
        """What the run states of its channels' columns, signs or units, for each of its logs."""
        stated = getattr(self, key)
        return tuple(one or {} for one in stated) if isinstance(stated, list) else (stated,) * self._count

    @property
    def _count(self) -> int:
        return 1 if self.logs is None else len(self.logs)

    @model_validator(mode="after")
    def _one_kind_of_log(self) -> Run:
        if (self.log is None) == (self.logs is None):
            raise PydanticCustomError("log", "a run has either 'log' or 'logs'")
        for key in ("recording", *OWN):
            stated = getattr(self, key)
            if isinstance(stated, list) and len(stated) != self._count:
                what = "'{key}' has {entries} of the {logs} entries, one for each log: write null for a log without"
                what = what if self.logs else "'{key}' is a list only with 'logs': write its entry without brackets"
                raise PydanticCustomError("each_log", what, {"key": key, "entries": len(stated), "logs": self._count})
        return self

    @field_validator("cuts", mode="before")
    @classmethod
    def _cut_list(cls, value: Any) -> Any:
        if isinstance(value, str) and value not in ("automatic", "none"):
            raise PydanticCustomError(
                "list", "takes automatic, none, or a list such as [{channel: speed, from: 12 s, to: 15 s}]"
            )
        return value


class Diagnose(Strict):
    """Candidate effects to test, and effects by which the model may be extended."""

    effects: Literal["all", "none"] | list[str] = Field(
        "all", description="candidate effects to test: all, none, or a list such as [headwind]"
    )
    extend: Literal["never", "named", "learned"] | list[str] = Field(
        "named",
        description="effects to add to the model. never: none; named: effects of the catalog that the diagnosis names, "
        "and a law learned from the data if the logs contradict the fit without one; learned: also other learned "
        "laws; or a list of requested effects",
    )
    matters: dict[str, str | float] = Field(
        {},
        description="smallest change that matters, by name: of the main output in its unit (rms) and of parameters in "
        "their unit or in % of their value, such as {speed: 0.05 m/s, rolling_resistance: 1 %}. A finding with smaller "
        "changes is a note, and the verdict is adequate. Default: a tenth of the output's noise floor and of each "
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


class Description(Strict):
    """The keys of every test description; a step derives its model from it and adds settings."""

    test: str = Field(description="the step that evaluates this test")
    title: str = Field("", description="title of the report")
    vehicle: Vehicle = Field(Vehicle(), description="known parameters of the vehicle, or a YAML file of them")
    environment: Environment = Field(Environment(), description="the air during the test")
    reading: Reading = Field(Reading(), description="format of the log files, if detection fails")
    channels: dict[str, ChannelSource] = Field(
        {}, description="vdyn's channel name: column and unit of the logs, or a constant such as {constant: 0 N}"
    )
    loggers: list[Logger] = Field([], description="several loggers of the same runs, each with its channels and clock")
    align_on: str | Annotated[list[str], Field(min_length=2, max_length=2)] | None = Field(
        None,
        description="channel that aligns the loggers' clocks: a channel of all loggers, or a list of the first logger's"
        " and the other's, such as [speed, acceleration]; if not given: the pair with the smallest standard error",
    )
    runs: list[Run] = Field([], description="the runs, one entry each")
    diagnose: Diagnose = Field(Diagnose(), description="which model errors to test, and whether to extend the model")
    plan: dict[str, str | float] = Field(
        {},
        description="values that 'vdyn plan' assumes without logs, such as {speed_noise: 0.05 m/s, rate: 10 Hz}; "
        "'vdyn plan' lists every key with its value",
    )

    @property
    def mapped(self) -> set[str]:
        """Names of the channels that the description maps, of all loggers."""
        return {name for channels in (self.channels, *(one.channels for one in self.loggers)) for name in channels}

    @field_validator("runs", mode="before")
    @classmethod
    def _times_of_day(cls, value: Any) -> Any:
        return seconds_after_first(value)
