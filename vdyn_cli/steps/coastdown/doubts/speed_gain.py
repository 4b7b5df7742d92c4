"""Interval widening where the position contradicts the speed.

If the speed reads 1/g times the true one (g: position over the integral of the speed), a coast-down has

    rolling resistance = g * estimate,    drag area = estimate / g

and the residuals do not show the error: only the position does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.io.quality.distance_gain import CommonGain, common_gain, distance_gain, gain_finding
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment
from vdyn_cli.steps.coastdown.doubts.agreement import widened_to_include
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit

POWERS = {"rolling_resistance": 1.0, "drag_area": -1.0}  # of g, by which an estimate is multiplied


def contradicted_gain(segments: Sequence[CoastSegment]) -> CommonGain | None:
    """Common ratio of distance by position to integrated speed, over all runs; None unless it differs from one.

    Significantly, by the scatter of the runs (``common_gain``).

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
    """The fit with intervals that include the road load by either sensor, and the finding on the contradiction.

    The finding is a data fault where the gain shifts a parameter by more than ``QUALITY.material_shift`` of its half
    interval. Unchanged without a gain or with a driven car.
    """
    if gain is None or fit.campaign.drive != "coasting":
        return fit, ()
    solution: Solution = fit.solution
    other = {n: solution.values[n] * gain.value**p for n, p in POWERS.items() if n in solution.names}
    halves = {n: 0.5 * (solution.interval95[n][1] - solution.interval95[n][0]) for n in other}
    material = any(abs(v - solution.values[n]) > QUALITY.material_shift * halves[n] for n, v in other.items())
    return replace(fit, solution=widened_to_include(solution, other)), (gain_finding(gain, material),)
