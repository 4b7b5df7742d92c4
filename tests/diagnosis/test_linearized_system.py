"""A linearized system of compressed rows has the information of the rows, whatever the units."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from tests.diagnosis.linear import Campaign
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.linearized_system import LinearizedRuns, linearize, linearized_system
from vdyn_cli.inference import Regression, Rows, Unknown, solve
from vdyn_cli.inference.linearized_regression import BLOCKS, FEWEST_ROWS

EXTRA = (Unknown("slope", 0.0), Unknown("wave", 0.0))


def linear_of(campaign: Campaign, at: Mapping[str, float] | None = None) -> LinearizedRuns:
    own = {"start": np.zeros(campaign.runs)} if campaign.own else {}
    return linearize(campaign.regression(EXTRA), at or {"level": 2.0}, own)


def whole(linear: LinearizedRuns) -> tuple[np.ndarray, np.ndarray]:
    """All rows over [shared | every run's own], including those of priors."""
    regression = linear.regression
    s, m, g = len(regression.shared), len(regression.own), len(regression.runs)
    columns, y = [], []
    for k, rows in enumerate(linear.rows):
        wide = np.zeros((len(rows.residual), s + m * g))
        wide[:, :s], wide[:, s + m * k : s + m * (k + 1)] = rows.jacobian[:, :s], rows.jacobian[:, s:]
        columns.append(wide)
        y.append(-rows.residual)
    for i, unknown in enumerate([*regression.shared, *regression.own * g]):
        if unknown.prior is not None:
            row = np.zeros((1, s + m * g))
            row[0, i] = 1 / unknown.prior[1]
            value = linear.shared[i] if i < s else linear.own.ravel()[i - s]
            columns.append(row)
            y.append(np.array([(unknown.prior[0] - value) / unknown.prior[1]]))
    return np.vstack(columns), np.concatenate(y)


def test_blocks_keep_all_products_of_the_rows_and_priors() -> None:
    linear = linear_of(Campaign(1, runs=4, priors={"bend": (-1.0, 0.5)}))
    made = linearized_system(linear)
    columns, y = whole(linear)
    assert made.kind == "block"
    np.testing.assert_allclose(made.columns.T @ made.columns, columns.T @ columns, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(made.columns.T @ made.y, columns.T @ y, rtol=1e-9, atol=1e-9)
    assert made.y @ made.y == pytest.approx(y @ y)


def test_runs_keep_all_products_once_their_own_unknowns_are_eliminated() -> None:
    linear = linear_of(Campaign(2, runs=POLICY.runs_as_units, priors={"bend": (-1.0, 0.5)}))
    made = linearized_system(linear)
    columns, y = whole(linear)
    s = len(linear.regression.shared)
    basis = np.linalg.qr(columns[:, s:])[0]
    left = columns[:, :s] - basis @ (basis.T @ columns[:, :s])
    rest = y - basis @ (basis.T @ y)
    np.testing.assert_allclose(made.columns.T @ made.columns, left.T @ left, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(made.columns.T @ made.y, left.T @ rest, rtol=1e-9, atol=1e-9)
    assert made.y @ made.y == pytest.approx(rest @ rest)


def test_a_step_on_the_sheet_is_the_fit() -> None:
    campaign = Campaign(3, runs=6, hidden={"slope": 0.8}, priors={"bend": (-1.0, 0.5)})
    made = linearized_system(linear_of(campaign))
    step = np.linalg.lstsq(made.columns, made.y, rcond=None)[0]
    fitted = solve(campaign.regression(EXTRA))
    for name, change in zip(made.names[:4], step, strict=False):
        assert (2.0 if name == "level" else 0.0) + change == pytest.approx(fitted.values[name], rel=1e-6)


@pytest.mark.parametrize(("runs", "kind"), [(POLICY.runs_as_units - 1, "block"), (POLICY.runs_as_units, "run")])
def test_the_run_is_the_unit_from_so_many_on(runs: int, kind: str) -> None:
    assert linearized_system(linear_of(Campaign(4, runs=runs))).kind == kind


@pytest.mark.parametrize("runs", [1, 2, 5])
def test_few_runs_are_cut_into_blocks_that_keep_enough_rows(runs: int) -> None:
    made = linearized_system(linear_of(Campaign(5, runs=runs, rows=90)))
    of_runs = made.run >= 0
    assert of_runs.sum() == pytest.approx(min(BLOCKS, runs * (90 // FEWEST_ROWS)), rel=0.05)
    assert made.counts[of_runs].sum() == runs * 90
    assert np.median(made.counts[of_runs]) >= FEWEST_ROWS
    assert made.effective_units > 6


def test_short_runs_are_cut_into_fewer_blocks() -> None:
    made = linearized_system(linear_of(Campaign(6, runs=2, rows=20)))
    assert (made.run >= 0).sum() == 2 * (20 // FEWEST_ROWS)


def test_priors_are_units_of_their_own() -> None:
    made = linearized_system(linear_of(Campaign(7, runs=3, priors={"bend": (-1.0, 0.5)})))
    assert (made.run == -1).sum() == 3 + 1  # every run's start, and the bend
    assert np.all(made.counts[made.run == -1] == 1)
    for unit in np.flatnonzero(made.run == -1):
        assert np.count_nonzero(made.columns[made.label == unit]) == 1


def test_whole_runs_hold_the_rows_of_their_blocks() -> None:
    linear = linear_of(Campaign(8, runs=3, priors={"bend": (-1.0, 0.5)}))
    blocks = linearized_system(linear)
    runs = blocks.by_run()
    assert runs.kind == "run"
    assert runs.units == 3 + (blocks.run == -1).sum()
    assert [int(c) for c in runs.counts[:3]] == [72, 72, 72]
    np.testing.assert_allclose(runs.columns.T @ runs.y, blocks.columns.T @ blocks.y)
    for k in range(3):
        mine = blocks.columns[blocks.run[blocks.label] == k]
        np.testing.assert_array_equal(runs.columns[runs.label == k], mine)
    assert runs.by_run() is runs
    assert np.all(np.diff(runs.label) >= 0)
    sums = np.add.reduceat(runs.columns, runs.starts, axis=0)  # priors stand between the runs' blocks on the sheet
    np.testing.assert_allclose(sums, [runs.columns[runs.label == u].sum(axis=0) for u in range(runs.units)])


def test_equal_runs_have_their_number_as_effective_number_and_a_single_strong_one_hardly_more_than_one() -> None:
    assert linearized_system(linear_of(Campaign(9, runs=20, own=False))).effective_units == pytest.approx(20, rel=0.05)
    regression = Regression(
        (Unknown("a", 0.0),),
        tuple("abcdefgh"),
        lambda k, theta: Rows(
            theta[0] * np.ones(30) * (100 if k == 0 else 1), np.full((30, 1), 100.0 if k == 0 else 1.0)
        ),
    )
    assert linearized_system(linearize(regression, {}, {})).by_run().effective_units == pytest.approx(1.0, abs=0.01)


def test_what_is_not_finite_is_refused() -> None:
    regression = Regression((Unknown("a", 0.0),), ("one",), lambda k, theta: Rows(np.ones(9), np.full((9, 1), np.nan)))
    with pytest.raises(ArithmeticError, match="no finite derivatives"):
        linearize(regression, {}, {})
