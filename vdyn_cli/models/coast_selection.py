"""Which parts of the logs show the road load, and which do not, with the reason.

A coast is taken from the last time above the upper speed to the first time below the lower one. Parts in which the
car slows or gains more than the other runs allow (brake, engaged driveline, throttle) are cut off; a run of which too
little is left is rejected. On an open road the stretches driven with torque are taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.log import Log
from vdyn_cli.models.bins import cut

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FEWEST_SAMPLES = 20
MOST_MISSING = 0.2  # of a stretch's rows
LEAST_COVERED = 0.5  # of the speed window
LEAST_FALL = 1.0  # m/s
SMOOTH = 1.0  # s, over which the speed is averaged to find where it passes a limit
LOOK = 2.0  # s, over which a deceleration is taken
EXCESS = 0.15  # m/s^2 beyond the other runs: a brake or a driveline; gusts reach 0.02, sensors 0.03
EXCESS_ALONE = 0.3  # m/s^2, where too few runs of a direction tell slope from brake
GROSS = 3.0  # times that much counts at one look; otherwise it takes two on end
ENGAGED = 0.25  # share of the usual deceleration by which a whole run may exceed it, and
ENGAGED_LEAST = 0.06  # m/s^2, at least
MARGIN = 1.0  # s left out where torque comes and goes: a brake may still be on, the driveline winds up
WIND_LIMIT = 16 / 3.6  # m/s, mean wind of a run; after SAE J1263


@dataclass(frozen=True)
class Stretch:
    """A part of a run that is fitted.

    Parameters
    ----------
    run : index of the run in the description; ``name`` is its log's, with the times where there are several parts.
    log : its rows: speed is finite in each.
    part : (n,), label of the window that each row belongs to.
    """

    run: int
    name: str
    log: Log
    part: NDArray[np.int64]

    def rows(self, keep: Mask) -> Stretch:
        return replace(self, log=rows(self.log, keep), part=self.part[keep])


@dataclass(frozen=True)
class Rejected:
    """What was left out of a run, s of the log's clock, and why."""

    run: str
    start: float
    stop: float
    why: str


def rows(log: Log, keep: Mask) -> Log:
    """The log's rows where ``keep``."""
    return Log(log.name, log.time[keep], {k: v[keep] for k, v in log.channels.items()}, log.findings)


def coast(run: int, log: Log, window: tuple[float, float] | None, shortest: float) -> Stretch | Rejected:
    """The part of a log in which it coasts through the window (upper, lower speed in m/s; None: all of the fall)."""
    speed, start, stop = log["speed"], float(log.time[0]), float(log.time[-1])
    there = np.isfinite(speed)
    if there.sum() < FEWEST_SAMPLES:
        return Rejected(log.name, start, stop, f"only {there.sum()} samples hold a speed")
    whole = rows(log, there)
    smooth = _smoothed(whole)
    upper, lower = window or (float(smooth.max()), float(smooth.min()))
    top, end = _passage(smooth, upper, lower)
    if window is None and upper - lower < LEAST_FALL:
        why = f"the speed falls by less than {LEAST_FALL:g} m/s: this is no coast"
        return Rejected(log.name, start, stop, why)
    covered = (min(upper, float(smooth[top])) - max(lower, float(smooth[end]))) / (upper - lower)
    if covered < LEAST_COVERED:
        reach = f"{3.6 * smooth[top]:.1f} to {3.6 * smooth[end]:.1f} km/h"
        wanted = f"{3.6 * upper:.1f} to {3.6 * lower:.1f} km/h"
        return Rejected(log.name, start, stop, f"coasts from {reach}, less than half of the speed window {wanted}")
    begin, finish = float(whole.time[top]), float(whole.time[end])
    if finish - begin < shortest:
        return Rejected(log.name, begin, finish, f"lasts {finish - begin:.1f} s, shorter than {shortest:g} s")
    missing = 1 - (end - top + 1) / max(int(np.sum((log.time >= begin) & (log.time <= finish))), 1)
    if missing > MOST_MISSING:
        return Rejected(log.name, begin, finish, f"the speed is missing in {missing:.0%} of the rows")
    part = rows(whole, (whole.time >= begin) & (whole.time <= finish))
    return Stretch(run, log.name, part, np.zeros(part.time.size, dtype=np.int64))


def _smoothed(log: Log) -> Array:
    """The speed averaged over about a second, so that noise does not pass a limit before the car does."""
    bins = cut(log.time, SMOOTH)
    return np.asarray(np.interp(log.time, bins.time, bins.mean(log["speed"])))


def _passage(smooth: Array, upper: float, lower: float) -> tuple[int, int]:
    """First and last index of the fall from ``upper`` to ``lower``, or of what there is of it."""
    peak = int(np.argmax(smooth))
    below = np.flatnonzero(smooth[peak:] <= lower)
    end = peak + int(below[0]) if below.size else peak + int(np.argmin(smooth[peak:]))
    above = np.flatnonzero(smooth[: end + 1] >= upper)
    return (int(above[-1]) if above.size else peak), end


def driven(
    run: int, log: Log, demand: Array | None, slowest: float, shortest: float
) -> tuple[Stretch | None, list[Rejected]]:
    """The stretches of a log faster than ``slowest`` m/s and, where ``demand`` (n,) is given, with drive demanded.

    Neither throttle nor brake is seen directly: while torque or force is above zero nobody brakes.
    """
    good = np.isfinite(log["speed"]) & (log["speed"] > slowest)
    if demand is not None:
        good &= demand > 0
    step = float(np.median(np.diff(log.time)))
    joined = good[1:] & good[:-1] & (np.diff(log.time) < 5 * step)
    label = np.r_[0, np.cumsum(~joined)]
    keep, left = np.zeros(good.size, dtype=bool), []
    for a, b in _groups(label):
        if not good[a]:
            continue
        begin, finish = float(log.time[a]), float(log.time[b])
        margin = MARGIN if demand is not None else 0.0
        inside = slice(*np.searchsorted(log.time, [begin + margin, np.nextafter(finish - margin, np.inf)]))
        if finish - begin - 2 * margin >= shortest and inside.stop - inside.start >= FEWEST_SAMPLES:
            keep[inside] = True
        else:
            left.append(Rejected(log.name, begin, finish, f"shorter than {shortest:g} s"))
    if not keep.any():
        return None, left
    return Stretch(run, log.name, rows(log, keep), label[keep]), left


def _groups(label: NDArray[np.int64]) -> list[tuple[int, int]]:
    begins = np.flatnonzero(np.r_[True, label[1:] != label[:-1]])
    return list(zip(begins.tolist(), (np.r_[begins[1:], label.size] - 1).tolist(), strict=True))


def split(stretch: Stretch) -> list[Stretch]:
    """One stretch for each of its windows, named by their times."""
    groups = _groups(stretch.part)
    if len(groups) == 1:
        return [stretch]
    found = []
    for a, b in groups:
        one = stretch.rows((np.arange(stretch.part.size) >= a) & (np.arange(stretch.part.size) <= b))
        found.append(replace(one, name=f"{stretch.name}, {one.log.time[0]:.0f} to {one.log.time[-1]:.0f} s"))
    return found


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
    groups = sorted({str(d) for d in directions}) if apart else [""]
    belongs = [groups.index(str(d)) if apart else 0 for d in directions]
    design = np.concatenate([_design(g, len(groups), s.speed) for g, s in zip(belongs, seen, strict=True)])
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
    odd, gross = np.abs(excess) > limit, np.abs(excess) > GROSS * limit
    held = np.flatnonzero((odd[1:] & odd[:-1]) | gross[1:] | gross[:-1])
    if not held.size:
        return stretch, None
    at = int(held[0])
    what, cause = ("slows by", "brake or driveline?") if excess[at] > 0 else ("is driven by", "throttle?")
    why = (
        f"{what} {abs(excess[at]):.2f} m/s^2 more than the other runs at {see.time[at]:.0f} s, "
        f"{3.6 * see.speed[at]:.0f} km/h: {cause}"
    )
    until, since = float(see.time[at]) - LOOK, float(see.time[held[-1] + 1]) + LOOK
    parts = ((log.time < until, until, finish), (log.time > since, begin, since))
    best, lost_from, lost_to = max(parts, key=lambda p: _fall(log, p[0]))
    if _fall(log, best) >= LEAST_COVERED * window:
        return stretch.rows(best), Rejected(stretch.name, lost_from, lost_to, why)
    return None, Rejected(stretch.name, begin, finish, why)


def _fall(log: Log, keep: Mask) -> float:
    """m/s, over which these rows reach."""
    return float(np.ptp(log["speed"][keep])) if keep.sum() >= FEWEST_SAMPLES else 0.0
