"""Rotation of a wheel of the vehicle under half-shaft, brake and tire forces."""

from __future__ import annotations

from vdyn_cli.engine.model_builder import ModelBuilder, Number, Signals
from vdyn_cli.physics.laws.brake import brake
from vdyn_cli.physics.laws.driveline import driveline
from vdyn_cli.physics.laws.rolling_resistance import rolling
from vdyn_cli.physics.laws.standstill_friction import bristle_rate, bristle_sense, turned
from vdyn_cli.physics.laws.wheel import wheel_spin
from vdyn_cli.physics.models.vehicle_parts import Body, Corner

ROLLING_DAMPING = 0.1  # s, damping time of the bristle of rolling resistance
BRAKE_DAMPING = 1e-3  # s, likewise of the brake


def spin(
    e: ModelBuilder,
    u: Signals,
    at: Corner,
    body: Body,
    contact: tuple[Number, Number],
    driven: tuple[Number, float] | None,
) -> Number:
    """Add the wheel's rotation; returns the torque T of body and half-shaft on the wheel, N m.

    J om' = T - Fx r - Rr r, as in ``models.vehicle``

    Parameters
    ----------
    contact : load and forward force of the road on the tire, N.
    driven : torque of the half-shaft (N m) and the wheel's share of the driven wheels; None where it is not driven.
    """
    load, forward = contact
    p, name = e.p, at.name
    radius = p.wheel_radius
    turning = e.state(f"wheel_speed{name}")
    rim, rub = turning * radius, (turning + body.pitch_rate) * radius  # relative to the road, and to the brake
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
    pushing: Number = 0.0
    if driven is not None:
        pushing, share = driven
        held = held + e(
            driveline,
            name,
            driveline_drag=0.0,
            driveline_viscous=0.0,
            speed=rub,
            sense=sense,
            share=share,
            **day,
        )
    rate = e(
        wheel_spin,
        name,
        hub_torque=pushing,
        hub_force_x=forward,
        hub_force_z=load,
        acceleration=0.0,
        bearing_torque=(held + tread) * radius,
        wheel_mass=0.0,  # the forces are those at the road, and the vehicle's mass includes the wheel
        wheel_radius=radius,
        rolling_resistance=0.0,
        wheel_inertia=p.wheel_inertia,
    )
    e.integrate(**{f"wheel_speed{name}": rate})
    return pushing - held * radius


def _sense(e: ModelBuilder, name: str, speed: Number, damping_time: float) -> Number:
    """Sense of a dry contact that slides at ``speed``; its deflection is a state, initially full if the car moves."""
    bend = e.state(name, turned(e.state("speed")))
    rate = e(bristle_rate, f"_{name}", speed=speed, bend=bend)
    e.integrate(**{name: rate})
    return e(bristle_sense, f"_{name}", speed=speed, bend=bend, bend_rate=rate, damping_time=damping_time)
