"""A wheel of the vehicle about its axle: half-shaft, brake and tread turn it and hold it."""

from __future__ import annotations

from vdyn_cli.engine.model_builder import ModelBuilder, Number, Signals
from vdyn_cli.physics.laws.brake import brake
from vdyn_cli.physics.laws.driveline import driveline
from vdyn_cli.physics.laws.rolling_resistance import rolling
from vdyn_cli.physics.laws.standstill_friction import bristle_rate, bristle_sense, turned
from vdyn_cli.physics.laws.torsion_shaft import shaft
from vdyn_cli.physics.laws.wheel import wheel_spin
from vdyn_cli.physics.models.vehicle_parts import Body, Corner

ROLLING_DAMPING = 0.1  # s, a bristle's damping time
BRAKE_DAMPING = 1e-3  # s


# Eight parameters: the forces and torques on one wheel
def spin(
    e: ModelBuilder,
    u: Signals,
    at: Corner,
    body: Body,
    contact: tuple[Number, Number],
    drive: tuple[Number | None, float],
) -> tuple[Number, Number | None]:
    """The wheel's spin; returns the torque of the body on the wheel and that in the half-shaft, N m.

    Parameters
    ----------
    contact : load and forward force of the road on the tire, N.
    drive : drive_torque and driven_share, as for a corner.
    """
    load, forward = contact
    drive_torque, driven_share = drive
    p, name = e.p, at.name
    radius = p.wheel_radius
    turning = e.state(f"wheel_speed{name}")
    rim, rub = turning * radius, (turning + body.pitch_rate) * radius  # over the road, and in the brake
    day = {"elapsed": u.elapsed, "run_time": e.state("run_time")}
    tread = e(
        rolling,
        name,
        rolling_resistance=p.rolling_resistance,
        rolling_speed=p.rolling_speed,
        load=load,
        speed=rim,
        sense=_sense(e, f"rolling_bend{name}", rim, ROLLING_DAMPING),
        share=0.25,
        **day,
    )
    sense = _sense(e, f"brake_bend{name}", rub, BRAKE_DAMPING)
    share = p.brake_share_front if at.axle == "front" else 1.0 - p.brake_share_front
    pressed = e("brake_torque", value=u.brake_torque) * share / (2 * radius)
    held = e(brake, name, brake_force=pressed, speed=rub, sense=sense, share=0.25, **day)
    shaft_torque = None
    if drive_torque is not None:
        held = held + e(
            driveline,
            name,
            driveline_drag=0.0,
            driveline_viscous=0.0,
            speed=rub,
            sense=sense,
            share=driven_share,
            **day,
        )
        shaft_torque = _half_shaft(e, at, turning + p.driveline_pitch * body.pitch_rate, drive_torque, driven_share)
    pushing = 0.0 if shaft_torque is None else shaft_torque
    rate = e(
        wheel_spin,
        name,
        hub_torque=pushing,
        hub_force_x=forward,
        hub_force_z=load,
        acceleration=0.0,
        bearing_torque=(held + tread) * radius,
        wheel_mass=0.0,  # its inertia along the road is in the vehicle's mass: the forces are those at the road
        wheel_radius=radius,
        rolling_resistance=0.0,
        wheel_inertia=p.wheel_inertia,
    )
    e.integrate(**{f"wheel_speed{name}": rate})
    return pushing - held * radius, shaft_torque


def _sense(e: ModelBuilder, name: str, speed: Number, damping_time: float) -> Number:
    """Sense of a dry contact that slides at ``speed``, with its bend as a state; a moving car starts with it bent."""
    bend = e.state(name, turned(e.state("speed")))
    rate = e(bristle_rate, f"_{name}", speed=speed, bend=bend)
    e.integrate(**{name: rate})
    return e(bristle_sense, f"_{name}", speed=speed, bend=bend, bend_rate=rate, damping_time=damping_time)


def _half_shaft(e: ModelBuilder, at: Corner, outer: Number, drive_torque: Number, share: float) -> Number:
    """Torque of a half-shaft between its inner end and the wheel, which turns at ``outer`` rad/s seen from the body."""
    p, name = e.p, at.name
    stiffness = getattr(p, f"shaft_stiffness_{at.side}")
    twist = e.state(f"twist{name}", drive_torque / stiffness)
    inner = e.state(f"inner_speed{name}", e.state("speed") / p.wheel_radius)
    twist_rate = inner - outer
    torque = e(
        shaft,
        name,
        twist=twist,
        twist_rate=twist_rate,
        stiffness=stiffness,
        damping=getattr(p, f"shaft_damping_{at.side}"),
    )
    inertia = p.driveline_inertia * share
    e.integrate(**{f"twist{name}": twist_rate, f"inner_speed{name}": (drive_torque - torque) / inertia})
    return torque
