"""Estimates of nondifferentiable effects (free play) and of the drive torque's zero in each drive, by grid search.

While a car coasts, a half-shaft carries only the torque of the driveline's inertia, about 1 N m, and the zero of the
torque sensor is as large. With another zero the simulated shaft rests on the other flank of the teeth, and the next
tip-in crosses a gap that the real shaft does not cross; with more play it impacts later. The likelihood jumps there, so
zeros and amplitudes are tried one by one. The residual of each is projected onto the complement of what the car without
play explains by its own unknowns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vdyn_cli.inference import Rows, Unknown
from vdyn_cli.inference.regression import prior_rows
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.validate.simulation import SimulatedSegment, SimulationSetup
from vdyn_cli.steps.validate.unknowns import TORQUE_ZERO
from vdyn_cli.steps.validate.whitening import WhitenedDrives, whiten_drives

WIDEST = 1.5  # standard deviations of a zero within which zeros are tried: farther off, impacts fit by chance
FEWEST, MOST = 3, 25  # zeros that are tried of a drive; odd, so that the likeliest is one of them
COARSEST = 0.5  # N m between them, if that takes no more
SPACING = 0.01  # sqrt(rad): the time to cross a gap goes with its root, and simulated and measured impact must coincide
SMALL = 4e-3  # rad; of larger play a small one fits better than none (5 mrad), or none leaves twice the noise (10, 30)
HALVINGS = 3  # of the distance to the best amplitude's neighbors
AROUND = (0.8, 0.85, 0.9, 0.95, 1.0, 1.05, 1.1, 1.15, 1.2)  # of an amplitude: the log likelihood is near a parabola
PARABOLA = 3  # amplitudes that determine one
# Drives disagree by more than their likelihoods say: by 1.4 to 2.9 times at 1 mrad in three vehicles. That ratio is the
# prior of Birge's ratio, with the weight of so many drives.
DISAGREE, DRIVES = 2.5, 2


@dataclass(frozen=True, eq=False)
class _Explained:
    """What the car without play explains of a drive.

    Parameters
    ----------
    basis : (n, k), orthonormal, of the sensitivities of whitened rows and prior rows to all unknowns.
    zero, std : N m, estimate of the drive torque's zero without play.
    left : square of the whitened residual that it does not explain.
    """

    basis: Array
    zero: float
    std: float
    left: float

    @property
    def zeros(self) -> Array:
        """(c,) N m, likely zeros, the likeliest in their middle."""
        count = int(np.clip(2 * np.ceil(WIDEST * self.std / COARSEST) + 1, FEWEST, MOST))
        return self.zero + self.std * np.linspace(-WIDEST, WIDEST, count) if self.std > 0 else np.zeros(1)


@dataclass(frozen=True, eq=False)
class DifferentiableReference:
    """A car without play: how it weights errors, and what it can explain of them.

    Parameters
    ----------
    setup : the bare car, or with effects whose amplitudes are unknown too; all but play explain their share.
    """

    setup: SimulationSetup

    @cached_property
    def whitened(self) -> WhitenedDrives:
        """Its drives with the noise of their rows."""
        return whiten_drives(self.setup, calm=True)

    @cached_property
    def _unknowns(self) -> tuple[Unknown, ...]:
        return (*self.whitened.regression.shared, *self.whitened.regression.own)

    @cached_property
    def explained(self) -> tuple[_Explained, ...]:
        """What it explains of every segment."""
        w = self.whitened
        return tuple(
            self._drive(w.white(k, o, w.setup.vector.start_speed(k)[0]), w.setup.vector.start(k))
            for k, o in enumerate(w.setup.first)
        )

    @property
    def freedom(self) -> int:
        """Rows less unknowns: the square of the whitened residual that noise alone leaves, on average."""
        return sum(one.basis.shape[0] - one.basis.shape[1] for one in self.explained)

    @property
    def misfit(self) -> bool:
        """Whether it leaves more than the noise of its rows (one-sided 97.5 %): only then play can be in the drives.

        Fast rows have a variance below one by their caution. The sum of squares of many rows is nearly normal.
        """
        mean = variance = 0.0
        for one, whitening in zip(self.explained, self.whitened.whitenings, strict=True):
            slow, quick = whitening.factor.shape[0], whitening.caution**-2.0
            fast = one.basis.shape[0] - one.basis.shape[1] - slow
            mean += slow + fast * quick
            variance += 2.0 * (slow + fast * quick**2)
        return sum(one.left for one in self.explained) > mean + NORMAL95 * float(np.sqrt(variance))

    def _drive(self, rows: Rows, start: Array) -> _Explained:
        kept = [i for i, u in enumerate(self._unknowns) if u.name not in self.setup.nondifferentiable]
        known = prior_rows(self._unknowns, start)
        matrix = np.vstack([rows.jacobian, known[:, :-1]])[:, kept]
        scale = np.linalg.norm(matrix, axis=0)
        scale[scale == 0.0] = 1.0
        basis, triangle = np.linalg.qr(matrix / scale)
        residual = np.concatenate([rows.residual, known[:, -1]])
        along = basis.T @ residual
        left = float(residual @ residual - along @ along)
        at = [k for k, i in enumerate(kept) if self._unknowns[i].name == TORQUE_ZERO]
        if not at:
            return _Explained(basis, 0.0, 0.0, left)
        back = np.linalg.pinv(triangle)[at[0]] / scale[at[0]]
        return _Explained(basis, float(start[kept[at[0]]] - back @ along), float(np.linalg.norm(back)), left)

    def cost(self, setup: SimulationSetup, run: int, zero: float) -> float:
        """Negative log likelihood of a segment with its drive torque's zero here (N m), minimized over other unknowns.

        The minimization is linear and moves the zero, too; the move away from the reference's estimate adds its own
        square.
        """
        theta = setup.vector.start(run)
        at = self.setup.vector.start(run)
        means = [setup.prior.values[n] for n in setup.prior.names]
        at[: len(means)] += theta[: len(means)] - means
        if setup.sensors.driving:
            theta[setup.vector.torque_zero_place] = zero
            at[self.setup.vector.torque_zero_place] = zero
        seen = setup.simulate(run, theta, slopes=False)
        rows = self.whitened.white(
            run, SimulatedSegment(seen.values, {}), setup.vector.start_speed(run)[0], slopes=False
        )
        left = np.concatenate([rows.residual, prior_rows(self._unknowns, at)[:, -1]])
        explained = self.explained[run]
        off = (zero - explained.zero) / explained.std if explained.std > 0 else 0.0
        return 0.5 * float(left @ left - np.sum((explained.basis.T @ left) ** 2) + off**2)


def differentiable_reference(setup: SimulationSetup) -> DifferentiableReference:
    """The reference of a car: without play, whether that is to be found or was found by an earlier step.

    Parameters
    ----------
    setup : its parameters of play are set to zero; nothing else changes.
    """
    bare = setup.bare
    if bare.nondifferentiable_prior:
        values = {**bare.prior.values, **dict.fromkeys(bare.nondifferentiable_prior, 0.0)}
        bare = replace(bare, prior=replace(bare.prior, values=values), baseline=None, extended=None)
    return DifferentiableReference(bare)


def with_best_zeros(setup: SimulationSetup, reference: DifferentiableReference) -> SimulationSetup:
    """The setup with the drive torque's zero started where each drive fits best, if there is play in the model.

    Raises
    ------
    ResultError : the simulation is not finite.
    """
    sizes = {**setup.prior.values, **dict(zip(setup.vector.shared, setup.vector.theta.tolist(), strict=True))}
    if not any(sizes.get(n) for n in setup.nondifferentiable) or not setup.sensors.driving:
        return setup
    if setup.torque_zeros and (setup.unextended is not None or not setup.extra):
        return setup  # found before its effects were added, which do nothing yet
    return replace(setup, torque_zeros=_zeros(reference, setup)[0], baseline=setup.bare)


def likely_size(
    setups: Callable[[float], SimulationSetup], reference: DifferentiableReference, least: float, most: float
) -> tuple[float, float]:
    """The likeliest amplitude of play, rad, and the gain in log likelihood over none.

    Amplitudes from ``least`` up are tried, and on to ``most`` where a small one fits better than no play, or no play
    leaves more than noise: far from the true amplitude, each may fit worse than none. Then the distances about the best
    are halved. Where no play leaves no more than noise, none is tried and the gain is zero.

    Parameters
    ----------
    setups : amplitude -> the setup with the effect of this amplitude. reference : of the car without play.

    Raises
    ------
    ResultError : the simulation is not finite.
    """
    if not reference.misfit:
        return least, 0.0
    without = likely_cost(reference, setups(0.0))
    misfit = without > reference.freedom / 2

    def cost(size: float, few: bool = False) -> float:
        try:
            return likely_cost(reference, setups(size), few)
        except ResultError:
            return np.inf

    count = max(3, round((np.sqrt(most) - np.sqrt(least)) / SPACING) + 1)
    sizes = np.linspace(np.sqrt(least), np.sqrt(most), count) ** 2
    costs: dict[float, float] = {}
    for size in sizes.tolist():
        if size <= SMALL or misfit or min(costs.values()) < without:
            costs[size] = cost(size, few=True)
    costs |= {size: cost(size) for size in [min(costs, key=costs.__getitem__)]}
    better = min(costs.values()) < without
    for _ in range(HALVINGS if better else 0):
        every = sorted(costs)
        best = min(every, key=costs.__getitem__)
        beside = (every[k] for k in (every.index(best) - 1, every.index(best) + 1) if 0 <= k < len(every))
        costs |= {size: cost(size) for size in [0.5 * (best + other) for other in beside]}
    best = min(costs, key=costs.__getitem__)
    if not np.isfinite(costs[best]):
        _zeros(reference, setups(best))  # raises the reason
    return best, without - costs[best]


def likely_cost(reference: DifferentiableReference, setup: SimulationSetup, few: bool = False) -> float:
    """Negative log likelihood of all drives where a setup starts, each with the best of its likely zeros.

    Parameters
    ----------
    few : of the two likely zeros that are farthest apart.

    Raises
    ------
    ResultError : the simulation is not finite.
    """
    return sum(_zeros(reference, setup, few)[1])


def profile_estimates(setup: SimulationSetup, reference: DifferentiableReference) -> dict[str, tuple[float, float]]:
    """Amplitudes of play and their standard deviations, from a parabola through the profile likelihood about the start.

    A linearized fit promises a smaller standard deviation than it can keep: a little farther on the next impact fits
    better again. Where hardly any amplitude can be simulated the start is returned, and where the likelihood does not
    fall to either side the best of those tried, both with the widest standard deviation. Drives that disagree widen it.

    Parameters
    ----------
    setup : started near the estimates. reference : of the car without play.
    """
    return {
        u.name: _among(setup, reference, u) for u in setup.extra if u.name in setup.nondifferentiable and u.start > 0.0
    }


def _among(setup: SimulationSetup, reference: DifferentiableReference, play: Unknown) -> tuple[float, float]:
    """The estimate of one amplitude from those about its start within its bounds, and its standard deviation."""
    sizes = np.unique(np.clip(np.multiply(AROUND, play.start), play.lower, play.upper))

    def costs_of(size: float) -> tuple[float, ...]:
        extra = tuple(replace(u, start=size) if u.name == play.name else u for u in setup.extra)
        try:
            return _zeros(reference, replace(setup, extra=extra))[1]
        except ResultError:
            return ()

    tried = [(size / play.start - 1.0, costs) for size in sizes.tolist() if (costs := costs_of(size))]
    widest = max(AROUND) - 1.0
    if len(tried) < PARABOLA:
        return play.start, play.start * widest
    off = np.array([at for at, _ in tried])
    bends, slopes, _ = np.polyfit(off, np.array([costs for _, costs in tried]), 2)
    if bends.sum() <= 0.0:
        best = min(tried, key=lambda one: sum(one[1]))[0]
        return play.start * (1.0 + best), play.start * widest
    least = float(np.clip(-0.5 * slopes.sum() / bends.sum(), off[0], off[-1]))
    std = (2.0 * bends.sum()) ** -0.5 * _disagree(bends, slopes, least)
    return play.start * (1.0 + least), play.start * min(widest, float(std))


def _disagree(bends: Array, slopes: Array, least: float) -> float:
    """Birge's ratio of the drives' scores at the common minimum, shrunk towards ``DISAGREE``, at least 1."""
    scores = slopes + 2.0 * bends * least
    squares = float(np.sum(scores**2) / np.sum(2.0 * bends)) * scores.size
    return max(1.0, float(np.sqrt((DRIVES * DISAGREE**2 + squares) / (DRIVES + scores.size - 1))))


def _zeros(
    reference: DifferentiableReference, setup: SimulationSetup, few: bool = False
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The best zero of every segment, of all that are likely or of the two farthest apart, and the cost with it."""
    tried, explained = replace(setup, torque_zeros=()), reference.explained  # made before threads ask for it

    def best(run: int) -> tuple[float, float]:
        zeros = explained[run].zeros.tolist()
        return min((reference.cost(tried, run, zero), zero) for zero in ({zeros[0], zeros[-1]} if few else zeros))

    found = tried.each(best)
    return tuple(zero for _, zero in found), tuple(cost for cost, _ in found)
