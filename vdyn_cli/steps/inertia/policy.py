"""Every threshold by which a wheel test on the road or a stand is refused, doubted or accepted, with its reason."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class InertiaPolicy:
    """The thresholds of the step."""

    inertia_disagreement: float = 3.5
    """[standard deviations] between road and pendulum, beyond which both results are marked as doubtful. By chance once
    in 2 000 tests."""

    least_rim_share: float = 0.2
    """[m r^2] least possible inertia of a wheel of mass m and rolling radius r. A disk of half the radius has 0.125,
    and the tire alone adds some 0.3; wheels have 0.45 to 0.8."""

    most_rim_share: float = 1.1
    """[m r^2] largest possible inertia of a wheel of mass m and rolling radius r. A hoop has 1; the tread lies outside
    the rolling radius by up to 5 %."""

    work_correlation: float = 5.0
    """[standard errors] of the correlation of work and kinetic energy, beyond which its sign is certain. By chance less
    than once in 10 000 logs, including its long tails."""

    radius_agreement: float = 0.02
    """[share of the radius] by which speed over wheel speed may differ from it. Rolling and loaded radius of a tire
    differ by this much."""

    radius_excess: float = 0.005
    """[share of the radius] by which wheel_radius may exceed speed over wheel speed. A loaded radius is below the
    rolling one; a ground speed is accurate to 0.2 %, and the slip at a tenth of the largest torque is 0.2 %."""


INERTIA_POLICY = InertiaPolicy()
