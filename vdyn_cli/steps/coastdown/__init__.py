"""Road load from coast-downs: rolling resistance, drag area, F0 F1 F2 and A B C.

A car of mass M with turning parts worth mr = sum J/r^2 slows down by::

    (M + mr) V' = F - 1/2 rho Cd A (V + w)|V + w| - frr M g cos(grade) - M g sin(grade)

with F = 0 in neutral, or the drive force (torque x gear_ratio x driveline_efficiency / wheel_radius) where it is known
and no brake is used. The simulated speed is fitted to the measured one, every run's start speed being unknown. Gusts
push the car and the push stays in its speed, so the residuals are whitened with the covariance of gusts, of wind and
rolling resistance that differ from run to run, and of the sensor, whose sizes come from the data (restricted maximum
likelihood). Wind of zero mean adds 1/2 rho Cd A var(w), which is reckoned with. Intervals come from the runs.
``noise: white`` is plain least squares instead, as in the paper.

Where an accelerometer (specific force f = V' + g sin(grade)) is mapped, M f + mr V' = F - Fd - Rr holds without the
slope. On a track it is fitted beside the speed, its zero unknown. On an open road (``windows: powered``: stretches with
drive above zero, so that nobody brakes) it is fitted alone; its zero comes from the energy of each whole log, with an
elevation channel or the assumption that roads lead up as often as down. Mass sets the scale of all forces; torque and
efficiency are one unknown with it, so give ``mass`` and ``driveline_efficiency`` as ``value +- std`` where they are not
known: the stated spreads are weighed with what the drives say, and carried into the result.

From a narrow window of speeds rolling resistance and drag area can't be told apart; ``settings: {fix:
{drag_coefficient: 0.25}}`` fixes one as the paper does. The result says how far up and down the speed must go.

Assumes a road load c0 + c2 V^2 (``terms: 3`` adds c1 V), straight driving, no crosswind, tires at one temperature. The
correction to 20 degC and 100 kPa follows UN GTR 15, the accuracies UN R83 and GTR 15.

Sources: Buggaveeti et al., SAE 2017-01-1574, equations (1) to (4); SAE J1263, J2263; Patterson and Thompson,
Biometrika 58 (1971) 545 for the noise.
"""
