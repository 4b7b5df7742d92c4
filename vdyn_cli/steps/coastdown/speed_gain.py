"""What a position that contradicts the speed means for the road load.

A speed that reads 1/g times the true one (g: position over the integral of the speed) gives, in a coast-down,

    rolling resistance = g * estimate,    drag area = estimate / g

and the residuals are those of a correct speed: only the position shows it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.io.quality.distance_gain import CommonGain, common_gain, distance_gain, gain_finding
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.coastdown.agreement import holding
from vdyn_cli.steps.coastdown.road_load_fit import RoadLoadFit
from vdyn_cli.steps.coastdown.segments import CoastSegment

POWERS = {"rolling_resistance": 1.0, "drag_area": -1.0}  # of g, by which an estimate is multiplied


def contradicted_gain(segments: Sequence[CoastSegment]) -> CommonGain | None:
    """The common gain of the runs' positions over the integrals of their speeds; None where they do not contradict.

    Parameters
    ----------
    segments : of the runs; those with ``position`` (m) are compared with their ``speed`` (m/s).
    """
    by_run: dict[int, list[float]] = {}
    for one in segments:
        if "position" in one.log and np.ptp(one.part) == 0:
            gain = distance_gain(one.log.time, one.log["speed"], one.log["position"])
            if gain is not None:
                by_run.setdefault(one.run, []).append(gain)
    found = common_gain([float(np.mean(gains)) for gains in by_run.values()])
    return found if found is not None and found.contradicts else None


def with_speed_gain(fit: RoadLoadFit, gain: CommonGain | None) -> tuple[RoadLoadFit, tuple[Finding, ...]]:
    """The fit with intervals that hold the road load by either sensor, and the finding on the contradiction.

    A data fault where the gain shifts a parameter by more than ``QUALITY.material_shift`` of its half interval.
    """
    if gain is None or fit.campaign.drive != "coasting":
        return fit, ()
    solution: Solution = fit.solution
    other = {n: solution.values[n] * gain.value**p for n, p in POWERS.items() if n in solution.names}
    halves = {n: 0.5 * (solution.interval95[n][1] - solution.interval95[n][0]) for n in other}
    material = any(abs(v - solution.values[n]) > QUALITY.material_shift * halves[n] for n, v in other.items())
    return replace(fit, solution=holding(solution, other)), (gain_finding(gain, material),)
