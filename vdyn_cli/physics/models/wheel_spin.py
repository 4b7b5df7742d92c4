"""One wheel between its force sensor and the road, driven by the measured torque and forces."""

from __future__ import annotations

from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import ModelBuilder, Signals
from vdyn_cli.physics.laws.brake import brake
from vdyn_cli.physics.laws.standstill_friction import turned
from vdyn_cli.physics.laws.wheel import bearing, wheel_spin

INPUTS = ("hub_torque", "hub_force_x", "hub_force_z", "acceleration", "wheel_speed")


READINGS = ("hub", "driven", "carried")  # their sum is the wheel's speed
LEVER = "lever"  # m, of the forces at the hub, to compare a moment with their noise
MASS = "mass"  # kg, factor of the accelerometer's noise
LAG = "lag"  # s, factor of the noise of the torque's readings where their filter is corrected


def _assemble(e: ModelBuilder, u: Signals) -> None:
    """The wheel's speed from the readings at its hub; ``u.wheel_speed`` gives only the initial speed.

    The parts due to the hub's torque, and to the longitudinal inertia of the wheel's mass by the car's accelerometer,
    are separate sensors, because their readings may have different clocks.
    """
    p = e.p
    speed, driven, carried = e.state("wheel_speed", u.wheel_speed), e.state("driven"), e.state("carried")
    rim = speed * p.wheel_radius
    run_time = e.state("run_time")
    sense = turned(rim)
    pads = e(brake, brake_force=0.0, speed=rim, sense=sense, share=1.0, run_time=run_time)
    drag = e(bearing, bearing_torque=0.0, wheel_speed=speed, sense=sense, run_time=run_time)
    rubbing = pads * p.wheel_radius
    acceleration = e("acceleration", value=u.acceleration)
    load = e("hub_force_z", value=u.hub_force_z)
    torque = e("hub_torque", value=u.hub_torque, run_time=run_time, vertical_force=load) - p.hub_torque_zero
    turning = e(
        wheel_spin,
        hub_torque=torque,
        hub_force_x=e("hub_force_x", value=u.hub_force_x),
        hub_force_z=load,
        acceleration=acceleration,
        bearing_torque=drag + rubbing,
        wheel_mass=p.wheel_mass,
        wheel_radius=p.wheel_radius,
        rolling_resistance=p.rolling_resistance,
        wheel_inertia=p.wheel_inertia,
    )
    taken = -p.wheel_mass * acceleration * p.wheel_radius / p.wheel_inertia
    given = torque / p.wheel_inertia
    e.integrate(wheel_speed=turning, driven=given, carried=taken, run_time=1.0)
    e.sensor(READINGS[0], speed - driven - carried, turning - given - taken)
    e.sensor(READINGS[1], driven, given, spun_by_torque=given)
    e.sensor(READINGS[2], carried, taken)
    e.sensor(LEVER, p.wheel_radius)
    e.sensor(MASS, p.wheel_mass)
    e.sensor(LAG, e(READINGS[1], value=0.0, spun_by_torque=1.0))


WHEEL_SPIN = Model(
    "wheel spin",
    _assemble,
    ("wheel_inertia", "wheel_mass", "wheel_radius", "rolling_resistance", "hub_torque_zero"),
    INPUTS,
)
