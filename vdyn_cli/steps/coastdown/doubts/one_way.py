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

from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.coastdown.doubts.crosswind import parameter_shift
from vdyn_cli.steps.coastdown.fit.residuals import fitted_to
from vdyn_cli.steps.coastdown.fit.road_load_fit import MAIN, RoadLoadFit
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

FEWEST_FOR_WIND = 4  # runs from which the diagnosis estimates a headwind: two of each direction


def is_one_way(fit: RoadLoadFit) -> bool:
    """Whether all runs of a fit have the same direction, or none states its direction."""
    return len(set(fit.campaign.headings)) == 1


def one_way_shifts(fit: RoadLoadFit) -> list[Mapping[str, float]]:
    """Shifts of rolling resistance and drag area by an unmeasured slope and wind; none with both directions.

    The slope is ``one_way_slope``, the wind ``one_way_wind``, either way. A measured wind, and a slope that is logged,
    surveyed or measured by the accelerometer, need no widening. A roughness that the description states is used as the
    slope's standard deviation.
    """
    campaign, found = fit.campaign, list[Mapping[str, float]]()
    if not is_one_way(fit):
        return found
    known = {n: all(isinstance(r.inputs[n], np.ndarray) for r in campaign.runs) for n in ("grade", "wind_speed")}
    if campaign.accelerometer == "none" and not known["grade"]:
        slope = COASTDOWN_POLICY.one_way_slope if campaign.roughness is None else NORMAL95 * campaign.roughness
        found.append({"rolling_resistance": slope})
    if campaign.accelerometer != "alone" and not known["wind_speed"]:
        wind, density = COASTDOWN_POLICY.one_way_wind, 0.5 * fit.at["air_density"] * fit.at["drag_area"]
        found.append(parameter_shift(fit, lambda speed: density * ((speed + wind) ** 2 - speed**2)))
    return found


def is_unbalanced(fit: RoadLoadFit) -> bool:
    """Whether runs too few to estimate a headwind have one direction more often than the other."""
    campaign, headings = fit.campaign, fit.campaign.headings
    few = campaign.both_ways and headings.size < FEWEST_FOR_WIND
    return few and bool(headings.sum() != 0.0) and campaign.coasting


def unbalanced_shift(fit: RoadLoadFit) -> Mapping[str, float]:
    """Shift to the far end of the interval of the mean of the estimates from either direction.

    Empty for other campaigns, and where the runs of one direction do not determine the unknowns.
    """
    if not is_unbalanced(fit):
        return {}
    ways = (np.flatnonzero(fit.campaign.headings == way).tolist() for way in (1.0, -1.0))
    sides = [side for runs in ways if (side := fitted_to(fit, runs)) is not None]
    if len(sides) < 2:
        return {}
    found = {}
    for name in (n for n in MAIN if n in fit.solution.names):
        shift = float(np.mean([one.values[name] for one in sides])) - fit.solution.values[name]
        half = 0.5 * float(np.hypot.reduce([one.half_width(name) for one in sides]))
        found[name] = shift + float(np.copysign(half, shift))
    return found


def unbalanced_finding(fit: RoadLoadFit) -> tuple[Finding, ...]:
    """How many runs each direction has, where their numbers differ and no headwind can be estimated."""
    if not is_unbalanced(fit):
        return ()
    headings = fit.campaign.headings.tolist()
    out, back = headings.count(1.0), headings.count(-1.0)
    what = f"{out} out and {back} back: wind and slope do not cancel; the intervals include the mean of both directions"
    return (Finding("runs", what, "", f"drive {abs(out - back)} more {'back' if out > back else 'out'}", doubt=True),)
