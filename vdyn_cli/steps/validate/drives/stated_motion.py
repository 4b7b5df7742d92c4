"""The acceleration of a driven car on a level road, from the stated parameters."""

from __future__ import annotations

from dataclasses import dataclass

from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.parameters import Parameters

USUAL_ROLLING, USUAL_DRAG, USUAL_DENSITY = 0.01, 0.7, 1.2  # of a car; m^2; kg/m^3


@dataclass(frozen=True)
class StatedMotion:
    """The acceleration a T + b + c V^2 of a driven car on a level road, as stated.

    Parameters
    ----------
    ratio : a, 1/(kg m). constant : b, m/s^2. drag : c, 1/m. inertia : mass with that of the rotating parts, kg.
    """

    ratio: float
    constant: float
    drag: float
    inertia: float = 1.0


def stated_motion(known: Parameters) -> StatedMotion | None:
    """The acceleration of a driven car with the stated parameters, on a level road; None where some are not known.

    a = i eta / (r (M + mr)), b = -frr M g / (M + mr) and c = -rho A / (2 (M + mr)); without frr or A: of a usual car
    """
    if "mass" not in known or "wheel_radius" not in known:
        return None
    force = known.value("gear_ratio", 1.0) * known.value("driveline_efficiency", 1.0) / known.value("wheel_radius", 1.0)
    mass = known.value("mass", 1.0)
    inertia = mass + known.value("rotating_mass", 0.0)
    if "road_load_f0" in known:
        rolling, drag = known.value("road_load_f0", 0.0), known.value("road_load_f2", 0.0)
    else:
        rolling = known.value("rolling_resistance", USUAL_ROLLING) * mass * GRAVITY
        drag = 0.5 * known.value("air_density", USUAL_DENSITY) * known.value("drag_area", USUAL_DRAG)
    return StatedMotion(force / inertia, -rolling / inertia, -drag / inertia, inertia)
