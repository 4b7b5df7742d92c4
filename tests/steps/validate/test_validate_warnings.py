"""The warnings of a validation."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np

from vdyn_cli.steps.validate.text import warnings
from vdyn_cli.steps.validate.validation import Validation


def contradicted(names: tuple[str, ...]) -> Validation:
    stated = ("wheel_radius", "rolling_resistance", "mass")
    made = SimpleNamespace(
        outside=(),
        contradicted=names,
        prior=SimpleNamespace(names=stated, values={"wheel_radius": 0.31, "rolling_resistance": 0.01, "mass": 1500.0},
                              std=np.array([0.001, 0.0003, 8.0])),
        posterior=SimpleNamespace(values=np.array([0.314, 0.012, 1501.0]), pull=np.array([4.0, 7.0, 0.1])),
    )  # fmt: skip
    return cast("Validation", made)


def test_parameters_that_one_fit_contradicts_are_one_warning_the_farthest_first() -> None:
    (found,) = warnings(contradicted(("wheel_radius", "rolling_resistance")))
    assert found.index("rolling resistance = 0.012") < found.index("wheel radius = 0.314")
    assert "one of them or the drive torque may be wrong" in found
    (one,) = warnings(contradicted(("wheel_radius",)))
    assert "it or the drive torque may be wrong" in one
    assert warnings(contradicted(())) == ()
