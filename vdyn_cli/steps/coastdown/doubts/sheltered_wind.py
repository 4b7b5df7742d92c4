"""A wind along the track that is weaker at one end (trees, buildings), as a widening of the intervals.

Runs out and back pass the same speed at opposite ends of the track. A headwind w along the out direction, stronger by e
in the first half of the way out and weaker by e in the second, then leaves in the mean of both directions::

    rho Cd A e w V in the first half of a run, the same with the opposite sign in the second

It has the same sign in both directions, and speed and place belong together in every run: no coast-down discriminates
between it and rolling resistance and drag area.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.coastdown.doubts.crosswind import is_material, parameter_shift
from vdyn_cli.steps.coastdown.doubts.one_way import is_one_way
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit
from vdyn_cli.steps.coastdown.fit.road_load_regression import effects_of

# EN 1991-1-4, 4.3.2, 2 m above ground: kr ln(z/z0) is 0.70 in open country (category II, kr 0.19, z0 0.05 m) and 0.41
# among hedges and single buildings (III, 0.215, 0.3 m): 1.27 and 0.73 of their mean.
DIFFERENCE = 0.27


def sheltered_wind_shift(fit: RoadLoadFit) -> Mapping[str, float]:
    """Change of rolling resistance and drag area (m^2) by a wind that is DIFFERENCE stronger in half of the track.

    Empty for a driven car, for runs of one direction, whose intervals include a wind anyway, for a measured wind, and
    where only the specific force is fitted.
    """
    campaign = fit.campaign
    measured = any(isinstance(r.inputs["wind_speed"], np.ndarray) for r in campaign.runs)
    if not campaign.coasting or not campaign.speed_fitted or measured or is_one_way(fit):
        return {}
    half = np.mean([np.interp(0.5 * r.distance[-1], r.distance, r.speed) for r in campaign.runs])
    pull = fit.at["air_density"] * fit.at["drag_area"] * DIFFERENCE * mean_wind(fit)

    def force(speed: Array) -> Array:
        return np.asarray(pull * speed * np.where(speed > half, 1.0, -1.0))

    return parameter_shift(fit, force)


def mean_wind(fit: RoadLoadFit) -> float:
    """Magnitude of the mean wind along the track, m/s: that of the effects, and what the noise contains of it."""
    winds = (e for e in effects_of(fit.regression) if e.turns_with_heading and "air" in e.on)
    found = sum(fit.at.get(n, 0.0) for e in winds for n in e.unknowns)
    return float(np.hypot(found, fit.sizes.get("run_wind", 0.0)))


def sheltered_wind_finding(fit: RoadLoadFit, shift: Mapping[str, float]) -> tuple[Finding, ...]:
    """A note where a shift of rolling resistance or drag area (m^2) lengthens its interval by a tenth."""
    if not is_material(fit, shift):
        return ()
    what = (
        f"a wind of {mean_wind(fit):.1f} m/s along the track that is stronger at one end of it (trees, buildings) is "
        f"collinear with rolling resistance and drag area; the intervals include +- {100 * DIFFERENCE:.0f} %"
    )
    return (Finding("runs", what, remedy="measure the wind at both ends, or repeat on a calmer day"),)
