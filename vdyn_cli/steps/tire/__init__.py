"""Tire curve from slip sweeps: magic formula B, C, D, E and the stiffness at zero slip.

Friction over slip, Fx/Fz = D sin(C atan(B s - E (B s - atan(B s)))), s = om r / V - 1 (SAE J670); the slope at zero
slip is B C D.

Slip is computed from two noisy speeds. Least squares of the force alone then flattens the curve, because noise in the
slip smears its steep part (B is a third too small at 1 % of slip noise). Here each sweep is averaged into bins in which
slip hardly changes, and each bin is fitted by its distance in slip and in force together, with the noise of every
channel estimated from the channel.

C, D and E need slip beyond the peak. Where no sweep reaches it, only the slope at zero slip is determined and
published, with the uncertainty due to the shapes of passenger car tires (C 1.6 +- 0.15, E 0 +- 0.6).

``tire_C: 1.32 +- 0.1`` under vehicle (or ``settings.priors``) is a prior of the fit, ``tire_C: 1.32`` fixes the value.
Options: ``shifts: true`` fits s + Sh for s and adds Sv to the friction; ``peaks: two`` fits a separate B and D for
braking (s < 0); the slope at zero slip is then that of driving.

Every sweep has its own zero of the longitudinal force, within ``force_zero`` (3 N: a sensor zeroed before each).

Assumes steady state (slow sweeps), pure longitudinal slip, one curve for all loads. An error of 1 % in the wheel
radius is an error of 1 % of slip everywhere; the radius' standard deviation, where given, is propagated.

Sources: Pacejka, Tire and Vehicle Dynamics, 3rd ed., 2012; Buggaveeti et al., SAE 2017-01-1574; Orear, Am. J. Phys. 50
(1982) 912 for errors in both variables.
"""
