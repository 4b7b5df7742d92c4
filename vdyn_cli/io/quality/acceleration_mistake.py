"""Wrong unit or sign of an acceleration or a speed: the same usual factor between both in all runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.io.quality.acceleration_gain import AccelerationGain, acceleration_gain
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.io.quality.road_gravity import without_road_gravity
from vdyn_cli.quantities.arrays import Array, cumulative_integral
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.unit_mistakes import ACCELERATION_MISTAKES, usual_mistake

WINDOWS = (1.0, 5.0, 10.0)  # s; over longer ones, noise hides less of the gentle acceleration of a coast-down
FEWEST_WINDOWS = 10  # windows
FEWEST_RUNS = 2  # whose gains show a mistake
WRONG_SIGN = "wrong sign"


def gain_over_windows(log: Log, speed: str) -> tuple[AccelerationGain | None, Array, Array]:
    """The gain of the acceleration over the change of the speed, and both in windows, (n,) m/s^2: change, acceleration.

    The shortest windows that determine the gain (None if none does); no windows of a log that is too short.

    Parameters
    ----------
    speed : name of the channel.
    """
    log = without_road_gravity(log, speed)
    found, change, mean = None, np.zeros(0), np.zeros(0)
    for window in WINDOWS:
        y, x = (np.diff(each) / window for each in _grid(log, speed, window))
        use = np.isfinite(x) & np.isfinite(y)
        if use.sum() < FEWEST_WINDOWS:
            break
        change, mean = x[use], y[use]
        if (found := acceleration_gain(change, mean)) is not None:
            break
    return found, change, mean


def common_mistake(gains: Sequence[float]) -> str:
    """The mistaken units or the wrong sign that explain the gain of each run; empty if none does, or with too few runs.

    A slope that resembles a gain does not resemble that of a mistake in several runs.
    """
    causes = {_mistake(g) for g in gains}
    return causes.pop() if len(gains) >= FEWEST_RUNS and len(causes) == 1 else ""


def _mistake(gain: float) -> str:
    if gain < 0.0 and usual_mistake(-gain, ((1.0, WRONG_SIGN),), QUALITY.near_unit_factor):
        return WRONG_SIGN
    return usual_mistake(abs(gain), ACCELERATION_MISTAKES, QUALITY.near_unit_factor)


def mistake_finding(gains: Sequence[float], second: str) -> Finding | None:
    """The finding on a unit or a sign that explains the gain of each run; None if there is none.

    Parameters
    ----------
    second : with what the acceleration is compared.
    """
    cause = common_mistake(gains)
    if not cause:
        return None
    opposite = max(gains) < 0.0
    gain = float(np.median(gains if opposite else np.abs(gains)))
    what = f"acceleration is {gain:.3f} times the {second} in {len(gains)} runs"
    remedies = [] if cause == WRONG_SIGN else [f"correct the unit of one of both channels ({cause}?)"]
    remedies += ["add 'sign: -1' to the channel acceleration, or remove it if it is there"] if opposite else []
    return Finding("channel 'acceleration'", what, "", "; ".join(remedies), doubt=True)


def without_mistaken_acceleration(
    logs: Sequence[Log], or_speed: bool = True
) -> tuple[tuple[Log, ...], tuple[Finding, ...]]:
    """The logs without an acceleration whose unit or sign, or the unit of the speed, is wrong in all; and the finding.

    Parameters
    ----------
    logs : SI, with the channel ``speed``.
    or_speed : whether the acceleration is left out also if the speed has the wrong unit.
    """
    there = [log for log in logs if "acceleration" in log]
    gains = [gain.value for log in there if (gain := gain_over_windows(log, "speed")[0]) is not None]
    found = mistake_finding(gains, "change of speed")
    if found is None:
        return tuple(logs), ()
    if common_mistake(gains).startswith("speed") and not or_speed:
        return tuple(logs), (found,)
    return without_acceleration(logs), (replace(found, what=f"not used: {found.what}"),)


def without_acceleration(logs: Sequence[Log]) -> tuple[Log, ...]:
    """The logs without their channel ``acceleration``."""
    return tuple(replace(log, channels={n: v for n, v in log.channels.items() if n != "acceleration"}) for log in logs)


def _grid(log: Log, speed: str, step: float) -> tuple[Array, ...]:
    """Integral of the acceleration and speed (2 x m), means over steps of a common grid.

    NaN where one of the channels has no value in a step; the integral interpolates over missing samples.
    """
    a, v = log["acceleration"], log[speed]
    known = np.isfinite(a) & np.isfinite(v)
    if not known.any():
        return np.zeros(1), np.zeros(1)
    time = log.time[known]
    gained = cumulative_integral(time, a[known])
    label = ((time - log.time[0]) / step).astype(np.int64)
    size = int((log.time[-1] - log.time[0]) / step) + 1
    count = np.bincount(label, minlength=size)
    with np.errstate(invalid="ignore"):
        return tuple(np.bincount(label, values, size) / count for values in (gained, v[known]))
