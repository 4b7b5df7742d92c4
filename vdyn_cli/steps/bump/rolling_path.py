"""The path of a wheel that rolls over the bump as a circle, which a tire with point contact does not have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.number_text import number
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.bump.measured_profile import BumpData
from vdyn_cli.steps.bump.spec import BumpSpec
from vdyn_cli.steps.step_policy import STEP_POLICY

USUAL_RADIUS = 0.31  # m, of a car's wheel
SPACING = 2e-3  # m, of the profile along the road: the circle's height is then exact to 0.01 mm


@dataclass(frozen=True)
class RollingPath:
    """How far a rolling wheel is above the bump under its center, because it touches the slope ahead or behind.

    Parameters
    ----------
    radius : of the wheels, m. gap : the largest height of the wheel's lowest point above the road under its center, m.
    """

    radius: float
    gap: float

    def doubts(self, stiffness: float, residual: float) -> tuple[Finding, ...]:
        """A doubt where the loads' residual is as large as a fit without this path leaves.

        Parameters
        ----------
        stiffness : of an axle's tires, N/m. residual : root mean square of the loads, N.
        """
        force = stiffness * self.gap
        if residual < STEP_POLICY.bump_rolling * force:
            return ()
        what = "tires with point contact do not explain the loads; a wheel that rolls over this bump takes another path"
        got = (
            f"a circle of {number(self.radius, 0.02)} m is up to {1e3 * self.gap:.0f} mm above the road under its "
            f"center; rms residual of the loads {number(residual, 0.05 * residual)} N"
        )
        remedy = (
            "do not use the tire stiffness; push the car slowly over the bump, and give the height of an axle over its "
            "position as the bump's 'profile'"
        )
        return (Finding("bump", what, got, remedy, doubt=True),)


def rolling_path(spec: BumpSpec, data: BumpData, known: Parameters) -> RollingPath:
    """The path of a rigid circle over the bump, and its largest distance from the road: max over x of u_c(x) - u(x).

    u_c(x) = max over y of u(x + y) - R + sqrt(R^2 - y^2)

    with u the road's height (m) and R the wheel's radius (m): as stated, or a usual one.
    """
    radius = known["wheel_radius"].value if "wheel_radius" in known else USUAL_RADIUS
    height = _heights(spec, data, radius)
    reach = int(radius / SPACING)
    circle = np.sqrt(radius**2 - (SPACING * np.arange(-reach, reach + 1)) ** 2) - radius
    around = np.lib.stride_tricks.sliding_window_view(np.pad(height, reach, mode="edge"), circle.size)
    return RollingPath(radius, float(np.max(np.max(around + circle, axis=1) - height)))


def _heights(spec: BumpSpec, data: BumpData, margin: float) -> Array:
    """Height (n,) of the road every ``SPACING``, m, from ``margin`` m before the bump to as much after it."""
    bump = spec.obstacle
    if data.profile is not None:
        position, height = np.array(data.profile).T
        along = np.arange(position[0] - margin, position[-1] + margin, SPACING)
        return np.asarray(np.interp(along, position, height))
    assert bump.width is not None
    assert bump.height is not None
    share = np.clip(np.arange(-margin, bump.width.value + margin, SPACING) / bump.width.value, 0.0, 1.0)
    return np.asarray(bump.height.value * np.sin(np.pi * share) ** (1 if bump.shape == "half_sine" else 2))
