"""Other laws with the same road load but another drag area, where an accepted effect adds a force.

A car that rises or sinks with speed, or closes its grille shutter, has a drag area A0 + A2 V^2 / V1^2, V1 the highest
speed. Deformation losses of tires grow with V to V^2 (``P^a Z^b (a + b V + c V^2)``, SAE J2452), not only with V. Over
the speeds of a coast-down such forces are nearly collinear with a resistance that increases with speed::

    c0 + c1 V + c2 V^2,   about   d0 + 1/2 rho (A0 + A2 V^2 / V1^2) V^2,   about   e0 + e1 V^1.5 + 1/2 rho A V^2

The laws give the same force, but other drag areas: no coast-down discriminates between them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.coastdown.fit.reference_conditions import RoadLoad

SPEEDS = 50  # at which the laws are compared
MATERIAL = 0.1  # half intervals, least change of the drag area that is reported: a smaller one is not seen in it


@dataclass(frozen=True)
class DragOverSpeed:
    """The rolling resistances and drag areas by laws that give the same force without the effects.

    Parameters
    ----------
    rolling : rolling resistance coefficient by each law. areas : drag areas, m^2. text : each law in words.
    """

    rolling: tuple[float, ...]
    areas: tuple[float, ...]
    text: tuple[str, ...]

    def matters(self, area: float, half: float) -> bool:
        """Whether these laws lengthen the interval of the drag area, area +- half (m^2), on one side by a tenth."""
        return max(abs(other - area) for other in self.areas) > MATERIAL * half

    def widened(self, name: str, value: float, interval: tuple[float, float]) -> tuple[float, float]:
        """The 95 % interval of ``rolling_resistance`` or ``drag_area`` that also includes these laws' values."""
        others = self.rolling if name == "rolling_resistance" else self.areas
        low, high = interval
        return min(low, min(others) - (value - low)), max(high, max(others) + (high - value))

    def finding(self) -> Finding:
        """A note that the intervals include these laws."""
        what = (
            f"a force that changes with speed is collinear with {', and with '.join(self.text)}: the road load is the "
            "same; the intervals of rolling resistance and drag area include them"
        )
        remedy = "coast down with ride height and shutter fixed, or give the drag area from a wind tunnel ('fix')"
        return Finding("drag_area", what, remedy=remedy)


def drag_over_speed(load: RoadLoad, speeds: tuple[float, float], mass: float, density: float) -> DragOverSpeed | None:
    """The other laws that describe a road load; None where both leave the road load's 95 % interval.

    Parameters
    ----------
    load : with the force of the accepted effects. speeds : lowest and highest, m/s. mass : kg. density : kg/m^3.
    """
    speed = np.linspace(*speeds, SPEEDS)
    rolling, areas, text = [], [], []
    share = (speed / speeds[1]) ** 2
    if (changing := _same_load(load, speed, 0.5 * density * speed**2 * share, mass, density)) is not None:
        slow, fast = (changing[1] + changing[2] * float(s) for s in share[[0, -1]])
        if min(slow, fast) > 0.0:
            rolling.append(changing[0])
            areas += [slow, fast]
            text.append(
                f"a drag area that changes with speed (ride height, grille shutter), {slow:.2f} m^2 at"
                f" {3.6 * speeds[0]:.0f} km/h and {fast:.2f} m^2 at {3.6 * speeds[1]:.0f} km/h"
            )
    if (steeper := _same_load(load, speed, mass * GRAVITY * speed**1.5, mass, density)) is not None:
        rolling.append(steeper[0])
        areas.append(steeper[1])
        text.append(f"a rolling resistance that changes with V^1.5 and a drag area of {steeper[1]:.2f} m^2")
    return DragOverSpeed(tuple(rolling), tuple(areas), tuple(text)) if areas else None


def _same_load(load: RoadLoad, speed: Array, further: Array, mass: float, density: float) -> list[float] | None:
    """Rolling resistance, drag area and factor of a further force (n,) N, with which a law gives the road load.

    Least squares over the speeds; None where the law leaves the road load's interval or a value is not physical.
    """
    laws = np.column_stack([np.full(speed.size, mass * GRAVITY), 0.5 * density * speed**2, further])
    low, high = load.interval(speed)
    found = np.linalg.lstsq(laws, np.asarray(load.force(speed)), rcond=None)[0]
    there = laws @ found
    if min(found[:2]) <= 0.0 or np.any(there < low) or np.any(there > high):
        return None
    return [float(v) for v in found]
