"""Interval widening for a slope and a steady wind where all runs have the same direction.

A slope i acts like a rolling resistance i; a headwind w adds 1/2 rho Cd A (2 V w + w^2), which the fit attributes to
rolling resistance and drag area. Runs in both directions separate slope and wind from the car. Runs in one direction do
not, and their scatter does not show the error, so the intervals include the largest slope and wind that the
regulations allow.

Of two or three runs in both directions, too few to estimate a headwind, more may have one direction. The mean of the
estimates from either direction then differs from that of all runs, and the intervals include it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.steps.coastdown.doubts.agreement import widened_to_include
from vdyn_cli.steps.coastdown.doubts.crosswind import parameter_shift
from vdyn_cli.steps.coastdown.fit.residuals import fitted_to
from vdyn_cli.steps.coastdown.fit.road_load_fit import MAIN, RoadLoadFit
from vdyn_cli.steps.step_policy import STEP_POLICY

FEWEST_FOR_WIND = 4  # runs from which the diagnosis estimates a headwind: two of each direction


def is_one_way(fit: RoadLoadFit) -> bool:
    """Whether all runs of a fit have the same direction, or none states its direction."""
    return len({r.heading for r in fit.campaign.runs}) == 1


def widened_if_one_way(fit: RoadLoadFit) -> Solution:
    """The solution with 95 % intervals that include an unmeasured slope and wind; unchanged with both directions.

    The slope is ``one_way_slope``, the wind ``one_way_wind``, either way. A measured wind, and a slope that is logged,
    surveyed or measured by the accelerometer, need no widening. A roughness that the description states is used as the
    slope's standard deviation.
    """
    campaign, solution = fit.campaign, fit.solution
    if not is_one_way(fit):
        return solution
    known = {n: all(isinstance(r.inputs[n], np.ndarray) for r in campaign.runs) for n in ("grade", "wind_speed")}
    if campaign.accelerometer == "none" and not known["grade"]:
        slope = STEP_POLICY.one_way_slope if campaign.roughness is None else NORMAL95 * campaign.roughness
        solution = _moved(solution, {"rolling_resistance": slope})
    if campaign.accelerometer != "alone" and not known["wind_speed"]:
        solution = _moved(solution, _by_wind(fit))
    return solution


def is_unbalanced(fit: RoadLoadFit) -> bool:
    """Whether runs too few to estimate a headwind have one direction more often than the other."""
    headings = [r.heading for r in fit.campaign.runs]
    both = {1.0, -1.0} <= set(headings)
    return both and len(headings) < FEWEST_FOR_WIND and sum(headings) != 0.0 and fit.campaign.drive == "coasting"


def widened_if_unbalanced(fit: RoadLoadFit) -> Solution:
    """The solution with 95 % intervals that include that of the mean of the estimates from either direction.

    Unchanged for other campaigns, and where the runs of one direction do not determine the unknowns.
    """
    if not is_unbalanced(fit):
        return fit.solution
    headings = [r.heading for r in fit.campaign.runs]
    try:
        sides = [fitted_to(fit, [k for k, h in enumerate(headings) if h == way]) for way in (1.0, -1.0)]
    except ResultError:
        return fit.solution
    farthest = {}
    for name in (n for n in MAIN if n in fit.solution.names):
        shift = float(np.mean([one.values[name] for one in sides])) - fit.solution.values[name]
        half = 0.5 * float(np.hypot.reduce([one.half_width(name) for one in sides]))
        farthest[name] = fit.solution.values[name] + shift + float(np.copysign(half, shift))
    return widened_to_include(fit.solution, farthest)


def unbalanced_finding(fit: RoadLoadFit) -> tuple[Finding, ...]:
    """How many runs each direction has, where their numbers differ and no headwind can be estimated."""
    if not is_unbalanced(fit):
        return ()
    headings = [r.heading for r in fit.campaign.runs]
    out, back = headings.count(1.0), headings.count(-1.0)
    what = f"{out} out and {back} back: wind and slope do not cancel; the intervals include the mean of both directions"
    return (Finding("runs", what, "", f"drive {abs(out - back)} more {'back' if out > back else 'out'}", doubt=True),)


def _by_wind(fit: RoadLoadFit) -> Mapping[str, float]:
    """Shift of rolling resistance and drag area by a headwind ``one_way_wind``, where they are estimated."""
    density = 0.5 * fit.at["air_density"] * fit.at["drag_area"]
    return parameter_shift(fit, lambda speed: density * ((speed + STEP_POLICY.one_way_wind) ** 2 - speed**2))


def _moved(solution: Solution, shift: Mapping[str, float]) -> Solution:
    known = {n: solution.values[n] + d for n, d in shift.items() if n in solution.values}
    return widened_to_include(solution, known)
