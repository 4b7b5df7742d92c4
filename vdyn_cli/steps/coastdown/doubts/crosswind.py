"""The drag of a crosswind, which the model does not contain, as a one-sided widening of the intervals.

A crosswind c turns the flow by the yaw angle b, tan(b) = c / V, and increases it. With a drag coefficient that grows by
k sin(b)^2, the force against the motion grows by::

    1/2 rho Cd A (sqrt(V^2 + c^2) V (1 + k sin(b)^2) - V^2),   about 1/2 rho Cd A c^2 (1/2 + k)

Runs in both directions have it alike, and no residual shows it: the fit attributes it to rolling resistance. It only
adds drag, so the car's own resistance lies below the estimate. Where c is not stated it follows from the gusts: a wind
U across the road has them with the standard deviation I U along the road, with the lateral turbulence intensity I. The
mean wind along the road, and how it differs between the runs, say nothing about c.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from vdyn_cli.inference.gust_covariance import SOURCES
from vdyn_cli.quantities.arrays import Array, rms
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.number_text import two_digits
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit
from vdyn_cli.steps.coastdown.spec import CoastdownSpec

# k of cars: Cd grows by 10 % at a yaw of 10 deg, in the middle of 5 to 15 % (Hucho, Aerodynamics of Road Vehicles).
YAW = 3.3
HEAVY_YAW = 7.0  # k of trucks and buses: by 20 % at 10 deg, VECTO's crosswind correction of coaches and rigid trucks
HEAVY = 3500.0  # kg, the limit of categories N1 and N2 (UN R.E.3)
# EN 1991-1-4, 4.4: 1/ln(z/z0) is 0.22 to 0.33 at z = 1 m above z0 = 0.01 m (no vegetation) to 0.05 m (grass), along the
# wind; across it 0.8 of that over flat terrain: 0.18 to 0.26.
TURBULENCE = 0.22
STRONGEST = 5.0  # m/s, the largest mean wind of UN GTR 15, annex 4, 4.1.1.1
SPEEDS = 50  # at which a force is projected on the road load
MATERIAL = 0.45  # half intervals, from which a shift lengthens that side of an interval by a tenth


def crosswind_shift(fit: RoadLoadFit, stated: float | None) -> tuple[Mapping[str, float], tuple[Finding, ...]]:
    """Change of rolling resistance and drag area (m^2) by a crosswind, and a finding where it matters.

    Empty for a driven car, and where only the specific force is fitted. It matters where it lengthens one side of an
    interval by a tenth.

    Parameters
    ----------
    stated : rms crosswind of the runs, m/s; None where it is not known: that of ``likely_crosswind`` then.
    """
    campaign = fit.campaign
    across = likely_crosswind(fit) if stated is None else stated
    if not campaign.coasting or not campaign.speed_fitted or not across:
        return {}, ()
    shift = parameter_shift(fit, lambda speed: crosswind_force(fit.at, speed, across))
    if not is_material(fit, shift):
        return shift, ()
    force = float(crosswind_force(fit.at, np.array([np.mean(fit.speeds)]), across)[0])
    if stated is not None:
        what = f"the stated crosswind of {across:.1f} m/s adds about {two_digits(force)} N; the intervals include it"
        return shift, (Finding("runs", what),)
    what = (
        f"no crosswind is stated; the gusts suggest up to {across:.1f} m/s, which adds {two_digits(force)} N; the "
        f"intervals include it (speed errors hide {100 * hidden_share(fit):.0f} % of the variance of usual gusts)"
    )
    remedy = "give the measured 'crosswind' of each run, or 'settings: {crosswind: 0 m/s}' for a calm day"
    return shift, (Finding("runs", what, remedy=remedy),)


def is_material(fit: RoadLoadFit, shift: Mapping[str, float]) -> bool:
    """Whether a shift of rolling resistance or drag area (m^2) lengthens one side of its interval by a tenth."""
    return not all(abs(d) < MATERIAL * fit.solution.half_width(n) for n, d in shift.items())


def stated_crosswind(spec: CoastdownSpec) -> float | None:
    """The rms of the crosswinds that the runs, or else the settings, state, m/s; None where neither does."""
    each = [run.crosswind.value for run in spec.runs if run.crosswind is not None]
    own = spec.settings.crosswind
    return rms(*each) if each else None if own is None else own.value


def likely_crosswind(fit: RoadLoadFit) -> float:
    """Mean wind, m/s, whose turbulence has the standard deviation of the fitted and measured gusts along the road.

    Errors of the speed hide a share h of them: w^2 + h (u^2 - w^2), with the standard deviations w of the fitted and
    measured gusts and u > w of usual ones.
    """
    measured = np.mean([np.var(r.inputs["wind_speed"]) for r in fit.campaign.runs])
    found = fit.sizes.get("gust", 0.0) ** 2 + measured
    hidden = hidden_share(fit) * max(SOURCES["gust"].typical ** 2 - found, 0.0)
    return float(min(np.sqrt(found + hidden) / TURBULENCE, STRONGEST))


def hidden_share(fit: RoadLoadFit) -> float:
    """Share of the variance of usual gusts that the error of the speed over a gust's duration T hides: e^2/(e^2 + v^2).

    v = rho Cd A V / (M + mr) u T,   e^2 = d^2 + s^2 / (f T)

    with the change of speed v by usual gusts u, m/s, the error d that lasts for seconds, m/s, and white noise s, m/s,
    of f samples in a second: rounding and the sensor's noise.
    """
    gust, time = SOURCES["gust"].typical, SOURCES["gust_time"].typical
    drag_slope = fit.at["air_density"] * fit.at["drag_area"] * float(np.mean(fit.speeds)) / fit.inertia
    bins, levels = fit.campaign.bins, [each.get("speed", 0.0) for each in fit.campaign.levels]
    rate = sum(float(np.sum(b.count)) for b in bins) / sum(float(np.sum(b.width)) for b in bins)
    white = (fit.sizes.get("speed_noise", 0.0) * rms(*levels)) ** 2 / (rate * time)
    error = fit.sizes.get("speed_drift", 0.0) ** 2 + white
    return error / (error + (drag_slope * gust * time) ** 2)


def crosswind_force(at: Mapping[str, float], speed: Array, across: float) -> Array:
    """Force, (n,) N, that a crosswind (m/s) adds at speeds (n,) m/s; see the module."""
    flow, yaw = speed**2 + across**2, HEAVY_YAW if at["mass"] > HEAVY else YAW
    drag = np.sqrt(flow) * speed * (1.0 + yaw * across**2 / flow) - speed**2
    return np.asarray(0.5 * at["air_density"] * at["drag_area"] * drag)


def parameter_shift(fit: RoadLoadFit, force: Callable[[Array], Array]) -> Mapping[str, float]:
    """Shift of rolling resistance and drag area (m^2) by a force over speed, for those of the two that are estimated.

    Least squares of the force over the fitted speeds.

    Parameters
    ----------
    force : speed (n,) m/s -> force (n,) N.
    """
    speed = np.linspace(*fit.speeds, SPEEDS)
    return fit.shift_by(speed, force(speed))
