"""The iteration and its linear algebra compared with dense solutions of random problems."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from vdyn_cli.inference import Regression, Rows, Unknown, solve
from vdyn_cli.inference.minimize import PACE, minimize
from vdyn_cli.inference.qr_factors import qr_factor
from vdyn_cli.inference.regression import Objective


def random_problem(seed: int, priors: bool = True) -> tuple[Regression, np.ndarray, np.ndarray]:
    """A linear regression of random shape, and its rows [J | -r at 0] stacked over all unknowns, including priors."""
    rng = np.random.default_rng(seed)
    runs, s, m = rng.integers(1, 6), rng.integers(1, 4), rng.integers(0, 4)
    scales = 10.0 ** rng.uniform(-4, 4, s + m)
    designs = [rng.standard_normal((rng.integers(12, 40), s + m)) / scales for _ in range(runs)]
    data = [d @ (scales * rng.standard_normal(s + m)) + rng.standard_normal(len(d)) for d in designs]
    unknowns = []
    for i in range(s + m):
        prior = (float(scales[i]), float(0.5 * scales[i])) if priors and rng.random() < 0.4 else None
        unknowns.append(Unknown(f"p{i}", 0.0, prior=prior, per_run=i >= s))
    wide = [np.zeros((len(d), s + runs * m)) for d in designs]
    for k, d in enumerate(designs):
        wide[k][:, :s], wide[k][:, s + k * m : s + (k + 1) * m] = d[:, :s], d[:, s:]
    rows, target = list(np.vstack(wide)), list(np.concatenate(data))
    for i, u in enumerate([*unknowns[:s], *unknowns[s:] * int(runs)]):
        if u.prior:
            rows.append(np.eye(s + runs * m)[i] / u.prior[1])
            target.append(u.prior[0] / u.prior[1])
    names = tuple(f"run {k}" for k in range(runs))
    regression = Regression(tuple(unknowns), names, lambda k, x: Rows(designs[k] @ x - data[k], designs[k]))
    return regression, np.array(rows), np.array(target)


@pytest.mark.parametrize("seed", range(25))
def test_linear_problems_of_any_shape(seed: int) -> None:
    regression, matrix, target = random_problem(seed)
    solution = solve(regression)
    wanted = np.linalg.lstsq(matrix, target, rcond=None)[0]
    s = len(solution.names)
    assert list(solution.values.values()) == pytest.approx(wanted[:s], rel=1e-6)
    own = np.array([solution.per_run[u.name] for u in regression.own]).T.ravel()
    assert own == pytest.approx(wanted[s:], rel=1e-5, abs=1e-9)
    residual = matrix @ wanted - target
    assert 2 * solution.cost == pytest.approx(residual @ residual, rel=1e-9)
    inverse = np.linalg.inv(matrix.T @ matrix) * (residual @ residual) / (len(target) - len(wanted))
    assert solution.classical_covariance == pytest.approx(inverse[:s, :s], rel=1e-5)
    std = np.sqrt(np.diag(inverse))[s:]
    assert np.array([solution.per_run_std[u.name] for u in regression.own]).T.ravel() == pytest.approx(std, rel=1e-5)


@dataclass(frozen=True)
class Counted:
    """Rows that count the requests for derivatives, and can return their residuals alone."""

    rows: Callable[[int, np.ndarray], Rows]
    linearized: list[int]

    def __call__(self, run: int, theta: np.ndarray) -> Rows:
        self.linearized.append(run)
        return self.rows(run, theta)

    def residual(self, run: int, theta: np.ndarray) -> np.ndarray:
        return self.rows(run, theta).residual


@pytest.mark.parametrize("seed", range(5))
def test_the_cost_by_residuals_alone_is_that_of_the_linearization(seed: int) -> None:
    regression, _, _ = random_problem(seed)
    cheap = replace(regression, rows=Counted(regression.rows, []))
    x = np.random.default_rng(seed).standard_normal(regression.start().size)
    point = Objective(regression)(x)
    assert point is not None
    assert Objective(cheap).cost(x) == pytest.approx(point.cost, rel=1e-12)
    assert Objective(regression).cost(x) == point.cost


def test_steps_that_fail_are_not_linearized() -> None:
    """Like Powell's badly scaled problem: from far away, many damped steps fail before one succeeds."""

    def rows(run: int, theta: np.ndarray) -> Rows:
        a, b = theta
        residual = np.array([a - 1.0, 30.0 * (b - a**3), 0.01 * b])
        return Rows(residual, np.array([[1.0, 0.0], [-90.0 * a**2, 30.0], [0.0, 0.01]]))

    unknowns = (Unknown("a", -2.0), Unknown("b", 5.0))
    counts = []
    for with_residuals in (False, True):
        counted = Counted(rows, [])
        plain: Callable[[int, np.ndarray], Rows] = counted if with_residuals else lambda k, x, c=counted: c(k, x)
        regression = Regression(unknowns, ("run",), plain)
        found = minimize(Objective(regression), regression.start(), *regression.bounds(), 200, 1e-9)
        assert found.point.x == pytest.approx([1.0, 1.0], abs=1e-3)
        counts.append(len(counted.linearized))
    assert counts[1] < counts[0]


@pytest.mark.parametrize("seed", range(25))
def test_bounds_end_where_a_bounded_solver_ends(seed: int) -> None:
    regression, matrix, target = random_problem(seed, priors=False)
    free = np.linalg.lstsq(matrix, target, rcond=None)[0]
    rng = np.random.default_rng(1000 + seed)
    near = free + np.abs(free) * rng.uniform(-0.8, 0.8, free.size)
    lower, upper = near - np.abs(free), near + np.abs(free) * rng.uniform(0.05, 1.0, free.size)
    wanted = lsq_linear(matrix, target, (lower, upper), method="bvls", tol=1e-14)
    found = minimize(Objective(regression), near, lower, upper, 200)
    assert found.converged
    assert found.point.cost == pytest.approx(wanted.cost, rel=1e-9)
    at_bound = (found.point.x <= lower) | (found.point.x >= upper)
    assert at_bound.tolist() == (wanted.active_mask != 0).tolist()


def test_rosenbrock() -> None:
    def rows(run: int, x: np.ndarray) -> Rows:
        return Rows(np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]]), np.array([[-20 * x[0], 10.0], [-1.0, 0.0]]))

    regression = Regression((Unknown("x", -1.2), Unknown("y", 1.0)), ("only",), rows)
    found = minimize(Objective(regression), regression.start(), *regression.bounds(), 200)
    assert found.converged
    assert found.point.x == pytest.approx([1.0, 1.0])


@pytest.mark.parametrize("reached", [1e-12, 0.5])
def test_a_start_that_cannot_beat_another_is_given_up(reached: float) -> None:
    """Rosenbrock's valley with a floor of 1/2: one start has got below it, or just as far."""

    def rows(run: int, x: np.ndarray) -> Rows:
        residual = np.array([10 * (x[1] - x[0] ** 2), 1 - x[0], 1.0])
        return Rows(residual, np.array([[-20 * x[0], 10.0], [-1.0, 0.0], [0.0, 0.0]]))

    regression = Regression((Unknown("x", -1.2), Unknown("y", 1.0)), ("only",), rows)
    end = minimize(Objective(regression), regression.start(), *regression.bounds(), 200)
    given_up = minimize(
        Objective(replace(regression, reached=reached)), regression.start(), *regression.bounds(), 200, 1e-9
    )
    assert end.converged
    assert not given_up.converged
    assert given_up.iterations < end.iterations


@pytest.mark.parametrize(("steepness", "slow"), [(100.0, False), (1000.0, True)])
def test_a_fit_too_slow_to_beat_another_is_given_up(steepness: float, slow: bool) -> None:
    """Rosenbrock's valley, the steeper the slower: in 40 iterations the cost falls from 2.4 to 0.03 or to 1.5."""

    def rows(run: int, x: np.ndarray) -> Rows:
        residual = np.array([steepness * (x[1] - x[0] ** 2), 1 - x[0]])
        return Rows(residual, np.array([[-2 * steepness * x[0], steepness], [-1.0, 0.0]]))

    regression = Regression((Unknown("x", -1.2), Unknown("y", 1.44)), ("only",), rows)
    beaten = replace(regression, reached=0.1)
    found = minimize(Objective(beaten), regression.start(), *regression.bounds(), 40)
    assert found.iterations == (PACE if slow else 40)


def test_a_step_onto_a_plateau_is_not_taken() -> None:
    """From b = 1 a full step makes exp(-b t) vanish, and with it the sensitivity to b."""
    t = np.array([1.0, 2, 3, 5, 7, 10])
    y = 213.8 * (1 - np.exp(-0.547 * t))

    def rows(run: int, x: np.ndarray) -> Rows:
        e = np.exp(-x[1] * t)
        return Rows(x[0] * (1 - e) - y, np.column_stack([1 - e, x[0] * t * e]))

    regression = Regression((Unknown("a", 1.0), Unknown("b", 1.0)), ("only",), rows)
    assert solve(regression).values == pytest.approx({"a": 213.8, "b": 0.547})


def test_a_step_to_sensitivities_that_overflow_is_not_taken() -> None:
    """The first step ends between 0.95 and 1, where d r / dx is 1e200: its square overflows."""
    times = np.linspace(0.5, 1.5, 20)
    noise = 0.01 * np.cos(9.0 * times)

    def rows(run: int, x: np.ndarray) -> Rows:
        steep = 1e200 if 0.95 < x[0] < 1.0 else 1.0
        return Rows(times * (x[0] ** 2 - 0.8) + noise, (2 * x[0] * steep * times)[:, None])

    solution = solve(Regression((Unknown("p", 0.6),), ("run",), rows))
    assert solution.values["p"] == pytest.approx(0.8**0.5, rel=0.01)


@pytest.mark.parametrize(("left", "arrives"), [(0.5, True), (5.0, False)])
def test_at_an_edge_the_fit_ends_where_no_step_keeps_what_it_promises(left: float, arrives: bool) -> None:
    """A smaller residual is predicted beyond x = 0, where another term rises: a predicted reduction below one standard
    deviation counts as convergence, a larger one means that the model does not fit."""

    def rows(run: int, x: np.ndarray) -> Rows:
        rest = np.ones(100)
        return Rows(
            np.concatenate([[left + x[0], 9.0 if x[0] < 0 else 0.0], rest]),
            np.concatenate([[1.0], np.zeros(101)])[:, None],
        )

    regression = Regression((Unknown("x", 1.0),), ("only",), rows)
    found = minimize(Objective(regression), regression.start(), *regression.bounds(), 100)
    assert found.converged is arrives
    assert found.point.x == pytest.approx([0.0], abs=1e-9)


@pytest.mark.parametrize("rows", [0, 1, 3, 4, 100])
def test_a_fold_keeps_all_products(rows: int) -> None:
    matrix = np.random.default_rng(rows).standard_normal((rows, 4))
    triangle = qr_factor(matrix)
    assert triangle.shape == (4, 4)
    assert np.tril(triangle, -1) == pytest.approx(np.zeros((4, 4)))
    assert triangle.T @ triangle == pytest.approx(matrix.T @ matrix, abs=1e-12)
