"""One half-shaft: its torque from the measured twist of its ends and the rate of twist."""

from __future__ import annotations

from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import ModelBuilder, Signals
from vdyn_cli.physics.laws.torsion_shaft import shaft


def _assemble(e: ModelBuilder, u: Signals) -> None:
    p = e.p
    torque = e(
        shaft,
        twist=e("twist", value=u.twist) - p.twist_zero,
        twist_rate=e("twist_rate", value=u.twist_rate) - p.rate_zero,
        stiffness=p.shaft_stiffness,
        damping=p.shaft_damping,
    )
    about = {"run_time": u.run_time, "motor_acceleration": u.motor_acceleration}
    e.sensor("shaft_torque", torque + p.torque_zero, **about)


HALF_SHAFT = Model(
    "half shaft",
    _assemble,
    ("shaft_stiffness", "shaft_damping", "twist_zero", "rate_zero", "torque_zero"),
    ("twist", "twist_rate", "run_time", "motor_acceleration"),
)
