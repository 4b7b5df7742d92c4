"""Wheel inertia from drives with a wheel force sensor, from a pendulum, or from both.

On the road the wheel's moment balance is integrated over short windows::

    Jw (om(t2) - om(t1)) = integral of T - (Fx + mw a) r - frr (Fz + mw g) r

with hub torque T, hub forces Fx and Fz, specific force a, and mass mw and radius r of the parts outside the sensor.
The wheel's speed is never differentiated: the noise of a differentiated speed biases Jw low, by 4 % at 200 Hz and by
half at 1 kHz on the sample drives, and smoothing changes the bias without removing it. Each run has its own zero of the
torque, within the sensors' data sheets.

There are two sources of error. First, a is nearly r om', so that only Jw + mw r^2 is observable: an error of 2 kg in mw
is 0.19 kg m^2. Second, Jw is the small difference of two large torques: 1 mm of r, or 0.5 % between the gains of torque
and force, changes it by a sixth or more. Stated standard deviations of mw, r and frr ("20.0 +- 0.1 kg") are propagated.

The period T of small oscillations of the suspended wheel gives its inertia::

    compound    J = m g d T^2 / (4 pi^2) - m d^2       a pivot at distance d from the axis
    bifilar     J = m g (s/2)^2 T^2 / (4 pi^2 l)       two cords of length l, s apart
    torsional   J = kt T^2 / (4 pi^2)                  a rod, its stiffness given or calibrated with a bar

T is given, timed, or fitted to a recording of angle or rate; large amplitudes are corrected (T = T0 (1 + phi^2/16 +
...)), and a disturbance during the recording is detected. All measured quantities contribute to the uncertainty.

With both methods, agreement is judged in standard deviations. Where they agree, the published value is their mean
weighted by inverse variance; otherwise it is the pendulum's, which depends only on lengths, mass and time. The
pendulum measures the wheel alone; the road's value includes a sensor's rotating part and the brake disc.

Sources: SAE 2017-01-1574, equations (19) to (22); JCGM 100:2008 for the propagation of uncertainty.

On a stand (``manoeuvre: stand``) the wheel turns freely, and a torque at its hub spins it up and down; inertia and
bearing drag follow without hub forces::

    J om' = T - Tb sgn(om) - cb om

J is the inertia of all rotating parts; ``settings.stand_inertia`` is subtracted for those that do not belong to the
wheel. The torque may be a motor's current times its torque constant (and gear_ratio), whose relative standard deviation
is also that of J.
"""
