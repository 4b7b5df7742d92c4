"""A wheel spun up and down on a stand: torque at its hub, drag of its bearing."""

from __future__ import annotations

from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import ModelBuilder, Signals
from vdyn_cli.physics.laws.standstill_friction import turned
from vdyn_cli.physics.laws.wheel import bearing, bearing_drag_torque, free_wheel_spin

DRAG = ("bearing_torque", "bearing_viscous")

LAG = "lag"  # s, factor of the noise of the torque's readings where their filter is corrected
LEVER = "lever"  # torque per reading, 1 without a gain error, to compare an impulse with the noise of the readings


def _assemble(e: ModelBuilder, u: Signals) -> None:
    """The wheel's speed from the torque at its hub, with a drag by the measured speed, whose noise matters little."""
    p = e.p
    speed, run_time = u.wheel_speed, e.state("run_time")
    sense = turned(speed)
    drag = e(
        bearing_drag_torque,
        bearing_torque=p.bearing_torque,
        bearing_viscous=p.bearing_viscous,
        wheel_speed=speed,
        sense=sense,
    )
    torque = e("hub_torque", value=u.hub_torque, run_time=run_time) - p.hub_torque_zero
    per_reading = e("hub_torque", value=1.0, run_time=run_time) - e("hub_torque", value=0.0, run_time=run_time)
    turning = e(
        free_wheel_spin,
        hub_torque=torque,
        bearing_torque=e(bearing, bearing_torque=drag, wheel_speed=speed, sense=sense, run_time=run_time),
        wheel_inertia=p.wheel_inertia,
    )
    e.integrate(wheel_speed=turning, run_time=1.0)
    e.sensor("driven", e.state("wheel_speed", u.wheel_speed), turning, spun_by_torque=torque / p.wheel_inertia)
    e.sensor(LEVER, per_reading)
    e.sensor(LAG, e("driven", value=0.0, spun_by_torque=1.0))


FREE_WHEEL = Model("free wheel", _assemble, ("wheel_inertia", *DRAG, "hub_torque_zero"), ("hub_torque", "wheel_speed"))
