"""Every threshold by which a step refuses, cuts, doubts or accepts data or results, with its reason."""

from __future__ import annotations

from dataclasses import dataclass

from vdyn_cli.steps.coastdown_policy import CoastdownPolicy
from vdyn_cli.steps.validate_policy import ValidatePolicy


@dataclass(frozen=True)
class StepPolicy(ValidatePolicy, CoastdownPolicy):
    """The thresholds of the steps; those of coast-downs and of validation have their own modules.

    ``vdyn explain policy`` prints each with unit, meaning and reason.
    """

    # Several steps ----------------------------------------------------------------------------------------------------
    sign_correlation: float = 0.3
    """[correlation] of two channels, above which its sign is certain. By chance, 100 independent samples reach it once
    in 400. Channels of the correct sign have more, or hardly any: a tire far beyond its peak."""

    agreeing_std: float = 2.0
    """[standard deviations] of the difference of two estimates of one quantity, up to which they agree. Two correct
    estimates differ by more in one case of twenty."""

    most_missing: float = 0.2
    """[share of the rows] without a number, above which a channel, or a coast for its speed, is not used. The remaining
    rows cover other speeds than the whole log, and give other intervals."""

    # Center of gravity ------------------------------------------------------------------------------------------------
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

    # Bump -------------------------------------------------------------------------------------------------------------
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

    gravity_left: float = 0.5
    """times the residual squares of the speed: most that they may be after gravity is removed from the acceleration, if
    its sensor is on the body. A sensor that does not read gravity leaves more: 34 times as much on a van, and the same
    without pitch."""

    cg_implausible: float = 3.0
    """[standard deviations] of the tires' slip or compliance, or of the pitch axis, from its usual value, beyond which
    the fit without effects keeps the usual value, and an effect that needs more is no answer. Chance exceeds it once in
    370 cars; beyond, the slip or the deflection is negative, or that of a tire on ice, and the body turns about a point
    below the road."""

    uneven_road: float = 10.0
    """[log-likelihood] gained by an uneven road before the bump, above which it is part of the noise. Twice this gain
    has a chi-square distribution with one degree of freedom: once in 10^5 crossings on a smooth road chance exceeds
    it."""

    smoothest_road: float = 0.0025
    """[m/s] standard deviation of an axle's vertical speed by the road, below which the road is smooth. At 10 m/s on a
    road of 6e-8 m^3 (ISO 8608), 1/250 of the mean of class A: a smaller error is the model's."""

    tire_follows: float = 0.5
    """[% per %] of tire stiffness by unsprung mass, above which only their ratio counts as determined. The middle
    between 1 without wheel hop and 0 where wheel hop separates the two."""

    # Inertia and pendulum ---------------------------------------------------------------------------------------------
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

    pendulum_jump: float = 30.0
    """[effective chi-square] gained by a disturbance of a pendulum, above which the recording is split there. Two
    unknowns at any time: by chance less than once in 1 000 recordings."""

    # Half-shaft -------------------------------------------------------------------------------------------------------
    shaft_excess: float = 1.3
    """[times the sensors' noise] of the residuals, beyond which the law is doubted. Noise levels are known to 10 %."""

    delay_std: float = 3.0
    """[standard deviations] of the delay of a shaft's torque, below which none is corrected. By chance once in 400
    logs, and the fit must also leave a residual without the delay."""

    ratio_agreement: float = 0.02
    """[share of the gear ratio] by which the ratio of the speeds may differ from it. A gear ratio is exact, because
    teeth are counted; gains of two speed sensors differ by less."""

    # Tire -------------------------------------------------------------------------------------------------------------
    prior_contradicted: float = 3.0
    """[standard deviations] from a stated shape factor, beyond which the fitted one contradicts it. By chance once in
    400 tests."""

    peak_slip: float = 0.15
    """[slip] by which a tire on asphalt has passed its peak. Pacejka, Tire and Vehicle Dynamics, ch. 4: 0.1 to 0.2."""

    two_peaks: float = 0.04
    """[share of the friction] by which the peaks in driving and braking must differ to be reported. Twice the effect of
    a force zero of 1 % of full scale."""


STEP_POLICY = StepPolicy()
