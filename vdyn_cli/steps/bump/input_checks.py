"""Checks of a crossing's log: signs, units, a missing bump, a sampling rate that is too low."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.inference import white_level
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.bump.bump_location import BumpLocation
from vdyn_cli.steps.bump.crossing import BODY_CHANNELS, LOADS, Crossing
from vdyn_cli.steps.bump.policy import BUMP_POLICY
from vdyn_cli.steps.sign_conventions import negative_loads, wrong_sign

SAMPLES_ON_BUMP = 8  # while an axle is on the bump: fewer than four per flank do not resolve its shape
FEWEST_SAMPLES = 50  # of a log: fewer do not contain a crossing at any rate that resolves a bump
FORCES = ((1e3, "kN"), (4.4482216, "lbf"), (GRAVITY, "kgf"))  # N of each unit
BEHIND = 1.0  # s after the rear axle meets the bump in which lift-off is checked
KINDS = {
    "vertical_acceleration": ((GRAVITY, "g"), (0.3048, "ft/s^2")),
    "pitch_rate": ((180 / np.pi, "rad/s"), (np.pi / 180, "deg/s")),
}


def wrong_log(log: Log, static: Mapping[str, float], width: float) -> list[Finding]:
    """Findings that make a log unusable, before the bump is located.

    Parameters
    ----------
    static : axle loads at rest, N, by channel. width : of the bump, m.
    """
    if log.time.size < FEWEST_SAMPLES:
        remedy = "log the whole crossing at 100 Hz or more"
        return [Finding(log.name, f"has fewer than {FEWEST_SAMPLES} samples", str(log.time.size), remedy)]
    empty = [n for n in ("speed", *LOADS) if np.count_nonzero(np.isfinite(log[n])) < log.time.size / 2]
    if empty:
        what, remedy = "has no reading in more than half of the samples", "map another column, or leave the run out"
        return [Finding(f"{log.name}, {n}", what, remedy=remedy) for n in empty]
    findings = [*_wrong_speed(log, width)]
    findings += negative_loads(log) or [f for name in LOADS for f in _wrong_load(log, name, static[name])]
    for name in BODY_CHANNELS:
        if name in log and not np.nanstd(log[name]) > 0:
            findings.append(Finding(f"{log.name}, {name}", "never changes", remedy="leave the channel out of the map"))
    return findings


def _wrong_speed(log: Log, width: float) -> list[Finding]:
    where, speed = f"{log.name}, speed", float(np.nanmedian(log["speed"]))
    if speed < -0.3:
        return [wrong_sign(log.name, "speed", "the car reverses: speed must be positive forward", f"{speed:.2f} m/s")]
    if abs(speed) < 0.3:
        return [Finding(where, "the car is almost at rest", f"{speed:.2f} m/s", "check the channel and its unit")]
    step = float(np.median(np.diff(log.time)))
    if width / (speed * step) < SAMPLES_ON_BUMP:
        got = f"{1 / step:.0f} Hz at {speed:.1f} m/s: {width / (speed * step):.1f} samples on the bump"
        remedy = f"log with {SAMPLES_ON_BUMP * speed / width:.0f} Hz or more (better 500), or drive slower"
        remedy = f"check the unit of time, or {remedy}" if width < speed * step else remedy
        return [Finding(log.name, "is sampled too slowly for this bump", got, remedy)]
    return []


def _wrong_load(log: Log, name: str, static: float) -> list[Finding]:
    where, load = f"{log.name}, {name}", log[name]
    rest = float(np.nanmedian(load))
    ratio = rest / static
    if not 0.75 < ratio < 1.33:
        likely = [unit for factor, unit in FORCES if 0.75 < ratio * factor < 1.33]
        guess = f"is its unit {likely[0]}?" if likely else "check unit and channel, mass and cg_to_front"
        if 0.4 < ratio < 0.62:
            both = f"{name[:-5]}_left_load and _right_load"
            guess = f"if it is the load of one wheel, map the axle's other wheel too ({both})"
        if abs(ratio) < 0.05 and not likely:
            guess = "loads must include the weight: zero the sensor without the car on it"
        got = f"{rest:.0f} N, expected {static:.0f} N from mass and center of gravity"
        return [Finding(where, "is not the axle's load at rest", got, guess)]
    change = float(np.nanmax(np.abs(load - rest)))
    if change < max(BUMP_POLICY.bump_visible * static, BUMP_POLICY.bump_visible_noise * white_level(load, log.time)):
        got = f"largest change {change:.0f} N of {static:.0f} N"
        remedy = "check the time window; drive over a higher bump, or faster"
        return [Finding(where, "shows no bump", got, remedy)]
    return []


def wrong_location(log: Log, found: BumpLocation, wheelbase: float) -> list[Finding]:
    """Findings on channels that contradict the located bump and the response of a typical car.

    The rear axle must meet the bump after the front one, at the logged speed within a factor of ``bump_speed_ratio``;
    the loads must correlate with the response by ``bump_correlation`` and have its size within ``bump_load_ratio``.

    Parameters
    ----------
    found : the bump as located in ``log``. wheelbase : m.
    """
    if found.delay <= 0:
        what = "the rear axle meets the bump before the front axle"
        remedy = "swap the columns of front_load and rear_load"
        return [Finding(f"{log.name}, front_load", what, f"{-found.delay:.3f} s before", remedy)]
    pace = wheelbase / found.delay
    if not 1 / BUMP_POLICY.bump_speed_ratio < found.speed / pace < BUMP_POLICY.bump_speed_ratio:
        late = f"{found.delay:.3f} s after the front axle"
        what = f"the rear axle meets the bump {late}, which corresponds to {pace:.2f} m/s"
        ratio = max(found.speed / pace, pace / found.speed)
        hint = "check whether its unit is km/h" if 3.0 < ratio < 4.3 else "check the unit of speed, and the wheelbase"
        return [Finding(f"{log.name}, speed", what, f"{found.speed:.2f} m/s", hint)]
    if found.correlation < BUMP_POLICY.bump_correlation:
        got = f"correlation {found.correlation:.2f}"
        remedy = "check the bump's size and shape; the log must begin before the front axle meets it"
        return [Finding(log.name, "the loads do not match a car on this bump", got, remedy)]
    gain = np.mean([found.gain[n] for n in LOADS])
    if not 1 / BUMP_POLICY.bump_load_ratio < gain < BUMP_POLICY.bump_load_ratio:
        what = f"the loads change {gain:.2g} times as much as for a typical car on this bump"
        return [Finding(log.name, what, "", "check height and width of the bump, and the loads' unit")]
    return [f for n in BODY_CHANNELS if n in found.gain for f in _wrong_gain(log, n, found.gain[n])]


def _wrong_gain(log: Log, name: str, gain: float) -> list[Finding]:
    if gain < -0.1:
        up = "up" if name == "vertical_acceleration" else "nose-up"
        what = f"has the opposite sign to the loads: it must be positive {up}"
        return [wrong_sign(log.name, name, what, f"gain {gain:.2f}")]
    if not 0.2 < gain < 5:
        likely = [unit for factor, unit in KINDS[name] if 0.5 < gain * factor < 2]
        remedy = f"is its unit {likely[0]}?" if likely else "check its unit, or leave it out of the map"
        what = f"is {gain:.2g} times that of a typical car on this bump"
        return [Finding(f"{log.name}, {name}", what, "", remedy)]
    return []


def doubts(log: Log, crossing: Crossing, stated: Given | None) -> list[Finding]:
    """Findings on a crossing that is used: a contradicting stated distance, clipped samples.

    Parameters
    ----------
    stated : distance of the bump in the description, m.
    """
    findings = []
    if stated is not None and abs(stated.value - crossing.distance) > max(0.5, 5 * stated.std):
        got = f"distance_front {stated.value:.2f} m"
        what = f"loads and speed show the bump {crossing.distance:.2f} m after the log's start; this distance is used"
        findings.append(Finding(log.name, what, got))
    for name, count in crossing.clipped.items():
        if count:
            what = f"{count} samples at the sensor's limit are left out"
            findings.append(Finding(f"{log.name}, {name}", what, "", "use a wider range"))
    return findings


def airborne(crossing: Crossing, static: Mapping[str, float], wheelbase: float) -> Finding | None:
    """The finding that excludes a run whose axle is off the road for much of the crossing, or None.

    An axle is off the road where its load is below 2 % of the static one. The run is excluded if the share of such
    samples, from the front axle's contact with the bump to ``BEHIND`` s after the rear axle's, exceeds
    ``bump_airborne``.

    Parameters
    ----------
    crossing : the run's loads, N, and speed about the bump.
    static : axle loads at rest, N, by channel. wheelbase : m.
    """
    front = crossing.time[0] + (crossing.distance - crossing.origin) / crossing.pace
    behind = (crossing.time > front) & (crossing.time < front + wheelbase / crossing.pace + BEHIND)
    for name in LOADS:
        load = crossing.channels[name][behind]
        share = float(np.mean(load[np.isfinite(load)] < 0.02 * static[name]))
        if share > BUMP_POLICY.bump_airborne:
            what = f"excluded: the {name[:-5]} axle is off the road for {100 * share:.0f} % of the crossing"
            return Finding(crossing.run, what, "", "drive slower, or use a lower bump")
    return None


def uneven_zeros(zeros: Mapping[str, Sequence[float]], std: Mapping[str, float]) -> list[Finding]:
    """Findings on loads at rest that deviate from the known weights by more than four times ``std``.

    Parameters
    ----------
    zeros : of each crossing, N, by channel. std : their standard deviations.
    """
    findings = []
    for name in LOADS:
        mean = float(np.mean(zeros[name]))
        if abs(mean) > 4 * std[name]:
            above = f"is {mean:+.0f} N at rest above the load from mass and cg_to_front"
            what = f"{above}: fitted as a zero offset of the sensor"
            remedy = "weigh the car as driven; a model error that offsets the load has the same effect"
            findings.append(Finding(name, what, "", remedy))
    return findings
