"""Cuts logs into the segments that are simulated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np

from vdyn_cli.description.description_model import HEADING
from vdyn_cli.inference import white_level
from vdyn_cli.physics.models.road_load import ENGINE_TURNS
from vdyn_cli.quantities.arrays import Array, Mask, filled, spans
from vdyn_cli.quantities.errors import Finding, raise_all
from vdyn_cli.quantities.log import Log, Samples
from vdyn_cli.steps.validate.drives.complete_inputs import (
    DRIVE_TORQUES,
    FEWEST_SAMPLES,
    INPUTS,
    OUTPUTS,
    completed,
    missing_inputs,
    unusable,
)
from vdyn_cli.steps.validate.drives.driven_samples import Driven
from vdyn_cli.steps.validate.drives.end_speed import end_speed
from vdyn_cli.steps.validate.drives.engine_turns import without_engine_share
from vdyn_cli.steps.validate.drives.power_limit import power_limits
from vdyn_cli.steps.validate.drives.ratio_changes import RatioChange, ratio_changes
from vdyn_cli.steps.validate.drives.regimes import Marks, marked, pressed, smoothed, stops
from vdyn_cli.steps.validate.drives.stated_motion import StatedMotion
from vdyn_cli.steps.validate.drives.unequal_drives import load_change, unequal_drives
from vdyn_cli.steps.validate.drives.unequal_resistance import other_resistance, resistance_finding
from vdyn_cli.steps.validate.drives.unlogged_braking import UnloggedBraking, unlogged_braking
from vdyn_cli.steps.validate.policy import VALIDATE_POLICY
from vdyn_cli.steps.validate.road.road_slope import SENSED_SLOPE

ModelName = Literal["vehicle", "road_load"]

FEWEST_DIFFERENCED = 8  # samples that are needed to estimate the noise from third differences
END = 0.1  # share of a spacing: a sample this close to an end of the segment counts as that end
SLOWEST = 1.0  # m/s, below which the road load model is not valid
CREEPING = 2.0  # m/s, below which rows are not used: tread damping and brake friction dominate
# Shares of the largest speed that replace these limits where the car is slow or the speed has a wrong unit (too low by
# 3.6 or more).
SLOWEST_SHARE, CREEPING_SHARE = 0.1, 0.2
MOVING = 0.35  # m/s, least speed of a moving car
MARGIN = 0.5  # s left out before and after braking
SHORTEST_SEGMENT = 5.0  # s, shortest segment
RUN_START = "run_start"  # s, context of a drive: its start after that of the first drive of the day


@dataclass(frozen=True, eq=False)
class DriveSegment:
    """A part of a drive that is simulated without interruption from its measured start.

    Parameters
    ----------
    run : index of the drive in the description. name : of its log, with the times if it has several segments.
    time : (n,) s, of the log.
    inputs : by channel, complete, each (n,).
    outputs : by channel, measured, each (n,), NaN where missing; ``jerk`` only if a channel has it.
    marks : (n,) the regime of every sample, an index into REGIMES.
    heading : +1 out, -1 back, 0 unknown. temperature : K.
    start, end : m/s, speed at the first and last sample, fitted over one second, with its standard deviation.
    since : s from the start of the drive to the first sample. run_start : s from the start of the day to that of the
        drive.
    creeping : m/s, below which rows are not used.
    sampled : times and values of inputs from a slower logger, which ``inputs`` interpolates linearly.
    changed : whether the car has another load than at first; None: no drive shows one.
    slope_error : (n, r), factor of the covariance of the error of the slope by a logged elevation; None without.
    """

    run: int
    name: str
    time: Array
    inputs: Mapping[str, Array]
    outputs: Mapping[str, Array]
    marks: Marks
    heading: float
    temperature: float
    start: tuple[float, float]
    end: tuple[float, float]
    since: float = 0.0
    run_start: float = 0.0
    creeping: float = CREEPING
    sampled: Mapping[str, Samples] = field(default_factory=dict)
    changed: bool | None = None
    slope_error: Array | None = None

    @cached_property
    def stopping(self) -> Mask:
        """Mask (n,) of coming to rest; gusts shift that instant, and with it a jump of the deceleration."""
        return stops(self.time, self.outputs["speed"])

    @cached_property
    def smooth_speed(self) -> Array:
        """Speed (n,) averaged over 0.1 s, m/s."""
        return smoothed(self.time, self.outputs["speed"])

    @cached_property
    def noise_levels(self) -> Mapping[str, float]:
        """Standard deviation of white noise, SI, by input and output with at least ``FEWEST_DIFFERENCED`` values."""
        every = {n: (self.time, v) for n, v in {**self.inputs, **self.outputs}.items()} | dict(self.sampled)
        return {n: white_level(v, t) for n, (t, v) in every.items() if np.isfinite(v).sum() >= FEWEST_DIFFERENCED}

    @property
    def log(self) -> str:
        """Name of the log, without the times of a cut part or a segment of it."""
        return self.name.partition(", ")[0]

    @property
    def duration(self) -> float:
        """Time from the first to the last sample, s."""
        return float(self.time[-1] - self.time[0])


@dataclass(frozen=True)
class Segmentation:
    """Rules by which drives are cut into segments.

    Parameters
    ----------
    model : of the simulation. length : s, of a window; None: segments are as long as possible.
    powered : whether only samples with a drive torque above zero are used. slowest : m/s, least speed for the road load
        model. motion : the stated acceleration of the driven car, if it is known.
    """

    model: ModelName
    length: float | None = None
    powered: bool = False
    slowest: float = SLOWEST
    motion: StatedMotion | None = None


@dataclass(frozen=True)
class RunConditions:
    """Direction (out, back, None: unknown), air temperature (K), and start of a run, s after that of the day."""

    direction: str | None = None
    temperature: float = 293.15
    start: float = 0.0


def drive_segments(
    logs: Sequence[Log], conditions: Sequence[RunConditions], cut: Segmentation
) -> tuple[list[DriveSegment], list[Finding]]:
    """The segments that are simulated, and findings about the logs.

    Parameters
    ----------
    logs : one for each run. conditions : of each run. cut : the rules.

    Raises
    ------
    InputError : an input has no values, a log is too short or, for the vehicle model, an input or a clock has gaps.
    """
    rolls = cut.model == "road_load"  # from a vehicle's drives nothing is left out; powered windows contain no braking
    raise_all(f for log in logs for f in unusable(log, rolls))
    found: list[DriveSegment] = []
    findings: list[Finding] = []
    drives = [completed(log) for log in logs]
    driven = without_engine_share([(w.time, w.channels, total_drive_torque(w.channels)) for w, _ in drives])
    limits = power_limits(driven, cut.motion if rolls else None)
    driven = [(time, channels, limit.torque) for (time, channels, _), limit in zip(driven, limits, strict=True)]
    nowhere = [np.zeros(time.size, dtype=bool) for time, _, _ in driven]
    unlogged = unlogged_braking(driven) if rolls and not cut.powered else [UnloggedBraking(n) for n in nowhere]
    changes = ratio_changes(driven, cut.motion) if rolls else [RatioChange(n) for n in nowhere]
    odd, loaded, said = _odd_drives(logs, conditions, driven, changes, cut)
    findings += said
    for k, (log, condition, (whole, doubts), braked) in enumerate(zip(logs, conditions, drives, unlogged, strict=True)):
        for found_here in (limits[k], braked, changes[k]):
            doubts += found_here.finding(log.name)
        findings += doubts
        top = float(np.nanmax(np.abs(whole["speed"])))
        if k in odd:
            continue
        gaps, missing = missing_inputs(log, whole) if rolls else (nowhere[k], [])
        findings += missing
        left_out = limits[k].beyond | braked.braked | changes[k].other | gaps
        parts = _parts(whole, cut, top, left_out) if top > MOVING else []
        made = [_segment(k, whole, condition, a, b, len(parts) > 1 or cut.length is not None) for a, b in parts]
        slow = min(CREEPING, CREEPING_SHARE * top)
        made = [replace(s, creeping=slow, sampled=_sampled(log, s), outputs=_as_sampled(log, s)) for s in made]
        made = [replace(s, changed=k in loaded if loaded else None) for s in made]
        made = [s for s in made if np.count_nonzero(s.smooth_speed > s.creeping) >= FEWEST_SAMPLES // 2]
        found += made
        if not made:
            what = "no segment of this run can be simulated: too slow, braked or too short"
            findings.append(Finding(log.name, what, remedy="leave the run out, or log its friction brakes"))
    return found, findings


def _odd_drives(
    logs: Sequence[Log],
    conditions: Sequence[RunConditions],
    driven: Sequence[Driven],
    changes: Sequence[RatioChange],
    cut: Segmentation,
) -> tuple[frozenset[int], frozenset[int], list[Finding]]:
    """Whole drives of a mass on a road that are left out, since they differ from the others; those from one drive on
    in which the car has another load; and findings on both.

    With the former, the fit of all drives would show a slope or a gain that none of them has.
    """
    order = sorted(range(len(logs)), key=lambda k: conditions[k].start)
    steady = [k for k in order if not changes[k].spans]
    motion, whole, loaded = cut.motion, cut.model == "road_load" and cut.length is None, frozenset[int]()
    findings: list[Finding] = []
    if whole and (change := load_change([driven[k] for k in steady])):
        first = steady[change.first]
        loaded = frozenset(order[order.index(first) :])
        driven = [(t, c, f / change.ratio if k in loaded else f) for k, (t, c, f) in enumerate(driven)]
        if abs(share := change.ratio - 1.0) > VALIDATE_POLICY.unequal_share:
            size = f"{100 * abs(share):.0f} % {'larger' if share > 0 else 'smaller'}"
            what = f"from this drive on the drive torque per acceleration is {size}: another load or torque gain"
            findings.append(Finding(logs[first].name, what, remedy="weigh the car in both states", doubt=True))
    compared = [logs[k].name for k in steady], [driven[k] for k in steady]
    unequal = unequal_drives(*compared, motion.ratio if motion else None)
    if not whole:
        return frozenset(), loaded, list(unequal.values())
    findings += [replace(f, what=f"{f.what}; this drive is left out") for f in unequal.values()]
    odd = {steady[k] for k in unequal}
    rest = [k for k in steady if k not in odd]
    if motion is not None:
        headings = [HEADING[conditions[k].direction] for k in rest]
        if other := other_resistance([driven[k] for k in rest], headings, motion.constant):
            odd.add(rest[other.drive])
            findings.append(resistance_finding(logs[rest[other.drive]].name, other, motion.inertia))
    return frozenset(odd), loaded, findings


def _sampled(log: Log, s: DriveSegment) -> dict[str, Samples]:
    """The samples of inputs that do not have a value in every row, with interpolated ones at the segment's ends."""
    found: dict[str, Samples] = {}
    for name in (n for n in s.inputs if n in log):
        time, read = log.samples.get(name, (log.time, log[name]))
        there = np.isfinite(read)
        if name in log.samples or not there[np.searchsorted(time, s.time)].all():
            edge = END * float(np.median(np.diff(time[there])))
            inside = there & (time > s.time[0] + edge) & (time < s.time[-1] - edge)
            ends = s.inputs[name][[0, -1]]
            found[name] = np.r_[s.time[0], time[inside], s.time[-1]], np.r_[ends[0], read[inside], ends[1]]
    return found


def _as_sampled(log: Log, s: DriveSegment) -> dict[str, Array]:
    """The outputs, where interpolated from a slower logger only in the row next to each sample, else NaN.

    The interpolated rows have no noise of their own: they would look more precise, and count more, than the samples.
    """
    found = dict(s.outputs)
    for name in log.samples.keys() & found.keys():
        time, read = log.samples[name]
        at = time[np.isfinite(read) & (time >= s.time[0]) & (time <= s.time[-1])]
        after = np.clip(np.searchsorted(s.time, at), 1, s.time.size - 1)
        rows = after - (at - s.time[after - 1] < s.time[after] - at)
        found[name] = np.full(s.time.size, np.nan)
        found[name][rows] = s.outputs[name][rows]
    return found


def _parts(log: Log, cut: Segmentation, top: float, left_out: Mask) -> list[tuple[int, int]]:
    """Indices of the first and last sample of every segment that is simulated.

    Parameters
    ----------
    top : m/s, the largest speed of the log. left_out : (n,) mask, for the road load model: braked without a channel, in
        another gear, above a limit of the power, or without an input.
    """
    if cut.model == "vehicle" and cut.length is None and not cut.powered:
        return [(0, log.time.size - 1)]
    good = np.ones(log.time.size, dtype=bool)
    if cut.powered:
        good &= total_drive_torque(log.channels) > 0
    if cut.model == "road_load":
        speed = filled(log.time, log["speed"])
        slowest = cut.slowest if cut.length is not None else min(cut.slowest, max(SLOWEST_SHARE * top, MOVING))
        good &= (speed > slowest) & ~(left_out | _braked(log))
    return [window for a, b in spans(good) for window in _windows(log.time, a, b - 1, cut.length)]


def _windows(time: Array, a: int, b: int, length: float | None) -> list[tuple[int, int]]:
    """The segment from ``a`` to ``b``, or its consecutive windows; short ones are left out."""
    if length is None:
        return [(a, b)] if time[b] - time[a] >= SHORTEST_SEGMENT and b - a >= FEWEST_SAMPLES else []
    count = int((time[b] - time[a]) / length + 1e-9)
    ends = np.searchsorted(time, time[a] + length * np.arange(count + 1) - 1e-9)
    return [(i, min(j, b)) for i, j in pairwise(ends.tolist()) if j - i >= FEWEST_SAMPLES // 2]


def _braked(log: Log) -> Mask:
    """Mask (n,) of the samples within ``MARGIN`` of a logged brake that is on."""
    on = log.time[pressed(log.time, log["brake_torque"])]
    if not on.size:
        return np.zeros(log.time.size, dtype=bool)
    at = np.searchsorted(on, log.time)
    before = np.where(at > 0, log.time - on[np.maximum(at - 1, 0)], np.inf)
    after = np.where(at < on.size, on[np.minimum(at, on.size - 1)] - log.time, np.inf)
    return np.asarray(np.minimum(before, after) < MARGIN)


def total_drive_torque(signals: Mapping[str, Array]) -> Array:
    """The total drive torque (n,), N m: of one motor, or the sum of both sides.

    Parameters
    ----------
    signals : (n,) each; ``drive_torque``, or ``drive_torque_left`` and ``drive_torque_right``, N m.
    """
    if "drive_torque" in signals:
        return signals["drive_torque"]
    return signals["drive_torque_left"] + signals["drive_torque_right"]


def _segment(run: int, log: Log, condition: RunConditions, a: int, b: int, timed: bool) -> DriveSegment:
    part = slice(a, b + 1)
    time = log.time[part]
    names = [n for n in (*DRIVE_TORQUES, SENSED_SLOPE, ENGINE_TURNS, *INPUTS) if n in log]
    inputs = {n: log[n][part] for n in names}
    outputs = {n: log[n][part] for n in (*OUTPUTS, "jerk") if n in log}
    name = f"{log.name}, {time[0]:.0f} to {time[-1]:.0f} s" if timed else log.name
    heading = HEADING[condition.direction]
    speed = outputs["speed"]
    start, end = end_speed(time, speed, first=True), end_speed(time, speed, first=False)
    marks = marked(time, speed, total_drive_torque(log.channels)[part], inputs["brake_torque"])
    made = DriveSegment(run, name, time, inputs, outputs, marks, heading, condition.temperature, start, end)
    return replace(made, since=float(time[0] - log.time[0]), run_start=condition.start)
