"""Comparison of physically related ("tied") channels of a run: gain, offset, delay and sign of each pair.

Over windows of a second, for the acceleration of up to ten seconds (T)::

    sum |position step|          = gain * integral |speed| dt
    integral acceleration dt / T = gain * (speed step) / T + offset
    wheel speed left             = gain * wheel speed right
    wheel speed * wheel radius   = gain * speed
    front load + rear load       = gain * mass * g

The limits are those of the quality tests, whose findings decide whether a run is used; this table shows all pairs.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from math import atan, degrees

import numpy as np

from vdyn_cli.io.clocks.clock_estimate import clock_difference
from vdyn_cli.io.clocks.tied_channels import tie_of
from vdyn_cli.io.quality.acceleration_mistake import FEWEST_WINDOWS, gain_over_windows, mistake_finding
from vdyn_cli.io.quality.cross_checks import AXLES, LEAST_DISTANCE
from vdyn_cli.io.quality.distance_gain import common_gain, distance_gain, gain_finding, over_ground
from vdyn_cli.io.quality.gain_changes import LOADS
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.io.quality.road_gravity import without_road_gravity
from vdyn_cli.project.checks.check_policy import CHECK
from vdyn_cli.quantities.arrays import Array, Mask
from vdyn_cli.quantities.check_schema import TiedPair
from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.vocabulary import WHEEL_SPEEDS
from vdyn_cli.steps.step_policy import STEP_POLICY

WINDOW = 1.0  # s
REACH = 1.0  # s, largest delay
TIMES_RADIUS = " * wheel_radius"
_CHECK_RADIUS = ": check wheel_radius and the scale of both speeds"
ROLLING = 3.0  # m/s, above which wheel speeds are compared
MEDIAN_ERROR = 0.93  # standard error of the median of n normal values / (interquartile range / sqrt(n)): 1.253 / 1.349


def tied_pairs(
    log: Log,
    known: Parameters,
    computed: Collection[tuple[str, str]] = (),
    clocks: Sequence[ClockDifference] = (),
    tilts: bool = False,
) -> Iterator[TiedPair]:
    """Every physically related pair of the log's channels.

    Parameters
    ----------
    log : SI, NaN where a sample is missing or cut. known : mass and wheel radius are used if they are known.
    computed : source and target of channels that are computed from another one, with which they agree by definition.
    clocks : the differences of the loggers' clocks; the gains of wheel speeds include their uncertainty.
    tilts : the accelerometer pitches with the body, and measures a component of gravity with it.
    """
    speed = next((n for n in ("speed", "vehicle_speed") if n in log), None)
    if speed is not None and "position" in log:
        yield _distance(log, speed)
    if speed is not None and "acceleration" in log:
        yield _change(log, speed, tilts)
    for left, right in AXLES:
        if left in log and right in log:
            yield _ratio(log, left, right, 1.0, (QUALITY.axle_speeds, QUALITY.axle_speeds))
    for pair in _rolling_pairs(log, known, computed, clocks):
        wheel = pair.first.removesuffix(TIMES_RADIUS)
        yield _with_delay(pair, _delay(log, wheel, pair.second)) if pair.good else pair
    if {"front_load", "rear_load"} <= set(log.channels) and "mass" in known.estimates:
        total = float(np.nanmean(log["front_load"] + log["rear_load"])) / (known["mass"].value * GRAVITY)
        good = abs(total - 1.0) <= QUALITY.reported_scale
        yield _pair(log, "front_load + rear_load", "mass * g", f"gain {total:.3f}", good, gain=total)


def untied_channels(logs: Sequence[Log], pairs: Sequence[TiedPair]) -> list[str]:
    """The logged channels whose gain no pair determines in any run.

    Parameters
    ----------
    logs : as recorded. pairs : of all runs.
    """
    compared = {word for p in pairs if p.gain is not None for word in re.findall(r"\w+", f"{p.first} {p.second}")}
    compared |= {"time", *(LOADS if "front_load" in compared else ())}
    return sorted({n for log in logs for n in log.channels} - compared)


def contradicted_radius(
    logs: Sequence[Log],
    known: Parameters,
    computed: Collection[tuple[str, str]],
    clocks: Sequence[ClockDifference],
) -> tuple[Finding, ...]:
    """Findings on wheel speeds times the wheel radius that contradict the car's speed in every comparable run.

    Parameters
    ----------
    logs, known, computed, clocks : as for ``tied_pairs``, of all runs.
    """
    rolling = [log for log in logs if "force_x" not in log]  # which is of a tire's test: its wheel slips
    pairs = [p for log in rolling for p in _rolling_pairs(log, known, computed, clocks)]
    return tuple(_radius_findings(_with_one_radius(pairs)))


def _rolling_pairs(
    log: Log, known: Parameters, computed: Collection[tuple[str, str]], clocks: Sequence[ClockDifference]
) -> Iterator[TiedPair]:
    """Each wheel's speed times the given radius against the car's speed."""
    speed = next((n for n in ("speed", "vehicle_speed") if n in log), None)
    if speed is None or "wheel_radius" not in known.estimates:
        return
    radius = known["wheel_radius"]
    limit = min(QUALITY.reported_scale, CHECK.rolling_slip + STEP_POLICY.agreeing_std * radius.std / radius.value)
    for wheel in ("wheel_speed", *WHEEL_SPEEDS):
        if wheel in log and (wheel, speed) not in computed:
            own = [c for c in clocks if c.run == log.name and (wheel in c.channels) != (speed in c.channels)]
            below = max(limit, CHECK.loaded_radius) if "hub_force_x" in log else limit  # its lever is that radius
            late = max((c.delay_std for c in own), default=0.0)
            yield _ratio(log, wheel, speed, radius.value, (below, limit), late)


def compared_over_runs(pairs: Sequence[TiedPair]) -> tuple[list[TiedPair], tuple[Finding, ...]]:
    """The pairs of all runs, and findings on contradictions that all runs together show.

    A gain of the position that is not significant in one run is significant if it is the same in all runs; the pairs of
    position are then marked as contradicting. All runs share the wheel's radius, too.
    """
    pairs, mistakes = _with_wrong_acceleration(_with_one_radius(pairs))
    findings = (*_radius_findings(pairs), *mistakes)
    places = [p for p in pairs if p.first == "position" and p.gain is not None]
    gain = common_gain([p.gain for p in places if p.gain is not None])
    if gain is None or not gain.contradicts:
        return list(pairs), findings
    judged = [p.model_copy(update={"good": False, "sign": 1}) if p in places else p for p in pairs]
    return judged, (gain_finding(gain, True), *findings)


def _with_wrong_acceleration(pairs: Sequence[TiedPair]) -> tuple[list[TiedPair], tuple[Finding, ...]]:
    """The pairs, those of acceleration marked if one mistake explains the gain of each run; and the finding."""
    found = [p for p in pairs if p.first == "acceleration" and p.gain is not None]
    finding = mistake_finding([p.gain for p in found if p.gain is not None], found[0].second) if found else None
    if finding is None or any(p.good for p in found):
        return list(pairs), ()
    return [p.model_copy(update={"good": False}) if p in found else p for p in pairs], (finding,)


def _with_one_radius(pairs: Sequence[TiedPair]) -> list[TiedPair]:
    """The pairs, those of a wheel's speed times its radius judged like most runs where their gains are alike.

    A gain near its limit exceeds it in some runs by chance, although one radius is right or wrong in all of them.
    """
    judged = []
    for pair in pairs:
        ratio = pair.first.endswith(TIMES_RADIUS) and pair.gain is not None
        alike = [p for p in pairs if ratio and (p.first, p.second) == (pair.first, pair.second) and p.gain is not None]
        usual = float(np.median([p.gain for p in alike])) if alike else 1.0
        one = all(abs(p.gain / usual - 1.0) <= CHECK.run_ratio for p in alike if p.gain is not None)
        good = 2 * sum(p.good is True for p in alike) > len(alike)
        if alike and one and good != pair.good:
            what = f"gain {pair.gain:.3f}{'' if good else _CHECK_RADIUS}"
            pair = pair.model_copy(update={"good": good, "what": what})
        judged.append(pair)
    return judged


def _radius_findings(pairs: Sequence[TiedPair]) -> Iterator[Finding]:
    """One finding on all wheel speeds times the radius that contradict the car's speed in every comparable run."""
    compared = [p for p in pairs if p.first.endswith(TIMES_RADIUS) and p.gain is not None]
    agreeing = {p.first for p in compared if p.good}
    wrong = [p for p in compared if p.first not in agreeing]
    if not wrong:
        return
    firsts, second = list(dict.fromkeys(p.first for p in wrong)), wrong[0].second
    gains = [float(np.median([p.gain for p in wrong if p.gain is not None and p.first == first])) for first in firsts]
    low, high = f"{min(gains):.3f}", f"{max(gains):.3f}"
    ratio = low if low == high else f"{low} to {high}"
    wheels = ", ".join(first.removesuffix(TIMES_RADIUS) for first in firsts)
    what = f"{wheels}{TIMES_RADIUS} is {ratio} times {second} in all {len({p.run for p in wrong})} runs that show it"
    remedy = "correct wheel_radius, or the scale of one of the two speeds"
    yield Finding(f"{wheels} and {second}", what, "", remedy, doubt=True)


# Seven parameters: one for each result of the pair.
def _pair(
    log: Log,
    first: str,
    second: str,
    what: str,
    good: bool | None = None,
    *,
    gain: float | None = None,
    offset: float | None = None,
) -> TiedPair:
    return TiedPair(
        run=log.name,
        first=first,
        second=second,
        gain=gain,
        offset=offset,
        delay=None,
        delay_std=None,
        sign=None if gain is None or good is None else -1 if gain < 0.0 else 1,
        good=good,
        what=what,
    )


def _with_delay(pair: TiedPair, delay: tuple[float, float] | None) -> TiedPair:
    if delay is None:
        return pair
    what = f"{pair.what}, delay {1e3 * delay[0]:+.1f} +- {1e3 * delay[1]:.1f} ms"
    return pair.model_copy(update={"delay": delay[0], "delay_std": delay[1], "what": what})


def _finite(*values: Array) -> Mask:
    return np.asarray(np.all([np.isfinite(v) for v in values], axis=0))


def _distance(log: Log, speed: str) -> TiedPair:
    known = _finite(log[speed], log["position"])
    time, v, place = (x[known] for x in (log.time, log[speed], log["position"]))
    if time.size < FEWEST_WINDOWS:
        return _pair(log, "position", speed, "too few samples")
    driven, ground = over_ground(time, np.abs(v), place)
    if driven[-1] < LEAST_DISTANCE:
        return _pair(log, "position", speed, f"not determined: the run is shorter than {LEAST_DISTANCE:g} m")
    ends = np.unique(np.linspace(0, time.size - 1, 51).astype(int))
    straight = distance_gain(time, v, place)
    gain = float(np.sum(np.abs(np.diff(ground[ends])))) / float(driven[-1]) if straight is None else straight
    good = abs(gain - 1.0) <= QUALITY.reported_scale
    delay = _delay(log, "position", speed) if good else None
    return _with_delay(_pair(log, "position", f"integral of {speed}", f"gain {gain:.3f}", good, gain=gain), delay)


def _change(log: Log, speed: str, tilts: bool) -> TiedPair:
    """Acceleration against the change of speed; only its offset if they are hardly correlated."""
    first, second = "acceleration", f"change of {speed}"
    if _finite(log["acceleration"], log[speed]).sum() < FEWEST_WINDOWS:
        return _pair(log, first, second, "too few samples")
    found, x, y = gain_over_windows(log, speed)
    if not x.size:
        return _pair(log, first, second, "too short")
    if found is None:
        offset = float(np.mean(y - x))
        tilt = degrees(atan(offset / GRAVITY))
        what = f"offset {offset:+.3f} m/s^2 (equal to {tilt:+.2f} deg of tilt or slope); gain not determined: "
        what += "hardly correlated"
        return _pair(log, first, second, what, offset=offset)
    lively = float(np.nanstd(log["acceleration"])) >= QUALITY.least_acceleration_std
    agrees = not found.differs(QUALITY.reported_tilted_scale if tilts else QUALITY.reported_scale)
    gain, offset = found.value, float(np.mean(y) - found.value * np.mean(x))
    pitches = tilts and agrees and found.differs(QUALITY.reported_scale)
    signed = log if gain > 0.0 else log.with_channels(acceleration=-log[first])
    what = f"gain {gain:.3f} ({found.low:.3f} to {found.high:.3f}), offset {offset:+.3f} m/s^2"
    what += f" (the body pitches by {degrees(gain - 1.0):+.1f} deg at 1 g)" if pitches else ""
    what += ", opposite signs" if gain < 0.0 else f" ({found.mistake}?)" if found.mistake else ""
    # In a gentle drive, a slope that changes steadily resembles a wrong gain: only all runs together show a unit.
    good = agrees if lively or agrees else None
    delay = _delay(without_road_gravity(signed, speed), first, speed)
    return _with_delay(_pair(log, first, second, what, good, gain=gain, offset=offset), delay)


def _delay(log: Log, first: str, second: str) -> tuple[float, float] | None:
    """Delay of the first channel behind the second, s, and its standard error; None if not determined."""
    tie = tie_of(second, first)
    steps = np.diff(log.time)
    if tie is None or log.time.size < FEWEST_WINDOWS or float(np.median(steps)) <= 0.0:
        return None
    try:
        found = clock_difference(log, log, tie)
    except InputError:
        return None
    clear = abs(found.delay) <= REACH and found.delay_std <= CHECK.largest_delay_error
    return (found.delay, found.delay_std) if clear else None


def _ratio(
    log: Log, first: str, second: str, scale: float, limits: tuple[float, float], delay_std: float = 0.0
) -> TiedPair:
    """The median ratio of two speeds while the wheels turn; not judged if it varies because of slip or bends.

    A wrong delay of two loggers, s, changes the ratio in proportion to V' / V, which is alike in all of a coast-down.
    ``limits`` are the shares by which the ratio may lie below and above 1.
    """
    y, x = np.abs(log[first]) * scale, np.abs(log[second])
    own = ROLLING if scale != 1.0 else ROLLING / 0.3
    use = _finite(x, y) & (np.maximum(np.nan_to_num(x), np.nan_to_num(y)) > own)
    shown = first if scale == 1.0 else first + TIMES_RADIUS
    if use.sum() < FEWEST_WINDOWS:
        return _pair(log, shown, second, "not determined: the car hardly moves")
    low, gain, high = (float(q) for q in np.quantile(y[use] / np.maximum(x[use], 1e-9), [0.25, 0.5, 0.75]))
    if high - low > 2.0 * QUALITY.reported_scale:
        return _pair(log, shown, second, f"not compared: the ratio varies from {low:.2f} to {high:.2f} (slip or bends)")
    limit = limits[0] if gain < 1.0 else limits[1]
    if scale == 1.0:
        return _pair(log, shown, second, f"gain {gain:.3f}", abs(gain - 1.0) <= limit, gain=gain)
    error = MEDIAN_ERROR * (high - low) / max(1.0, use.mean() * log.duration / WINDOW) ** 0.5
    if delay_std > 0.0:
        rate = np.gradient(x[use], log.time[use]) / np.maximum(x[use], ROLLING)
        error = float(np.hypot(error, gain * delay_std * abs(float(np.median(rate)))))
    if abs(gain - 1.0) > limit + STEP_POLICY.agreeing_std * error:
        what = f"gain {gain:.3f} +- {error:.3f}{_CHECK_RADIUS}"
        return _pair(log, shown, second, what, False, gain=gain)
    return _pair(log, shown, second, f"gain {gain:.3f}", True, gain=gain)
