"""Selection of the fitted segments of the logs: coasts or driven parts, in calm air, without brakes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

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
    NoSegmentError,
    RejectedSegment,
    coast_segment,
    driven_segment,
    further_coasts,
    rows,
    split,
)
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
        raise InputError(Finding("settings.windows", what, remedy="map drive_torque or drive_force, or choose 'coast'"))
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
    settings, window = spec.settings, _speed_window(spec.settings, logs)
    segments: list[CoastSegment] = []
    rejected: list[RejectedSegment] = []
    for k, log in enumerate(logs):
        if drive == "coasting":
            found = _coast(spec, k, log, window)
            if isinstance(found, CoastSegment):
                segments.append(found)
            else:
                rejected.append(found)
            continue
        there = usable(log, drive)
        demand = there[f"drive_{drive}"] if settings.windows == "powered" else None
        slowest = window[1] if window else SLOWEST
        one, left = driven_segment(k, there, demand, slowest, settings.minimum_length.value)
        segments += [] if one is None else [one]
        rejected += _summed(log, left)
    if drive == "coasting":
        segments, rejected = _with_both_directions(spec, logs, window, segments, rejected)
    segments, windy = _calm(segments, settings.wind_limit.value)
    rejected += windy
    if segments and drive == "coasting":
        segments, braked = _without_braked_runs(spec, logs, segments, known)
        rejected += braked
    if segments and settings.windows != "powered":
        segments, braked = _without_disturbed_parts(spec, logs, segments, drive, known, window)
        rejected += braked
    if drive == "coasting" and spec.reading.split_times is None:
        for run in sorted({s.run for s in segments}):
            used = [s for s in segments if s.run == run]
            rejected += further_coasts(usable(_own_rows(logs[run]), "coasting"), used)
    if not segments:
        if drive == "coasting":
            _refuse_other_quantity(spec, logs)
        remedy = "check speed_window (with unit, such as [70 km/h, 25 km/h]), minimum_length and the channel map"
        nothing = Finding("runs", "no log has a sample above the lowest speed that is fitted", "", remedy)
        why_not = [Finding(r.run, f"rejected: {r.why}", "", remedy) for r in rejected] or [nothing]
        raise NoSegmentError(*why_not, rejected=rejected)
    why = "the speed is held before the coast"
    rejected += dict.fromkeys(RejectedSegment(logs[s.run].name, *s.held, why, usual=True) for s in segments if s.held)
    return SegmentSelection(tuple(segments), tuple(rejected))


def _refuse_other_quantity(spec: CoastdownSpec, logs: Sequence[Log]) -> None:
    """Refuse a speed that ends above its begin in every log, such as a temperature.

    Raises
    ------
    InputError : it does.
    """
    ends = [one[[0, -1]] for log in logs if (one := log["speed"][np.isfinite(log["speed"])]).size]
    if not ends or any(last <= first for first, last in ends):
        return
    mapped = spec.channels.get("speed")
    column = f"column '{mapped.column}'" if isinstance(mapped, Channel) else "the speed"
    first, last = 3.6 * ends[0]
    what = (
        f"{column} increases in all {len(logs)} runs, in {logs[0].name} from {first:.1f} to {last:.1f} km/h as mapped"
    )
    remedy = "map the column of the speed, with its unit; a coast-down is a decrease of the speed"
    raise InputError(Finding("channels.speed", what, "", remedy))


def _coast(
    spec: CoastdownSpec,
    run: int,
    log: Log,
    window: tuple[float, float] | None,
    covered: float = STEP_POLICY.least_covered,
) -> CoastSegment | RejectedSegment:
    """The coast of one log through the speed window, of which it must cover the share ``covered``."""
    table = spec.reading.split_times is not None
    there = usable(log if table else _own_rows(log), "coasting")
    return coast_segment(run, there, window, spec.settings.minimum_length.value, table, covered)


def _with_both_directions(
    spec: CoastdownSpec,
    logs: Sequence[Log],
    window: tuple[float, float] | None,
    segments: list[CoastSegment],
    rejected: list[RejectedSegment],
) -> tuple[list[CoastSegment], list[RejectedSegment]]:
    """The segments, with runs of a missing direction added even if they cover little of the speed window.

    Downhill a car may stop decelerating within the window; without those runs a slope looks like resistance.
    """
    used = {spec.runs[s.run].direction for s in segments}
    lost = [k for k, run in enumerate(spec.runs) if run.direction not in used]
    if len(used) != 1 or None in used or not lost:
        return segments, rejected
    names = {logs[k].name for k in lost}
    again = [_coast(spec, k, logs[k], window, STEP_POLICY.some_covered) for k in lost]
    found = sorted((*segments, *(a for a in again if isinstance(a, CoastSegment))), key=lambda s: s.run)
    left = [a for a in again if isinstance(a, RejectedSegment)]
    return found, [*(r for r in rejected if r.run not in names), *left]


def _speed_window(settings: CoastdownSettings, logs: Sequence[Log]) -> tuple[float, float] | None:
    """Upper and lower speed, m/s."""
    if not settings.speed_window:
        return None
    speeds = [v.value for v in settings.speed_window]
    upper, lower = max(speeds), min(speeds)
    if upper - lower < STEP_POLICY.least_window:
        got = f"{upper:g} to {lower:g} m/s"
        what = f"must span at least {STEP_POLICY.least_window:g} m/s"
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


def usable(log: Log, drive: DriveSignal) -> Log:
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


def _calm(segments: Sequence[CoastSegment], limit: float) -> tuple[list[CoastSegment], list[RejectedSegment]]:
    """Segments whose mean measured wind is at most ``limit`` (m/s), and the others as rejected."""
    calm, windy = [], []
    for s in segments:
        wind = abs(float(np.mean(s.log["wind_speed"]))) if "wind_speed" in s.log else 0.0
        if wind > limit:
            why = f"mean wind {3.6 * wind:.0f} km/h, above the limit of {3.6 * limit:.0f} km/h"
            windy.append(RejectedSegment(s.name, float(s.log.time[0]), float(s.log.time[-1]), why))
        else:
            calm.append(s)
    return calm, windy


def _without_braked_runs(
    spec: CoastdownSpec, logs: Sequence[Log], segments: list[CoastSegment], known: Mapping[str, Given]
) -> tuple[list[CoastSegment], list[RejectedSegment]]:
    """Segments of runs not braked above the speed window, and the others as rejected: their brakes may still drag."""
    wholes = [coast_segment(k, usable(_own_rows(log), "coasting"), None, 0.0) for k, log in enumerate(logs)]
    coasts = [s for s in wholes if isinstance(s, CoastSegment)]
    braked = braked_while_coasting(coasts, *_pushed(spec, coasts, "coasting", known)) if coasts else {}
    kept: list[CoastSegment] = []
    rejected: list[RejectedSegment] = []
    for one in segments:
        begin, end = float(one.log.time[0]), float(one.log.time[-1])
        above = [why for time, why in braked.get(one.run, ()) if time < begin]
        if above:
            rejected.append(RejectedSegment(one.name, begin, end, f"{above[0]} (above the speed window)"))
        else:
            kept.append(one)
    return kept, rejected


def _without_disturbed_parts(
    spec: CoastdownSpec,
    logs: Sequence[Log],
    segments: list[CoastSegment],
    drive: DriveSignal,
    known: Mapping[str, Given],
    window: tuple[float, float] | None,
) -> tuple[list[CoastSegment], list[RejectedSegment]]:
    """Segments without the parts that a brake, a clutch, a driveline, a throttle or a filter disturbed."""
    shortest = spec.settings.minimum_length.value
    if drive != "coasting":
        if all("acceleration" in s.log for s in segments):
            return segments, []  # unknown hills would be mistaken for brakes here
        return without_outliers(segments, *_pushed(spec, segments, drive, known), shortest)
    kept = [_kept(spec, s) for s in segments]
    wholes = [logs[s.run] for s in segments]
    segments, filtered = without_filtered_start(segments, wholes, kept)
    segments, late = without_late_clutch(segments, wholes, [spec.runs[s.run].direction for s in segments], kept)
    span = window and window[0] - window[1]
    segments, braked = without_braking(segments, *_pushed(spec, segments, drive, known), span, shortest)
    segments = [part for s in segments for part in split(s)]
    segments, ended = without_final_braking(segments, [_kept(spec, s) for s in segments])
    segments, crept = without_creep(segments, *_pushed(spec, segments, drive, known))
    return segments, [*filtered, *late, *braked, *ended, *crept]


def _kept(spec: CoastdownSpec, segment: CoastSegment) -> list[tuple[float, float]]:
    """First and last times, s, of what the description keeps of a run."""
    return [(k.start.value, k.stop.value) for k in spec.runs[segment.run].keep]


def _pushed(
    spec: CoastdownSpec, segments: Sequence[CoastSegment], drive: DriveSignal, known: Mapping[str, Given]
) -> tuple[list[Array], list[str | None]]:
    """Acceleration by drive and slope of each segment, (n,) m/s^2, and its direction."""
    inertia = known["mass"].value + known["rotating_mass"].value
    forces = [_known_force(s.log, drive, known) for s in segments]
    return [force / inertia for force in forces], [spec.runs[s.run].direction for s in segments]


def _known_force(log: Log, drive: DriveSignal, known: Mapping[str, Given]) -> Array:
    """Force by drive and slope, (n,) N."""
    force = -known["mass"].value * GRAVITY * log.channels.get("grade", np.zeros(log.time.size))
    if drive == "torque":
        torque, efficiency = log["drive_torque"], known["driveline_efficiency"].value
        per_torque = known["gear_ratio"].value / known["wheel_radius"].value
        return force + per_torque * torque * np.where(torque < 0, 1.0, efficiency)
    return force + log["drive_force"] if drive == "force" else force
