"""The path of a wheel that rolls over the bump as a circle, which a tire with point contact does not have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.physics.laws.road import Hump
from vdyn_cli.physics.models.half_car import Points
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.number_text import number
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.bump.crossing import Ground
from vdyn_cli.steps.bump.measured_profile import BumpData, simplified
from vdyn_cli.steps.bump.policy import BUMP_POLICY
from vdyn_cli.steps.bump.spec import BumpSpec

USUAL_RADIUS = 0.31  # m, of a car's wheel
SPACING = 2e-3  # m, of the profile along the road: the circle's height is then exact to 0.01 mm
TOLERANCE = 1e-4  # m, of the lines of a path over a measured profile: 25 N of an axle, as much as load cells' noise
ROUNDING = 1e-9  # of a height, in that of the bump: below it the wheel is on the level road
ORDER = 5  # of a hump, whose errors are below 0.02 mm on bumps 2 to 12 cm high and 0.3 to 1.5 m long


@dataclass(frozen=True)
class RollingPath:
    """How far a rolling wheel is above the bump under its center, because it touches the slope ahead or behind.

    Parameters
    ----------
    radius : of the wheels, m. gap : the largest height of the wheel's lowest point above the road under its center, m.
    stated : whether the description gives the radius.
    shape : of the path: a hump over a described bump, points (position, height) in m over a measured profile.
    ground : positions and heights (n,) of the road, m, the bump from 0 on.
    """

    radius: float
    gap: float
    stated: bool
    shape: Hump | Points
    ground: Ground

    def doubts(self, stiffness: float, residual: float) -> tuple[Finding, ...]:
        """A doubt where the loads' residual is as large as a fit without this path leaves.

        Parameters
        ----------
        stiffness : of an axle's tires, N/m. residual : root mean square of the loads, N.
        """
        force = stiffness * self.gap
        if residual < BUMP_POLICY.bump_rolling * force:
            return ()
        what = "tires with point contact do not explain the loads; a wheel that rolls over this bump takes another path"
        usual, state = ("", "") if self.stated else (" (usual)", "state wheel_radius, or ")
        got = (
            f"a circle of {number(self.radius, 0.02)} m{usual} is up to {1e3 * self.gap:.0f} mm above the road under "
            f"its center; rms residual of the loads {number(residual, 0.05 * residual)} N"
        )
        remedy = (
            f"do not use the tire stiffness; {state}push the car slowly over the bump, and give the height of an axle "
            "over its position as the bump's 'profile'"
        )
        return (Finding("bump", what, got, remedy, doubt=True),)


def rolling_path(spec: BumpSpec, data: BumpData, known: Parameters) -> RollingPath:
    """The path of a rigid circle over the bump, and its largest distance from the road: max over x of u_c(x) - u(x).

    u_c(x) = max over y of u(x + y) - R + sqrt(R^2 - y^2)

    with u the road's height (m) and R the wheel's radius (m): as stated, or a usual one.
    """
    radius = known["wheel_radius"].value if "wheel_radius" in known else USUAL_RADIUS
    along, height = _heights(spec, data, radius)
    reach = int(radius / SPACING)
    circle = np.sqrt(radius**2 - (SPACING * np.arange(-reach, reach + 1)) ** 2) - radius
    around = np.lib.stride_tricks.sliding_window_view(np.pad(height, reach, mode="edge"), circle.size)
    path = np.max(around + circle, axis=1)
    gap = float(np.max(path - height))
    bump = spec.obstacle
    if data.profile is not None or bump.width is None or bump.height is None:
        shape: Hump | Points = simplified(along, path, TOLERANCE)[0]
    else:
        shape = _hump(along / bump.width.value, path / bump.height.value)
    return RollingPath(radius, gap, "wheel_radius" in known, shape, (along, height))


def _hump(share: Array, height: Array) -> Hump:
    """The hump through heights (n,) at positions (n,), both relative to the bump's."""
    off = np.abs(share - 0.5)
    reach = float(np.max(off[height > ROUNDING]))
    inside = 1.0 - (off[off < reach] / reach) ** 2
    powers = inside[:, None] ** np.arange(1, ORDER + 1)
    coefficients = np.linalg.lstsq(powers, height[off < reach])[0]
    return Hump(reach, tuple(coefficients.tolist()))


def _heights(spec: BumpSpec, data: BumpData, margin: float) -> tuple[Array, Array]:
    """Positions and heights (n,) of the road, m, from ``margin`` m before the bump to as much after it."""
    bump = spec.obstacle
    if data.profile is not None:
        position, height = np.array(data.profile).T
        along = np.arange(position[0] - margin, position[-1] + margin, SPACING)
        return along, np.asarray(np.interp(along, position, height))
    assert bump.width is not None
    assert bump.height is not None
    along = np.arange(-margin, bump.width.value + margin, SPACING)
    share = np.clip(along / bump.width.value, 0.0, 1.0)
    return along, np.asarray(bump.height.value * np.sin(np.pi * share) ** (1 if bump.shape == "half_sine" else 2))
