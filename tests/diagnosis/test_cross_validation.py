"""Systems with one run or block left out."""

import numpy as np
import pytest

from vdyn_cli.diagnosis.gain.cross_validation import CrossValidation
from vdyn_cli.diagnosis.strategies.linearized_system import LinearizedSystem


def system(runs: int) -> LinearizedSystem:
    """Runs of four rows over three unknowns, and a prior."""
    rng = np.random.default_rng(4)
    columns, y = rng.standard_normal((4 * runs + 1, 3)), rng.standard_normal(4 * runs + 1)
    label = np.append(np.repeat(np.arange(runs), 4), runs).astype(np.int64)
    counts = np.append(np.full(runs, 4), 1)
    return LinearizedSystem(("a", "b", "c"), columns, y, label, np.append(np.arange(runs), -1), counts, "run")


@pytest.mark.parametrize("runs", [2, 5])
def test_the_factor_of_the_rest_has_the_products_of_its_rows(runs: int) -> None:
    left_out = CrossValidation(system(runs), 2)
    assert len(left_out.folds) == runs
    for k, (run, rows) in enumerate(left_out.folds):
        rest, kept = left_out.training(k), left_out.training_by_unit(k)
        assert run == k
        assert len(kept.y) == np.count_nonzero(~rows)
        for one in (rest, kept):
            assert np.allclose(one.columns.T @ one.columns, left_out.system.columns[~rows].T @ kept.columns)
            assert np.allclose(one.columns.T @ one.y, left_out.system.columns[~rows].T @ left_out.system.y[~rows])
