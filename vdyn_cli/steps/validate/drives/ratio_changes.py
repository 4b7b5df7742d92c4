"""Detects drives in which the acceleration per drive torque changes at an instant: a gear, or the gain of the torque.

While the car is driven, its acceleration is a_j T + b + c V^2 + d T', with a = i/(r (M + mr)) constant within each
piece j of the drive. The pieces are those of least squares with a penalty for each (Jackson et al., IEEE Signal
Processing Letters 12 (2005) 105). Hills that are not logged also make pieces, but by forces that do not follow the
torque: pieces with b_j instead of a_j are the alternative. A gearbox returns to the same few ratios, which hills do not
even where they resemble ratios: its pieces are described as well by one ratio for each gear.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.change_points import ratio_pieces
from vdyn_cli.inference.robust_fits import ordinary_least_squares
from vdyn_cli.quantities.arrays import Array, Mask, median_deviation
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.validate.drives.driven_samples import Driven, DrivenSamples, driven_samples
from vdyn_cli.steps.validate.drives.span_averages import SPAN
from vdyn_cli.steps.validate.drives.stated_motion import StatedMotion
from vdyn_cli.steps.validate.policy import VALIDATE_POLICY

SAMPLE_STEP = SPAN / 2  # s between samples
SHORTEST_PIECE = 6  # samples of a piece: 3 s, as long as a gear is held on a road
FEWEST_SAMPLES = 60  # samples of a drive: 30 s
LOCAL = 12  # samples within which the noise of the acceleration is estimated, with a line over the torque of their own
LASTING = 3.0  # samples that have an error in common: spans overlap by a half, and gusts last longer
MOST_SAMPLES = 4000  # samples, above which every second, third, ... is used: the search takes their number squared
LEAST_NOISE = 0.005  # m/s^2: gusts of 0.3 m/s change the drag of a car by as much
PIECE_ROUNDS = 8  # of finding pieces and the coefficients common to all
WIDEST = 12.0  # ratio of the lowest gear to the highest: 4 to 6 in cars, 12 in trucks
FEWEST_RETURNS = 2  # to earlier levels, from which their repetition is tested
MOST_UNREPEATED = 3  # levels, above which a drive must return to some of them
LEAST_KNOWN = 0.7  # share of the driving time in known levels: shifts disturb the rest
HIGH = 0.9  # quantile of the torque that stands for its largest values
MAIN_SHARE = 0.2  # within which a ratio may be the stated one: errors of mass, torque and radius together


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces of a drive with constant acceleration per torque.

    Parameters
    ----------
    time : (p + 1,) s, start of each piece, and the end of the last one. ratio : (p,) 1/(kg m). driven : (p,) s.
    ends : (p,) s, the last driven sample of each piece. certain : whether this drive alone shows that they differ.
    """

    time: Array
    ratio: Array
    driven: Array
    ends: Array
    certain: bool

    def has(self, levels: Array, beside: float = 0.0) -> bool:
        """Whether the car is in one of these ``levels`` of the ratio, (m,) 1/(kg m), for most of the driving time.

        Also of the time that it is not in the ratio ``beside``, which a drive without gears has in most of its time.
        """
        near, other = _among(self.ratio, levels), ~_among(self.ratio, np.array([beside]))
        return all(
            bool(self.driven[near & part].sum() >= LEAST_KNOWN * self.driven[part].sum())
            for part in (np.ones(near.size, dtype=bool), other)
        )


@dataclass(frozen=True, eq=False)
class RatioChange:
    """Parts of a drive with another acceleration per torque than the one that most of the drives have.

    Parameters
    ----------
    other : (n,) mask of their samples. spans : start and end of each, s, with its ratio over the usual one.
    """

    other: Mask
    spans: tuple[tuple[float, float, float], ...] = ()

    def finding(self, log: str) -> tuple[Finding, ...]:
        """A finding on the parts that are left out; empty where there are none."""
        if not self.spans:
            return ()
        shown = [f"{factor:.2f} from {a:.1f} s to {b:.1f} s" for a, b, factor in self.spans[:3]]
        more = f" and in {len(self.spans) - 3} more parts" if len(self.spans) > 3 else ""
        what = (
            f"the acceleration per torque changes suddenly, to {', '.join(shown)}{more} (usual: 1): "
            "another gear, or the gain of a channel changed; these parts are left out"
        )
        remedy = (
            "if gears are shifted, map the torque behind the gearbox with gear_ratio 1 or the final drive's, or "
            "validate each gear with its gear_ratio (from_time, to_time); else check the torque's channel"
        )
        return (Finding(f"{log}, channel 'drive_torque'", what, "", remedy, doubt=True),)


def ratio_changes(drives: Sequence[Driven], stated: StatedMotion | None = None) -> tuple[RatioChange, ...]:
    """The changes of the acceleration per torque in each drive.

    The usual ratio is that of the longest driving time of all drives, among those within ``MAIN_SHARE`` of the stated
    one if there are any; else the nearest to it. Drives without a change have none, whatever their ratio.

    Parameters
    ----------
    drives : of one car. stated : of this car; None where it is not known.
    """
    found = [_pieces(driven_samples(*drive, SAMPLE_STEP), stated) for drive in drives]
    certain = [one for one in found if one is not None and one.certain]
    if not any(one.ratio.size > 1 for one in certain):
        return tuple(RatioChange(np.zeros(time.size, dtype=bool)) for time, _, _ in drives)
    levels, driven = (np.concatenate(v) for v in zip(*((one.ratio, one.driven) for one in certain), strict=True))
    usual = _usual(levels, driven, stated.ratio if stated else None)
    return tuple(_changed(time, one, usual, levels) for (time, _, _), one in zip(drives, found, strict=True))


def _usual(ratios: Array, driven: Array, stated: float | None) -> float:
    """The ratio (1/(kg m)) with the longest driving time, s, near the stated one."""
    near = np.abs(ratios[:, None] / ratios - 1.0) <= VALIDATE_POLICY.unequal_share
    weight = near.T @ driven
    if stated is not None:
        off = np.abs(np.log(np.maximum(ratios / stated, 1e-12)))
        close = off <= np.log1p(MAIN_SHARE)
        weight = np.where(close, weight, 0.0) if close.any() else -off
    return float(ratios[int(np.argmax(weight))])


def _changed(time: Array, found: Pieces | None, usual: float, levels: Array) -> RatioChange:
    """The parts of a drive whose ratio is not the usual one.

    A drive that does not show alone that it has several ratios has them if they are mostly the gears of
    other drives.
    """
    mask, spans = np.zeros(time.size, dtype=bool), list[tuple[float, float, float]]()
    if found is None or found.ratio.size == 1:
        return RatioChange(mask)
    geared = levels.max() > (1.0 + MAIN_SHARE) * levels.min()
    if not (found.certain or (geared and found.has(levels, usual))):
        return RatioChange(mask)
    factor = found.ratio / usual
    for k in np.flatnonzero(np.abs(factor - 1.0) > VALIDATE_POLICY.unequal_share).tolist():
        start = found.ends[k - 1] if k else time[0]
        mask |= (time >= start) & (time <= found.time[k + 1])
        spans.append((float(found.time[k]), float(found.time[k + 1]), float(factor[k])))
    return RatioChange(mask, tuple(spans))


def _among(ratio: Array, levels: Array) -> Mask:
    """Mask (p,) of the ratios (p,) that are near one of the levels (m,)."""
    close = np.abs(ratio[:, None] - levels) <= VALIDATE_POLICY.unequal_share * levels
    return np.asarray(np.any(close, axis=1))


def _pieces(seen: DrivenSamples, stated: StatedMotion | None) -> Pieces | None:
    """The pieces of a drive; None where it is driven for too short a time."""
    step = -(-seen.time.size // MOST_SAMPLES) if seen.time.size else 1
    every = [v[::step] for v in (seen.time, seen.rate, seen.columns[:, 0], seen.columns[:, 1:])]
    held = _held(seen.columns)[::step]
    time, rate, torque, rest = (v[held] for v in every)
    if time.size < FEWEST_SAMPLES:
        return None
    starts, coefficients = _search(rate, torque, rest, _Law(stated, _lasting_variance(rate, torque, rest)))
    ratio, edges = coefficients[: len(starts)], np.array([*starts, time.size])
    levels = _are_levels(ratio)
    returns = levels and _returns(rate, torque, rest, starts, ratio)
    follows = levels and _follow_torque(rate, torque, rest, starts) and _has_levels(*every[1:])
    certain = len(starts) == 1 or returns or follows
    at = np.r_[time[starts], time[-1]]
    return Pieces(at, ratio, SAMPLE_STEP * step * np.diff(edges), time[edges[1:] - 1], certain)


def _has_levels(rate: Array, torque: Array, rest: Array) -> bool:
    """Whether all samples of a drive, without a stated motion, show levels of the ratio.

    Beside the stated motion and without fast changes of the torque, a hill may resemble another ratio.
    """
    starts, coefficients = _search(rate, torque, rest, _Law(None, _lasting_variance(rate, torque, rest)))
    return _are_levels(coefficients[: len(starts)]) and _follow_torque(rate, torque, rest, starts)


def _lasting_variance(rate: Array, torque: Array, rest: Array) -> float:
    return LASTING * _local_variance(rate, torque, rest)


def _held(columns: Array) -> Mask:
    """Mask (n,) of the samples in whose span the torque changes by less than a shift changes it."""
    torque, rate = columns[:, 0], columns[:, 3]
    most = float(np.quantile(torque, HIGH)) if torque.size else 0.0
    return np.asarray(np.abs(rate) * SPAN < VALIDATE_POLICY.held_torque * most)


def _are_levels(ratio: Array) -> bool:
    """Whether ratios (p,) differ, by no more than those of a gearbox, and return to a few levels if there are many."""
    low, high = float(np.min(ratio)), float(np.max(ratio))
    if low <= 0.0 or not 1.0 + VALIDATE_POLICY.unequal_share < high / low < WIDEST:
        return False
    return int(_level_of(ratio).max()) < max(MOST_UNREPEATED, (ratio.size + 1) // 2)


def _level_of(ratio: Array) -> NDArray[np.intp]:
    """Index (p,) of each ratio's level, ascending; levels are further apart than twice ``unequal_share``."""
    order = np.argsort(ratio)
    found = np.zeros(ratio.size, dtype=np.intp)
    found[order[1:]] = np.cumsum(np.diff(np.log(ratio[order])) > 2.0 * VALIDATE_POLICY.unequal_share)
    return found


def _local_variance(rate: Array, torque: Array, rest: Array) -> float:
    """Variance of the acceleration about lines over the torque, one for every ``LOCAL`` samples, (m/s^2)^2."""
    own = _indicators(rate.size, list(range(0, rate.size - LOCAL + 1, LOCAL)))
    _, residual = ordinary_least_squares(np.column_stack([own * torque[:, None], own, rest]), rate)
    return median_deviation(residual) ** 2 * LOCAL / (LOCAL - 2) + LEAST_NOISE**2


@dataclass(frozen=True)
class _Law:
    """The stated motion as a prior of the common coefficients; ``variance`` of a sample, (m/s^2)^2."""

    stated: StatedMotion | None
    variance: float

    @property
    def start(self) -> Array:
        """The common coefficients (3,), before pieces are known; NaN where they are not stated."""
        return np.array([self.stated.constant, self.stated.drag, 0.0]) if self.stated else np.full(3, np.nan)

    def fit(self, rate: Array, torque: Array, rest: Array, starts: list[int]) -> Array:
        """The coefficients by least squares: a ratio for each piece, then the common ones."""
        columns = np.column_stack([_indicators(rate.size, starts) * torque[:, None], rest])
        if self.stated is not None:
            spread = VALIDATE_POLICY.drive_slope * GRAVITY, VALIDATE_POLICY.drag_spread * abs(self.stated.drag)
            weight = np.sqrt(self.variance) / np.maximum(spread, 1e-12)
            rows = np.zeros((2, columns.shape[1]))
            rows[[0, 1], [len(starts), len(starts) + 1]] = weight
            columns, rate = np.vstack([columns, rows]), np.r_[rate, weight * self.start[:2]]
        return np.asarray(np.linalg.lstsq(columns, rate, rcond=None)[0])


def _search(rate: Array, torque: Array, rest: Array, law: _Law) -> tuple[list[int], Array]:
    """First samples of the pieces, and the coefficients: a ratio for each piece, then those common to all."""
    penalty = VALIDATE_POLICY.unequal_t**2 * law.variance
    starts, common = [0], law.start
    if not np.isfinite(common).all():
        common = law.fit(rate, torque, rest, starts)[1:]
    for _ in range(PIECE_ROUNDS):
        found = ratio_pieces(rate - rest @ common, torque, penalty, SHORTEST_PIECE)
        fitted = law.fit(rate, torque, rest, found)
        if found == starts:
            break
        starts, common = found, fitted[len(found) :]
    return starts, law.fit(rate, torque, rest, starts)


def _follow_torque(rate: Array, torque: Array, rest: Array, starts: list[int]) -> bool:
    """Whether the pieces differ by a factor of the torque rather than by forces of their own, such as hills."""
    own = _indicators(rate.size, starts)
    return _evidence(rate, torque, rest, own, own) > VALIDATE_POLICY.ratio_evidence


def _returns(rate: Array, torque: Array, rest: Array, starts: list[int], ratio: Array) -> bool:
    """Whether the pieces return to the same few ratios (p,), one for each level instead of one for each piece."""
    level, own = _level_of(ratio), _indicators(rate.size, starts)
    count = int(level.max()) + 1
    same = own @ (level[:, None] == np.arange(count))
    several = 1 < count <= ratio.size - FEWEST_RETURNS
    return several and _evidence(rate, torque, rest, own, same) > VALIDATE_POLICY.level_evidence


def _evidence(rate: Array, torque: Array, rest: Array, own: Array, same: Array) -> float:
    """Log likelihood by which each further ratio explains more than a force in every piece.

    Parameters
    ----------
    own : (n, p) 1 where a sample belongs to a piece. same : (n, k) likewise, to the pieces with a ratio in common.
    """
    by_ratio = _variance(rate, same * torque[:, None], rest)
    by_force = _variance(rate, own, torque, rest[:, 1:])  # the first of the common columns is constant
    return likelihood_gain(rate.size, by_force, by_ratio) / float(same.shape[1] - 1)


def _indicators(n: int, starts: list[int]) -> Array:
    """(n, p) 1 where a sample belongs to a piece."""
    piece = np.searchsorted(starts, np.arange(n), side="right") - 1
    return np.asarray(piece[:, None] == np.arange(len(starts)), dtype=np.float64)


def _variance(y: Array, *columns: Array) -> float:
    """Variance of the residual of y (n,) beside columns (n,) or (n, k), (m/s^2)^2."""
    whole = np.column_stack(columns)
    _, residual = ordinary_least_squares(whole, y)
    return float(residual @ residual) / max(y.size - int(np.linalg.matrix_rank(whole)), 1) + LEAST_NOISE**2


def likelihood_gain(samples: int, worse: float, better: float) -> float:
    """Log likelihood by which a law with the residual variance ``better`` exceeds one with the variance ``worse``."""
    return 0.5 * samples / LASTING * float(np.log(worse / better))
