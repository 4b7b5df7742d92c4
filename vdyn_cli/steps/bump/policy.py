"""Every threshold by which a crossing of a bump or a drop is refused, doubted or accepted, with its reason."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class BumpPolicy:
    """The thresholds of the step."""

    bump_visible: float = 0.01
    """[share of the load at rest] by which a load must change on a bump. Scales and load cells agree to 1 %: a smaller
    change may be drift."""

    bump_transfer: float = 0.02
    """[share of the load at rest] that brakes or throttle may move between the axles on a bump. The dampers' losses
    alone slow a car on bumps of 3 to 9 cm by what would move up to 0.014, in 80 simulated crossings of four vehicles
    without brakes."""

    bump_visible_noise: float = 8.0
    """[noise levels] by which a load must also change on a bump. White noise stays below 5 deviations."""

    bump_correlation: float = 0.3
    """[correlation] of the loads with a typical car's response, below which a crossing is refused. Far below the 0.90
    to 0.99 of 120 crossings of 30 random cars in the tests."""

    bump_speed_ratio: float = 1.25
    """of the logged speed to that from the axles' delay, or its inverse, beyond which a run is refused. In the same
    tests: 0.99 to 1.01. mph or km/h read as m/s are off by factors of 2.2 and 3.6."""

    bump_load_ratio: float = 4.0
    """of the loads' changes to a typical car's, or its inverse, beyond which a run is refused. In the same tests: 0.94
    to 1.04. lbf, kgf and kN read as N are off by factors of 4.4 and more."""

    bump_rolling: float = 0.01
    """[share of the force] of a wheel's rolling path that the loads still show, above which it is doubted. Simulated
    crossings of other vehicles: 0.044 to 0.054 with circular wheels, 0.019 with a flat contact patch, 0.005 with the
    path as the profile, 0.003 with point contact."""

    bump_accelerometer: float = 0.05
    """[m] standard deviation of an accelerometer's place along the car, where the description gives none. The center of
    gravity that it is measured from is known to 1 to 2 cm; the sprung body's lies 1 to 3 cm from the car's, and the
    sensor itself is some 5 cm long. On a bump 3 cm change its reading by five noise levels."""

    bump_airborne: float = 0.25
    """[share of the crossing] with an axle off the road, above which it is excluded. Such a car lands on its bump
    stops, which the model does not have."""

    mass_agreement: float = 0.01
    """[share of the mass] by which it may differ from the sum of sprung and unsprung masses. The accuracy of a scale,
    and of a summed list of parts."""

    vague_interval: float = 0.1
    """[share of the value] half a 95 % interval above which a value is called poorly determined. With a wider one a
    ride simulation is not useful."""

    tire_follows: float = 0.5
    """[% per %] of tire stiffness by unsprung mass, above which only their ratio counts as determined. The middle
    between 1 without wheel hop and 0 where wheel hop separates the two."""


BUMP_POLICY = BumpPolicy()
