"""Heave of a sprung body caused by its pitch."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array

# Heave of a passenger car's body: 1 to 1.5 Hz, damping ratio 0.2 to 0.4 (Gillespie, Fundamentals of Vehicle Dynamics,
# 1992). For a body of 2.3 Hz, both levers together still describe half of the heave that pitching causes.
FREQUENCY, DAMPING = 1.3, 0.3  # Hz, -


def pitch_heave(time: Array, pitch_rate: Array) -> tuple[Array, Array]:
    """Heave acceleration (n,) per meter of lever, by the springs and by the dampers, m/s^2 per m.

    z'' + 2 D w z' + w^2 z = w^2 e_k th + 2 D w e_c th'

    The levers e_k = (lr kr - lf kf)/(kf + kr), and e_c likewise, are the distances of the centers of springs and
    dampers behind the center of gravity.

    Parameters
    ----------
    time : (n,), s. pitch_rate : (n,), rad/s, nose-up.

    Assumes that the body is at rest on its springs at the start, and that the samples are nearly equidistant.
    """
    from scipy.signal import bilinear, lfilter

    w = 2 * np.pi * FREQUENCY
    swing = [1.0, 2 * DAMPING * w, w**2]
    per_second = 1.0 / float(np.median(np.diff(time)))
    sprung, damped = (
        np.asarray(lfilter(*bilinear(drive, swing, per_second), pitch_rate))
        for drive in ([w**2, 0.0], [2 * DAMPING * w, 0.0, 0.0])
    )
    return sprung, damped
