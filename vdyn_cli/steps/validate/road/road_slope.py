"""The road's slope from the car's accelerometer and the measured speed.

A forward accelerometer reads f = V' + g sin(slope) + zero. The energy of the whole drive gives its zero, if both ends
of the road are at the same height::

    zero = (int f V dt - (V_end^2 - V_start^2)/2) / distance,   slope = (f - zero - V') / g

The torque is not used. A logged elevation replaces the assumption by the heights of both ends. Without it, the mean
slope remains an unknown of each drive that is cut into windows. Whole drives have none: there, the zeros of one
accelerometer are compared. With n zeros z_k that scatter by s, more than those of a sensor do (s_e), the drives have
other mean slopes, and the zero of a drive is (least squares, variance s^2 of which s_e^2 is the sensor's)::

    zero_k = z + min(1, s_e^2 / s^2) (z_k - z)

with z their mean weighted by distance: all drives together end at the height at which they began.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.effects import Effect, effect
from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.inference.smoothed_slope import smoothed_slope
from vdyn_cli.quantities.arrays import Array, cumulative_integral, filled, net_change
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.steps.step_policy import STEP_POLICY

SENSED_SLOPE, DRIVE_SLOPE = "accelerometer_slope", "drive_slope"
LOOK = 1.0  # s over which specific force and speed are compared
PLACES = 100.0  # m between the points of a profile
CREEPING = 2.0  # m/s, below which braking pitches the body
SHORTEST_DRIVE = 500.0  # m, shortest drive from which a zero is estimated


@dataclass(frozen=True, eq=False)
class RoadProfile:
    """One drive's road.

    Parameters
    ----------
    zero : m/s^2, zero of the accelerometer if both ends of the road have equal heights (or the logged elevations).
    slope : (n,) at the log's samples, in addition to the recorded grade.
    distance : (p + 1,) m from the start, edges of the pieces. profile : (p,) mean slope of each piece.
    """

    zero: float
    slope: Array
    distance: Array
    profile: Array


def sensed_road(log: Log, zero: float | None = None) -> RoadProfile:
    """The road of a drive by the module's equations: the slope averaged over ``LOOK`` and smoothed.

    Without a stated ``zero``, m/s^2, it is that of the energy balance, or 0 on drives shorter than ``SHORTEST_DRIVE``.
    The slope is the sine of the angle that is added to the logged grade.

    Parameters
    ----------
    log : with channels speed (m/s) and acceleration (m/s^2), whose gaps are filled linearly; optionally grade or
        elevation (m).
    """
    time = log.time
    speed, force = (filled(time, log[n]) for n in ("speed", "acceleration"))
    known = filled(time, log["grade"]) if "grade" in log else np.zeros(time.size)
    weight = GRAVITY * known / np.sqrt(1.0 + known**2)
    along = cumulative_integral(time, speed)
    risen = cumulative_integral(along, force - weight) - 0.5 * (speed**2 - speed[0] ** 2)
    if zero is None:
        zero = float((risen[-1] - GRAVITY * _climb(log)) / along[-1]) if along[-1] > SHORTEST_DRIVE else 0.0
    kept = (cumulative_integral(time, force - weight) - speed) / GRAVITY
    ends = time[0] + LOOK * np.arange(max(int((time[-1] - time[0]) / LOOK), 1) + 1)
    middle, looks = ends[:-1] + 0.5 * LOOK, np.diff(np.interp(ends, time, kept)) / LOOK - zero / GRAVITY
    moving = np.interp(middle, time, speed) > CREEPING
    smooth, _ = smoothed_slope(np.interp(middle, time, along), looks, moving)
    slope: Array = np.interp(time, middle, smooth)
    edges = PLACES * np.arange(int(along[-1] / PLACES) + 1)
    height = np.interp(edges, *_once(along, (risen - zero * along) / GRAVITY))
    return RoadProfile(zero, slope, np.asarray(edges, dtype=np.float64), np.diff(height) / PLACES)


def _climb(log: Log) -> float:
    """Height gained from start to end by the logged elevation, m; 0 without one, or with a logged grade."""
    if "elevation" not in log or "grade" in log:
        return 0.0
    return net_change(log["elevation"])


def _once(along: Array, values: Array) -> tuple[Array, Array]:
    """Distances and values without repeated distances, as where the car stands still."""
    first = np.r_[True, np.diff(along) > 0]
    return along[first], values[first]


@effect(
    on="grade",
    unknowns=(Quantity(DRIVE_SLOPE, "", "mean slope of a whole drive", "i", -0.03, 0.03),),
    reference="assumed: mean slope of zero over all roads",
)
def drive_slope(grade: Law, s: Signals, q: Signals) -> Number:
    """The grade plus the mean slope of the drive, which the estimated zero of the accelerometer has absorbed."""
    return grade(s) + q.drive_slope


def _lag(name: str, channel: str, on: str | tuple[str, ...], sign: float) -> Effect:
    """An apparent lag of a channel: drivers react to a hill at once, while its measured slope is smoothed."""

    def law(clock: Law, s: Signals, q: Signals) -> Number:
        """A shifted clock."""
        return clock(s) + sign * getattr(q, name)

    law.__name__ = name
    seconds = Quantity(name, "s", f"time by which the {channel} seems to lag", "tau", -0.5, 0.5)
    return effect(on=on, unknowns=(seconds,), reference="a slope resolved in seconds, and a driver who reacts to it")(
        law
    )


SPEED_LAG = _lag("speed_timing", "speed", ("speed_clock", "acceleration_clock"), -1.0)  # the car lags, not a sensor
APPARENT_LAGS = (_lag("torque_timing", "torque", "drive_torque_lead", 1.0), SPEED_LAG)
LATENCIES = {n: _lag(f"{n}_latency", n, f"{n}_clock", -1.0) for n in ("speed", "acceleration")}


@dataclass(frozen=True, eq=False)
class DriveRoads:
    """The slope of every drive's road by its accelerometer, in addition to a logged grade; empty without.

    Parameters
    ----------
    sensed : one for each drive.
    """

    sensed: tuple[RoadProfile, ...] = ()

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the channels with the slopes."""
        return (SENSED_SLOPE,) if self.sensed else ()

    def channels(self, logs: Sequence[Log]) -> tuple[Log, ...]:
        """The logs with these slopes, each (n,) and uphill positive, as an additional channel."""
        if not self.sensed:
            return tuple(logs)
        return tuple(log.with_channels(**{SENSED_SLOPE: r.slope}) for log, r in zip(logs, self.sensed, strict=True))

    @property
    def slopes(self) -> list[Array]:
        """The slope for each log, (n,) each, uphill positive."""
        return [road.slope for road in self.sensed]


def sensed_roads(logs: Sequence[Log], scatter: float = 0.0) -> DriveRoads:
    """The roads of drives that their accelerometers show.

    Parameters
    ----------
    logs : with speed (m/s), and acceleration (m/s^2).
    scatter : s_e of the module's equation, m/s^2; 0: every drive has its own zero.
    """
    least = 1.0 - STEP_POLICY.most_missing
    there = all("acceleration" in log and np.isfinite(log["acceleration"]).mean() > least for log in logs)
    roads = [sensed_road(log) for log in logs] if there else []
    long = [k for k, road in enumerate(roads) if road.zero != 0.0]
    if scatter > 0.0 and len(long) > 1:
        own = np.array([roads[k].zero for k in long])
        mean = float(np.average(own, weights=[roads[k].distance[-1] for k in long]))
        share = min(1.0, scatter**2 / float(np.var(own, ddof=1)))
        if share < 1.0:
            for k, zero in zip(long, mean + share * (own - mean), strict=True):
                roads[k] = sensed_road(logs[k], float(zero))
    return DriveRoads(tuple(roads))
