"""Half-shaft stiffness from the drawing, a bar hung on the shaft, or a tip-in log; damping from the log.

A torsion bar's stiffness is k = G J / L with J = pi (do^4 - di^4) / 32; sections in series add their compliances::

    1/k = sum(Li / (G Ji))          solid, hollow or tapered sections

Hung up by one end with a bar of known inertia across the other, the shaft swings with T = 2 pi sqrt(J / k). In a log of
torque and twist (or of the speeds of both ends, whose difference is the twist's rate) it obeys::

    T = k phi + c phi' + zero

Encoders at both ends give phi = motor_angle / gear_ratio - wheel_angle, their zeros being where the torque is zero; the
rate is then that of the fitted twist, and no angle is differentiated.

Noise is in every channel; the readings are adjusted, each by its own noise, until this law holds and the twist is the
integral of its rate. Plain least squares would lose some per cent of c.

The log's stiffness includes all parts between its two sensors, also joints and splines, as in the car; where there
is a log, its value is published. If it is softer than the drawing, the compliance in series is given. A plain
half-shaft of 24 to 28 mm is 2 900 to 8 000 N m/rad; the paper's values are three to five times that.

Assumes no free play, constant k and c, one shear modulus (79.3 +- 0.8 GPa, steel, where none is given).
Sources: SAE 2017-01-1574, equation (26); any text on torsion of round bars for J.
"""
