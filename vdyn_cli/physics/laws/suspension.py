"""Springs and dampers between the body and an axle, at the wheels."""

from __future__ import annotations

from vdyn_cli.engine.model_builder import Number, Signals


def spring(s: Signals) -> Number:
    """Force of an axle's springs relative to rest, N; positive in extension, when it pulls the body down.

    F = K x

    Parameters
    ----------
    s : stiffness N/m (both wheels of the axle), stroke m (extension from rest, compression negative),
        share (of the axle that this call represents: 1, or 1/2 for one wheel with half the axle's stiffness).

    Notes
    -----
    Assumes a constant rate: no bump stop, no progression. Source: doi:10.4271/2017-01-1574, equations (8)-(11).
    """
    return s.stiffness * s.stroke


def damper(s: Signals) -> Number:
    """Force of an axle's dampers, N; positive in rebound, when it pulls the body down.

    F = C x'

    Parameters
    ----------
    s : damping N s/m (both wheels of the axle), stroke_rate m/s (positive in rebound),
        share (of the axle, as for ``spring``).

    Notes
    -----
    Assumes the same rate in rebound and compression, and no dry friction.
    Source: doi:10.4271/2017-01-1574, equations (8)-(11).
    """
    return s.damping * s.stroke_rate


def of_axle(s: Signals, balance: Number) -> Number:
    """Factor of one axle where front and rear differ: 1 + b in front, 1 - b at the rear, with balance b.

    Parameters
    ----------
    s : place of the call ("_front", "_rl"); ``alone`` in a model of one axle, where no balance exists and the factor
        is 1. balance : b = (front - rear)/(front + rear).
    """
    if getattr(s, "alone", False):
        return 1.0
    return 1.0 - balance if s.place.startswith("_r") else 1.0 + balance
