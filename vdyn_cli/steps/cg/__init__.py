"""Center of gravity and pitch inertia from accelerate-and-brake runs: height, distance to the axles.

Moments of the whole car about the rear contact, nose-up positive::

    L Ff - lr (Ff + Fr) + (M h + J) a + Fd hd = I th'',      a = a_antenna + (H - h) th''

with axle loads Ff, Fr; antenna at height H; drag Fd at height hd; J = sum of wheel inertia over radius (accelerating
wheels also unload the front axle; where it is not given, 9 +- 3 mm times M is assumed). Without rear loads, Fr = M g -
Ff, which is equation (5) of SAE 2017-01-1574, plus the heave that pitching causes on springs and dampers whose centers
lie ahead of or behind the center of gravity, by two levers of 0 +- 0.3 m. The contact force of a rolling tire acts frr
r ahead of its hub, that of a tire at rest directly below it. A speed that is not logged is integrated from the
acceleration.

Where the unsprung masses m of both axles are given, the axles move vertically on the tires, z'' = -F''/Kt: Ff and Fr
are then the forces on the body, F - m (g + z''), and lr is the distance to the body's center. Without these masses the
pitch inertia is up to 1 % too high or too low.

The body turns about an axis e below its center: M g e th is added for the pitch angle th. The prior
of e is centered between zero and the height of a usual center above the hubs, with the distance to either as standard
deviation; the runs determine it better.

The loads at rest determine lr, the load transfer per acceleration M h, and the load transfer per pitch acceleration
I - (M h + J) (H - h). The last two have opposite signs: a pitch rate of the wrong sign turns I into
2 (M h + J)(H - h) - I without any misfit, so the sign is checked against physics (a car squats when it accelerates).

The balance is integrated over 20 ms, so the pitch rate is never differentiated; noise in loads, acceleration and pitch
rate all enters the balance (total least squares). Each run has its own zero of the load cells, within ``load_zero``.
An uneven road moves the axles: colored noise with the spectrum of the road's slope. Without rear loads, it is the heave
of the body that is colored noise of the front load. Both are estimated from the residual of the balance, and then the
instruments of the fit are the parts of the channels that follow from the acceleration.

Assumes a flat road, no lift, rigid body; a road grade acts like an accelerometer offset. Source: SAE 2017-01-1574,
equations (5) to (7).
"""
