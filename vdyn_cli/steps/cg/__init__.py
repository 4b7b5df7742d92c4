"""Center of gravity and pitch inertia from accelerate-and-brake runs: height, distance to the axles.

Moments of the whole car about the rear contact, nose-up positive::

    L Ff - lr (Ff + Fr) + (M h + J) a + Fd hd = I th'',      a = a_antenna + (H - h) th''

with axle loads Ff, Fr; antenna at height H; drag Fd at height hd; J = sum of wheel inertia over radius (wheels that
spin up unload the front axle too; without it, the height is 1 to 2 % too high). Without rear loads, Fr = M g - Ff,
which is the paper's equation (5), plus the heave that pitching causes on springs and dampers whose centers lie ahead of
or behind the center of gravity, by two levers of 0 +- 0.3 m. Rolling resistance pushes a tire that rolls up frr r
ahead of its hub, and one at rest right below it. A speed that is not logged is integrated from the acceleration.

The loads at rest give lr; the load moved per acceleration gives M h; the load moved per pitch acceleration gives
I - (M h + J) (H - h). The last two have opposite signs: a pitch rate of the wrong sign turns I into
2 (M h + J)(H - h) - I without any misfit, so the sign is checked against physics (a car squats when it is driven).

The balance is integrated over 20 ms, so the pitch rate is never differentiated; noise in loads, acceleration and pitch
rate all enters the balance (total least squares). Each run has its own zero of the load cells, within ``load_zero``.
Without rear loads, the heave by an uneven road is colored noise of the front load, estimated from what the balance
leaves, and the unknowns are found by what of the channels follows from the acceleration (instrumental variables).

Assumes a flat road, no lift, rigid body; a road grade acts like an accelerometer offset. Source: SAE 2017-01-1574,
equations (5) to (7).
"""
