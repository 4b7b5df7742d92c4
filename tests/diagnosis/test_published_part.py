"""The band of a part's curve includes the free curve's interval and the law of the catalog that follows it."""

from __future__ import annotations

import numpy as np

from vdyn_cli.diagnosis.part.part_curve import Curve
from vdyn_cli.diagnosis.part.published_part import points_of
from vdyn_cli.steps.free_part import Part

PART = Part(element="damper", place="rear", coordinate="stroke_rate", span=(-2.0, 2.0), size=500.0, unit="N",
            coordinate_unit="m/s", what="the rear damper's force", over="rate", scale=0.005)  # fmt: skip


def test_the_band_holds_a_law_that_follows_the_curve() -> None:
    at, value = np.linspace(-1.0, 1.0, 5), np.array([-3.0, -1.0, 0.0, 1.0, 3.0])
    curve = Curve(PART, at, value, np.full(5, 0.1), value, np.eye(5))
    free = points_of(curve, None)
    both = points_of(curve, value + np.array([0.0, 0.5, 0.0, 0.0, -0.02]))
    assert [p.value for p in both] == [p.value for p in free]
    assert both[0].interval95 == free[0].interval95
    assert both[1].interval95[0] < free[1].interval95[0]
    assert both[1].interval95[1] > value[1] + 0.5
