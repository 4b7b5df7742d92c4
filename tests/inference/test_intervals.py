"""Intervals from independent units compared with refits and expectation, and their coverage."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.inference.gusty import TRUTH, Case, campaign
from vdyn_cli.inference import Regression, Rows, Solution, Unknown, solve
from vdyn_cli.inference.intervals import effective_number, equal_information_blocks, t_quantile

BLOCK = np.repeat(np.arange(4), 10)


def line(runs: int, seed: int, lengths: tuple[int, ...] = (), block: bool = False) -> Regression:
    """y = slope x + offset of the run + white noise."""
    rng = np.random.default_rng(seed)
    sizes = lengths or (40,) * runs
    xs = [rng.uniform(0, 1, n) for n in sizes]
    data = [2.0 * x + rng.standard_normal() + rng.standard_normal(x.size) for x in xs]

    def rows(run: int, theta: np.ndarray) -> Rows:
        design = np.column_stack([xs[run], np.ones(xs[run].size)])
        return Rows(design @ theta - data[run], design, BLOCK if block else None)

    unknowns = (Unknown("slope", 0.0), Unknown("offset", 0.0, per_run=True, nuisance=True))
    return Regression(unknowns, tuple(f"run {k}" for k in range(runs)), rows)


def without(regression: Regression, run: int, block: int | None) -> Solution:
    def rows(k: int, theta: np.ndarray) -> Rows:
        full = regression.rows(k, theta)
        keep = np.full(full.residual.size, k != run) if block is None else (full.block != block) | (k != run)
        return Rows(full.residual[keep], full.jacobian[keep])

    if block is not None:
        return solve(Regression(regression.unknowns, regression.runs, rows))
    left = [k for k in range(len(regression.runs)) if k != run]
    return solve(
        Regression(regression.unknowns, tuple(regression.runs[k] for k in left), lambda i, t: rows(left[i], t))
    )


def test_a_deletion_is_the_refit_without_the_run() -> None:
    regression = line(6, 0)
    solution = solve(regression, units="run")
    for unit in solution.units:
        refit = without(regression, unit.run, None)
        assert unit.change[0] == pytest.approx(refit.values["slope"] - solution.values["slope"], rel=1e-6)


def test_a_deletion_is_the_refit_without_the_block() -> None:
    regression = line(3, 1, block=True)
    solution = solve(regression, units="block")
    assert len(solution.units) == 12
    for unit in solution.units:
        refit = without(regression, unit.run, unit.block)
        assert unit.change[0] == pytest.approx(refit.values["slope"] - solution.values["slope"], rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("units", "runs", "lengths"),
    [("run", 6, ()), ("run", 6, (200, 20, 20, 40, 40, 80)), ("block", 4, ()), ("block", 1, (60,))],
)
def test_the_variance_is_unbiased_where_the_noise_is_as_assumed(
    units: str, runs: int, lengths: tuple[int, ...]
) -> None:
    """Over campaigns of one design the mean of std^2 is the model's variance, and its scatter gives the degrees."""
    squares, degrees, classical = [], [], 0.0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        fixed = line(runs, 99, lengths)
        truth = np.array([2.0, 0.5])
        data = [fixed.rows(k, truth).jacobian @ truth for k in range(runs)]
        noisy = [d + rng.standard_normal(d.size) for d in data]
        rows = [fixed.rows(k, truth).jacobian for k in range(runs)]
        regression = Regression(
            fixed.unknowns, fixed.runs, lambda k, t, rows=rows, noisy=noisy: Rows(rows[k] @ t - noisy[k], rows[k])
        )
        solution = solve(regression, units=units)  # type: ignore[arg-type]
        squares.append(solution.std["slope"] ** 2)
        degrees.append(solution.degrees["slope"])
        total = sum((r[:, 0] - r[:, 0].mean()) @ (r[:, 0] - r[:, 0].mean()) for r in rows)
        classical = 1.0 / float(total)
    # equal-information cuts move a little with the data, the design does not: hence the margin on the degrees
    assert np.mean(squares) == pytest.approx(classical, rel=0.12)
    assert 2 * np.mean(squares) ** 2 / np.var(squares) == pytest.approx(np.mean(degrees), rel=0.35)


def test_unequal_runs_have_fewer_degrees_than_equal_ones() -> None:
    equal = solve(line(8, 0), units="run")
    unequal = solve(line(8, 0, (300, 20, 20, 20, 20, 20, 20, 20)), units="run")
    assert equal.degrees["slope"] == pytest.approx(7, abs=0.6)
    assert unequal.degrees["slope"] < 3
    assert unequal.effective_units < 3


@pytest.mark.parametrize(
    ("runs", "lengths", "unit"),
    [
        (8, (), "run"),
        (6, (), "run"),
        (5, (), "block"),
        (1, (40,), "block"),
        (8, (900, 20, 20, 20, 20, 20, 20, 20), "block"),
        (1, (8,), "model"),
    ],
)
def test_the_unit_of_evidence(runs: int, lengths: tuple[int, ...], unit: str) -> None:
    solution = solve(line(runs, 5, lengths))
    assert solution.unit == unit
    assert bool(solution.warnings) == (unit == "model")
    if unit == "block":
        assert solution.n_units >= 12
    if unit == "model":
        assert "are based on the noise model alone" in solution.warnings[0]
        assert solution.std == solution.classical_std


def coverage(case: Case, seeds: int) -> np.ndarray:
    inside = []
    for seed in range(seeds):
        solution = solve(campaign(case, 10_000 + seed))
        inside.append([solution.interval95[n][0] <= TRUTH[n] <= solution.interval95[n][1] for n in TRUTH])
    return np.sum(inside, axis=0)


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [Case(8), Case(8, believed_gust=0.3, believed_memory=3.0), Case(4), Case(4, run_wind=0.3, wind_prior=0.3)],
    ids=["8 runs", "8 runs, wrong noise", "4 runs", "4 runs, wind under a prior"],
)
def test_intervals_cover(case: Case) -> None:
    """40 campaigns: at 95 % fewer than 33 inside has probability 2e-4. The bench asks for 92 to 97 % of 300."""
    assert np.all(coverage(case, 40) >= 33)


@pytest.mark.slow
def test_textbook_intervals_would_not_cover_in_gusts_assumed_too_weak() -> None:
    """The reason for independent units: the same 40 campaigns by sample count."""
    case, inside = Case(8, believed_gust=0.3, believed_memory=3.0), 0
    for seed in range(40):
        solution = solve(campaign(case, 10_000 + seed))
        inside += abs(solution.values["f"] - TRUTH["f"]) < 1.96 * solution.classical_std["f"]
    assert inside < 33


@given(st.lists(st.floats(0, 1e6), min_size=1, max_size=300), st.integers(1, 40))
def test_blocks_cover_all_rows_in_order(information: list[float], blocks: int) -> None:
    labels = equal_information_blocks(np.array(information), blocks)
    assert len(labels) == len(information)
    assert labels[0] == 0
    assert set(np.diff(labels)) <= {0, 1}
    assert labels[-1] < blocks


def test_blocks_carry_equal_information() -> None:
    information = np.exp(-np.linspace(0, 3, 10_000))
    labels = equal_information_blocks(information, 16)
    shares = np.bincount(labels, information)
    assert shares == pytest.approx(np.full(16, information.sum() / 16), rel=0.01)


def test_blocks_without_information_have_equal_length() -> None:
    assert np.bincount(equal_information_blocks(np.zeros(40), 4)).tolist() == [10, 10, 10, 10]


def test_effective_number() -> None:
    assert effective_number(np.ones((7, 1))) == pytest.approx([7])
    assert effective_number(np.array([[1.0], [0.0], [0.0]])) == pytest.approx([1])


def test_student() -> None:
    assert t_quantile(7) == pytest.approx(2.3646, abs=1e-4)
    assert t_quantile(np.inf) == pytest.approx(1.95996, abs=1e-4)
