"""Comparison of redundant channels: two channels of the same motion reveal a wrong unit or scale."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from vdyn_cli.io.file_units import is_unit_of, wrong_units
from vdyn_cli.io.quality.acceleration_gain import acceleration_gain
from vdyn_cli.io.quality.distance_gain import over_ground
from vdyn_cli.io.quality.gain_changes import gain_change_findings
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.io.quality.road_gravity import without_road_gravity
from vdyn_cli.quantities.arrays import Array, cumulative_integral
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import to_si
from vdyn_cli.quantities.unit_mistakes import ACCELERATION_MISTAKES, SPEED_MISTAKES, usual_mistake
from vdyn_cli.quantities.vocabulary import CHANNELS

LEAST_DISTANCE = 20.0  # m, least distance over which position and speed are compared
INTERVAL = 1.0  # s over which accelerations are compared
AXLES = (("wheel_speed_fl", "wheel_speed_fr"), ("wheel_speed_rl", "wheel_speed_rr"))
SIDES = (*AXLES, ("shaft_torque_left", "shaft_torque_right"))
LEAST_WHEEL_SPEED = 5.0  # rad/s, above which wheel speeds are compared
FEWEST_SAMPLES = 100  # samples


def with_cross_checks(log: Log, refuse: bool = True, tilts: bool = False) -> Log:
    """The log with a finding for every pair of contradicting channels.

    Position is compared with the integral of speed, and the change of speed with the integral of acceleration, without
    gravity's component where an elevation is logged. They contradict if the
    ratio of the scales differs from 1 by more than ``reported_scale`` (``reported_tilted_scale`` if ``tilts``).

    Parameters
    ----------
    refuse : refuse scales that differ by more than ``refused_scale``; False: report them, for a step that can decide
        which of the two channels is wrong.
    tilts : the accelerometer pitches with the body, so that it measures a component of gravity proportional to the
        acceleration.

    Raises
    ------
    InputError : the scales differ by more than ``refused_scale``: one channel's unit is wrong.
    """
    findings = []
    for first, second, ratio in _ratios(log):
        off = abs(ratio - 1.0)
        if off <= (QUALITY.reported_tilted_scale if tilts and first == "acceleration" else QUALITY.reported_scale):
            continue
        what = (
            f"{first} and {second} contradict each other: according to {second}, {first} is {ratio:.3g} times as large"
        )
        finding = Finding(log.name, what, remedy=_remedy(first, ratio, "pitch_rate" in log and not tilts), doubt=True)
        if refuse and off > QUALITY.refused_scale:
            raise InputError(*_by_cause(log, (first, second), ratio, finding), *(f for f in log.findings if f.fault))
        findings.append(finding)
    findings += [f for left, right in AXLES if left in log and right in log for f in _apart(log, left, right)]
    findings += [f for left, right in SIDES if left in log and right in log for f in _dead(log, left, right)]
    findings += gain_change_findings(log)
    return replace(log, findings=(*log.findings, *findings)) if findings else log


def _by_cause(log: Log, pair: tuple[str, str], ratio: float, contradiction: Finding) -> Iterator[Finding]:
    """The units that the log's file contradicts, and the contradiction of two channels: one finding where it is the
    same mistake.

    Parameters
    ----------
    pair, ratio : the channels, and the factor between them.
    """
    explained = False
    for one in wrong_units(log.findings):
        if one.channel in pair and ratio > 0.0:
            si = CHANNELS[one.channel].unit
            if not is_unit_of(one.stated, si):
                explained = True
                yield one
                continue
            factor = to_si(1.0, one.stated, si) / to_si(1.0, one.read, si)
            if abs(abs(np.log(factor)) - abs(np.log(ratio))) < QUALITY.near_unit_factor:
                explained = True
                one = replace(one, what=f"{one.what}; {contradiction.what} ({one.stated} read as {one.read})")
        yield one
    if not explained:
        yield contradiction


def _remedy(first: str, ratio: float, pitched: bool) -> str:
    """What to do about a channel that is ``ratio`` times as large according to another one.

    ``pitched``: the pitch is logged, so that gravity in the acceleration could be subtracted, but is not.
    """
    if ratio < 0.0:
        return f"add 'sign: -1' to the channel {first}, or remove it if it is there"
    if first == "acceleration":
        cause = usual_mistake(1.0 / ratio, ACCELERATION_MISTAKES, QUALITY.near_unit_factor)
        if not cause and abs(ratio - 1.0) <= QUALITY.refused_scale:  # no unit
            gravity = f"a body that pitches adds up to {100 * QUALITY.reported_tilted_scale:.0f} %"
            gravity += ": if the accelerometer is on it, write 'settings: {accelerometer: body}'" if pitched else ""
            return f"if the accelerometer's gain is wrong, write 'scale: {ratio:.4f}' at the channel; {gravity}"
    else:
        cause = usual_mistake(1.0 / ratio, SPEED_MISTAKES, QUALITY.refused_scale)
    return f"check units and scale of both channels{f' ({cause}?)' if cause else ''}"


def _dead(log: Log, left: str, right: str) -> list[Finding]:
    """The finding that one side is zero in the whole log while the other is not."""
    still = [n for n in (left, right) if not np.any(np.nan_to_num(log[n]))]
    if len(still) != 1:
        return []
    what = (
        f"{still[0]} is 0 in the whole log and {right if still[0] == left else left} is not: its sensor failed or is "
        "not connected"
    )
    remedy = "remove the channel, or repair the sensor and repeat the test"
    return [Finding(log.name, what, "", remedy, fault=True, doubt=True)]


def _apart(log: Log, left: str, right: str) -> list[Finding]:
    """The finding that the wheels of an axle do not turn equally fast, except in bends."""
    a, b = log[left], log[right]
    moving = np.isfinite(a) & np.isfinite(b) & (np.maximum(np.abs(a), np.abs(b)) > LEAST_WHEEL_SPEED)
    if np.count_nonzero(moving) < FEWEST_SAMPLES:
        return []
    a, b = np.abs(a[moving]), np.abs(b[moving])
    differ = np.abs(a - b) > QUALITY.bend_speeds * np.maximum(a, b)
    ratio = float(np.median(a[~differ] / b[~differ])) if np.any(~differ) else float(np.median(a) / np.median(b))
    if differ.mean() > QUALITY.most_bends:
        first, share = log.time[moving][np.argmax(differ)], differ.mean()
        what = (
            f"{left} and {right} differ by more than {100 * QUALITY.bend_speeds:.0f} % for {100 * share:.0f} % of "
            f"the time, first at {first:.1f} s"
        )
    elif abs(ratio - 1.0) > QUALITY.axle_speeds:
        what = f"{left} is {ratio:.3f} times {right} in the whole log"
    else:
        return []
    remedy = "check scale and sensor of both, or remove the wrong channel"
    return [Finding(log.name, what, remedy=remedy, fault=True, doubt=True)]


def _ratios(log: Log) -> list[tuple[str, str, float]]:
    """Each channel, the channel compared with it, and the size according to the second over that of the first."""
    name = "speed" if "speed" in log else "vehicle_speed"
    if name not in log:
        return []
    speed = log[name]
    found = []
    if "position" in log and (ratio := _distance_ratio(log.time, speed, log["position"])) is not None:
        found.append((name, "position", ratio))
    if "acceleration" in log and (ratio := _change_ratio(without_road_gravity(log, name), name)) is not None:
        found.append(("acceleration", name, ratio))
    return found


def _distance_ratio(time: Array, speed: Array, position: Array) -> float | None:
    good = np.isfinite(speed) & np.isfinite(position)
    if np.count_nonzero(good) < 10:
        return None
    driven, place = over_ground(time[good], np.abs(speed[good]), position[good])
    coarse = np.linspace(0, good.sum() - 1, min(51, good.sum())).astype(int)
    moved = float(np.sum(np.abs(np.diff(place[coarse]))))
    return moved / float(driven[-1]) if driven[-1] > LEAST_DISTANCE and moved > 0.0 else None


def _change_ratio(log: Log, name: str) -> float | None:
    """Signed ratio of speed changes to integrals of acceleration, rms over intervals of a second.

    None if the two are hardly correlated, or if noise or slopes alone explain that the ratio is not 1.
    """
    speed, acceleration = log[name], log["acceleration"]
    good = np.isfinite(speed) & np.isfinite(acceleration)
    if np.count_nonzero(good) < 50 or np.std(acceleration[good]) < QUALITY.least_acceleration_std:
        return None
    time, speed, change = log.time[good], speed[good], cumulative_integral(log.time[good], acceleration[good])
    ends = np.searchsorted(time, np.arange(time[0], time[-1], INTERVAL))
    if ends.size < 3:
        return None
    by_speed, by_force = np.diff(speed[ends]), np.diff(change[ends])
    gain = acceleration_gain(by_speed, by_force)
    return None if gain is None or not gain.differs(0.0) else 1.0 / gain.value
