"""Free profiles: a force or torque of any shape over one signal, for errors that no candidate effect explains.

A profile is tested as an effect among the candidates, so it has few knots. The finer additions of ``free_part`` show
afterwards in which law the error lies, and its course.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.effects import Effect, effect
from vdyn_cli.engine.maths import fabs, fmax, fmin
from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.quantities.quantity import Quantity

KNOTS = 8  # resolve shapes of a quarter of the span and longer


def profile(name: str, on: str, signal: str, span: Sequence[float], size: float, unit: str) -> Effect:
    """An effect that adds a free function of one signal to a law: hat functions, constant beyond the outer knots.

    F = law + share sum_k c_k hat_k(signal)

    Parameters
    ----------
    name : of the effect; the unknowns are ``<name>_1`` and so on.
    on, signal : the law, and one of its signals.
    span : first and last of ``KNOTS`` knots of the signal; or all knots, equally spaced.
    size : plausible amplitude of the coefficients, in ``unit``.

    Returns
    -------
    The effect. ``share`` is 1 unless the law is called for a part of the vehicle and states its share.
    """
    at = np.linspace(span[0], span[-1], KNOTS if len(span) == 2 else len(span))
    width = float(at[1] - at[0])
    names = [f"{name}_{k + 1}" for k in range(at.size)]
    unknowns = tuple(
        Quantity(n, unit, f"free addition near {signal} {x:.3g}", "", -size, size)
        for n, x in zip(names, at, strict=True)
    )

    def law(element: Law, s: Signals, q: Signals) -> Number:
        """A free function of one signal, for a residual of unknown shape."""
        x = fmin(fmax(getattr(s, signal), float(at[0])), float(at[-1]))
        total: Number = 0.0
        for unknown, knot in zip(names, at.tolist(), strict=True):
            total = total + getattr(q, unknown) * fmax(1.0 - fabs(x - knot) / width, 0.0)
        return element(s) + s.__dict__.get("share", 1.0) * total

    law.__name__ = name
    return effect(on=on, unknowns=unknowns, reference="piecewise linear, no physics assumed")(law)


def span_of(values: Sequence[np.ndarray], least: float) -> tuple[float, float]:
    """First and last knot for a signal: the 1 % and 99 % quantiles of all ``values``, at least ``least`` apart."""
    every = np.concatenate([np.asarray(v)[np.isfinite(v)] for v in values])
    low, high = (float(v) for v in np.quantile(every, [0.01, 0.99]))
    return (low, high) if high - low > least else (low, low + max(least, 1e-6))
