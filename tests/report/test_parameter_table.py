from __future__ import annotations

from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.report.parameter_table import parameter_rows


def estimate(*spans: str) -> Estimate:
    return Estimate(1.0, 0.1, (0.8, 1.2), "m^2", "drag coefficient times frontal area", "coastdown", spans=spans)


def test_parameters_that_hold_the_same_answers_share_one_note() -> None:
    rows = parameter_rows(
        {
            "drag_area": estimate("speed_scale"),
            "rolling_resistance": estimate("speed_scale"),
            "mass": estimate(),
            "road_load_f0": estimate("baseline", "headwind"),
        }
    )
    assert [row.mark for row in rows] == ["a", "a", "", "b"]
    assert [row.doubtful for row in rows] == [False, False, False, True]
    assert rows[0].spans == "a speed with a wrong gain"
