"""Free profiles: a force or torque of any shape over one signal, for what no candidate effect explains."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.effects import Effect, effect
from vdyn_cli.engine.maths import fabs, fmax, fmin
from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.quantities.quantity import Quantity

KNOTS = 8  # shapes of a quarter of the span and longer are followed


def profile(name: str, on: str, signal: str, span: Sequence[float], size: float, unit: str) -> Effect:
    """An addition to a law that is free over one of its signals: hats on equal knots, constant beyond the ends.

    F = law + share sum_k c_k hat_k(signal)

    Parameters
    ----------
    name : of the effect; the unknowns are ``<name>_1`` and so on.
    on, signal : the law, and the signal that it is called with.
    span : of the signal, first and last of ``KNOTS`` knots; or all knots, equally spaced.
    size : plausible size of the coefficients, in ``unit``.

    Returns
    -------
    The effect. A law that acts on a part of the vehicle states ``share``, the part's share of the addition.
    """
    at = np.linspace(span[0], span[-1], KNOTS if len(span) == 2 else len(span))
    width = float(at[1] - at[0])
    names = [f"{name}_{k + 1}" for k in range(at.size)]
    unknowns = tuple(
        Quantity(n, unit, f"free addition near {signal} {x:.3g}", "", -size, size)
        for n, x in zip(names, at, strict=True)
    )

    def law(element: Law, s: Signals, q: Signals) -> Number:
        """What is left over one signal, in no particular shape."""
        x = fmin(fmax(getattr(s, signal), float(at[0])), float(at[-1]))
        total: Number = 0.0
        for unknown, knot in zip(names, at.tolist(), strict=True):
            total = total + getattr(q, unknown) * fmax(1.0 - fabs(x - knot) / width, 0.0)
        return element(s) + s.__dict__.get("share", 1.0) * total

    law.__name__ = name
    return effect(on=on, unknowns=unknowns, reference="piecewise linear, no physics assumed")(law)


def span_of(values: Sequence[np.ndarray], least: float = 0.0) -> tuple[float, float]:
    """First and last knot for a signal: all but its outermost hundredths, ``least`` apart at the least."""
    every = np.concatenate([np.asarray(v)[np.isfinite(v)] for v in values])
    low, high = (float(v) for v in np.quantile(every, [0.01, 0.99]))
    return (low, high) if high - low > least else (low, low + max(least, 1e-6))
