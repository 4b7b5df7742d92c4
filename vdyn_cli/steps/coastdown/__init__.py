"""Road load from coast-downs: rolling resistance, drag area, F0 F1 F2 and A B C.

A car of mass M with rotating parts of mr = sum J/r^2 decelerates according to::

    (M + mr) V' = F - 1/2 rho Cd A (V + w)|V + w| - frr M g cos(grade) - M g sin(grade)

with F = 0 in neutral, or the drive force (torque x gear_ratio x driveline_efficiency / wheel_radius; for
``recuperation_loss`` see ``laws.driveline``) where it is measured and no brake is used. The simulated speed is fitted
to the measured one; every run's start speed is unknown. A gust changes the speed, and the change persists, so the
residuals are whitened with the covariance of gusts, of wind and rolling resistance that differ from run to run, and of
the sensor. The amplitudes of this noise are estimated from the data (restricted maximum likelihood). Wind of zero mean
adds 1/2 rho Cd A var(w), which the model includes.
Intervals follow from the scatter between runs. ``noise: white`` uses plain least squares instead.

Where an accelerometer (specific force f = V' + g sin(grade)) is mapped, M f + mr V' = F - Fd - Rr holds without the
slope. On a track the specific force is fitted together with the speed, and its zero is unknown. On an open road
(``windows: powered``: parts with drive above zero, without braking) it is fitted alone; its zero comes from the
energy of each whole log, with an elevation channel or the assumption that the mean slope of all roads is zero. Mass
scales all forces; torque and efficiency are collinear with it, so give ``mass`` and ``driveline_efficiency`` as
``value +- std`` where they are uncertain: the stated values are priors of the fit and widen the intervals.

Where an elevation is logged but no acceleration, the grade over each run's distance is computed from the elevation and
scaled by the share of it that the coasts' deceleration shows; its remaining error is part of the noise
(``elevation_grade``).

Where only a wheel's speed is logged (rad/s or rpm), V = om r: a free-rolling wheel slips by less than 0.1 %, which
is part of the effective radius. The radius' standard deviation is a scale error of the speed, which the intervals
include. Likewise a motor's current times its torque constant is a drive torque.

Where a position is logged, its distance over the integral of the speed measures the gain of the speed: a wrong gain is
then no open answer, unless the position may be the integral of that speed.

The mean wind of a run, measured beside the track, is the run's ``wind_speed`` (against the motion) where no channel of
this name is logged; the remaining wind is estimated as a headwind. A crosswind adds drag that acts like rolling
resistance: the intervals extend to the load without it. State it as ``crosswind`` of each run, or ``settings:
{crosswind: 0 m/s}`` for a calm day. Else it is the wind that has the fitted gusts, across the road.

In a narrow window of speeds rolling resistance and drag area are collinear; ``settings: {fix: {drag_coefficient:
0.25}}`` fixes one. The result states the window of speeds that separates them.

Lift or downforce changes the wheel loads by rho/2 CzA V^2 (CzA > 0: downforce), and the rolling resistance by frr times
that: frr CzA is part of the estimated drag area, 0.01 m^2 for frr = 0.01 and CzA = 1 m^2.

Assumes a road load c0 + c2 V^2 (``terms: 3`` adds c1 V), straight driving, tires at one temperature. The
correction to 20 degC and 100 kPa follows UN GTR 15, the accuracies UN R83 and GTR 15.

Sources: Buggaveeti et al., SAE 2017-01-1574, equations (1) to (4); SAE J1263, J2263; Patterson and Thompson,
Biometrika 58 (1971) 545 for the noise.
"""
