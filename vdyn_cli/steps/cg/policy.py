"""Every threshold by which a run of longitudinal accelerations is refused, doubted or accepted, with its reason."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class CgPolicy:
    """The thresholds of the step."""

    cg_gentle: float = 0.5
    """[m/s^2] standard deviation of the acceleration below which a run is doubted. A smaller one changes the loads by
    less than 1 % of the weight, as zeros and grades do."""

    weight_doubted: float = 0.015
    """[share of the weight] by which the loads may differ from it where the mass has no standard deviation. Scales and
    load cells agree to 1 %."""

    weight_refused: float = 0.2
    """[share of the weight] beyond which the loads are refused. A gain of the loads is a candidate effect and can be
    corrected; the missing load of a wheel, a quarter, cannot."""

    gps_zero_least: float = 0.02
    """[m/s^2] least reported zero of an accelerometer, relative to the derivative of the speed. It shifts the center of
    gravity by about a millimeter."""

    gps_zero_std: float = 5.0
    """[standard deviations] of scatter and noise that a reported zero of the accelerometer must exceed. With two runs,
    Student's t of their scatter has long tails."""

    carried_windows: int = 8
    """[windows] that a run must have to compare the load of both axles over the speed. Each run has a free constant:
    seven independent values remain."""

    axle_gain: float = 0.015
    """[share] by which the loads of one axle may read too high, relative to the other axle: prior. Loads that exceed
    the weight by 1.5 % are scaled. If one axle alone is wrong, it is so by 3 %, two standard deviations. A gain changes
    the sum of the loads with the acceleration by a fifth as much as an equal crosstalk."""

    balance_misfit: float = 1.5
    """[squares per row] of the fit with all effects, above which it does not describe a large effect. Noise levels that
    are wrong by 10 % change squares by 20 %: more than twice that is a misfit."""

    balance_noise: float = 1.05
    """[squares per row] of the fit with all effects, up to which the residual counts as noise. Two standard deviations
    of 3000 rows. In three logs with an effect outside the catalog (0.99 to 1.03 squares per row), channels estimated
    with it moved a curve by 0.02 to 0.13 of its half-interval."""

    gravity_left: float = 0.5
    """times the residual squares of the speed: most that they may be after gravity is removed from the acceleration, or
    added again, if its sensor is of the other kind than stated. Otherwise more is left: 34 times as much on a van, and
    the same without pitch."""

    cg_implausible: float = 3.0
    """[standard deviations] of the tires' slip or compliance, or of the pitch axis, from its usual value, beyond which
    the fit without effects keeps the usual value, and an effect that needs more is no answer. Chance exceeds it once in
    370 cars; beyond, the slip or the deflection is negative, or that of a tire on ice, and the body turns about a point
    below the road."""

    smoothest_road: float = 0.0025
    """[m/s] standard deviation of an axle's vertical speed by the road, below which the road is smooth. At 10 m/s on a
    road of 6e-8 m^3 (ISO 8608), 1/250 of the mean of class A: a smaller error is the model's."""


CG_POLICY = CgPolicy()
