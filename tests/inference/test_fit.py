"""The fit compared with dense linear algebra and scipy, and the fits that it must refuse."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from vdyn_cli.inference import Regression, Rows, Solution, Unknown, solve
from vdyn_cli.quantities.errors import ResultError

NOISE = 0.05
TIME = np.linspace(0.0, 20.0, 120)


def decay(a: float, b: float, start: float, time: np.ndarray = TIME) -> tuple[np.ndarray, np.ndarray]:
    """start exp(-a t) - b t and its derivatives to a, b, start."""
    e = np.exp(-a * time)
    return start * e - b * time, np.column_stack([-time * start * e, -time, e])


def recorded(runs: int, seed: int = 0) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [decay(0.1, 0.2, 10.0 + k)[0] + NOISE * rng.standard_normal(TIME.size) for k in range(runs)]


def decays(data: list[np.ndarray], **changes: Unknown) -> Regression:
    def rows(run: int, theta: np.ndarray) -> Rows:
        value, slopes = decay(*theta)
        return Rows((value - data[run]) / NOISE, slopes / NOISE)

    unknowns = {
        "start": Unknown("start", 8.0, per_run=True),
        "a": Unknown("a", 0.05, 0.0, 1.0, "1/s"),
        "b": Unknown("b", 0.1, 0.0, 5.0, "m/s"),
    }
    return Regression(tuple({**unknowns, **changes}.values()), tuple(f"run {k}" for k in range(len(data))), rows)


def linear(
    design: list[np.ndarray], data: list[np.ndarray], unknowns: tuple[Unknown, ...], block: np.ndarray | None = None
) -> Regression:
    names = tuple(f"run {k}" for k in range(len(data)))
    return Regression(unknowns, names, lambda k, x: Rows(design[k] @ x - data[k], design[k], block))


def dense(solution: Solution, regression: Regression) -> tuple[np.ndarray, np.ndarray]:
    """Scipy's answer on the stacked problem, and the textbook's standard errors."""
    s, runs = len(regression.shared), len(regression.runs)

    def stacked(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        residuals, jacobians = [], []
        for k in range(runs):
            rows = regression.rows(k, regression.local(x, k))
            wide = np.zeros((rows.residual.size, x.size))
            wide[:, :s] = rows.jacobian[:, :s]
            own = rows.jacobian.shape[1] - s
            wide[:, s + k * own : s + (k + 1) * own] = rows.jacobian[:, s:]
            residuals.append(rows.residual)
            jacobians.append(wide)
        return np.concatenate(residuals), np.vstack(jacobians)

    found = least_squares(
        lambda x: stacked(x)[0], regression.start(), jac=lambda x: stacked(x)[1], x_scale="jac", xtol=1e-14, ftol=1e-14
    )
    variance = 2 * found.cost / (found.fun.size - found.x.size)
    return found.x, np.sqrt(variance * np.diag(np.linalg.inv(found.jac.T @ found.jac)))


@pytest.mark.parametrize("runs", [1, 3, 20])
def test_the_same_answer_as_a_dense_fit(runs: int) -> None:
    regression = decays(recorded(runs))
    solution = solve(regression)
    values, std = dense(solution, regression)
    assert list(solution.values.values()) == pytest.approx(values[:2], rel=1e-7)
    assert solution.per_run["start"] == pytest.approx(values[2:], rel=1e-7)
    assert list(solution.classical_std.values()) == pytest.approx(std[:2], rel=1e-6)
    assert solution.per_run_std["start"] == pytest.approx(std[2:], rel=1e-6)
    assert solution.names == ("a", "b")
    assert [r.size for r in solution.residuals] == [TIME.size] * runs
    assert 2 * solution.cost == pytest.approx(sum(float(r @ r) for r in solution.residuals))


def test_two_calls_give_the_same_bytes() -> None:
    first, second = solve(decays(recorded(4))), solve(decays(recorded(4)))
    assert first.values == second.values
    assert first.interval95 == second.interval95


def test_each_run_may_have_its_own_start() -> None:
    data = recorded(3)
    regression = decays(data)
    near = Regression(regression.unknowns, regression.runs, regression.rows, {"start": np.array([10.0, 11.0, 12.0])})
    assert near.start().tolist() == [0.05, 0.1, 10.0, 11.0, 12.0]
    assert solve(near).values == pytest.approx(solve(regression).values, rel=1e-8)


def test_per_run_unknowns_alone_can_be_fitted() -> None:
    rng = np.random.default_rng(3)
    data = [rng.standard_normal(30) + k for k in range(3)]
    unknown = Unknown("level", 0.0, per_run=True)
    solution = solve(linear([np.ones((30, 1))] * 3, data, (unknown,)))
    assert solution.values == {}
    assert solution.per_run["level"] == pytest.approx([d.mean() for d in data])


def test_a_prior_is_one_more_measurement() -> None:
    rng = np.random.default_rng(4)
    design = [rng.standard_normal((20, 2)) for _ in range(2)]
    data = [d @ [1.0, 2.0] + rng.standard_normal(20) for d in design]
    shared = (Unknown("p", 0.0), Unknown("q", 0.0, prior=(1.5, 0.1)))
    stacked = np.vstack([*design, [0.0, 10.0]])
    wanted = np.linalg.lstsq(stacked, np.concatenate([*data, [15.0]]), rcond=None)[0]
    assert list(solve(linear(design, data, shared)).values.values()) == pytest.approx(wanted)


def test_a_prior_of_each_run_holds_what_the_data_cannot() -> None:
    """Only its prior separates each run's offset from the shared level."""
    data = [np.full(10, 3.0), np.full(10, 5.0)]
    unknowns = (Unknown("level", 0.0), Unknown("offset", 0.0, prior=(0.0, 1.0), per_run=True))
    solution = solve(linear([np.ones((10, 2))] * 2, data, unknowns))
    assert solution.values["level"] == pytest.approx(4.0)
    assert solution.per_run["offset"] == pytest.approx([-10 / 11, 10 / 11])


def test_a_value_at_its_bound_is_refused_by_name() -> None:
    with pytest.raises(ResultError) as caught:
        solve(decays(recorded(3), b=Unknown("b", 0.1, 0.0, 0.15, "m/s")))
    (finding,) = caught.value.findings
    assert finding.what == "b lies at its upper bound"
    assert finding.got == "0.15 m/s"
    assert "state its value" in finding.remedy


def test_a_bound_that_rounding_cannot_meet_exactly_is_still_met() -> None:
    for upper in (0.15, 0.1234567, 0.1 + 1e-9):
        with pytest.raises(ResultError, match="b lies at its upper bound"):
            solve(decays(recorded(3), b=Unknown("b", 0.07, 0.0, upper)))


def test_a_run_s_own_value_at_its_bound_is_refused_with_the_run() -> None:
    with pytest.raises(ResultError, match="start of run 2 lies at its upper bound"):
        solve(decays(recorded(3), start=Unknown("start", 8.0, 0.0, 11.5, "m", per_run=True)))


def test_a_bound_may_be_met_on_the_way() -> None:
    """From a far start the first steps run into the bounds; the answer lies inside."""
    far = decays(recorded(3), a=Unknown("a", 0.95, 0.0, 1.0), b=Unknown("b", 4.9, 0.0, 5.0))
    assert solve(far).values == pytest.approx(solve(decays(recorded(3))).values, rel=1e-7)


def test_start_outside_its_range_is_brought_inside() -> None:
    assert solve(decays(recorded(3), a=Unknown("a", -1.0, 0.0, 1.0))).values["a"] == pytest.approx(0.1, rel=0.02)


@pytest.mark.parametrize("bad", [lambda: np.full(TIME.size, np.nan), lambda: 1 / 0], ids=["nan", "raises"])
def test_a_model_that_fails_at_the_start_is_reported_with_the_start(bad: Callable[[], np.ndarray]) -> None:
    regression = decays(recorded(1))
    broken = Regression(regression.unknowns, regression.runs, lambda k, x: Rows(bad(), np.zeros((TIME.size, 3))))
    with pytest.raises(ResultError) as caught:
        solve(broken)
    assert "a = 0.05 1/s" in caught.value.findings[0].got


@pytest.mark.parametrize("raises", [False, True])
def test_a_model_that_fails_on_the_way_makes_shorter_steps(raises: bool) -> None:
    regression = decays(recorded(2))

    def fragile(run: int, theta: np.ndarray) -> Rows:
        rows = regression.rows(run, theta)
        if theta[0] > 0.101:
            if raises:
                raise FloatingPointError("unstable step size")
            return Rows(np.full_like(rows.residual, np.inf), rows.jacobian)
        return rows

    found = solve(Regression(regression.unknowns, regression.runs, fragile))
    assert found.values == pytest.approx(solve(regression).values, rel=1e-6)


def test_no_convergence_is_an_error_that_says_what_still_moves() -> None:
    with pytest.raises(ResultError, match="did not converge in 1 iterations") as caught:
        solve(decays(recorded(2)), most_iterations=1)
    assert "next step" in caught.value.findings[0].got


def test_a_function_of_the_unknowns_has_a_std_and_an_interval() -> None:
    solution = solve(decays(recorded(8)))
    gradient = {"a": 2.0, "b": -1.0}
    g = np.array([2.0, -1.0])
    assert solution.std_of(gradient) == pytest.approx(np.sqrt(g @ solution.covariance @ g))
    assert solution.std_of(g) == solution.std_of(gradient)
    assert solution.std_of({"a": 1.0}) == pytest.approx(solution.std["a"])
    assert solution.interval_of(solution.values["b"], {"b": 1.0}) == pytest.approx(solution.interval95["b"])
    assert solution.interval_of(3.0, {}) == (3.0, 3.0)
    with pytest.raises(KeyError, match="mass"):
        solution.std_of({"mass": 1.0})


def test_correlation_by_name() -> None:
    correlation = solve(decays(recorded(8))).correlation
    assert correlation["a"]["a"] == pytest.approx(1.0)
    assert correlation["a"]["b"] == correlation["b"]["a"]
    assert -1.0 < correlation["a"]["b"] < -0.5


@pytest.mark.parametrize("runs", [2, 8])
def test_the_triangles_of_the_units_hold_all_the_data(runs: int) -> None:
    regression = decays(recorded(runs))
    solution = solve(regression)
    for run in range(runs):
        theta = np.array([*solution.values.values(), solution.per_run["start"][run]])
        rows = regression.rows(run, theta)
        whole = np.column_stack([rows.jacobian[:, 2:], rows.jacobian[:, :2], rows.residual])
        parts = sum(u.factor.T @ u.factor for u in solution.units if u.run == run)
        assert parts == pytest.approx(whole.T @ whole, rel=1e-9, abs=1e-6)


def test_given_blocks_are_kept_and_channels_are_cut_by_time() -> None:
    data = recorded(1)
    labels = np.repeat(np.arange(12), 10)
    regression = decays(data)
    given = Regression(
        regression.unknowns,
        regression.runs,
        lambda k, x: Rows(regression.rows(k, x).residual, regression.rows(k, x).jacobian, block=labels + 7),
    )
    solution = solve(given)
    assert sorted((u.run, u.block) for u in solution.units) == [(0, k) for k in range(12)]

    order = np.random.default_rng(0).permutation(TIME.size)

    def shuffled(run: int, theta: np.ndarray) -> Rows:
        rows = regression.rows(run, theta)
        return Rows(rows.residual[order], rows.jacobian[order], time=TIME[order])

    mixed = solve(Regression(regression.unknowns, regression.runs, shuffled))
    straight = solve(regression)
    assert mixed.std == pytest.approx(straight.std, rel=1e-6)
    assert mixed.n_units == straight.n_units


def test_parts_of_a_run_are_one_unit() -> None:
    """A run in two parts has the interval of the whole run, not that of twice as many runs."""
    rng = np.random.default_rng(3)
    design = [np.column_stack([np.ones(20), TIME[:20]]) for _ in range(8)]
    data = [d @ [1.0, 2.0] + rng.standard_normal() + 0.1 * rng.standard_normal(20) for d in design]
    unknowns = (Unknown("a", 0.0), Unknown("b", 0.0))
    whole = solve(linear(design, data, unknowns), units="run")
    halves = linear([h for d in design for h in np.split(d, 2)], [h for d in data for h in np.split(d, 2)], unknowns)
    parts = solve(replace(halves, origins=tuple(np.arange(16) // 2)), units="run")
    assert parts.n_units == 8
    assert parts.std == pytest.approx(whole.std)
    assert parts.interval95["a"] == pytest.approx(whole.interval95["a"])
