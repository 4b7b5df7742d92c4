"""Selection of the fitted segments of the logs: coasts or driven parts, in calm air, without brakes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.ndimage import uniform_filter1d

from vdyn_cli.description.description_model import Channel
from vdyn_cli.io.clocks.interpolated_values import sampled_rows
from vdyn_cli.io.file_units import wrong_units
from vdyn_cli.physics.models.road_load import DriveSignal
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.coastdown.coasts.braking import braked_while_coasting, without_braking, without_outliers
from vdyn_cli.steps.coastdown.coasts.creep import without_creep
from vdyn_cli.steps.coastdown.coasts.filtered_start import without_filtered_start
from vdyn_cli.steps.coastdown.coasts.final_braking import without_final_braking
from vdyn_cli.steps.coastdown.coasts.late_clutch import without_late_clutch
from vdyn_cli.steps.coastdown.coasts.segments import (
    CoastSegment,
    KeptAndRejected,
    NoSegmentError,
    RejectedSegment,
    coast_segment,
    driven_segment,
    further_coasts,
    kept_and_rejected,
    rows,
    split,
)
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY
from vdyn_cli.steps.coastdown.spec import CoastdownSettings, CoastdownSpec
from vdyn_cli.steps.step_policy import STEP_POLICY

SLOWEST = 1.0  # m/s: below, tires and brakes follow other laws
FEWEST_LISTED = 4  # number of short parts of one log from which they are listed as one entry


@dataclass(frozen=True)
class SegmentSelection:
    """The segments that are fitted, and those that are left out with the reason."""

    segments: tuple[CoastSegment, ...]
    rejected: tuple[RejectedSegment, ...]


def measured_drive(settings: CoastdownSettings, logs: Sequence[Log]) -> DriveSignal:
    """The drive signal that every log contains; "coasting" if there is none or the description requests coasts.

    Whether it is zero throughout, so that the runs are coast-downs, is decided by ``idle_drive.is_idle``.

    Raises
    ------
    InputError : ``windows: powered`` without such a signal.
    """
    signals: tuple[DriveSignal, ...] = ("torque", "force")
    for signal in signals:
        if all(f"drive_{signal}" in log for log in logs) and settings.windows != "coast":
            return signal
    if settings.windows == "powered":
        what = "windows 'powered' needs a measured drive"
        raise InputError(
            Finding("settings.windows", what, remedy="map drive_torque, drive_force or drive_power, or choose 'coast'")
        )
    return "coasting"


def selected(
    spec: CoastdownSpec, logs: Sequence[Log], drive: DriveSignal, known: Mapping[str, Given]
) -> SegmentSelection:
    """The segments that are fitted, and the rejected ones with their reasons.

    Parameters
    ----------
    known : mass, rotating_mass, air_density, for torque also gear_ratio, wheel_radius and driveline_efficiency; SI.

    Raises
    ------
    InputError : the speed window is too narrow, or outside the logged speeds. NoSegmentError : no segment is left.
    """
    runs = _LoggedRuns(spec, tuple(logs), drive, known, _speed_window(spec.settings, logs))
    segments, rejected = runs.coasts() if drive == "coasting" else runs.driven()
    for left_out in runs.filters():
        if segments:
            segments, parts = left_out(segments)
            rejected += parts
    if not segments:
        if drive == "coasting":
            _refuse_other_quantity(spec, logs)
        remedy = "check speed_window (with unit, such as [70 km/h, 25 km/h]), minimum_length and the channel map"
        nothing = Finding("runs", "no log has a sample above the lowest speed that is fitted", "", remedy)
        why_not = [Finding(r.run, f"rejected: {r.why}", "", remedy) for r in rejected] or [nothing]
        raise NoSegmentError(*why_not, rejected=rejected)
    if drive == "coasting" and spec.reading.split_times is None:
        for run in sorted({s.run for s in segments}):
            used = [s for s in segments if s.run == run]
            rejected += further_coasts(_usable(_own_rows(logs[run]), "coasting"), used)
    why = "the speed is held before the coast"
    rejected += dict.fromkeys(RejectedSegment(logs[s.run].name, *s.held, why, usual=True) for s in segments if s.held)
    return SegmentSelection(tuple(segments), tuple(rejected))


def whole_segments(
    spec: CoastdownSpec, logs: Sequence[Log], drive: DriveSignal, known: Mapping[str, Given]
) -> list[CoastSegment]:
    """The whole coasts or driven windows of logs, before any is left out; arguments as those of ``selected``."""
    runs = _LoggedRuns(spec, tuple(logs), drive, known, _speed_window(spec.settings, logs))
    if drive == "coasting":
        return runs.whole_coasts()
    return [window for segment in runs.driven()[0] for window in split(segment)]


@dataclass(frozen=True)
class _LoggedRuns:
    """The logs with what is known of the runs; ``window``: upper and lower speed, m/s; None: the whole fall."""

    spec: CoastdownSpec
    logs: tuple[Log, ...]
    drive: DriveSignal
    known: Mapping[str, Given]
    window: tuple[float, float] | None

    def coasts(self) -> KeptAndRejected:
        """The coast of each log, and what is rejected.

        Runs of a missing direction are added even if they cover little of the speed window. Downhill a car may stop
        decelerating within the window; without those runs a slope looks like resistance.
        """
        found = [self._coast(k, COASTDOWN_POLICY.least_covered) for k in range(len(self.logs))]
        used = {one.direction for one in found if isinstance(one, CoastSegment)}
        if len(used) == 1 and None not in used:
            lost = [k for k, run in enumerate(self.spec.runs) if run.direction not in used]
            found = [self._coast(k, COASTDOWN_POLICY.some_covered) if k in lost else one for k, one in enumerate(found)]
        return [a for a in found if isinstance(a, CoastSegment)], [a for a in found if isinstance(a, RejectedSegment)]

    def whole_coasts(self) -> list[CoastSegment]:
        """Each log from its highest speed on, of those in which the car coasts."""
        wholes = [coast_segment(k, _usable(_own_rows(log), "coasting"), None, 0.0) for k, log in enumerate(self.logs)]
        return [self._of_run(s) for s in wholes if isinstance(s, CoastSegment)]

    def driven(self) -> KeptAndRejected:
        """The driven parts of each log, and what is rejected."""
        settings, segments, rejected = self.spec.settings, list[CoastSegment](), list[RejectedSegment]()
        slowest = self.window[1] if self.window else SLOWEST
        for k, log in enumerate(self.logs):
            there = _usable(log, self.drive)
            demand = there[f"drive_{self.drive}"] if settings.windows == "powered" else None
            one, left = driven_segment(k, there, demand, slowest, settings.minimum_length.value)
            segments += [] if one is None else [self._of_run(one)]
            if one is None and not left:
                what = "the vehicle is never" + ("" if demand is None else " driven and")
                why = f"{what} faster than {3.6 * slowest:.3g} km/h"
                left = [RejectedSegment(log.name, float(log.time[0]), float(log.time[-1]), why)]
            rejected += _summed(log, left)
        return segments, rejected

    def filters(self) -> list[Callable[[Sequence[CoastSegment]], KeptAndRejected]]:
        """What leaves out, in turn, parts that wind, brake, clutch, driveline, throttle or a filter disturb."""
        settings, shortest = self.spec.settings, self.spec.settings.minimum_length.value
        calm = partial(_calm, limit=settings.wind_limit.value)
        if self.drive != "coasting":
            undisturbed = partial(_without_outliers, shortest=shortest)
            return [calm] if settings.windows == "powered" else [calm, undisturbed]
        span = self.window and self.window[0] - self.window[1]
        return [
            calm,
            self._without_braked_runs,
            without_filtered_start,
            without_late_clutch,
            partial(without_braking, window=span, shortest=shortest),
            lambda segments: ([part for s in segments for part in split(s)], []),
            without_final_braking,
            without_creep,
        ]

    def _coast(self, run: int, covered: float) -> CoastSegment | RejectedSegment:
        """The coast of one log through the speed window, of which it must cover the share ``covered``."""
        log, table = self.logs[run], self.spec.reading.split_times is not None
        there, shortest = _usable(log if table else _own_rows(log), "coasting"), self.spec.settings.minimum_length.value
        found = coast_segment(run, there, self.window, shortest, table, covered)
        return self._of_run(found) if isinstance(found, CoastSegment) else found

    def _of_run(self, one: CoastSegment) -> CoastSegment:
        """The segment with what is known of its run."""
        run, inertia = self.spec.runs[one.run], self.known["mass"].value + self.known["rotating_mass"].value
        kept = tuple((k.start.value, k.stop.value) for k in run.keep)
        pushed = _known_force(one.log, self.drive, self.known) / inertia
        return replace(one, pushed=pushed, whole=self.logs[one.run], direction=run.direction, kept=kept)

    def _without_braked_runs(self, segments: Sequence[CoastSegment]) -> KeptAndRejected:
        """Segments of runs not braked above the speed window, and the others: their brakes may still drag."""
        coasts = self.whole_coasts()
        braked = braked_while_coasting(coasts) if coasts else {}

        def why_not(one: CoastSegment) -> str:
            above = (why for time, why in braked.get(one.run, ()) if time < one.log.time[0])
            return next((f"{why} (above the speed window)" for why in above), "")

        return _without(segments, why_not)


def _refuse_other_quantity(spec: CoastdownSpec, logs: Sequence[Log]) -> None:
    """Refuse a speed that ends above its begin and has no long decrease in every log, such as a temperature.

    A log may begin at rest, and end before the car stops: its speed then falls by at least half of its range.

    Raises
    ------
    InputError : it does.
    """
    speeds = [one for log in logs if (one := log["speed"][np.isfinite(log["speed"])]).size]
    ends = [one[[0, -1]] for one in speeds]
    falls = [np.max(np.maximum.accumulate(one) - one) >= 0.5 * np.ptp(one) for one in speeds]
    if not ends or any(falls) or any(last <= first for first, last in ends):
        return
    mapped = spec.channels.get("speed")
    column = f"column '{mapped.column}'" if isinstance(mapped, Channel) else "the speed"
    first, last = 3.6 * ends[0]
    runs = f"all {len(logs)} runs, in " if len(logs) > 1 else ""
    what = f"{column} increases in {runs}{logs[0].name} from {first:.1f} to {last:.1f} km/h as mapped"
    remedy = "map the column of the speed, with its unit; a coast-down is a decrease of the speed"
    raise InputError(Finding("channels.speed", what, "", remedy))


def _speed_window(settings: CoastdownSettings, logs: Sequence[Log]) -> tuple[float, float] | None:
    """Upper and lower speed, m/s."""
    if not settings.speed_window:
        return None
    speeds = [v.value for v in settings.speed_window]
    upper, lower = max(speeds), min(speeds)
    if upper - lower < COASTDOWN_POLICY.least_window:
        got = f"{upper:g} to {lower:g} m/s"
        what = f"must span at least {COASTDOWN_POLICY.least_window:g} m/s"
        raise InputError(Finding("settings.speed_window", what, got, "write a wider one, or omit it"))
    logged = [np.abs(log["speed"][np.isfinite(log["speed"])]) for log in logs]  # negative on the way back
    ends = [(float(one.min()), float(one.max())) for one in logged if one.size]
    slowest, fastest = min((low for low, _ in ends), default=0.0), max((high for _, high in ends), default=0.0)
    outside = bool(ends) and (lower >= fastest or upper <= slowest)
    if outside and not wrong_units(f for log in logs for f in log.findings):  # else the speeds are wrong
        what = f"lies outside the logged speeds, {3.6 * fastest:.1f} to {3.6 * slowest:.1f} km/h"
        got = f"{3.6 * upper:.1f} to {3.6 * lower:.1f} km/h"
        remedy = "write one within the logged speeds, omit it, or correct the unit of the channel speed"
        raise InputError(Finding("settings.speed_window", what, got, remedy))
    return upper, lower


def _usable(log: Log, drive: DriveSignal) -> Log:
    """The log without mostly empty channels, reduced to the rows in which every channel of the fit has a number."""
    optional = [n for n in ("grade", "wind_speed", "acceleration") if n in log]
    there = np.isfinite(log["speed"])  # parts that were cut have no speed either
    empty = [n for n in optional if there.any() and np.isnan(log[n][there]).mean() > STEP_POLICY.most_missing]
    needed = [n for n in optional if n not in empty] + ([] if drive == "coasting" else [f"drive_{drive}"])
    keep = np.all([np.isfinite(log[n]) for n in needed], axis=0) if needed else np.ones(log.time.size, dtype=bool)
    return rows(replace(log, channels={n: v for n, v in log.channels.items() if n not in empty}), keep)


def _own_rows(log: Log) -> Log:
    """The rows with a new measured speed, with the other channels averaged around them.

    A linearly interpolated speed would be mistaken for a speed without noise.
    """
    own = sampled_rows(log["speed"])
    if own is None:
        return log
    width = int(own[1] - own[0])
    others = {n: uniform_filter1d(v, width, mode="nearest") for n, v in log.channels.items() if n != "speed"}
    return rows(log.with_channels(**others), np.isin(np.arange(log.time.size), own))


def _summed(log: Log, left: list[RejectedSegment]) -> list[RejectedSegment]:
    """Short parts of one log combined into one entry, because an open road has many."""
    if len(left) < FEWEST_LISTED:
        return left
    total = sum(r.seconds for r in left)
    why = f"{len(left)} parts ({total:.0f} s in total) are {left[0].why}"
    return [RejectedSegment(log.name, left[0].start, left[-1].stop, why, length=total)]


def _calm(segments: Sequence[CoastSegment], limit: float) -> KeptAndRejected:
    """Segments whose mean measured wind is at most ``limit`` (m/s), and the others as rejected."""

    def why_not(one: CoastSegment) -> str:
        wind = abs(float(np.mean(one.log["wind_speed"]))) if "wind_speed" in one.log else 0.0
        return f"mean wind {3.6 * wind:.0f} km/h, above the limit of {3.6 * limit:.0f} km/h" if wind > limit else ""

    return _without(segments, why_not)


def _without(segments: Sequence[CoastSegment], why_not: Callable[[CoastSegment], str]) -> KeptAndRejected:
    """The segments for which there is no reason not to use them, and the others as rejected."""
    reasons = [why_not(one) for one in segments]
    return kept_and_rejected(
        (None, [one.rejected(why)]) if why else (one, []) for one, why in zip(segments, reasons, strict=True)
    )


def _without_outliers(segments: Sequence[CoastSegment], shortest: float) -> KeptAndRejected:
    """Driven segments without outliers. With an accelerometer all are kept: hills would be mistaken for brakes."""
    if all("acceleration" in s.log for s in segments):
        return list(segments), []
    return without_outliers(segments, shortest)


def _known_force(log: Log, drive: DriveSignal, known: Mapping[str, Given]) -> Array:
    """Force by drive and slope, (n,) N."""
    force = -known["mass"].value * GRAVITY * log.channels.get("grade", np.zeros(log.time.size))
    if drive == "torque":
        torque, efficiency = log["drive_torque"], known["driveline_efficiency"].value
        per_torque = known["gear_ratio"].value / known["wheel_radius"].value
        return force + per_torque * torque * np.where(torque < 0, 1.0, efficiency)
    return force + log["drive_force"] if drive == "force" else force
