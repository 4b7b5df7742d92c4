"""Channels whose sign contradicts physics: similarity of two signals, and the finding for the user."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log

REMEDY = "add 'sign: -1' to its channel"
TARED = 0.1  # of the largest load: the median of a sensor that was set to zero under the car is smaller


def cosine(a: Array, b: Array) -> float:
    """a . b / (|a| |b|) of two signals (n,), over samples where both are finite; 0 where either is zero throughout."""
    good = np.isfinite(a) & np.isfinite(b)
    size = float(np.linalg.norm(a[good]) * np.linalg.norm(b[good]))
    return float(a[good] @ b[good]) / size if size > 0 else 0.0


@dataclass(frozen=True)
class WrongSign(Finding):
    """The finding of a channel whose sign contradicts physics.

    Parameters
    ----------
    log, channel : their names.
    """

    log: str = field(default="", compare=False)
    channel: str = field(default="", compare=False)


def negative_loads(log: Log) -> list[Finding]:
    """Findings on vertical loads with a negative median: of wheels where these are mapped, else of axles."""
    loads = {n: log[n] for n in log.channels if n.endswith("_load") and np.isfinite(log[n]).any()}
    medians = {n: float(np.nanmedian(load)) for n, load in loads.items()}
    low = {n: value for n, value in medians.items() if value < -TARED * float(np.nanmax(np.abs(loads[n])))}
    wheels = {n: value for n, value in low.items() if n.endswith(("_left_load", "_right_load"))}
    what = f"negative {'wheel' if wheels else 'axle'} load: loads must be positive"
    return [wrong_sign(log.name, n, what, f"{value:.0f} N") for n, value in (wheels or low).items()]


def wrong_sign(log: str, channel: str, what: str, got: str = "", remedy: str = REMEDY) -> Finding:
    """The finding of a channel whose sign contradicts physics, with the line of the description that corrects it.

    Parameters
    ----------
    log, channel : their names. what : the contradiction. got : the number that shows it.
    """
    return WrongSign(f"{log}, {channel}", what, got, remedy, log=log, channel=channel)
