"""Drives against the model: whether it predicts them as well as its parameters' uncertainty allows.

The model is simulated open loop with the measured torque from the measured start, and compared with every measured
output. The parameters' covariance C and the exact sensitivities S of an output give the band in which it may lie,

    y +- 1.96 sqrt(S C S' + gusts + sensor noise)

Outside the band the model is wrong; inside it the deviation is explained by uncertain parameters. The result says for
every output and regime (launch, acceleration, cruise, coast, braking, low speed) how large the error is against sensor
noise, how long it is outside and how long a correct model would be, which parameter's uncertainty makes the band, and
the pull of each parameter: its change by the drives over the standard deviation of that change.

``model: vehicle`` takes the parameters of all steps; parameters that no step estimates are assumed with a wide prior,
and reported. A front-driven car with an open differential has 16 degrees of freedom:

    6  body: forward, sideways, up; roll, pitch, yaw
    4  height of each wheel (suspension travel)
    4  spin of each wheel
    2  half-shafts' inner ends, which twist them (the carrier turns at their mean)

A locked differential (``differential: locked``) leaves 15; with both axles driven, each by its motor and differential,
there are 18. SAE 2017-01-1574 counts 18 for the front-driven car, with a mass within each stepped half-shaft: such a
bar turns about itself at 2 kHz and more (0.7 kHz with a heavy joint in its middle), which no step of 1 ms can follow
and no channel shows, and up to 40 Hz its sections in series have the same stiffness within 0.4 %. The side gears' own
motion (above 300 Hz) is condensed; the half-shafts' torques are equal within 0.2 % in a tip-in. The body takes the
drive torque's reaction, and that of the torque that spins up the motor (``motor_reaction``).

``model: road_load`` is a mass on a road, for cars of which only mass,
radius, ratio and road load are known (rolling_resistance and drag_area, or road_load_f0, f1, f2); it leaves out braked
parts. ``windows`` cuts long trips into short windows and states the error of the speed at the end of each; ``powered``
takes those in which the torque is above zero throughout, since the brakes are released then.

Inputs: drive torque (or left and right), brake torque, grade, wind; what is not recorded is zero. They must
have no gaps; outputs may have gaps. Publishes no parameters.

Assumes straight driving, gusts along the road, sensors with white noise, a zero and a gain.
Sources: SAE 2017-01-1574 for model and drives; JCGM 100:2008 for the propagation; Patterson and Thompson, Biometrika 58
(1971) 545 for the noise.
"""
