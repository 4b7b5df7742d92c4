"""Validation by drives: error of the simulated model against the uncertainty of its parameters.

The model is simulated open loop from the measured start with the measured torque, and compared with every measured
output. The parameters' covariance C and the exact sensitivities S of an output give the 95 % band of a correct model,

    y +- 1.96 sqrt(S C S' + gusts + sensor noise)

Outside the band the model is wrong; inside it, uncertain parameters explain the deviation. For every output and regime
(launch, acceleration, cruise, coast, braking, low speed), the result states the error against the sensor noise, the
time outside the band and the time that a correct model would be outside, and which parameters' uncertainty makes the
band. The pull of each parameter is its change by the drives over the standard deviation of that change.

``model: vehicle`` needs the parameters of all steps; parameters that no step estimates are assumed with a wide prior,
and reported. A front-driven car with an open differential has 16 degrees of freedom:

    6  body: forward, sideways, up; roll, pitch, yaw
    4  height of each wheel (suspension travel)
    4  spin of each wheel
    2  half-shafts' inner ends, which twist them (the carrier turns at their mean)

A locked differential (``differential: locked``) leaves 15; with both axles driven, each by its motor and differential,
there are 18. SAE 2017-01-1574 counts 18 for the front-driven car, with a mass within each stepped half-shaft. That mass
is omitted: it oscillates at 2 kHz or more (0.7 kHz with a heavy joint in the middle), which steps of 1 ms and measured
channels do not resolve, and up to 40 Hz the sections in series have the same stiffness within 0.4 %. The motion of the
side gears (above 300 Hz) is condensed; the half-shafts' torques are equal within 0.2 % in a tip-in. The body takes the
reaction of the drive torque, and of the torque that accelerates the motor (``motor_reaction``).

``model: road_load`` is a mass on a road, for cars with known mass, radius, ratio and road load (rolling_resistance and
drag_area, or road_load_f0, f1, f2) only; it leaves out braked parts, and parts in which the acceleration per torque
changes (another gear, or the gain of a channel). A speed that is 0.4 s or more late or early against the torque is
shifted to its clock, with a warning. A whole drive whose acceleration per torque (a load, a trailer) or resistance (a
dragging brake) differs from the others is left out, too. ``windows`` cuts long trips into short windows and
states the error of the speed at the end of each; ``powered`` uses only windows with the torque above zero throughout,
since the brakes are released then. Where a drive of more than 100 s is missed as a whole, though the car follows its
torque, and no candidate effect gives a result, powered windows of 20 s answer instead, with both errors stated.

The engine of a car with gears takes part of its own torque to accelerate: with its speed logged (``motor_speed``), its
inertia acts by the square of the ratio of each gear (``engine_inertia``, in the model of a mass on a road). The gears
are found in engine speed over speed; while the clutch is open or slips, the inertia does not act.

Inputs: drive torque (or left and right), brake torque, grade, wind; unrecorded ones are zero. With ``road_load``, a
drive is simulated between their gaps; the vehicle model needs them without gaps. Outputs may have gaps. Publishes no
parameters.

Assumes straight driving, gusts along the road, sensors with white noise, a zero and a gain.
Sources: SAE 2017-01-1574 for model and drives; JCGM 100:2008 for the propagation; Patterson and Thompson, Biometrika 58
(1971) 545 for the noise.
"""
