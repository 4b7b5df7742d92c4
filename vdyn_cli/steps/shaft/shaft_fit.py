"""Stiffness and damping of a half-shaft from a log of its torque and twist, with noise in every channel.

The true twist phi and its rate are unknown; torque, twist and rate are measured with noise, and obey

    T = k phi + c phi' + zero,      phi(i+1) - phi(i) = integral of phi'    (``ShaftReadings.chain``)

Least squares of the torque alone would mistake the noise of the rate for rate and underestimate c by a sixth. Here the
readings are adjusted, each within its noise, until both hold (functional maximum likelihood; Gauss-Helmert model): with
A the derivative of the conditions g by the readings and S the readings' covariance, g'(A S A')^-1 g is minimized. Its
gradient is exact if dg/d(k, c) is evaluated at the adjusted readings. J'J counts their noise as information, so the
intervals use the second derivative of the cost. A channel that is not logged has a variance so large that it has no
weight.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vdyn_cli.engine.simulate import Drive, Simulated, Simulator
from vdyn_cli.inference import Regression, Rows, Solution, Unknown, solve
from vdyn_cli.inference.banded import whitened
from vdyn_cli.inference.iterate import until_settled
from vdyn_cli.inference.regression import evaluate, stacked
from vdyn_cli.inference.restrict import restricted
from vdyn_cli.physics.models.half_shaft import HALF_SHAFT
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.shaft.noise import ReadingConditions
from vdyn_cli.steps.shaft.shaft_readings import UNREAD_TWIST, ShaftReadings

# s, damping over stiffness, beyond which it is no damping but friction: steel shafts have 1 to 10 ms, and a rubber
# coupling with a loss factor of one at 3 Hz has 50 ms.
MOST_DAMPING = 0.05
RATE_ZERO = 0.05  # rad/s, standard deviation of the difference of the two speeds' zeros
TORQUE_ZERO = 10.0  # N m, standard deviation of the torque's zero where it can be separated from the twist's
TWIST_ZERO = 2e-3  # rad, standard deviation of the twist's zero, a tenth of a degree
# As ARRIVED, without effects: J'J exceeds the cost's second derivative up to a hundredfold with noisy rates, so that
# steps are as much too short, and a gain of 1e-6 still leaves 1 % of a standard deviation.
LINEAR = 1e-6
ARRIVED = 1e-3  # of one residual's variance that a further step may gain, where the law is nonlinear
FIRST_ROUNDS = 2  # of adjusting the readings with the effects held: they only give start values
READJUSTMENTS, SETTLED = 12, 0.02  # of the readings, until no unknown changes by more standard deviations
CORNERED = 0.5  # standard deviations of change accepted after that: at a corner two solutions can alternate
DERIVATIVE_STEP = 0.3  # standard deviations, of the central differences of the cost's gradient
ADJUSTMENTS = 4  # of the readings about the last adjusted ones, where the law is nonlinear


@dataclass(frozen=True)
class ShaftFit:
    """Runs of one half-shaft, the conditions on their readings, and the regression.

    Parameters
    ----------
    runs : all of the same shaft.
    added : corrections of the shaft's law.
    bar : stiffness of the bar and its standard deviation, N m/rad, where it is known from elsewhere.
    """

    runs: tuple[ShaftReadings, ...]
    added: AddedEffects = NO_EFFECTS
    bar: tuple[float, float] | None = None

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Stiffness, damping, those of the effects, and each run's zeros.

        The zeros of torque and twist can be separated only where effects make the law nonlinear.
        """
        stiffness = _plain_stiffness(self.runs)
        wider = _zeros_beyond_priors(self.runs, stiffness)
        twist = TWIST_ZERO * wider if all(run.noise[1] < UNREAD_TWIST for run in self.runs) else UNREAD_TWIST
        torque = (0.0, TORQUE_ZERO * wider) if self.added.effects else None
        damping = -stiffness, MOST_DAMPING * stiffness
        zeros = (
            Unknown("torque_zero", 0.0, unit="N m", prior=torque, per_run=True, nuisance=True),
            Unknown("rate_zero", 0.0, unit="rad/s", prior=(0.0, RATE_ZERO), per_run=True, nuisance=True),
            Unknown("twist_zero", 0.0, unit="rad", prior=(0.0, twist), per_run=True, nuisance=True),
        )
        return (
            Unknown("shaft_stiffness", stiffness, 0.02 * stiffness, 50 * stiffness, "N m/rad", self.bar),
            Unknown("shaft_damping", 1e-3 * stiffness, -stiffness, stiffness, "N m s/rad", physical=damping),
            *self.added.unknowns,
            *(zeros if self.added.effects else zeros[:2]),
        )

    @cached_property
    def regression(self) -> Regression:
        """The regression over all runs; each evaluation readjusts the readings, which suits a linear law."""
        return Regression(self.unknowns, tuple(run.name for run in self.runs), self._rows)

    def frozen_regression(self, at: Array, start: Array | None = None) -> Regression:
        """The regression with readings adjusted, and weights computed, at fixed values of the unknowns.

        For a nonlinear law (backlash) the readings are adjusted once, the law is fitted at these, and both are repeated
        until the fit converges::

            r(theta) = L^-1 (g(at; read) + g(theta; adjusted) - g(at; adjusted))

        Parameters
        ----------
        at : (s + runs m,), all unknowns. start : start values of the fit, else ``at``.
        """
        frozen = [self._frozen_rows(index, self.regression.local(at, index)) for index in range(len(self.runs))]
        regression = replace(self.regression, rows=lambda k, theta: frozen[k](theta))
        return regression.started(at if start is None else start)

    def unknowns_at(self, solution: Solution) -> Array:
        """All unknowns, (s + runs m,), at a solution of this fit, or of the linear one with effects at their starts.

        A linear law determines only one zero. For a nonlinear one it becomes the twist's, as torques are zeroed well.
        """
        zeros = dict(solution.per_run)
        if "twist_zero" not in zeros:
            zeros["twist_zero"] = -zeros["torque_zero"] / solution.values["shaft_stiffness"]
            zeros["torque_zero"] = np.zeros(len(self.runs)) if self.added.effects else zeros["torque_zero"]
        return stacked(self.unknowns, solution.values, zeros)

    def adjusted(self, index: int, theta: Array) -> tuple[Array, Array, Array]:
        """Adjusted twist (rad) and rate (rad/s) of a run and the law's torque (N m) for them, (n,) each."""
        twist, rate, motor = self._conditions(index, theta).adjusted()
        torque = self._simulated(self.runs[index].drive(twist, rate, motor), theta).outputs["shaft_torque"]
        return twist, rate, np.asarray(torque)

    def solve(self, linear: Solution) -> tuple[Solution, Array]:
        """The solution, and the covariance (s, s) of the shared unknowns.

        The blocks' contributions to the estimate, (J'J)^-1 g_b, are too small because J contains the noise of the
        adjusted readings. The factor H^-1 (J'J), H the cost's second derivative, corrects them.

        Parameters
        ----------
        linear : the solution without effects.

        Raises
        ------
        ResultError : the fit fails, or the adjusted readings do not converge.
        """
        solution = self._settled(linear) if self.added.effects else linear
        gauss, hessian = _curvatures(self.regression, solution)
        scale = np.linalg.solve(hessian, gauss)
        return solution, scale @ solution.covariance @ scale.T

    def fit_holding_effects(self, linear: Solution) -> tuple[Array, float]:
        """All unknowns, and the cost, of the fit with the effects held at their start values.

        A search starts there; otherwise a corner of the law at a wrong twist would lead the fit astray.
        """
        at = self.unknowns_at(linear)
        held, cost = {u.name: u.start for u in self.added.unknowns}, np.inf
        for _ in range(FIRST_ROUNDS):
            solution = solve(restricted(self.frozen_regression(at), held), tolerance=ARRIVED)
            at, cost = self.unknowns_at(solution), solution.cost
        return at, cost

    def _settled(self, linear: Solution) -> Solution:
        """The solution that is reproduced, within CORNERED, by readings adjusted at it."""

        def step(last: tuple[Array, Solution | None, float]) -> tuple[tuple[Array, Solution | None, float], float]:
            at, best, least = last
            solution = solve(self.frozen_regression(at), tolerance=ARRIVED)
            at, moved = unknowns_and_change(self, at, solution)
            return (at, solution, moved) if moved < least else (at, best, least), moved

        start: tuple[Array, Solution | None, float] = (self.fit_holding_effects(linear)[0], None, CORNERED)
        _, best, _ = until_settled(step, start, READJUSTMENTS, SETTLED).state
        if best is None:
            raise ResultError(
                Finding("fit", "the adjusted readings have not converged", "", "check units and the loggers' clocks")
            )
        return best

    def _frozen_rows(self, index: int, at: Array) -> Callable[[Array], Rows]:
        """One run's rows with readings adjusted, and weights computed, at its local unknowns ``at``."""
        run, zero = self.runs[index], self._names.index("rate_zero")
        about = run.twist, run.rate, run.motor_speed
        for _ in range(ADJUSTMENTS):
            conditions = self._conditions(index, at, about[:2])
            about = run.within_noise(*conditions.adjusted())
        drive = run.drive(*about)
        torque = self._simulated(drive, at).outputs["shaft_torque"]

        def rows(theta: Array) -> Rows:
            simulated, values = self._simulated(drive, theta), conditions.values.copy()
            values[::2] += simulated.outputs["shaft_torque"] - torque
            values[1::2] -= run.chain[1].sum(axis=1) * (theta[zero] - at[zero])
            return self._white_rows(conditions, values, simulated, theta.size)

        return rows

    def _rows(self, index: int, theta: Array) -> Rows:
        conditions = self._conditions(index, theta)
        simulated = self._simulated(self.runs[index].drive(*conditions.adjusted()), theta)
        return self._white_rows(conditions, conditions.values, simulated, theta.size)

    def _white_rows(self, conditions: ReadingConditions, values: Array, simulated: Simulated, unknowns: int) -> Rows:
        """Whitened rows of the conditions, in which torque and integration conditions alternate."""
        columns = np.zeros((values.size, unknowns + 1))
        columns[::2, :-1] = simulated.sensitivities["shaft_torque"][:, :unknowns]
        columns[1::2, self._names.index("rate_zero")] = -conditions.run.chain[1].sum(axis=1)
        columns[:, -1] = values
        white = whitened(conditions.factor, columns)
        return Rows(white[:, -1], white[:, :-1], time=np.repeat(conditions.run.time, 2)[:-1])

    def _conditions(self, index: int, theta: Array, about: tuple[Array, Array] | None = None) -> ReadingConditions:
        """The conditions at a run's local unknowns, with the law linearized about twist and rate, else the readings.

        A law that is nonlinear within the readings' noise must be linearized about estimates of the true twist and
        rate: at a corner, a linearization about the readings would be wrong by k times the noise.
        """
        run = self.runs[index]
        twist, rate = (run.twist, run.rate) if about is None else about
        simulated = self._simulated(run.drive(twist, rate, run.motor_speed), theta)
        tangents = simulated.sensitivities["shaft_torque"]
        # The derivative of the torque by the twist is minus that by its zero.
        zero = self._names.index("rate_zero")
        to_twist, to_rate = -tangents[:, self._names.index("twist_zero")], -tangents[:, zero]
        values = np.empty(2 * run.time.size - 1)
        values[::2] = simulated.outputs["shaft_torque"] - run.torque
        if about is not None:
            values[::2] += to_twist * (run.twist - twist) + to_rate * (run.rate - rate)
        values[1::2] = run.linked(run.twist, run.rate - theta[zero])
        return ReadingConditions(run, values, to_twist, to_rate, _inertia(self, run, theta))

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys([*(u.name for u in self.unknowns), "twist_zero"]))

    @cached_property
    def _simulator(self) -> Simulator:
        zeros = dict.fromkeys(("shaft_damping", "twist_zero", "rate_zero", "torque_zero"), 0.0)
        values = {"shaft_stiffness": self.unknowns[0].start, **zeros}
        return Simulator(HALF_SHAFT, values, self._names, self.added.effects)

    def _simulated(self, drive: Drive, theta: Array) -> Simulated:
        """The law's torque at the unknowns ``theta``, with a twist zero of 0 where that is not an unknown."""
        return self._simulator(drive, np.append(theta, np.zeros(len(self._names) - theta.size)))


def _inertia(fit: ShaftFit, run: ShaftReadings, theta: Array) -> float:
    """Derivative of the torque by the acceleration of the inner end, kg m^2, at a run's local unknowns."""
    if not (fit.added.effects and run.motor_speed.size):
        return 0.0
    inputs = dict.fromkeys(HALF_SHAFT.inputs, np.zeros(2)) | {"motor_acceleration": np.array([0.0, 1.0])}
    torque = fit._simulated(Drive(run.time[:2], inputs), theta).outputs["shaft_torque"]
    return float(torque[1] - torque[0])


def linear_solution(runs: Sequence[ShaftReadings]) -> Solution:
    """Stiffness and damping of one shaft without effects.

    Raises
    ------
    ResultError : the fit fails.
    """
    return solve(ShaftFit(tuple(runs)).regression, tolerance=LINEAR)


def noise_excess(solutions: Iterable[Solution], runs: Iterable[ShaftReadings]) -> float:
    """Rms of the residuals of solutions of these runs, in standard deviations of the sensors' noise."""
    squares = sum(float(np.sum(r**2)) for s in solutions for r in s.residuals)
    return float((squares / sum(run.conditions_per_sample * run.time.size for run in runs)) ** 0.5)


def unknowns_and_change(fit: ShaftFit, at: Array, solution: Solution) -> tuple[Array, float]:
    """All unknowns (u,) at a solution; largest change of a shared one from ``at`` (u,), in standard deviations."""
    shared = zip(fit.regression.shared, at.tolist(), strict=False)
    return fit.unknowns_at(solution), solution.move_from({u.name: x for u, x in shared if u.name in solution.values})


def _zeros_beyond_priors(runs: Sequence[ShaftReadings], stiffness: float) -> float:
    """Factor of the priors of both zeros, 1 or more, with which the largest zero of a run is one standard deviation.

    A linear law contains only z = torque_zero - k twist_zero, whatever its size. Priors that exclude it would make
    every law with effects contradict the logs.
    """
    zero = max(abs(float(r.torque.mean() - stiffness * r.twist.mean())) for r in runs)
    return max(1.0, zero / float(np.hypot(TORQUE_ZERO, stiffness * TWIST_ZERO)))


def _plain_stiffness(runs: Sequence[ShaftReadings]) -> float:
    """Least squares of torque on twist, each run about its mean."""
    above = sum(float(np.sum((r.twist - r.twist.mean()) * (r.torque - r.torque.mean()))) for r in runs)
    below = sum(float(np.sum((r.twist - r.twist.mean()) ** 2)) for r in runs)
    return abs(above / below)


def _curvatures(regression: Regression, solution: Solution) -> tuple[Array, Array]:
    """J'J and the cost's second derivative at a solution, with the runs' own unknowns eliminated, (s, s) each.

    The second derivative is that of J'r by central differences; both include the priors, which must be independent.
    """
    s = len(regression.shared)
    x = stacked(regression.unknowns, solution.values, solution.per_run)
    prior = np.array([u.prior[1] ** -2.0 if u.prior else 0.0 for u in (*regression.shared, *regression.own)])
    size = np.sqrt(np.diag(solution.classical_covariance))
    steps = np.concatenate([size, np.array([solution.per_run_std[u.name] for u in regression.own]).T.ravel()])
    hessian = np.diag(prior[:s])
    for run in range(len(regression.runs)):
        curvature = _hessian(regression, run, regression.local(x, run), DERIVATIVE_STEP * regression.local(steps, run))
        curvature[s:, s:] += np.diag(prior[s:])
        hessian += curvature[:s, :s] - curvature[:s, s:] @ np.linalg.solve(curvature[s:, s:], curvature[s:, :s])
    point = evaluate(regression, x)
    assert point is not None  # the fit ended here
    return point.system.reduced().information, hessian


def _hessian(regression: Regression, run: int, local: Array, steps: Array) -> Array:
    """The derivative of J'r by central differences, symmetrized."""
    columns = []
    for shift in np.diag(steps):
        above, below = regression.rows(run, local + shift), regression.rows(run, local - shift)
        columns.append(above.jacobian.T @ above.residual - below.jacobian.T @ below.residual)
    curvature = np.array(columns).T / (2 * steps)
    return np.asarray((curvature + curvature.T) / 2)
