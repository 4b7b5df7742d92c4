"""Springs, dampers and tire stiffness from driving over a bump: half car, both axles, wheels that leave the road.

Heave z and pitch th (nose-up) of the sprung body, heights zf, zr of the axles, all relative to rest::

    Ms z'' = -Sf - Sr              Is th'' = -lf Sf + lr Sr
    mf zf'' = Sf + Fzf - F0f       mr zr'' = Sr + Fzr - F0r
    Sf = Kf e + Cf e',  e = z + lf th - zf        (rear: z - lr th - zr)
    Fz = max(0, F0 + Kt (u - zt))                 no tension: the wheel lifts off

The road u is a bump, which the rear axle reaches one wheelbase after the front axle: haversine
A/2 (1 - cos(2 pi x/lambda)), half sine A sin(pi x/lambda), or a measured profile. Kf, Kr (N/m) and Cf, Cr (N s/m) are
rates at the wheels, Kt (N/m) is the stiffness of the tires, each the sum of left and right.

Simulated and measured axle loads, and vertical acceleration and pitch rate where they are logged, are compared over all
runs at once, each channel weighted by its noise (or the loads by the setting ``rear_weight``). Each run has as unknowns
the position of the bump, scale and slope of the speed, the body's motion before the bump and the sensors' zeros: a
millimeter of position changes the load by some hundred newtons. A matched filter locates the bump in a log;
``distance_front`` selects it where a log contains several; the response to another bump is left out.

The half car needs the pitch inertia of the sprung body about its center. ``pitch_inertia``, as `vdyn cg` estimates it,
is that of the whole car with wheels that do not pitch. It includes the axles' fore-and-aft motion against the body:
I = Is + mu M/Ms (h - r)^2, mu the unsprung mass, h and r the heights of the center of gravity and of the wheels (some
0.7 % of I). State ``sprung_pitch_inertia`` where that is known.

A bump that does not excite wheel hop does not determine Kt, only the ratio of Kt to the unsprung mass.

``manoeuvre: drop`` needs no bump: a quarter or half car is released above its rest position, and heights of body and
wheels are logged (``body_height_front``, ``wheel_height_front`` ...). It oscillates from unknown heights and rates::

    Ms z'' = -S,   mu y'' = S + Fz - F0,   S = K (z - y) + C (z' - y'),   Fz = max(0, F0 - Kt y)

Heights alone determine only the ratios of K, C and Kt to the masses, which must be known. Dry friction, which ends a
weakly damped oscillation, is a candidate of the diagnosis; ``diagnose: {extend: [suspension_friction]}`` includes it in
any case.

Assumes loads between tires and road (setting ``load_sensor: hub`` for sensors in the wheel, which do not measure the
inertia of the parts outside of them), linear springs and dampers, and tires with point contact; wheels that roll over
the bump as circles, with the stated or a usual ``wheel_radius``, are a candidate of the diagnosis.
Source: SAE 2017-01-1574, equations (8) to (18), with lift-off added.
"""
