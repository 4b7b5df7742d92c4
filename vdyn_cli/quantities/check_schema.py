"""The document of ``vdyn check``, for the terminal, the page and the JSON."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.quantities.entry import Entry
from vdyn_cli.quantities.result_schema import FindingEntry

Decision = Literal["cut", "kept", "marked"]
Outcome = Literal["met", "not met", "not checked"]


RunVerdict = Literal["keep", "repeat", "wrong", "unreadable", "unknown"]


class CheckedRun(Entry):
    """One run, and whether it must be driven again."""

    run: str = Field(description="name of the run's log")
    verdict: RunVerdict = Field(
        description="repeat: the run cannot be used for its step; wrong: its entries in the description are wrong; "
        "unreadable: its log cannot be read as described; unknown: the run is not judged before another entry is "
        "corrected"
    )
    why: list[str] = Field(description="reasons of the verdict; for a run to keep: notes about it")
    duration: float = Field(description="time from the first to the last sample, s; 0 for an unreadable log")
    samples: int = Field(description="number of rows; 0 for an unreadable log")
    lost: float = Field(
        description="share of the evaluated time in which a needed channel is cut or the clock pauses, 0 to 1"
    )


class CheckFlag(Entry):
    """Segments of one channel of one run that failed one test, or are suspect."""

    run: str = Field(description="name of the run's log")
    channel: str = Field(description="channel, or 'all'")
    test: str = Field(
        description="frozen, straight_line, spike, dropout, requested; missing, level_step, saturated, clock_gap"
    )
    decision: Decision = Field(description="cut; kept by the description; marked: suspect, and used")
    segments: int = Field(description="number of segments")
    start: float = Field(alias="from", description="first time of the longest segment, s")
    stop: float = Field(alias="to", description="last time of the longest segment, s")
    samples: int = Field(description="samples of all segments")
    share: float = Field(
        description="samples of all segments over the rows of the run; of clock gaps, their time over the duration"
    )
    why: str = Field(description="the fact, of the longest segment")


class TiedPair(Entry):
    """Two quantities of a run with a known physical relation: first = gain x second + offset, delayed."""

    run: str = Field(description="name of the run's log")
    first: str = Field(description="the first quantity")
    second: str = Field(description="the second quantity")
    gain: float | None = Field(description="first over second; null where the run does not determine it")
    offset: float | None = Field(description="constant term, in the SI unit of the first; null where a pair has none")
    delay: float | None = Field(description="of the first relative to the second, s; null where it is not determined")
    delay_std: float | None = Field(description="standard error of the delay, s; null where it is not determined")
    sign: Literal[-1, 1] | None = Field(description="-1: opposite signs; null where it is not determined")
    good: bool | None = Field(description="whether they agree; null where nothing is determined")
    what: str = Field(description="the result in words")


class RunDeceleration(Entry):
    """The mean deceleration of one coast over the speed range that all coasts cover."""

    run: str = Field(description="name of the run's log")
    direction: str = Field(description="out, back, or empty")
    start: float | None = Field(description="start since the first run, s; null where the description has none")
    mean: float | None = Field(description="mean deceleration over the common speeds, m/s^2")
    influence: float | None = Field(
        description="relative change of the mean of all runs (both directions with equal weight) without this run"
    )
    material: bool = Field(description="whether that exceeds the 95 % interval of the other runs' mean")
    wind_mean: float | None = Field(description="mean measured wind along the road, m/s; null where it is not known")
    wind_peak: float | None = Field(
        description="largest measured wind along the road, at the rate of the step (20 Hz), m/s; null where not logged"
    )


class TimeAccuracy(Entry):
    """Statistical accuracy of the pairs' coast times about one speed."""

    speed: float = Field(description="reference speed, km/h; the times are those of +-5 km/h about it")
    time: float = Field(description="harmonic mean of the times, s")
    r83: float | None = Field(description="p of UN R83, Annex 4a, Appendix 7; null below four pairs")
    wltp: float | None = Field(description="p of UN GTR 15, Annex 4; null below three pairs")


class RegulationLimit(Entry):
    """One limit of a regulation."""

    regulation: str = Field(description="name of the regulation")
    clause: str = Field(description="where it states the limit; empty where only the topic is known")
    limit: str = Field(description="the limit")
    found: str = Field(description="what the test has, or why it is not checked")
    outcome: Outcome = Field(description="met, not met, or not checked")


class CoastBalance(Entry):
    """Order, directions, warm-up and wind of a coast-down campaign."""

    out: int = Field(description="usable runs out")
    back: int = Field(description="usable runs back")
    pairs: int = Field(description="usable pairs: the k-th run out with the k-th run back")
    unpaired: list[str] = Field(description="usable runs without a partner")
    alternating: bool | None = Field(description="whether directions alternate in the order of the description")
    speeds: tuple[float, float] | None = Field(description="speed range that all usable runs cover, km/h: from, to")
    trend: float | None = Field(description="relative change of the mean deceleration from the first to the last run")
    trend_half: float | None = Field(description="half of the 95 % interval of the trend")
    difference: float | None = Field(description="mean deceleration out minus that back, m/s^2")
    difference_half: float | None = Field(description="half of its 95 % interval, m/s^2")
    scatter: float | None = Field(
        description="standard deviation of runs of one direction about the trend, over the mean deceleration"
    )
    runs: list[RunDeceleration] = Field(description="in the order of the description")
    accuracy: list[TimeAccuracy] = Field(description="highest speed first")
    limits: list[RegulationLimit] = Field(description="limits of regulations")
    sentences: list[str] = Field(description="balance, order, warm-up and wind in words")


class CheckDocument(Entry):
    """The result of ``vdyn check``: whether the runs of a test are usable, before the car leaves the track."""

    format: Literal["vdyn/check/1"] = Field("vdyn/check/1", description="name and version of this format")
    step: str = Field(description="the step that the description is for")
    title: str = Field(description="title of the description")
    good: bool = Field(
        description="whether no run must be repeated and no entry of the description is wrong or implausible"
    )
    sentence: str = Field(description="the answer in one sentence")
    runs: list[CheckedRun] = Field(description="in the order of the description")
    flags: list[CheckFlag] = Field(description="faulty and suspect segments")
    redundancy: list[TiedPair] = Field(description="channels with a known physical relation")
    untied: list[str] = Field([], description="logged channels whose gain no pair determines in any run")
    clocks: list[ClockDifference] = Field([], description="differences of the clocks of several loggers")
    coasts: CoastBalance | None = Field(description="of a coast-down; null for other steps and driven logs")
    parameters: Literal["not evaluated"] = Field(
        "not evaluated", description="change of the parameters when a run is left out; the step evaluates it"
    )
    findings: list[FindingEntry] = Field(description="notes and doubts about the description and the logs")
