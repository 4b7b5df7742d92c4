"""The parts of the load-transfer balance whose laws can be replaced by free curves."""

from __future__ import annotations

from collections.abc import Sequence

from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.free_part import Part, addition, sensor_part
from vdyn_cli.steps.free_profiles import span_of

MOMENT, LOAD = 200.0, 50.0  # N m, N: plausible sizes of a missing moment, and of a load reading's error


def balance_parts(logs: Sequence[Log]) -> tuple[Part, ...]:
    """The parts: the body's moment over acceleration and pitch rate, the load readings over their value.

    The moment is zero at rest, because a constant moment is that of the weight, through ``cg_to_rear``.
    """
    push = span_of([log["acceleration"] for log in logs], 1.0)
    parts = [
        Part(
            "motion_moment", "", "acceleration", push, MOMENT, "N m", "m/s^2", "the moment of the body's motion",
            "acceleration", law=addition, related=("climb", "acceleration"),
        )
    ]  # fmt: skip
    if all("pitch_rate" in log for log in logs):
        rate = span_of([log["pitch_rate"] for log in logs], 0.02)
        parts.append(
            Part(
                "motion_moment", "", "pitch_rate", rate, MOMENT, "N m", "rad/s", "the moment of the body's motion",
                "pitch rate", law=addition,
            )
        )  # fmt: skip
    for place in ("front", "rear"):
        if all(f"{place}_load" in log for log in logs):
            load = span_of([log[f"{place}_load"] for log in logs], 100.0)
            parts.append(sensor_part("wheel_force", load, LOAD, "N", f"the {place} load reading", place))
    return tuple(parts)
