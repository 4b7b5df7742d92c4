"""One corner of the vehicle: suspension, wheel, tire, brake and, where it is driven, its half-shaft."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from vdyn_cli.elements.brake import brake
from vdyn_cli.elements.driveline import driveline
from vdyn_cli.elements.rolling import rolling
from vdyn_cli.elements.shaft import shaft
from vdyn_cli.elements.standstill import bristle_rate, bristle_sense, turned
from vdyn_cli.elements.suspension import damper, spring
from vdyn_cli.elements.tire import cornering, friction, tire
from vdyn_cli.elements.tire_slip import damped_slip, fresh_tread, slip_rate
from vdyn_cli.elements.tire_vertical import tire_vertical
from vdyn_cli.elements.wheel import wheel_spin
from vdyn_cli.engine.bench import Bench, Number, Signals
from vdyn_cli.engine.maths import GRAVITY

ROLLING_DAMPING = 0.1  # s, a bristle's damping time
BRAKE_DAMPING = 1e-3  # s
CONTACT_LAG = 2e-3  # s, within which a tire's damping follows the road's height


@dataclass(frozen=True)
class Corner:
    """Where a wheel is: ``name`` as the suffix of its states, ``axle`` and ``side``."""

    name: str
    axle: str
    side: str


CORNERS = tuple(Corner(f"_{axle[0]}{side[0]}", axle, side) for axle in ("front", "rear") for side in ("left", "right"))


@dataclass(frozen=True)
class Body:
    """The chassis's states, SI, and what follows from them and the parameters.

    ``sprung_mass`` kg has its centre ``sprung_to_front`` m behind the front axle; ``lightness`` m/s^2 is what a slope
    takes from gravity across the road, g (1 - cos).
    """

    speed: Number
    lateral_speed: Number
    heave: Number
    heave_rate: Number
    pitch: Number
    pitch_rate: Number
    roll: Number
    roll_rate: Number
    yaw: Number
    yaw_rate: Number
    sprung_mass: Number
    sprung_to_front: Number
    grade: Number
    lightness: Number


@dataclass(frozen=True)
class Forces:
    """What corners do to the body: forces (N) ``forward`` and ``left`` at the road, the struts' pull beyond rest, and
    moments (N m) nose-up, left side up and to the left; loads and half-shaft torques by corner."""

    forward: Number = 0.0
    left: Number = 0.0
    strut: Number = 0.0
    pitch: Number = 0.0
    roll: Number = 0.0
    yaw: Number = 0.0
    loads: Mapping[str, Number] = field(default_factory=dict)
    shafts: Mapping[str, Number] = field(default_factory=dict)

    def __add__(self, other: Forces) -> Forces:
        return Forces(
            self.forward + other.forward,
            self.left + other.left,
            self.strut + other.strut,
            self.pitch + other.pitch,
            self.roll + other.roll,
            self.yaw + other.yaw,
            {**self.loads, **other.loads},
            {**self.shafts, **other.shafts},
        )


def corner(e: Bench, u: Signals, at: Corner, body: Body, drive_torque: Number | None, driven_share: float) -> Forces:
    """One wheel's motion; returns what it does to the body.

    Parameters
    ----------
    drive_torque : N m at the inner end of its half-shaft; None where there is none.
    driven_share : the part of all driven wheels that one stands for.
    """
    p = e.p
    along = p.cg_to_front if at.axle == "front" else p.cg_to_front - p.wheelbase  # ahead of the whole car's centre
    arm = body.sprung_to_front if at.axle == "front" else body.sprung_to_front - p.wheelbase  # of the sprung body's
    across = getattr(p, f"track_{at.axle}") * (0.5 if at.side == "left" else -0.5)
    strut, load, static = _suspension(e, u, at, body, arm, across)
    speed = body.speed - across * body.yaw_rate + (p.cg_height - p.wheel_radius) * body.pitch_rate
    sideways = body.lateral_speed + along * body.yaw_rate + p.cg_height * body.roll_rate
    forward, left = _contact(e, at, speed, sideways, load, static)
    torque, shaft_torque = _spin(e, u, at, body, load, forward, drive_torque, driven_share)
    return Forces(
        forward=forward,
        left=left,
        strut=strut,
        pitch=torque + (p.cg_height - p.wheel_radius) * forward - arm * strut,
        roll=p.cg_height * left - across * strut,
        yaw=along * left - across * forward,
        loads={at.name: load},
        shafts={} if shaft_torque is None else {at.name: shaft_torque},
    )


def _suspension(
    e: Bench, u: Signals, at: Corner, body: Body, arm: Number, across: Number
) -> tuple[Number, Number, Number]:
    """Pull of spring and damper beyond rest, load on the road, and that at rest, N."""
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
    e: Bench, at: Corner, speed: Number, sideways: Number, load: Number, static: Number
) -> tuple[Number, Number]:
    """Forces between tire and road, forward and to the left, N, from the hub's speed along and across."""
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
    forward = e(
        tire,
        name,
        load=load,
        slip=e(damped_slip, name, slip=slip, sliding=sliding, speed=speed, stiffness=p.tire_B),
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
            speed=speed,
            stiffness=p.tire_cornering_stiffness,
        ),
        tire_D=grip,
        tire_cornering_stiffness=p.tire_cornering_stiffness,
    )
    return forward, left


def _spin(
    e: Bench,
    u: Signals,
    at: Corner,
    body: Body,
    load: Number,
    forward: Number,
    drive_torque: Number | None,
    driven_share: float,
) -> tuple[Number, Number | None]:
    """The wheel's spin; returns what the body turns it with and what its half-shaft carries, N m."""
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
        shaft_torque = _half_shaft(e, at, turning + body.pitch_rate, drive_torque, driven_share)
    pushing = 0.0 if shaft_torque is None else shaft_torque
    spin = e(
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
    e.integrate(**{f"wheel_speed{name}": spin})
    return pushing - held * radius, shaft_torque


def _sense(e: Bench, name: str, speed: Number, damping_time: float) -> Number:
    """Sense of a dry contact that slides at ``speed``, with its bend as a state; a moving car starts with it bent."""
    bend = e.state(name, turned(e.state("speed")))
    rate = e(bristle_rate, f"_{name}", speed=speed, bend=bend)
    e.integrate(**{name: rate})
    return e(bristle_sense, f"_{name}", speed=speed, bend=bend, bend_rate=rate, damping_time=damping_time)


def _half_shaft(e: Bench, at: Corner, outer: Number, drive_torque: Number, share: float) -> Number:
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
