"""Half-shaft stiffness from the drawing, a bar hung on the shaft, or a tip-in log; damping from the log.

A torsion bar's stiffness is k = G J / L with J = pi (do^4 - di^4) / 32; sections in series add their compliances::

    1/k = sum(Li / (G Ji))          solid, hollow or tapered sections

Suspended at one end with a bar of known inertia across the other, the shaft oscillates with T = 2 pi sqrt(J / k). A log
of torque and twist (or of the speeds of both ends, whose difference is the rate of twist) obeys::

    T = k phi + c phi' + zero

Encoders at both ends give phi = motor_angle / gear_ratio - wheel_angle, with zero twist at zero torque; the rate is
then that of the fitted twist, and no angle is differentiated.

All channels have noise. The readings are adjusted, each within its noise, until this law holds and the twist is the
integral of its rate. Plain least squares would underestimate c by some percent.

The stiffness from a log includes all parts between its two sensors, such as joints and splines; where there is a log,
its value is published with its measured interval. A drawing or a bar that agrees refines it; one that contradicts it
is reported with both numbers, and the compliance in series if the log is the softer one. A plain half-shaft of
24 to 28 mm has 2 900 to 8 000 N m/rad; SAE 2017-01-1574 publishes two to four times that.

A torque that is logged late by d lowers c by k d; without a stated ``torque_delay``, the interval of c includes half
a sampling interval (one standard deviation). Where the fit leaves a residual above the noise and a delay explains
it, the torque is shifted by the delay; c is then determined only if the delay is measured and stated. Where a low-pass
filter of the torque (one pole, or a Butterworth filter with two or four) explains it, twist and rate are filtered
likewise. Where a viscoelastic shaft or joint explains it (a Zener solid, stiffer in fast oscillations), k and c are
those of slow oscillations.

Assumes no free play, constant k and c, one shear modulus (79.3 +- 0.8 GPa, steel, where none is given).
Sources: SAE 2017-01-1574, equation (26); any text on torsion of round bars for J.
"""
