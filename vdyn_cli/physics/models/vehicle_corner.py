"""One corner of the vehicle: suspension, the tire's contact with the road, and the wheel between them."""

from __future__ import annotations

from vdyn_cli.engine.model_builder import ModelBuilder, Number, Signals
from vdyn_cli.physics.laws.suspension import damper, spring
from vdyn_cli.physics.laws.tire_forces import cornering, friction, tire
from vdyn_cli.physics.laws.tire_slip import damped_slip, fresh_tread, slip_rate
from vdyn_cli.physics.laws.tire_vertical import tire_vertical
from vdyn_cli.physics.models.vehicle_parts import Body, Corner, Forces
from vdyn_cli.physics.models.vehicle_wheel import spin
from vdyn_cli.quantities.constants import GRAVITY

CONTACT_LAG = 2e-3  # s, time constant with which a tire's damping follows the road's height


def corner(e: ModelBuilder, u: Signals, at: Corner, body: Body, driven: tuple[Number, float] | None) -> Forces:
    """Add one wheel's motion; returns its forces (N) and moments (N m) on the body, and its load (N).

    The hub pitches with the body; the contact patch moves with the hub and yaws with the body.

    Parameters
    ----------
    e, u : the model that is built, and its inputs, SI. at : axle and side. body : its motion, SI.
    driven : torque of the half-shaft (N m) and the wheel's share of the driven wheels; None where it is not driven.
    """
    p = e.p
    along = p.cg_to_front if at.axle == "front" else p.cg_to_front - p.wheelbase  # ahead of the whole car's center
    arm = body.sprung_to_front if at.axle == "front" else body.sprung_to_front - p.wheelbase  # of the sprung body's
    across = getattr(p, f"track_{at.axle}") * (0.5 if at.side == "left" else -0.5)
    strut, load, static = _suspension(e, u, at, body, arm, across)
    swing = p.hub_swing * (p.cg_height - p.wheel_radius)
    speed = body.speed - across * body.yaw_rate + swing * body.pitch_rate
    sideways = body.lateral_speed + along * body.yaw_rate + p.cg_height * body.roll_rate
    forward, left = _contact(e, at, speed, sideways, load, static)
    torque = spin(e, u, at, body, (load, forward), driven)
    return Forces(
        forward=forward,
        left=left,
        strut=strut,
        pitch=torque + (p.cg_height - p.wheel_radius) * forward - arm * strut,
        roll=p.cg_height * left - across * strut,
        yaw=along * left - across * forward,
        loads={at.name: load},
        shafts={} if driven is None else {at.name: driven[0]},
    )


def _suspension(
    e: ModelBuilder, u: Signals, at: Corner, body: Body, arm: Number, across: Number
) -> tuple[Number, Number, Number]:
    """Force of spring and damper relative to rest, load on the road, and load at rest, N."""
    p, name = e.p, at.name
    road = getattr(u, f"road{name}")
    height, rate = e.state(f"wheel_height{name}", road), e.state(f"wheel_rate{name}")
    contact = e.state(f"contact{name}", road)
    rise = (road - contact) / CONTACT_LAG
    strut = e(
        spring,
        name,
        stiffness=getattr(p, f"suspension_stiffness_{at.axle}") / 2,
        stroke=body.heave + arm * body.pitch + across * body.roll - height,
        share=0.5,
    ) + e(
        damper,
        name,
        damping=getattr(p, f"suspension_damping_{at.axle}") / 2,
        stroke_rate=body.heave_rate + arm * body.pitch_rate + across * body.roll_rate - rate,
        share=0.5,
    )
    to_front = p.cg_to_front / p.wheelbase
    static = p.mass * GRAVITY * ((1.0 - to_front) if at.axle == "front" else to_front) / 2
    load = e(
        tire_vertical,
        name,
        static_load=static,
        stiffness=p.tire_vertical_stiffness / 2,
        damping=p.tire_vertical_damping / 2,
        compression=road - height,
        compression_rate=rise - rate,
        share=0.5,
        rear=float(at.axle == "rear"),
    )
    mass = getattr(p, f"unsprung_mass_{at.axle}") / 2
    e.integrate(
        **{
            f"wheel_height{name}": rate,
            f"wheel_rate{name}": (strut + load - static) / mass + body.lightness,
            f"contact{name}": rise,
        }
    )
    return strut, load, static


def _contact(
    e: ModelBuilder, at: Corner, speed: Number, sideways: Number, load: Number, static: Number
) -> tuple[Number, Number]:
    """Forces between tire and road, forward and to the left, N, from the hub's longitudinal and lateral speed."""
    p, name = e.p, at.name
    sliding = e.state(f"wheel_speed{name}", e.state("speed") / p.wheel_radius) * p.wheel_radius - speed
    slip, lateral = e.state(f"slip{name}"), e.state(f"lateral_slip{name}")
    fresh = e(fresh_tread, name, speed=speed, sliding=sliding, sideways=sideways, slip=slip, lateral_slip=lateral)
    lag = {"fresh": fresh, "relaxation_length": p.tire_relaxation_length}
    e.integrate(
        **{
            f"slip{name}": e(slip_rate, name, sliding=sliding, slip=slip, **lag),
            f"lateral_slip{name}": e(slip_rate, f"_lateral{name}", sliding=-sideways, slip=lateral, **lag),
        }
    )
    grip = e(
        friction,
        name,
        load=load,
        static_load=static,
        tire_D=p.tire_D,
        tire_load_sensitivity=p.tire_load_sensitivity,
    )
    rest = {"speed": speed, "tire_rest_damping": p.tire_rest_damping}
    forward = e(
        tire,
        name,
        load=load,
        slip=e(damped_slip, name, slip=slip, sliding=sliding, stiffness=p.tire_B, **rest),
        tire_B=p.tire_B,
        tire_C=p.tire_C,
        tire_D=grip,
        tire_E=p.tire_E,
    )
    left = e(
        cornering,
        name,
        load=load,
        slip=e(
            damped_slip,
            f"_lateral{name}",
            slip=lateral,
            sliding=-sideways,
            stiffness=p.tire_cornering_stiffness,
            **rest,
        ),
        tire_D=grip,
        tire_cornering_stiffness=p.tire_cornering_stiffness,
    )
    return forward, left
