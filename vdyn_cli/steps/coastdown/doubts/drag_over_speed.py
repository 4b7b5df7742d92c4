"""A drag area that changes with speed, instead of the force that an accepted effect adds.

A car that rises or sinks with speed, or closes its grille shutter, has a drag area A0 + A2 V^2 / V1^2, V1 the highest
speed. Over the speeds of a coast-down such a force is nearly collinear with a resistance that increases with speed::

    c0 + c1 V + c2 V^2,   about   d0 + 1/2 rho (A0 + A2 V^2 / V1^2) V^2

Both laws give the same force, but other drag areas: no coast-down discriminates between them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.coastdown.fit.reference_conditions import RoadLoad

SPEEDS = 50  # at which both laws are compared
MATERIAL = 0.1  # half intervals, least change of the drag area that is reported: a smaller one is not seen in it


@dataclass(frozen=True)
class DragOverSpeed:
    """The drag area that would give the same force without the effects, if it changed with speed.

    Parameters
    ----------
    rolling : rolling resistance coefficient. slow, fast : drag area, m^2, at ``speeds``, m/s.
    """

    rolling: float
    slow: float
    fast: float
    speeds: tuple[float, float]

    def matters(self, area: float, half: float) -> bool:
        """Whether this law lengthens the interval of the drag area, area +- half (m^2), on one side by a tenth."""
        return max(abs(self.slow - area), abs(self.fast - area)) > MATERIAL * half

    def widened(self, name: str, value: float, interval: tuple[float, float]) -> tuple[float, float]:
        """The 95 % interval of ``rolling_resistance`` or ``drag_area`` that also includes this law's values."""
        others = [self.rolling] if name == "rolling_resistance" else [self.slow, self.fast]
        low, high = interval
        return min(low, min(others) - (value - low)), max(high, max(others) + (high - value))

    def finding(self) -> Finding:
        """A note that the intervals include this law."""
        (slow, fast), low, high = self.speeds, self.slow, self.fast
        what = (
            "a force that increases with speed is collinear with a drag area that changes with it (ride height, grille "
            f"shutter): {low:.2f} m^2 at {3.6 * slow:.0f} km/h and {high:.2f} m^2 at {3.6 * fast:.0f} km/h give the "
            "same road load; the intervals of rolling resistance and drag area include them"
        )
        remedy = "coast down with ride height and shutter fixed, or give the drag area from a wind tunnel ('fix')"
        return Finding("drag_area", what, remedy=remedy)


def drag_over_speed(load: RoadLoad, speeds: tuple[float, float], mass: float, density: float) -> DragOverSpeed | None:
    """The changing drag area that describes a road load; None where it leaves the road load's 95 % interval.

    Parameters
    ----------
    load : with the force of the accepted effects. speeds : lowest and highest, m/s. mass : kg. density : kg/m^3.
    """
    speed = np.linspace(*speeds, SPEEDS)
    share = (speed / speeds[1]) ** 2
    laws = np.column_stack([np.full(SPEEDS, mass * GRAVITY), *(0.5 * density * speed**2 * s for s in (1.0, share))])
    force, (low, high) = np.asarray(load.force(speed)), load.interval(speed)
    rolling, first, change = np.linalg.lstsq(laws, force, rcond=None)[0].tolist()
    there = laws @ np.array([rolling, first, change])
    if rolling <= 0.0 or np.any(there < low) or np.any(there > high):
        return None
    slow, fast = (first + change * float(s) for s in share[[0, -1]])
    return DragOverSpeed(rolling, slow, fast, speeds) if min(slow, fast) > 0.0 else None
