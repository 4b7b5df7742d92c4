"""The parts of a wheel's moment balance whose laws can be replaced by free curves."""

from __future__ import annotations

from collections.abc import Sequence

from vdyn_cli.physics.laws.wheel import bearing
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.free_part import Part, sensor_part
from vdyn_cli.steps.free_profiles import span_of

TORQUE, FORCE, ACCELERATION = 2.0, 100.0, 0.2  # N m, N, m/s^2: plausible sizes of drag and of errors of readings
SENSORS = {
    "hub_torque": (TORQUE, "N m", "the hub torque reading"),
    "hub_force_x": (FORCE, "N", "the longitudinal hub force reading"),
    "acceleration": (ACCELERATION, "m/s^2", "the acceleration reading"),
}


def bearing_part(logs: Sequence[Log]) -> tuple[Part, ...]:
    """The bearing's torque over the wheel's speed in the ``logs`` of the runs; no part without logs."""
    if not logs:
        return ()
    turn = span_of([log["wheel_speed"] for log in logs], 1.0)
    spin = Part(
        "bearing", "", "wheel_speed", turn, TORQUE, "N m", "rad/s", "the bearing's drag torque", "wheel speed",
        anchored=False, law=bearing, arguments=lambda x, values: {"bearing_torque": 0.0}, related=("brake",),
    )  # fmt: skip
    return (spin,)


def wheel_parts(logs: Sequence[Log]) -> tuple[Part, ...]:
    """The parts: the bearing's torque over the wheel's speed, and the readings over their value.

    Parameters
    ----------
    logs : of the runs; no parts without logs.
    """
    readings = (
        sensor_part(n, span_of([log[n] for log in logs], 0.1), size, unit, what)
        for n, (size, unit, what) in SENSORS.items()
        if logs and all(n in log for log in logs)
    )
    return (*bearing_part(logs), *readings)
