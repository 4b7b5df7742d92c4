"""A simulated output at shifted times: the reading of a sensor with a delay or a clock offset."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array


# Seven arrays: three signals with their tangents on one time axis.
def read_at(
    time: Array,
    value: Array,
    rate: Array | None,
    tangents: Array,
    rate_tangents: Array | None,
    shift: Array,
    shift_tangents: Array,
) -> tuple[Array, Array]:
    """An output at time + shift, with its sensitivities, by cubic Hermite interpolation.

    y(t + s): d y(t + s)/d theta = (dy/d theta)(t + s) + y'(t + s) ds/d theta.

    Parameters
    ----------
    time, value, shift : (n,) s, trace, s.
    rate : (n,) time derivative of the trace, or None: slopes are then those of parabolas through three neighbors.
    tangents, rate_tangents, shift_tangents : (n, k) derivatives to the unknowns.

    Returns
    -------
    (n,) and (n, k). Outside the time range the trace is extrapolated linearly if its rate is known, else held constant
    (the slope of a noisy trace does not allow extrapolation).
    """
    if time.size < 2:
        return value, tangents
    known = rate is not None
    slope = rate if rate is not None else _slopes(time, value[:, None])[:, 0]
    moving = shift_tangents.any(axis=0)  # most unknowns do not shift most outputs
    if not shift.any():  # an effect that starts at zero
        carried = tangents.copy()
        carried[:, moving] += slope[:, None] * shift_tangents[:, moving]
        return value, carried
    at = time + shift
    inside = np.clip(at, time[0], time[-1])
    i = np.clip(np.searchsorted(time, inside, side="right") - 1, 0, time.size - 2)
    step = time[i + 1] - time[i]
    a = (inside - time[i]) / step
    value_weights = ((1 + 2 * a) * (1 - a) ** 2, a * (1 - a) ** 2 * step, a * a * (3 - 2 * a), a * a * (a - 1) * step)
    slope_weights = ((6 * a * a - 6 * a) / step, (1 - a) * (1 - 3 * a), (6 * a - 6 * a * a) / step, a * (3 * a - 2))
    beyond = (at - inside) if known else np.zeros_like(at)
    slope_there = (
        slope_weights[0] * value[i]
        + slope_weights[1] * slope[i]
        + slope_weights[2] * value[i + 1]
        + slope_weights[3] * slope[i + 1]
    )
    slope_there = slope_there if known else np.where(at == inside, slope_there, 0.0)
    reading = (
        value_weights[0] * value[i]
        + value_weights[1] * slope[i]
        + value_weights[2] * value[i + 1]
        + value_weights[3] * slope[i + 1]
        + beyond * slope_there
    )
    if not tangents.shape[1]:
        return reading, tangents
    live = tangents.any(axis=0)  # most unknowns do not change most outputs
    if rate_tangents is not None:
        live |= rate_tangents.any(axis=0)
    own = tangents[:, live]
    own_slopes = _slopes(time, own) if rate_tangents is None else rate_tangents[:, live]
    c = [(wk + beyond * dk)[:, None] for wk, dk in zip(value_weights, slope_weights, strict=True)]
    carried = np.zeros_like(tangents)
    carried[:, live] = c[0] * own[i] + c[1] * own_slopes[i] + c[2] * own[i + 1] + c[3] * own_slopes[i + 1]
    carried[:, moving] += slope_there[:, None] * shift_tangents[:, moving]
    return reading, carried


def _slopes(time: Array, values: Array) -> Array:
    """Slopes (n, k) of the parabolas through each sample and its neighbors; one-sided at the ends."""
    step = np.diff(time)[:, None]
    chord = np.diff(values, axis=0) / step
    if step.size == 1:
        return np.vstack([chord, chord])
    middle = (step[1:] * chord[:-1] + step[:-1] * chord[1:]) / (step[1:] + step[:-1])
    return np.vstack([2 * chord[:1] - middle[:1], middle, 2 * chord[-1:] - middle[-1:]])
