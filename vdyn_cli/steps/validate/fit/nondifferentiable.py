"""Estimates of nondifferentiable effects (free play) and of the drive torque's zero in each drive, by grid search.

While a car coasts, a half-shaft carries only the torque of the driveline's inertia, about 1 N m, and the zero of the
torque sensor is as large. With another zero the simulated shaft rests on the other flank of the teeth, and the next
tip-in crosses a gap that the real shaft does not cross; with more play it impacts later. The likelihood jumps there, so
zeros and amplitudes are tried one by one. The residual of each is projected onto the orthogonal complement of what the
car without play can explain by its unknowns.

Linearizations take secants over the most likely amplitudes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.inference import Rows, Unknown
from vdyn_cli.inference.regression import prior_rows
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.validate.car.simulation import (
    Car,
    SimulatedSegment,
    SimulationSetup,
    added_at_zero,
    nondifferentiable,
)
from vdyn_cli.steps.validate.car.unknowns import TORQUE_ZERO
from vdyn_cli.steps.validate.fit.whitening import WhitenedDrives, whiten_drives

WIDEST = 1.5  # standard deviations of a zero within which zeros are tried: farther away, impacts fit by chance
FEWEST_ZEROS, MOST_ZEROS = 3, 25  # number of zeros tried for a drive; odd, so that the most likely one is included
COARSEST = 0.5  # N m between them, unless that exceeds MOST_ZEROS
SPACING = 0.01  # sqrt(rad): the time to cross a gap is proportional to the root of the gap; impacts must coincide
# rad, up to which all amplitudes are tried: with true play of 5 mrad, a small amplitude fits better than none; with 10
# and 30 mrad, none leaves twice the noise.
SMALL = 4e-3
HALVINGS = 3  # of the distance to the best amplitude's neighbors
AROUND = (0.8, 0.85, 0.9, 0.95, 1.0, 1.05, 1.1, 1.15, 1.2)  # times an amplitude: range of the fitted parabola
PARABOLA = 3  # amplitudes that determine a parabola
# Prior of Birge's ratio, with the weight of this number of drives: drives differ by 1.4 to 2.9 times as much as their
# likelihoods predict, at 1 mrad in three vehicles.
DISAGREE, DRIVES = 2.5, 2
LikelySize = Callable[[Effect, Callable[[float], tuple[Unknown, ...]]], tuple[float, float]]


@dataclass(frozen=True, eq=False)
class _Explained:
    """The fit of one drive by the car without play.

    Parameters
    ----------
    basis : (n, k), orthonormal basis of the sensitivities of whitened rows and prior rows to all unknowns.
    zero, std : N m, estimate of the drive torque's zero and its standard error.
    left : squared norm of the whitened residual of the fit.
    """

    basis: Array
    zero: float
    std: float
    left: float

    @property
    def zeros(self) -> Array:
        """Likely zeros (c,), N m, with the most likely one in the middle."""
        count = int(np.clip(2 * np.ceil(WIDEST * self.std / COARSEST) + 1, FEWEST_ZEROS, MOST_ZEROS))
        return self.zero + self.std * np.linspace(-WIDEST, WIDEST, count) if self.std > 0 else np.zeros(1)


@dataclass(frozen=True, eq=False)
class DifferentiableReference:
    """A car without play: the weights of errors, and the part of them that its unknowns can explain.

    Parameters
    ----------
    setup : the known car, or the car with effects of unknown amplitudes; all except play are fitted.
    """

    setup: SimulationSetup

    @cached_property
    def whitened(self) -> WhitenedDrives:
        """The drives with the noise of their rows."""
        return whiten_drives(self.setup, averaged=True)

    @cached_property
    def _unknowns(self) -> tuple[Unknown, ...]:
        return (*self.whitened.regression.shared, *self.whitened.regression.own)

    @cached_property
    def explained(self) -> tuple[_Explained, ...]:
        """The fit of every segment."""
        w = self.whitened
        return tuple(self._drive(self._start_rows(k), w.setup.vector.start(k)) for k in range(len(w.setup.segments)))

    def _start_rows(self, run: int) -> Rows:
        """The rows of a segment at the start values, of which the start speed is the measured one."""
        w = self.whitened
        measured = w.setup.vector.start_speed(run)[0]
        if measured > 0.0 or w.setup.vector.first_speed(run) == measured:  # a measured motion is read from the outputs
            return w.at_start[run]
        return w.white(run, w.setup.first[run], measured)

    @property
    def freedom(self) -> int:
        """Rows minus unknowns: the expected square of the whitened residual of noise."""
        return sum(one.basis.shape[0] - one.basis.shape[1] for one in self.explained)

    @property
    def misfit(self) -> bool:
        """Whether the residual exceeds the noise of its rows (one-sided 97.5 %); otherwise, there is no play.

        The variance of fast rows is below one by their caution. The sum of squares of many rows is nearly normal.
        """
        mean = variance = 0.0
        for one, whitening in zip(self.explained, self.whitened.whitenings, strict=True):
            slow, quick = whitening.factor.shape[0], whitening.caution**-2.0
            fast = one.basis.shape[0] - one.basis.shape[1] - slow
            mean += slow + fast * quick
            variance += 2.0 * (slow + fast * quick**2)
        return sum(one.left for one in self.explained) > mean + NORMAL95 * float(np.sqrt(variance))

    def _drive(self, rows: Rows, start: Array) -> _Explained:
        kept = [i for i, u in enumerate(self._unknowns) if u.name not in nondifferentiable(self.setup.effects)]
        known = prior_rows(self._unknowns, start)
        matrix = np.vstack([rows.jacobian, known[:, :-1]])[:, kept]
        scale = np.linalg.norm(matrix, axis=0)
        scale[scale == 0.0] = 1.0
        basis, factor = np.linalg.qr(matrix / scale)
        residual = np.concatenate([rows.residual, known[:, -1]])
        along = basis.T @ residual
        left = float(residual @ residual - along @ along)
        at = [k for k, i in enumerate(kept) if self._unknowns[i].name == TORQUE_ZERO]
        if not at:
            return _Explained(basis, 0.0, 0.0, left)
        back = np.linalg.pinv(factor)[at[0]] / scale[at[0]]
        return _Explained(basis, float(start[kept[at[0]]] - back @ along), float(np.linalg.norm(back)), left)

    def cost(self, setup: SimulationSetup, run: int, zero: float) -> float:
        """Negative log likelihood of a segment with this zero (N m) of its drive torque, minimized over all unknowns.

        The minimization is linear and includes the zero; its distance from the reference's estimate adds its square.
        """
        theta = setup.vector.start(run)
        at = self.setup.vector.start(run)
        means = [setup.prior.values[n] for n in setup.prior.names]
        at[: len(means)] += theta[: len(means)] - means
        if setup.sensors.input_zeros:
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


def differentiable_reference(car: Car) -> DifferentiableReference:
    """The car without play, neither as a candidate nor from an earlier step.

    Parameters
    ----------
    car : its parameters of play are set to zero; nothing else changes.
    """
    if car.known_play:
        values = {**car.prior.values, **dict.fromkeys(car.known_play, 0.0)}
        car = replace(car, prior=replace(car.prior, values=values))
    return DifferentiableReference(car.at_prior)


def with_best_zeros(setup: SimulationSetup, reference: DifferentiableReference) -> SimulationSetup:
    """The setup with the drive torque's zero started where each drive fits best, if there is play in the model.

    Raises
    ------
    ResultError : the simulation is not finite.
    """
    sizes = {**setup.prior.values, **dict(zip(setup.vector.shared, setup.vector.theta.tolist(), strict=True))}
    if not any(sizes.get(n) for n in nondifferentiable(setup.effects)) or not setup.sensors.input_zeros:
        return setup
    if setup.point.torque_zeros and added_at_zero(setup):
        return setup  # the zeros were found before effects were added, which are still at zero amplitude
    return setup.moved_to(replace(setup.point, torque_zeros=_zeros(reference, setup)[0]))


def likely_size(
    setups: Callable[[float], SimulationSetup], reference: DifferentiableReference, least: float, most: float
) -> tuple[float, float]:
    """The most likely amplitude of play, rad, and its gain in log likelihood over no play.

    Amplitudes from ``least`` to ``SMALL`` are tried; larger ones up to ``most`` only if a small one fits better than no
    play or the model without play leaves more than noise, since far from the true amplitude each may fit worse than
    none. Then the distances about the best are halved. If the car without play leaves only noise, the gain is zero.

    Parameters
    ----------
    setups : amplitude -> the setup with the effect of this amplitude. reference : the car without play.

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
    """Negative log likelihood of all drives at the start values of a setup, each with the best of its likely zeros.

    Parameters
    ----------
    few : try only the two likely zeros that are farthest apart.

    Raises
    ------
    ResultError : the simulation is not finite.
    """
    return sum(_zeros(reference, setup, few)[1])


def profile_estimates(setup: SimulationSetup, reference: DifferentiableReference) -> dict[str, tuple[float, float]]:
    """Amplitudes of play and their standard deviations, from a parabola through the profile likelihood about the start.

    A linearized fit underestimates the standard deviation, since slightly farther away the next impact fits better
    again. If fewer than ``PARABOLA`` amplitudes can be simulated, the estimate is the start; if the likelihood has no
    maximum, the best of those tried; both with the largest standard deviation. Disagreement of drives widens it.

    Parameters
    ----------
    setup : started near the estimates. reference : the car without play.
    """
    return {
        u.name: _profile_estimate(setup, reference, u)
        for u in setup.added.unknowns
        if u.name in nondifferentiable(setup.effects) and u.start > 0.0
    }


def _profile_estimate(setup: SimulationSetup, reference: DifferentiableReference, play: Unknown) -> tuple[float, float]:
    """The estimate of one amplitude, and its standard deviation, from amplitudes about its start within its bounds."""
    sizes = np.unique(np.clip(np.multiply(AROUND, play.start), play.lower, play.upper))

    def costs_of(size: float) -> tuple[float, ...]:
        try:
            return _zeros(reference, replace(setup, added=setup.added.started_at({play.name: size})))[1]
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
    std = (2.0 * bends.sum()) ** -0.5 * _birge_ratio(bends, slopes, least)
    return play.start * (1.0 + least), play.start * min(widest, float(std))


def _birge_ratio(bends: Array, slopes: Array, least: float) -> float:
    """Birge's ratio of the drives' scores at the common minimum, shrunk towards ``DISAGREE``, at least 1."""
    scores = slopes + 2.0 * bends * least
    squares = float(np.sum(scores**2) / np.sum(2.0 * bends)) * scores.size
    return max(1.0, float(np.sqrt((DRIVES * DISAGREE**2 + squares) / (DRIVES + scores.size - 1))))


def _zeros(
    reference: DifferentiableReference, setup: SimulationSetup, few: bool = False
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The best zero of every segment, of all likely ones or (``few``) of the two farthest apart, and its cost."""
    tried = setup.moved_to(replace(setup.point, torque_zeros=()))
    explained = reference.explained  # computed before threads need it

    def best(run: int) -> tuple[float, float]:
        zeros = explained[run].zeros.tolist()
        return min((reference.cost(tried, run, zero), zero) for zero in ({zeros[0], zeros[-1]} if few else zeros))

    found = tried.each(best)
    return tuple(zero for _, zero in found), tuple(cost for cost, _ in found)


def likely_secants(added: AddedEffects, likely_size: LikelySize) -> dict[str, float]:
    """The likely amplitude of each nondifferentiable effect that starts at zero, if it can be simulated.

    Large play shifts an impact by more than its duration, so that the response to small play says nothing about it.

    Parameters
    ----------
    likely_size : (effect, amplitude -> its unknowns) -> likely amplitude and gain in log likelihood.
    """
    found = {}
    for effect in tried_from_zero(added):
        own = {u.name: u for u in added.unknowns if u.name in effect.unknowns}
        first = next(iter(effect.unknowns))
        with suppress(ResultError):
            found[first], _ = likely_size(effect, partial(_started_at, own, first))
    return found


def tried_from_zero(added: AddedEffects) -> tuple[Effect, ...]:
    """The nondifferentiable effects whose amplitude starts at zero."""
    starts = {u.name: u.start for u in added.unknowns}
    return tuple(e for e in added.effects if e.probes and not starts[next(iter(e.unknowns))])


def _started_at(own: Mapping[str, Unknown], first: str, amplitude: float) -> tuple[Unknown, ...]:
    return tuple(replace(u, start=amplitude) if n == first else u for n, u in own.items())
