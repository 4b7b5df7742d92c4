"""Brakes, engaged drivelines and throttles in the logs, which no channel shows: found by what the runs agree on.

All stretches share one law of deceleration over speed, out and back apart by what a slope does. Parts in which the car
slows or gains more than that are cut off, and a run of which too little is left is rejected.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.bins import cut
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.selection import (
    FEWEST_SAMPLES,
    LEAST_COVERED,
    Array,
    Mask,
    Rejected,
    Stretch,
    groups,
)

LOOK = 2.0  # s, over which a deceleration is taken
EXCESS = 0.15  # m/s^2 beyond the other runs: a brake or a driveline; gusts reach 0.02, sensors 0.03
EXCESS_ALONE = 0.3  # m/s^2, where too few runs of a direction tell slope from brake
GROSS = 3.0  # times that much counts at one look; otherwise it takes two on end
ENGAGED = 0.25  # share of the usual deceleration by which a whole run may exceed it, and
ENGAGED_LEAST = 0.06  # m/s^2, at least


@dataclass(frozen=True)
class _Slowing:
    """One stretch's deceleration without what is known to cause it: (b,) s, m/s, m/s^2."""

    time: Array
    speed: Array
    slowing: Array


def without_braking(
    stretches: Sequence[Stretch], known: Sequence[Array], directions: Sequence[str | None], window: float
) -> tuple[list[Stretch], list[Rejected]]:
    """Cut off or reject what slows down, or gains, more than the stretches agree on.

    Parameters
    ----------
    known : for each stretch (n,) m/s^2, the acceleration that drive and slope give.
    directions : of each stretch; a slope shifts all runs of one direction alike.
    window : m/s, span of speed of which at least half must be left.

    Notes
    -----
    The common law is c(direction) + k V^2 with least absolute deviations, which half of the points cannot bend.
    """
    seen = [_slowing(s, k) for s, k in zip(stretches, known, strict=True)]
    excess, usual, limits = _beyond_common(seen, directions)
    kept, left = [], []
    for each in zip(stretches, seen, excess, usual, limits, strict=True):
        stretch, cut_off = _judged(*each, window)
        kept += [stretch] if stretch else []
        left += [cut_off] if cut_off else []
    return kept, left


def without_odd_parts(
    stretches: Sequence[Stretch], known: Sequence[Array], directions: Sequence[str | None], shortest: float
) -> tuple[list[Stretch], list[Rejected]]:
    """Take out of driven stretches what slows down, or gains, more than the known drive and the common law allow.

    Parameters
    ----------
    known, directions : as in ``without_braking``.
    shortest : s, of what is kept.
    """
    seen = [_slowing(s, k) for s, k in zip(stretches, known, strict=True)]
    excess, _, limits = _beyond_common(seen, directions)
    kept, left = [], []
    for stretch, see, more, limit in zip(stretches, seen, excess, limits, strict=True):
        at = _held(more, limit)
        if not at.size:
            kept.append(stretch)
            continue
        odd, time = _marked(stretch, see, at), stretch.log.time
        left.append(Rejected(stretch.name, float(time[odd][0]), float(time[odd][-1]), _why(see, more, int(at[0]))))
        kept += _between(stretch, odd, shortest)
    return kept, left


def _marked(stretch: Stretch, see: _Slowing, at: NDArray[np.int64]) -> Mask:
    """(n,), the rows about the odd looks."""
    time = stretch.log.time
    marked = [(time > see.time[k] - LOOK) & (time < see.time[k + 1] + LOOK) for k in at]
    return np.asarray(np.any(marked, axis=0))


def _between(stretch: Stretch, odd: Mask, shortest: float) -> list[Stretch]:
    """What is left between odd rows, as windows of one stretch."""
    time = stretch.log.time
    label = np.r_[0, np.cumsum((odd[1:] != odd[:-1]) | (stretch.part[1:] != stretch.part[:-1]))]
    good = np.zeros(time.size, dtype=bool)
    for a, b in groups(label):
        good[a : b + 1] = not odd[a] and time[b] - time[a] >= shortest
    return [replace(stretch, part=label).rows(good)] if good.any() else []


def _slowing(stretch: Stretch, known: Array) -> _Slowing:
    bins = cut(stretch.log.time, LOOK, stretch.part)
    speed, time = bins.mean(stretch.log["speed"]), bins.time
    gained = np.diff(speed) / np.diff(time)
    pushed = bins.mean(known)
    return _Slowing(
        0.5 * (time[1:] + time[:-1]), 0.5 * (speed[1:] + speed[:-1]), 0.5 * (pushed[1:] + pushed[:-1]) - gained
    )


def _beyond_common(
    seen: Sequence[_Slowing], directions: Sequence[str | None]
) -> tuple[list[Array], list[float], list[float]]:
    """Excess (b,) over the common law, the usual deceleration and the limit of each stretch."""
    counts = {d: sum(x == d for x in directions) for d in directions}
    apart = all(n >= 3 for n in counts.values())
    ways = sorted({str(d) for d in directions}) if apart else [""]
    belongs = [ways.index(str(d)) if apart else 0 for d in directions]
    design = np.concatenate([_design(g, len(ways), s.speed) for g, s in zip(belongs, seen, strict=True)])
    law = _least_absolute(design, np.concatenate([s.slowing for s in seen]))
    excess: list[Array] = []
    usual: list[float] = []
    limits: list[float] = []
    for g, s in zip(belongs, seen, strict=True):
        common = law[g] + law[-1] * s.speed**2
        excess.append(s.slowing - common)
        usual.append(float(np.mean(common)))
        limits.append(EXCESS if counts[directions[len(usual) - 1]] >= 3 else EXCESS_ALONE)
    return excess, usual, limits


def _design(group: int, groups: int, speed: Array) -> Array:
    """Columns of c(direction) and k V^2."""
    columns = np.zeros((speed.size, groups + 1))
    columns[:, group], columns[:, -1] = 1.0, speed**2
    return columns


def _least_absolute(design: Array, values: Array, rounds: int = 30) -> Array:
    """Coefficients of least absolute deviations, by reweighting."""
    weight = np.ones(values.size)
    for _ in range(rounds):
        root = np.sqrt(weight)
        law = np.linalg.lstsq(design * root[:, None], values * root, rcond=None)[0]
        weight = 1.0 / np.maximum(np.abs(values - design @ law), 1e-3)
    return np.asarray(law)


def _judged(
    stretch: Stretch, see: _Slowing, excess: Array, usual: float, limit: float, window: float
) -> tuple[Stretch | None, Rejected | None]:
    """What is left of a stretch, and what was taken from it."""
    log = stretch.log
    begin, finish = float(log.time[0]), float(log.time[-1])
    middle = float(np.median(excess))
    if middle > max(ENGAGED_LEAST, ENGAGED * usual):
        why = f"slows by {middle:.2f} m/s^2 more than the other runs throughout: engaged driveline or dragging brake?"
        return None, Rejected(stretch.name, begin, finish, why)
    held = _held(excess, limit)
    if not held.size:
        return stretch, None
    at, why = int(held[0]), _why(see, excess, int(held[0]))
    until, since = float(see.time[at]) - LOOK, float(see.time[held[-1] + 1]) + LOOK
    parts = ((log.time < until, until, finish), (log.time > since, begin, since))
    best, lost_from, lost_to = max(parts, key=lambda p: _fall(log, p[0]))
    if _fall(log, best) >= LEAST_COVERED * window:
        return stretch.rows(best), Rejected(stretch.name, lost_from, lost_to, why)
    return None, Rejected(stretch.name, begin, finish, why)


def _held(excess: Array, limit: float) -> NDArray[np.int64]:
    """Where the excess is beyond the limit for two looks on end, or far beyond it for one: the first of the two."""
    odd, gross = np.abs(excess) > limit, np.abs(excess) > GROSS * limit
    return np.flatnonzero((odd[1:] & odd[:-1]) | gross[1:] | gross[:-1])


def _why(see: _Slowing, excess: Array, at: int) -> str:
    what, cause = ("slows by", "brake or driveline?") if excess[at] > 0 else ("is driven by", "throttle?")
    return (
        f"{what} {abs(excess[at]):.2f} m/s^2 more than the other runs at {see.time[at]:.0f} s, "
        f"{3.6 * see.speed[at]:.0f} km/h: {cause}"
    )


def _fall(log: Log, keep: Mask) -> float:
    """m/s, over which these rows reach."""
    return float(np.ptp(log["speed"][keep])) if keep.sum() >= FEWEST_SAMPLES else 0.0
