"""The tyre's force over slip as a model: slip and load in, longitudinal force out."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, pi, tan

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.elements.tire import tire
from vdyn_cli.engine.bench import Bench, Signals
from vdyn_cli.engine.model import Model
from vdyn_cli.fit import white_level
from vdyn_cli.log import Log

Array = NDArray[np.float64]

LONGEST = 40  # samples averaged into one bin
WIDEST = 0.015  # slip over which a bin may extend: a fifth of the width of a stiff tyre's knee


def _assemble(e: Bench, u: Signals) -> None:
    p = e.p
    slip = e("slip", value=(1 + u.slip) * (1 + p.radius_error) - 1)
    load = e("force_z", value=u.load)
    force = e(tire, slip=slip, load=load, tire_B=p.tire_B, tire_C=p.tire_C, tire_D=p.tire_D, tire_E=p.tire_E)
    e.sensor("force_x", force, 0.0)


TIRE_CURVE = Model("tire_curve", _assemble, ("tire_B", "tire_C", "tire_D", "tire_E", "radius_error"), ("slip", "load"))


def peak_slip(b: float, c: float, e: float) -> float:
    """Slip at which the magic formula is largest: B s - E (B s - atan(B s)) = tan(pi / 2 C); infinite for C <= 1."""
    if c <= 1:
        return float("inf")
    target = tan(pi / (2 * c))
    low, high = 0.0, 1.0

    def inner(x: float) -> float:
        return x - e * (x - atan(x))

    while inner(high) < target:
        high *= 2
        if high > 1e6:
            return float("inf")
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if inner(middle) < target else (low, middle)
    return (low + high) / 2 / b


@dataclass(frozen=True)
class Bins:
    """A slip sweep averaged over short stretches of time, in which slip moves little.

    Parameters
    ----------
    run : the log's name; time, slip, load, force : (n,) means of each bin.
    spread : (n,), variance of the true slip inside the bin, from its drift.
    slip_variance, force_variance, load_variance : (n,), of the bin's means, from the white noise of the channels.
    """

    run: str
    time: Array
    slip: Array
    load: Array
    force: Array
    spread: Array
    slip_variance: Array
    force_variance: Array
    load_variance: Array


def bin_sweep(log: Log) -> Bins:
    """Average a log with ``slip``, ``force_x`` and ``force_z`` so that the noise in slip falls.

    Noise in the slip itself pulls a least-squares fit of the curve flat; averaging m samples takes away all but 1/m
    of that, the fit's errors-in-variables residual the rest.
    """
    good = np.isfinite(log["slip"]) & np.isfinite(log["force_x"]) & np.isfinite(log["force_z"])
    time, slip, force, load = (log[n][good] for n in ("time", "slip", "force_x", "force_z"))
    edges = _edges(slip)
    count = np.diff(edges)

    def mean(values: Array) -> Array:
        return np.asarray(np.add.reduceat(values, edges[:-1]) / count)

    centre = mean(slip)
    middle = mean(time)
    drift = np.gradient(centre, middle) * (mean(np.concatenate([np.diff(time), [0.0]])) * count)
    return Bins(
        log.name,
        middle,
        centre,
        mean(load),
        mean(force),
        drift**2 / 12,
        white_level(slip, time) ** 2 / count,
        white_level(force, time) ** 2 / count,
        white_level(load, time) ** 2 / count,
    )


def _edges(slip: Array) -> NDArray[np.int64]:
    """Where bins begin and end: as long as allowed, and shorter where the smoothed slip moves fast."""
    width = min(15, slip.size)
    smooth = np.convolve(np.pad(slip, width // 2, mode="edge"), np.ones(width) / width, mode="valid")[: slip.size]
    steps = np.abs(np.diff(smooth, append=smooth[-1]))
    share = np.maximum(steps / WIDEST, 1 / LONGEST)
    label = np.floor(np.cumsum(share) + 1e-9).astype(np.int64)
    starts = np.flatnonzero(np.diff(label, prepend=label[0] - 1))
    return np.concatenate([starts, [slip.size]]).astype(np.int64)
