"""Grade of the road and grade resistance."""

from __future__ import annotations

from typing import Literal

from vdyn_cli.engine.maths import sqrt
from vdyn_cli.engine.model_builder import ModelBuilder, Number, Signals
from vdyn_cli.quantities.constants import GRAVITY

GradeSource = Literal["stated", "sensor", "elevation"]


def read_grade(e: ModelBuilder, grade: Number, source: GradeSource) -> Number:
    """The grade of an input, with the errors of its source.

    Parameters
    ----------
    grade : rise over run. source : "stated" (without error), "sensor" in the car (law ``logged_grade``), or "elevation"
        over the distance by the measured speed (law ``risen_grade``: a speed that reads too high flattens the hills).
    """
    if source == "stated":
        return grade
    made: Number = e("logged_grade" if source == "sensor" else "risen_grade", value=grade)
    return made


def climb(s: Signals) -> Number:
    """Component of the weight along the road, N, positive uphill.

    M g sin(atan(i)) = M g i / sqrt(1 + i^2)

    Parameters
    ----------
    s : mass M kg, grade i (rise over run).
    """
    return s.mass * GRAVITY * s.grade / sqrt(1.0 + s.grade**2)


def slope(s: Signals) -> Number:
    """Grade in the direction of driving, with a mean slope of the road that is uphill on the way out.

    i = i_known + h i_road

    Parameters
    ----------
    s : grade (known, in the direction of driving), road_slope (uphill on the way out), heading h (+1 out, -1 back).
    """
    return s.grade + s.heading * s.road_slope
