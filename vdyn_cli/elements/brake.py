"""The brakes' force on the road."""

from __future__ import annotations

from vdyn_cli.elements.rolling import STANDSTILL
from vdyn_cli.engine.bench import Number, Signals
from vdyn_cli.engine.maths import tanh


def brake(s: Signals) -> Number:
    """Brake force, N, against the motion.

    Parameters
    ----------
    s : brake_force N (0 where nobody brakes: pads that drag are an effect on this law), speed m/s.
    """
    return s.brake_force * tanh(s.speed / STANDSTILL)
