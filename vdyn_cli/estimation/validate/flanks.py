"""On which flank a gearing with play rests while a car coasts, and so whether the next tip-in has a gap to cross.

Coasting, next to no torque goes through a half-shaft: what the driveline's inertia gives, a newton metre or so, and the
zero that the torque sensor has in a drive is as large. Simulated with another zero, the shaft rests on the other flank
and crosses the gap where the real one does not; with a little more play it knocks later. No straight line leads from
one to the other, so zeros and sizes are tried: each is simulated, and of what it leaves the car without play may take
away what it can by its own unknowns.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.estimation.validate.regression import Weighed, weigh
from vdyn_cli.estimation.validate.trial import TORQUE_ZERO, Outcome, Trial
from vdyn_cli.fit.regression import prior_rows

Array = NDArray[np.float64]

COARSE = (-4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0)  # standard deviations of a zero that are tried first
FINE = (-0.5, 0.0, 0.5)  # about the best of those
SPACING = 5e-3  # sqrt(rad): the time in which a gap is crossed goes with its root, and a knock must fall on a knock
HALVINGS = 2  # of the distance to the best size's neighbours
AROUND = (0.8, 0.9, 1.0, 1.1, 1.2)  # of a size: steps over which knocks fit worse evenly, however they fit in between


@dataclass(frozen=True, eq=False)
class Plain:
    """The car without play: how it weighs errors, and what it can explain of them by itself."""

    weighed: Weighed

    @cached_property
    def _explained(self) -> tuple[tuple[Array, int], ...]:
        """Of every drive an orthonormal basis of what all unknowns but the torque's zero do, and how many are known."""
        w = self.weighed
        unknowns = (*w.regression.shared, *w.regression.own)
        known = prior_rows(unknowns, np.zeros(len(unknowns)))[:, :-1]
        others = [i for i, u in enumerate(unknowns) if u.name != TORQUE_ZERO]
        jacobians = (w.white(k, o, w.trial.begun(k)[0]).jacobian for k, o in enumerate(w.first))
        return tuple((np.linalg.qr(np.vstack([j, known])[:, others])[0], len(known)) for j in jacobians)

    def cost(self, trial: Trial, run: int, zero: float) -> float:
        """Log likelihood, negative, of a drive with this zero of its drive torque."""
        theta, std = trial.start(run), trial.zeros.get("drive_torque", 0.0)
        if trial.sensors.driving:
            theta[len(trial.shared) + trial.own.index(TORQUE_ZERO)] = zero
        seen = trial.simulate(run, theta, slopes=False)
        basis, known = self._explained[run]
        left = self.weighed.white(run, Outcome(seen.values, {}), trial.begun(run)[0], slopes=False).residual
        left = np.concatenate([left, np.zeros(known)])
        unlikely = (zero / std) ** 2 if zero else 0.0
        return 0.5 * float(left @ left - np.sum((basis.T @ left) ** 2) + unlikely)

    def best(self, trial: Trial, run: int, zeros: Iterable[float]) -> tuple[float, float]:
        """The least cost among some zeros, and which."""
        return min((self.cost(trial, run, zero), zero) for zero in set(zeros))


@lru_cache(maxsize=1)
def _plain(bare: Trial) -> Plain:
    return Plain(weigh(bare, calm=True))


def rested(trial: Trial) -> Trial:
    """The trial with the drive torque's zero begun where each drive fits best, if there is play in it.

    Raises
    ------
    ResultError : the simulation is not finite.
    """
    sizes = dict(zip(trial.shared, trial.theta().tolist(), strict=True))
    plays = any(e.probes and sizes.get(next(iter(e.unknowns))) for e in trial.effects)
    if not plays or not trial.sensors.driving:
        return trial
    return replace(trial, torque_zeros=_zeros(_plain(trial.bare), trial)[0])


def likely_size(trials: Callable[[float], Trial], least: float, most: float) -> tuple[float, float]:
    """The size of play, rad, with which the drives fit best, and by how much their log likelihood rises with it.

    All from ``least`` to ``most`` are tried: wherever the play is large, a small one fits a little better than its
    like. Zeros stay near those of the car without play: from size to size they would lose their way.

    Parameters
    ----------
    trials : the trial with an effect of this size.

    Raises
    ------
    ResultError : the simulation is not finite.
    """
    plain = _plain(trials(0.0).bare)
    zeros, without = _zeros(plain, trials(0.0))

    def cost(size: float) -> float:
        return _zeros(plain, trials(size), zeros)[1]

    costs = {size: cost(size) for size in (np.arange(np.sqrt(least), np.sqrt(most), SPACING) ** 2).tolist()}
    for _ in range(HALVINGS):
        every = sorted(costs)
        best = min(every, key=costs.__getitem__)
        beside = (every[k] for k in (every.index(best) - 1, every.index(best) + 1) if 0 <= k < len(every))
        costs |= {size: cost(size) for size in [0.5 * (best + other) for other in beside]}
    best = min(costs, key=costs.__getitem__)
    return best, without - costs[best]


def spreads(trial: Trial) -> dict[str, float]:
    """Standard deviations of the sizes of play that a trial begins at, by how evenly the drives fit worse about them.

    A straight line through one knock promises more: a little farther on another knock fits better again.
    """
    found = {}
    for name in (next(iter(e.unknowns)) for e in trial.effects if e.probes):
        size = {u.name: u.start for u in trial.extra}.get(name, 0.0)
        if size > 0.0:
            plain, costs = _plain(trial.bare), []
            zeros, _ = _zeros(plain, trial)
            for factor in AROUND:
                extra = tuple(replace(u, start=factor * size) if u.name == name else u for u in trial.extra)
                costs.append(_zeros(plain, replace(trial, extra=extra), zeros)[1])
            curvature = 2.0 * float(np.polyfit(size * np.array(AROUND), costs, 2)[0])
            widest = size * (max(AROUND) - 1.0)
            found[name] = min(widest, curvature**-0.5) if curvature > 0 else widest
    return found


def _zeros(plain: Plain, trial: Trial, about: Sequence[float] = ()) -> tuple[tuple[float, ...], float]:
    """The best zero of every drive, and the cost of all: near some that are known, or anywhere."""
    std = trial.zeros.get("drive_torque", 0.0)
    tried = replace(trial, step=plain.weighed.trial.step, torque_zeros=())

    def best(run: int) -> tuple[float, float]:
        first = about[run] if about else plain.best(tried, run, (std * z for z in COARSE))[1]
        return plain.best(tried, run, (first + std * z for z in FINE))

    found = tried.each(best)
    return tuple(zero for _, zero in found), sum(cost for cost, _ in found)
