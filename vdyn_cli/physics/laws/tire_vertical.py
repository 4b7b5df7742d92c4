"""The tires of an axle as a spring and damper between wheel and road that transmit no tension."""

from __future__ import annotations

from vdyn_cli.engine.maths import fmax
from vdyn_cli.engine.model_builder import Number, Signals


def tire_vertical(s: Signals) -> Number:
    """Load between an axle's tires and the road, N, never below zero.

    Fz = max(0, F0 + Kt (u - z) + Ct (u' - z'))

    Parameters
    ----------
    s : static_load N (F0, at rest), stiffness N/m and damping N s/m of both tires, compression m (u - z: road height
        minus wheel height, relative to rest), compression_rate m/s, share (of the axle's two tires that this call
        represents: 1, or 1/2 for one wheel with half of the axle's values), rear (1 for the rear axle, 0 for the front
        one; absent in a model of one axle).

    Notes
    -----
    Assumes a linear tire with point contact. Without the limit at zero, a tire behind the paper's bump (7 cm high,
    48 cm long, 15 km/h) would pull with several kN; in fact the wheel leaves the road.
    Source: doi:10.4271/2017-01-1574, equations (14) and (15), with lift-off added.
    """
    return fmax(s.static_load + s.stiffness * s.compression + s.damping * s.compression_rate, 0.0)
