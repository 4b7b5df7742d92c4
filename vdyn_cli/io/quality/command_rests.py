"""Constant segments (rests) of a command that the motion of the car, or the command's other rests, contradict.

A drive torque may be constant for any time, at zero while the car rolls or at a limit of the motor. A logger that loses
the signal also records zero or the last value; but the car accelerates with the true torque, and the recorded torque
jumps where the signal is lost and where it returns.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.io.quality.regular_segments import quantum
from vdyn_cli.quantities.arrays import Array, Mask, median_deviation

_ROUNDS = 3  # of the fit, each without the outliers of the previous one
_OUTLIER = 3.0  # standard deviations by the median absolute residual
_FEWEST_REPEATED = 5  # values at which a command rested more than once, to determine the grid of its source
_WITHIN = 1e-3  # of a grid's step: rounding of the file


@dataclass(frozen=True, eq=False)
class DriveTie:
    """Regression of the specific force on the logged torque, a = k T + c0 + c2 v^2 + e.

    Parameters
    ----------
    residual : (n,), e, m/s^2. gain : k, m/s^2 per unit of the command.
    scatter, tail : standard deviation and 99.9 % quantile of absolute means of e over ``width`` samples, in the half of
        the drive in which the torque changes least; infinite if the regression explains too little.
    """

    residual: Array
    gain: float
    scatter: float
    tail: float
    width: int


@dataclass(frozen=True)
class Rest:
    """A segment of equal values: first sample, the one after its last, and the jumps into it and out of it."""

    first: int
    stop: int
    value: float
    entered: float
    left: float

    @property
    def jumps(self) -> tuple[tuple[int, float], tuple[int, float]]:
        """The first sample after each jump, and the jump."""
        return (self.first, self.entered), (self.stop, self.left)

    @property
    def edge(self) -> float:
        """The size of the smaller jump; 0 at an end of the log."""
        return min(abs(self.entered), abs(self.left))


def drive_tie(time: Array, values: Array, force: Array, speed: Array, judged: Mask) -> DriveTie:
    """The regression of the specific force on the torque, fitted where the torque drives.

    Friction brakes are not logged, so that only samples with a torque above idle count. With a gearbox or a second
    driven axle the regression explains too little; its scatter is then returned as infinite.

    Parameters
    ----------
    time, values, force, speed : (n,), SI, NaN where unknown. judged : (n,), where the car moves and nothing failed.
    """
    width = max(round(QUALITY.rest_window / float(np.median(np.diff(time)))), 1)
    none = DriveTie(np.zeros(values.size), 0.0, np.inf, np.inf, width)
    drives = judged & np.isfinite(force + speed) & (values > QUALITY.idle_share * float(np.abs(values).max()))
    if np.count_nonzero(drives) < 20 * width:
        return none
    design = np.column_stack([values, np.ones(values.size), speed**2])
    used = drives
    for _ in range(_ROUNDS):
        found = np.linalg.lstsq(design[used], force[used], rcond=None)[0]
        residual = force - design @ found
        used = drives & (np.abs(residual) < _OUTLIER * median_deviation(residual[drives]))
    left, all_ = float(np.var(residual[used])), float(np.var(force[used]))
    if found[0] <= 0.0 or left > (1.0 - QUALITY.least_drive_tie) * all_:
        return none
    whole = _sliding(drives.astype(float), width) > 0.999
    if np.count_nonzero(whole) < 20 * width:
        return none
    change = _sliding(np.abs(np.diff(values, append=values[-1])), width)
    steady = whole & (change <= float(np.median(change[whole])))
    means = _sliding(np.nan_to_num(residual), width)[steady]
    return DriveTie(residual, float(found[0]), median_deviation(means), float(np.quantile(np.abs(means), 0.999)), width)


def contradicted_rests(
    values: Array, rests: list[tuple[int, int]], tie: DriveTie
) -> Iterator[tuple[int, int, str, str]]:
    """The rests (first, stop, test, why) of a command that the car's motion or their jumps contradict.

    During a rest at idle or below the car may brake, which is not logged: only an acceleration above that by the torque
    contradicts such a rest; above idle, one below it does, too. A rest at zero between two jumps is a lost signal
    unless the acceleration follows. If the tie has an infinite scatter nothing is tested: a test bench may step its
    torque.

    Parameters
    ----------
    values : (n,), the command. rests : its segments of equal values while the car moves.
    """
    if not np.isfinite(tie.scatter):
        return
    idle = QUALITY.idle_share * float(np.abs(values).max())
    steps = np.abs(np.diff(values))
    usual = float(np.quantile(steps[steps > 0.0], 0.99)) if np.any(steps) else 0.0
    found = [_rest(values, a, b) for a, b in rests]
    excess = np.array([_excess(r, tie, idle) for r in found])
    edges = np.array([r.edge for r in found])
    for k, rest in enumerate(found):
        most = QUALITY.rest_apart * _others(excess, k)
        enough = len(found) > QUALITY.fewest_judged_rests
        limit = max(QUALITY.rest_t * tie.scatter, most if enough else tie.tail)
        if excess[k] > limit:
            torque = excess[k] / tie.gain
            why = f"is constant at {rest.value:.5g} N m while the acceleration changes as if by {torque:.3g} N m more"
            yield rest.first, rest.stop, "dropout" if rest.value == 0.0 else "frozen", why
        elif (
            rest.value == 0.0
            and edges[k] > max(QUALITY.rest_apart * _others(edges, k), QUALITY.least_rest_edge * usual)
            and not _followed(rest, tie)
        ):
            why = f"jumps from {-rest.entered:.3g} N m to 0 and back to {rest.left:.3g} N m; the acceleration does not"
            yield rest.first, rest.stop, "dropout", why
        elif any(abs(jump) > usual and _missed(values, at, jump, tie) for at, jump in rest.jumps):
            jump = max(rest.entered, rest.left, key=abs)
            why = f"is constant at {rest.value:.5g} N m and jumps by {jump:.3g} N m without a change of acceleration"
            yield rest.first, rest.stop, "dropout" if rest.value == 0.0 else "frozen", why


def off_source_grid(values: Array, rests: list[tuple[int, int]]) -> Mask | None:
    """Mask (n,) of a command that is off the quantization grid of its source; None if its rests show no such grid.

    A logger that resamples a coarse command interpolates between its levels. The command itself is constant only at
    these levels, so that a constant segment between them is the logger's.

    Parameters
    ----------
    values : (n,), the command in any unit. rests : index of the first sample and of the one after the last.
    """
    where, count = np.unique([values[a] for a, _ in rests], return_counts=True)
    repeated = where[count > 1]
    if repeated.size < _FEWEST_REPEATED:
        return None
    step = quantum(repeated)
    place = values / step
    off = np.abs(place - np.round(place)) > max(_WITHIN, 1e-7 * float(np.abs(place).max()))
    resting = [bool(off[a]) for a, _ in rests]
    moving = np.concatenate([[False], np.diff(values) != 0.0])
    between = float(np.mean(off[moving])) if moving.any() else 0.0
    if between < QUALITY.between_steps or np.mean(resting) > QUALITY.most_off_steps:
        return None
    return off


def _rest(values: Array, a: int, b: int) -> Rest:
    entered = float(values[a] - values[a - 1]) if a > 0 else 0.0
    left = float(values[b] - values[b - 1]) if b < values.size else 0.0
    return Rest(a, b, float(values[a]), entered, left)


def _excess(rest: Rest, tie: DriveTie, idle: float) -> float:
    """The largest mean of the residual within a rest that braking does not explain, m/s^2."""
    inside = tie.residual[rest.first : rest.stop]
    inside = inside[np.isfinite(inside)]
    if inside.size < tie.width // 2 or inside.size == 0:
        return 0.0
    width = min(tie.width, inside.size)
    means = _sliding(inside, width)[width // 2 : inside.size - width + width // 2 + 1]
    return float(np.abs(means).max() if rest.value > idle else max(means.max(), 0.0))


def _missed(values: Array, at: int, jump: float, tie: DriveTie) -> bool:
    """Whether the residual jumps opposite to the torque at a sample, as the car's acceleration does not follow.

    A torque that goes on changing after the jump, as between two gears, is compared by all of its change: if it is late
    by a tenth of a second, the acceleration changes by all of that before the jump.
    """
    n = max(tie.width // 2, 1)
    before, after = slice(max(at - n, 0), at), slice(at, at + n)
    if not all(np.isfinite(tie.residual[part]).any() for part in (before, after)):
        return False
    change, rest = (float(np.nanmean(x[after]) - np.nanmean(x[before])) for x in (values, tie.residual))
    change = max(change * np.sign(jump), abs(jump)) * np.sign(jump)
    return tie.gain * abs(jump) > QUALITY.rest_t * tie.scatter and rest / (-tie.gain * change) > 0.5


def _others(sizes: Array, k: int) -> float:
    return float(np.delete(sizes, k).max(initial=0.0))


def _followed(rest: Rest, tie: DriveTie) -> bool:
    """Whether the car accelerates according to the torque within the rest rather than that before and after it."""
    inside = tie.residual[rest.first : rest.stop]
    missing = tie.gain * rest.edge
    return missing > QUALITY.rest_t * tie.scatter and abs(float(np.nanmean(inside))) < 0.5 * missing


def _sliding(values: Array, width: int) -> Array:
    """Means (n,) of ``width`` values centered on each; values beyond the ends count as zero."""
    padded = np.concatenate([np.zeros(width // 2 + 1), values, np.zeros((width - 1) // 2)])
    total = np.cumsum(padded)
    return np.asarray((total[width:] - total[:-width]) / width)
