"""The gain of the speed by the position: a known error, or wider intervals where the position contradicts the speed.

If the speed reads 1/g times the true one (g: position over the integral of the speed), a coast-down has

    rolling resistance = g * estimate,    drag area = estimate / g

and the residuals do not show the error: only the position does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.io.quality.distance_gain import CommonGain, common_gain, distance_gain, gain_finding, is_integral
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit

POWERS = {"rolling_resistance": 1.0, "drag_area": -1.0}  # of g, by which an estimate is multiplied


@dataclass(frozen=True)
class SpeedGain:
    """The position over the integral of the speed, over all runs.

    Parameters
    ----------
    common : the ratio. independent : whether no position may be the integral of that speed.
    """

    common: CommonGain
    independent: bool


def speed_gain(segments: Sequence[CoastSegment]) -> SpeedGain | None:
    """Common ratio of distance by position to integrated speed; None for fewer than two runs with position.

    Parameters
    ----------
    segments : of the runs; those with ``position`` (m) are compared with their ``speed`` (m/s).
    """
    with_position = [one for one in segments if "position" in one.log and np.ptp(one.part) == 0]
    by_run: dict[int, list[float]] = {}
    for one in with_position:
        gain = distance_gain(one.log.time, one.log["speed"], one.log["position"])
        if gain is not None:
            by_run.setdefault(one.run, []).append(gain)
    common = common_gain([float(np.mean(gains)) for gains in by_run.values()])
    if common is None:
        return None
    integrals = (is_integral(one.log.time, one.log["speed"], one.log["position"]) for one in with_position)
    return SpeedGain(common, not any(integrals))


def with_measured_gain(added: AddedEffects, gain: SpeedGain | None) -> AddedEffects:
    """The effects, a gain error of the speed with the prior that an agreeing position gives.

    Unchanged without a position, where it contradicts the speed, and where it may be the integral of that speed.
    """
    if gain is None or gain.common.contradicts or not gain.independent:
        return added
    scales = {next(iter(e.unknowns)) for e in added.effects if e.gain_of == "speed"}
    prior = 0.0, gain.common.speed_error_std
    return replace(added, unknowns=tuple(replace(u, prior=prior) if u.name in scales else u for u in added.unknowns))


def with_speed_gain(fit: RoadLoadFit, gain: SpeedGain | None) -> tuple[RoadLoadFit, tuple[Finding, ...]]:
    """The fit with intervals that include the road load by either sensor, and the finding on the contradiction.

    The finding is a data fault where the gain shifts a parameter by more than ``QUALITY.material_shift`` of its half
    interval. Unchanged without a contradiction or with a driven car.
    """
    if gain is None or not gain.common.contradicts or not fit.campaign.coasting:
        return fit, ()
    solution = fit.solution
    shift = {n: solution.values[n] * (gain.common.value**p - 1.0) for n, p in POWERS.items() if n in solution.names}
    material = any(abs(d) > QUALITY.material_shift * solution.half_width(n) for n, d in shift.items())
    return fit.including(shift), (gain_finding(gain.common, material),)
