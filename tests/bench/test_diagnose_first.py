"""A fixed part of the table of ``diagnose_first``: none ends before its candidates were tried, each has a report."""

from __future__ import annotations

import pytest

from tests.bench.diagnose_first import GOOD, ROWS, run

# Every row of the table once; the thorough tier runs those whose mechanism another row shows too.
MORE = [
    pytest.param(*case, marks=pytest.mark.thorough)
    for case in ((1, 105), (2, 105), (3, 101), (4, 100), (5, 100), (6, 201))
]


# Gain and radius of seed 105 leave a negative inertia; clocks of seed 101 are 0.147 s apart.
@pytest.mark.slow
@pytest.mark.parametrize(("index", "seed"), [(0, 3), *MORE])
def test_the_baseline_fails_and_the_effect_is_found(index: int, seed: int) -> None:
    trial = run(index, seed)
    assert trial.outcome in GOOD, f"{ROWS[index].about}: {trial.says}"
    assert trial.report
