"""Interval widening for a crosswind, whose drag the model does not contain.

A crosswind c turns the flow by the yaw angle b, tan(b) = c / V, and increases it. With a drag coefficient that grows by
k sin(b)^2, the force against the motion grows by::

    1/2 rho Cd A (sqrt(V^2 + c^2) V (1 + k sin(b)^2) - V^2),   about 1/2 rho Cd A c^2 (1/2 + k)

Runs in both directions have it alike, and no residual shows it: the fit attributes it to rolling resistance. Where c is
not stated it follows from the gusts. They have the standard deviation I U in a mean wind U, with the turbulence
intensity I, and U may blow across the road, up to the crosswind that the standards allow: who tests in more states it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.number_text import two_digits
from vdyn_cli.steps.coastdown.doubts.agreement import widened_to_include
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit
from vdyn_cli.steps.coastdown.noise import wind_variance
from vdyn_cli.steps.coastdown.spec import CoastdownSpec

YAW = 3.3  # k: Cd grows by 10 % at a yaw of 10 deg, in the middle of 5 to 15 % (Hucho, Aerodynamics of Road Vehicles)
# EN 1991-1-4, 4.4: 1/ln(z/z0) is 0.22 to 0.33 at z = 1 m above z0 = 0.01 m (no vegetation) to 0.05 m (grass).
TURBULENCE = 0.25
STRONGEST = 2.0  # m/s, the largest mean crosswind of UN R83 (Annex 4a, Appendix 7, 3.1) and UN GTR 15 (4.1.1.1)
SPEEDS = 50  # at which a force is projected on the road load
MATERIAL = 0.45  # half intervals, from which a shift widens an interval by a tenth


def widened_by_crosswind(fit: RoadLoadFit, stated: float | None) -> tuple[Solution, tuple[Finding, ...]]:
    """The solution with intervals that include the drag of a crosswind, and a finding where it widens them by a tenth.

    Parameters
    ----------
    stated : rms crosswind of the runs, m/s; None where it is not known: that of ``likely_crosswind`` then.
    """
    campaign, solution = fit.campaign, fit.solution
    across = likely_crosswind(fit) if stated is None else stated
    if campaign.drive != "coasting" or not campaign.speed_fitted or not across:
        return solution, ()
    shift = absorbed(fit, lambda speed: crosswind_force(fit.at, speed, across))
    wider = widened_to_include(solution, {n: solution.values[n] - d for n, d in shift.items()})
    halves = {n: 0.5 * float(np.diff(solution.interval95[n])[0]) for n in shift}
    if all(abs(d) < MATERIAL * halves[n] for n, d in shift.items()):
        return wider, ()
    force = float(crosswind_force(fit.at, np.array([np.mean(fit.speeds)]), across)[0])
    if stated is not None:
        what = f"the stated crosswind of {across:.1f} m/s adds about {two_digits(force)} N; the intervals include it"
        return wider, (Finding("runs", what),)
    what = (
        f"no crosswind is stated: the gusts suggest up to {across:.1f} m/s across the road, which adds "
        f"{two_digits(force)} N; the intervals include it"
        + (" (more is not allowed by UN R83 and WLTP)" if across == STRONGEST else "")
    )
    remedy = "give the measured 'crosswind' of each run, or 'settings: {crosswind: 0 m/s}' for a calm day"
    return wider, (Finding("runs", what, remedy=remedy),)


def stated_crosswind(spec: CoastdownSpec) -> float | None:
    """The rms of the crosswinds that the runs, or else the settings, state, m/s; None where neither does."""
    each = [run.crosswind.value for run in spec.runs if run.crosswind is not None]
    own = spec.settings.crosswind
    return float(np.sqrt(np.mean(np.square(each)))) if each else None if own is None else own.value


def likely_crosswind(fit: RoadLoadFit) -> float:
    """Mean wind, m/s, whose turbulence has the standard deviation of the fitted and measured wind along the road.

    At most ``STRONGEST``: fitted gusts also contain noise of the speed.
    """
    runs = fit.campaign.runs
    along = np.concatenate([r.heading * np.broadcast_to(r.inputs["wind_speed"], r.time.shape) for r in runs])
    return float(min(np.sqrt(wind_variance(fit.sizes) + np.var(along)) / TURBULENCE, STRONGEST))


def crosswind_force(at: Mapping[str, float], speed: Array, across: float) -> Array:
    """Force, (n,) N, that a crosswind (m/s) adds at speeds (n,) m/s; see the module."""
    flow = speed**2 + across**2
    drag = np.sqrt(flow) * speed * (1.0 + YAW * across**2 / flow) - speed**2
    return np.asarray(0.5 * at["air_density"] * at["drag_area"] * drag)


def absorbed(fit: RoadLoadFit, force: Callable[[Array], Array]) -> Mapping[str, float]:
    """Shift of rolling resistance and drag area (m^2) by a force over speed, for those of the two that are estimated.

    Least squares of the force on M g and 1/2 rho V^2 over the fitted speeds.
    """
    at, speed = fit.at, np.linspace(*fit.speeds, SPEEDS)
    columns = {
        "rolling_resistance": np.full(SPEEDS, at["mass"] * GRAVITY),
        "drag_area": 0.5 * at["air_density"] * speed**2,
    }
    names = [n for n in columns if n in fit.solution.names]
    found = np.linalg.lstsq(np.column_stack([columns[n] for n in names]), force(speed), rcond=None)[0]
    return dict(zip(names, found.tolist(), strict=True))
