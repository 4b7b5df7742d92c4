"""The sentence names the stated value that the baseline contradicts."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vdyn_cli.diagnosis.name.candidate_judgment import _contradicted
from vdyn_cli.inference.regression import Unknown

UNKNOWNS = (
    Unknown("driveline_efficiency", 1.0, prior=(1.0, 0.002)),
    Unknown("mass", 1500.0, prior=(1500.0, 3.0)),
    Unknown("road", 0.0, prior=(0.0, 1e-4), prior_stated=False),
    Unknown("load_zero", 0.0, prior=(0.0, 10.0), per_run=True),
)


@pytest.mark.parametrize(("efficiency", "zeros", "told"), [
    (0.97, (0.0, 0.0), "driveline_efficiency"), (0.999, (5.0, -70.0), "load_zero"), (0.999, (5.0, 0.0), ""),
])  # fmt: skip
def test_it_is_the_one_farthest_off(efficiency: float, zeros: tuple[float, float], told: str) -> None:
    solution = SimpleNamespace(per_run={"load_zero": np.array(zeros)})
    values = {"driveline_efficiency": efficiency, "mass": 1503.0, "road": 1.0}
    base: Any = SimpleNamespace(solution=solution, values=values)
    assert _contradicted(UNKNOWNS, base) == told
