"""A half-shaft's stiffness and damping from a log of its torque and twist, with noise in every channel.

The true twist phi and its rate are unknown; torque, twist and rate are read with noise, and bound by

    T = k phi + c phi' + zero,      phi(i+1) - phi(i) = h (phi'(i) + phi'(i+1)) / 2

Least squares of the torque alone would take the noise of the rate for rate and lose a sixth of c. Here the readings are
adjusted, each by its own noise, until both hold (functional maximum likelihood; Gauss-Helmert model): with A the
derivative of the conditions g to the readings and S the readings' covariance, g'(A S A')^-1 g is least. Its gradient is
exact with dg/d(k, c) taken at the adjusted readings; their noise, though, passes for information, so the intervals go
by the cost's own second derivative. A channel that is not logged takes part with a variance so large that it tells
nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.simulate import Drive, Simulated, Simulator
from vdyn_cli.inference import Regression, Rows, Solution, Unknown, solve, white_level
from vdyn_cli.inference.banded import factored, weighed, whitened
from vdyn_cli.inference.restrict import restricted
from vdyn_cli.physics.models.half_shaft import HALF_SHAFT
from vdyn_cli.quantities.errors import Finding, ResultError

if TYPE_CHECKING:
    from vdyn_cli.engine.model_builder import Correction
    from vdyn_cli.quantities.log import Log

Array = NDArray[np.float64]

UNREAD_TWIST = 0.3  # rad, standard deviation of a twist that was not logged
UNREAD_RATE = 30.0  # rad/s, of its rate
RATE_ZERO = 0.05  # rad/s, how far the two speeds' zeros may differ
TORQUE_ZERO = 10.0  # N m, standard deviation of the torque's zero where it is told from the twist's
TWIST_ZERO = 2e-3  # rad, standard deviation of the twist's zero, a tenth of a degree
ARRIVED = 1e-3  # of one residual's variance that a further step may still promise, where the law bends
FIRST_ROUNDS = 2
MOST_ROUNDS, SETTLED = 12, 0.02  # of adjusting the readings anew, until nothing moves by more standard deviations
CORNERED = 0.5  # standard deviations by which they may still move then
BENT = 4  # times that the readings are adjusted about the last adjusted ones, where the law bends
GAP = 3.0  # of the median time step; longer ones break the chain


@dataclass(frozen=True)
class Twisting:
    """One run's readings, without gaps in the values.

    Parameters
    ----------
    name : of the log. time, torque, twist, rate : (n,), SI; twist or rate from the other where not logged.
    noise : of torque (N m), twist (rad), rate (rad/s).
    """

    name: str
    time: Array
    torque: Array
    twist: Array
    rate: Array
    noise: tuple[float, float, float]

    @classmethod
    def of(cls, log: Log, gear_ratio: float) -> Twisting:
        """From a log of shaft_torque and of twist, or motor_speed and wheel_speed, or all of them."""
        both = "motor_speed" in log and "wheel_speed" in log
        used = (
            ["shaft_torque"] + (["twist"] if "twist" in log else []) + (["motor_speed", "wheel_speed"] if both else [])
        )
        good = np.all([np.isfinite(log[name]) for name in used], axis=0)
        time, values = log.time[good], {name: log[name][good] for name in used}
        level = {name: white_level(v, time) for name, v in values.items()}
        if both:
            rate = values["motor_speed"] / gear_ratio - values["wheel_speed"]
            rate_noise = float(np.hypot(level["motor_speed"] / gear_ratio, level["wheel_speed"]))
        else:
            rate, rate_noise = np.gradient(values["twist"], time), UNREAD_RATE
        twist, twist_noise = values.get("twist"), level.get("twist", UNREAD_TWIST)
        if twist is None:
            steps = np.diff(time) * (rate[1:] + rate[:-1]) / 2
            twist = np.concatenate([[0.0], np.cumsum(steps)])
        noise = (level["shaft_torque"], twist_noise, rate_noise)
        return cls(log.name, time, values["shaft_torque"], twist, rate, noise)

    @property
    def conditions_per_sample(self) -> int:
        """How many of the two conditions on each sample can be violated: a channel that was not read gives way."""
        return 2 - (self.noise[1] == UNREAD_TWIST) - (self.noise[2] == UNREAD_RATE)

    def drive(self, twist: Array, rate: Array) -> Drive:
        return Drive(self.time, {"twist": twist, "twist_rate": rate})


@dataclass(frozen=True)
class Fixed:
    """One run about some values of its unknowns.

    Parameters
    ----------
    drive : the readings, adjusted there. torque : (n,) N m that they call for. rate_zero : rad/s.
    conditions : (2 n - 1,) of the readings as read, torque and chain in turn. factor : Cholesky's, of their covariance.
    """

    drive: Drive
    torque: Array
    rate_zero: float
    conditions: Array
    factor: Array


@dataclass(frozen=True)
class Adjusted:
    """Readings adjusted until the conditions hold: (n,) each, and the torque that they call for."""

    twist: Array
    rate: Array
    torque: Array


class ShaftFit:
    """Runs of one half-shaft, the conditions on their readings, and the regression.

    Parameters
    ----------
    runs : all of the same shaft.
    extra, effects : further shared unknowns, of the model or of effects on it.
    known : stiffness that the bar is known to have, with its standard deviation, from elsewhere.
    """

    def __init__(
        self,
        runs: Sequence[Twisting],
        extra: Sequence[Unknown] = (),
        effects: Sequence[Correction] = (),
        known: tuple[float, float] | None = None,
    ) -> None:
        self.runs, self._bent, self._extra = tuple(runs), bool(effects), tuple(extra)
        stiffness = _start(self.runs)
        self.unknowns = (
            Unknown("shaft_stiffness", stiffness, 0.02 * stiffness, 50 * stiffness, "N m/rad", known),
            Unknown("shaft_damping", 1e-3 * stiffness, -stiffness, stiffness, "N m s/rad"),
            *extra,
            *_own(self.runs, self._bent),
        )
        names = [u.name for u in self.unknowns]
        values = {"shaft_stiffness": stiffness, "twist_zero": 0.0, "rate_zero": 0.0, "torque_zero": 0.0}
        # The slope of the torque to the twist itself is that to its zero, turned round.
        self._names = tuple(dict.fromkeys([*names, "twist_zero"]))
        self._simulator = Simulator(HALF_SHAFT, {**values, "shaft_damping": 0.0}, self._names, effects)
        self._rate_zero, self._twist_zero = names.index("rate_zero"), self._names.index("twist_zero")
        self._read = [run.drive(run.twist, run.rate) for run in self.runs]

    def regression(self, at: Array | None = None, start: Array | None = None) -> Regression:
        """The regression over all runs; with ``at`` (all unknowns) readings are adjusted and weighted as there.

        Without, each evaluation adjusts the readings anew: right for a law that is linear in them. A law that bends
        (free play) has its readings adjusted once and is compared at those, as often as its fit needs to settle::

            r(theta) = L^-1 (g(at; read) + g(theta; adjusted) - g(at; adjusted))

        It begins at ``start``, or at ``at``.
        """
        names = tuple(run.name for run in self.runs)
        if at is None:
            return Regression(self.unknowns, names, self._rows)
        fixed = [self._fix(index, theta) for index, theta in enumerate(self._locals(at))]

        def rows(index: int, theta: Array) -> Rows:
            here, step = fixed[index], np.diff(self.runs[index].time)
            simulated = self._simulated(here.drive, theta)
            conditions, slopes = here.conditions.copy(), np.zeros((here.conditions.size, theta.size))
            conditions[::2] += simulated.outputs["shaft_torque"] - here.torque
            conditions[1::2] += step * (theta[self._rate_zero] - here.rate_zero)
            slopes[::2] = simulated.sensitivities["shaft_torque"][:, : theta.size]
            slopes[1::2, self._rate_zero] = step
            white = whitened(here.factor, np.column_stack([slopes, conditions]))
            return Rows(white[:, -1], white[:, :-1], time=self._times(index))

        begin = at if start is None else start
        s, m = self._counts
        shared = iter(begin[:s].tolist())
        begun = tuple(u if u.per_run else replace(u, start=next(shared)) for u in self.unknowns)
        own = {u.name: begin[s + i :: m] for i, u in enumerate(u for u in self.unknowns if u.per_run)}
        return Regression(begun, names, rows, own)

    @property
    def _counts(self) -> tuple[int, int]:
        """Shared unknowns, and each run's own."""
        own = sum(u.per_run for u in self.unknowns)
        return len(self.unknowns) - own, own

    def _locals(self, at: Array) -> list[Array]:
        s, m = self._counts
        return [np.concatenate([at[:s], at[s + k * m : s + (k + 1) * m]]) for k in range(len(self.runs))]

    def place(self, solution: Solution) -> Array:
        """All unknowns at a solution of this fit, or of one without its effects: those are at their starts.

        A straight law tells one zero only. Of a law that bends it is the twist's: torques are zeroed well.
        """
        shared = [solution.values.get(u.name, u.start) for u in self.unknowns if not u.per_run]
        zeros = dict(solution.per_run)
        if "twist_zero" not in zeros:
            zeros["twist_zero"] = -zeros["torque_zero"] / solution.values["shaft_stiffness"]
            zeros["torque_zero"] = np.zeros(len(self.runs)) if self._bent else zeros["torque_zero"]
        own = np.array([zeros[u.name] for u in self.unknowns if u.per_run])
        return np.concatenate([shared, own.T.ravel()])

    def _fix(self, index: int, theta: Array) -> Fixed:
        run = self.runs[index]
        adjusted, conditions, factor = (run.twist, run.rate), np.zeros(0), np.zeros(0)
        for _ in range(BENT):
            conditions, factor, to_twist, to_rate = self._conditions(index, theta, adjusted)
            adjusted = _adjust(run, conditions, factor, to_twist, to_rate)
        drive = run.drive(*adjusted)
        torque = self._simulated(drive, theta).outputs["shaft_torque"]
        return Fixed(drive, torque, float(theta[self._rate_zero]), conditions, factor)

    def _times(self, index: int) -> Array:
        """When each condition was read, s: torque and chain in turn."""
        return np.repeat(self.runs[index].time, 2)[:-1]

    def _rows(self, index: int, theta: Array) -> Rows:
        run = self.runs[index]
        conditions, factor, to_twist, to_rate = self._conditions(index, theta)
        adjusted = _adjust(run, conditions, factor, to_twist, to_rate)
        simulated = self._simulated(run.drive(*adjusted), theta)
        slopes = np.zeros((conditions.size, theta.size))
        slopes[::2] = simulated.sensitivities["shaft_torque"][:, : theta.size]
        slopes[1::2, self._rate_zero] = np.diff(run.time)
        white = whitened(factor, np.column_stack([slopes, conditions]))
        return Rows(white[:, -1], white[:, :-1], time=self._times(index))

    def _conditions(
        self, index: int, theta: Array, about: tuple[Array, Array] | None = None
    ) -> tuple[Array, Array, Array, Array]:
        """The conditions at the readings, torque and chain in turn, (2 n - 1,); the Cholesky factor of their
        covariance; the torque's slopes to twist and rate, (n,) each.

        A law that bends within the readings' noise is a straight line ``about`` the true twist and rate, not about
        their readings: at a corner those would be off by k times the noise.
        """
        run = self.runs[index]
        simulated = self._simulated(self._read[index] if about is None else run.drive(*about), theta)
        tangents = simulated.sensitivities["shaft_torque"]
        to_twist, to_rate = -tangents[:, self._twist_zero], -tangents[:, self._rate_zero]
        step, rate = np.diff(run.time), run.rate - theta[self._rate_zero]
        conditions = np.empty(2 * run.time.size - 1)
        conditions[::2] = simulated.outputs["shaft_torque"] - run.torque
        if about is not None:
            conditions[::2] += to_twist * (run.twist - about[0]) + to_rate * (run.rate - about[1])
        conditions[1::2] = np.diff(run.twist) - step * (rate[1:] + rate[:-1]) / 2
        return conditions, _factor(run, step, to_twist, to_rate), to_twist, to_rate

    def adjusted(self, index: int, theta: Array) -> Adjusted:
        """The readings of a run, adjusted, at its local unknowns."""
        run = self.runs[index]
        twist, rate = _adjust(run, *self._conditions(index, theta))
        return Adjusted(twist, rate, self._simulated(run.drive(twist, rate), theta).outputs["shaft_torque"])

    def _simulated(self, drive: Drive, theta: Array) -> Simulated:
        """With the twist's zero at 0 where it is not among the unknowns."""
        return self._simulator(drive, np.append(theta, np.zeros(len(self._names) - theta.size)))

    def solve(self) -> tuple[Solution, Array]:
        """The solution, and the covariance of the shared unknowns.

        The blocks' pulls are (J'J)^-1 g_b; with the noise of the adjusted readings in J they are too small, and
        multiplied by H^-1 (J'J), H the cost's second derivative, they are right.
        """
        regression = self.regression()
        solution = self._settled() if self._bent else solve(regression)
        gauss, own = _curvatures(regression, solution)
        mend = np.linalg.solve(own, gauss)
        return solution, mend @ solution.covariance @ mend.T

    def begun(self, straight: Solution) -> tuple[Array, float]:
        """All unknowns, and the cost, where a search may begin: all else fitted to the effects as they start.

        A corner that is looked for in the wrong place draws a fit away from it.

        Parameters
        ----------
        straight : the fit without effects.
        """
        at = self.place(straight)
        held, cost = {u.name: u.start for u in self._extra}, np.inf
        for _ in range(FIRST_ROUNDS):
            solution = solve(restricted(self.regression(at), held), tolerance=ARRIVED)
            at, cost = self.place(solution), solution.cost
        return at, cost

    def _settled(self) -> Solution:
        """The solution at which readings adjusted for it lead to it again, or nearly: at a corner two may for ever
        lead to each other.

        Raises
        ------
        ResultError : the fit's own, or there is none.
        """
        at, _ = self.begun(solve(ShaftFit(self.runs).regression()))
        best, least = None, CORNERED
        for _ in range(MOST_ROUNDS):
            solution = solve(self.regression(at), tolerance=ARRIVED)
            later = self.place(solution)
            std = np.array([solution.std[n] for n in solution.names])
            moved, at = float(np.max(np.abs(later - at)[: std.size] / std)), later
            if moved < SETTLED:
                return solution
            if moved < least:
                best, least = solution, moved
        if best is not None:
            return best
        raise ResultError(Finding("fit", "the adjusted readings do not settle", "", "check units and the clock"))


def _own(runs: Sequence[Twisting], nonlinear: bool) -> tuple[Unknown, ...]:
    """Each run's zeros; that of the twist tells itself from the torque's only where the law bends."""
    twist = TWIST_ZERO if all(run.noise[1] < UNREAD_TWIST for run in runs) else UNREAD_TWIST
    known = (0.0, TORQUE_ZERO) if nonlinear else None
    own = (
        Unknown("torque_zero", 0.0, unit="N m", prior=known, per_run=True, nuisance=True),
        Unknown("rate_zero", 0.0, unit="rad/s", prior=(0.0, RATE_ZERO), per_run=True, nuisance=True),
        Unknown("twist_zero", 0.0, unit="rad", prior=(0.0, twist), per_run=True, nuisance=True),
    )
    return own if nonlinear else own[:2]


def _curvatures(regression: Regression, solution: Solution) -> tuple[Array, Array]:
    """J'J and the cost's second derivative, each with the runs' own unknowns eliminated, (s, s)."""
    s, m, runs = len(regression.shared), len(regression.own), len(regression.runs)
    x = np.concatenate([list(solution.values.values()), *(zip(*solution.per_run.values(), strict=True))])
    prior = np.array([u.prior[1] ** -2.0 if u.prior else 0.0 for u in (*regression.shared, *regression.own)])
    size = np.sqrt(np.diag(solution.classical_covariance))
    steps = np.concatenate([size, np.array([solution.per_run_std[u.name] for u in regression.own]).T.ravel()])
    found = []
    for exact in (False, True):
        total = np.zeros((s, s))
        for run in range(runs):
            local, step = regression.local(x, run), regression.local(steps, run)
            curvature = _curvature(regression, run, local, 0.3 * step if exact else None)
            curvature[range(s, s + m), range(s, s + m)] += prior[s:]
            total += curvature[:s, :s] - curvature[:s, s:] @ np.linalg.solve(curvature[s:, s:], curvature[s:, :s])
        found.append(total + np.diag(prior[:s]))
    return found[0], found[1]


def _curvature(regression: Regression, run: int, local: Array, steps: Array | None) -> Array:
    """J'J of one run, or by central differences the derivative of J'r."""
    if steps is None:
        jacobian = regression.rows(run, local).jacobian
        return np.asarray(jacobian.T @ jacobian)
    columns = []
    for shift in np.diag(steps):
        above, below = regression.rows(run, local + shift), regression.rows(run, local - shift)
        columns.append(above.jacobian.T @ above.residual - below.jacobian.T @ below.residual)
    curvature = np.array(columns).T / (2 * steps)
    return np.asarray((curvature + curvature.T) / 2)


def _adjust(run: Twisting, conditions: Array, factor: Array, to_twist: Array, to_rate: Array) -> tuple[Array, Array]:
    """Twist and rate nearest to the readings that fulfil the conditions: x - S A' (A S A')^-1 g."""
    weights = weighed(factor, whitened(factor, conditions))
    torque, chain = weights[::2], np.concatenate([[0.0], weights[1::2], [0.0]])
    half = np.concatenate([[0.0], np.diff(run.time) / 2, [0.0]])
    _, twist_noise, rate_noise = run.noise
    twist = run.twist - twist_noise**2 * (to_twist * torque + chain[:-1] - chain[1:])
    pulled = half[:-1] * chain[:-1] + half[1:] * chain[1:]
    return twist, run.rate - rate_noise**2 * (to_rate * torque - pulled)


def _factor(run: Twisting, step: Array, to_twist: Array, to_rate: Array) -> Array:
    """Banded Cholesky factor, (3, 2 n - 1), of the covariance of torque and chain conditions in turn."""
    torque, twist, rate = (noise**2 for noise in run.noise)
    half = step / 2
    band = np.zeros((3, 2 * run.time.size - 1))
    band[0, ::2] = torque + to_twist**2 * twist + to_rate**2 * rate
    loose = np.where(step > GAP * np.median(step), 1.0, 0.0)  # rad^2: over a gap nothing is known
    band[0, 1::2] = 2 * twist + 2 * half**2 * rate + loose
    band[1, :-1:2] = -to_twist[:-1] * twist - to_rate[:-1] * half * rate
    band[1, 1::2] = to_twist[1:] * twist - to_rate[1:] * half * rate
    band[2, 1:-2:2] = -twist + half[:-1] * half[1:] * rate
    return factored(band)


def _start(runs: Sequence[Twisting]) -> float:
    """Stiffness by plain least squares of torque on twist, each run about its mean."""
    above = sum(float(np.sum((r.twist - r.twist.mean()) * (r.torque - r.torque.mean()))) for r in runs)
    below = sum(float(np.sum((r.twist - r.twist.mean()) ** 2)) for r in runs)
    return abs(above / below)
