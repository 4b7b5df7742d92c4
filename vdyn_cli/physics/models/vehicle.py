"""The full vehicle: a body on four suspended wheels that slip, driven through half-shafts that twist."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Literal

from vdyn_cli.engine.maths import cos, sin, sqrt
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import ModelBuilder, Number, Signals
from vdyn_cli.physics.laws.air_drag import air, gust_drag
from vdyn_cli.physics.laws.driveline import drive, dry_loss, spin_loss
from vdyn_cli.physics.laws.grade_resistance import GradeSource, climb, read_grade
from vdyn_cli.physics.laws.standstill_friction import turned
from vdyn_cli.physics.models.half_car import sprung_body
from vdyn_cli.physics.models.vehicle_axle import Axle, Differential, driven_axle
from vdyn_cli.physics.models.vehicle_corner import corner
from vdyn_cli.physics.models.vehicle_parts import CORNERS, Body, Forces
from vdyn_cli.quantities.constants import GRAVITY

Driven = Literal["front", "rear", "both"]
Torque = Literal["axle", "sides"]

BODY = (
    *("mass", "wheelbase", "cg_to_front", "cg_height", "track_front", "track_rear"),
    *("pitch_inertia", "roll_inertia", "yaw_inertia", "unsprung_mass_front", "unsprung_mass_rear"),
    *("suspension_stiffness_front", "suspension_stiffness_rear"),
    *("suspension_damping_front", "suspension_damping_rear"),
)
TIRES = (
    *("tire_vertical_stiffness", "tire_vertical_damping", "wheel_inertia", "wheel_radius"),
    *("tire_B", "tire_C", "tire_D", "tire_E", "tire_load_sensitivity", "tire_relaxation_length"),
    *("tire_cornering_stiffness", "tire_rest_damping", "rolling_resistance", "rolling_speed"),
)
AIR = ("drag_area", "drag_height", "air_density", "wind_variance")
AXLE_TORQUE = ("gear_ratio", "driveline_efficiency", "recuperation_loss")
DRIVELINE = (
    *("driveline_inertia", "motor_reaction", "shaft_stiffness_left", "shaft_stiffness_right"),
    *("shaft_damping_left", "shaft_damping_right", "brake_share_front", "hub_swing", "driveline_pitch"),
)
SIDE_GEARS = ("side_gear_inertia",)
AXLES = ("front", "rear")
ROAD = tuple(f"road{at.name}" for at in CORNERS)


def vehicle(
    driven: Driven = "front",
    torque: Torque = "axle",
    located: bool = False,
    differential: Differential = "open",
    graded: GradeSource = "stated",
) -> Model:
    """Rigid chassis with 6 degrees of freedom, 4 suspensions, 4 spinning wheels and a half-shaft to each driven one.

    M (V' - vy yaw')   = sum Fx - Fd - M g sin(grade)          M (vy' + V yaw') = sum Fy
    Ms z''             = -sum S + Ms g (1 - cos(grade))        mw zw'' = S + Fz - F0 + mw g (1 - cos(grade))
    I pitch''          = -sum l S + (h - r) sum Fx + sum T + (hd - h) Fd
    Ir roll''          = -sum b S + h sum Fy                   Iz yaw'' = sum (l Fy - b Fx)
    J om'              = T - Fx r - Rr r                       Jd wc' = Td - Tl - Tr

    over the wheels: Fx, Fy, Fz between tire and road, S of spring and damper relative to rest, T the torque of the body
    on the wheel (half-shaft minus brake), whose reaction acts on the body, Td the drive torque at a differential's
    carrier and Tl, Tr the torques of its two half-shafts (``driven_axle``). The pitch equation also contains the
    reaction of the rotor, a (Td - Tl - Tr).

    Parameters
    ----------
    driven : the driven axle, or "both".
    torque : "axle": input drive_torque, N m at the planetary output, shared equally by all driven wheels; "sides":
        inputs drive_torque_left and _right, N m at the half-shafts' inner ends (sum of both axles where both are
        driven): a motor on each side and no differential.
    located : heading times the state ``position`` is the road's coordinate, m, given by a drive's start; the context
        then also has road_begin and road_end, the range of the drives.
    differential : connection of the half-shafts of a driven axle, where ``torque`` is "axle": "open" (equal torques) or
        "locked" (equal speeds of their inner ends). Where both axles are driven, each has a motor and a differential.
    graded : source of the grade (``read_grade``).

    Returns
    -------
    Model with outputs speed (m/s), wheel_speed_fl, _fr, _rl, _rr (rad/s), shaft_torque_left, _right (N m, the front
    axle's where both are driven), acceleration (m/s^2, specific force along the road at the center of gravity),
    front_load, rear_load (N at the road), jerk (m/s^3, the time derivative of V').

    Notes
    -----
    Inputs: drive torque, brake_torque (N m, all wheels together), grade, wind_speed, elapsed, road_fl to road_rr (m,
    height of the road under each wheel). Context: heading, temperature. Step: Runge-Kutta, at most 1 ms. The state
    run_time (s since the run's log began) starts at zero unless a drive's start states it.
    Axes: x forward, y left, z up; roll left side up, pitch nose-up, yaw to the left. Heave, pitch, roll and the wheels'
    heights are zero at rest on a flat road of height zero; a run starts at rest on the heights of its first sample,
    rolling freely at its start speed, with shafts twisted by the torque of the first sample.
    Stiffness, damping and unsprung mass are per axle; ``pitch_inertia`` and ``roll_inertia`` are the whole car's about
    its center, with wheels on the ground. V is the speed of the whole car's center; the hubs, which move with the
    pitching body, have the speed V + a (h - r) pitch'. With a = ``hub_swing`` = 1 the energy balance holds without a
    term for the sprung body's inertia I - mu M/Ms (h - r)^2. Suspension links that restrain the hubs reduce a. Likewise
    soft mounts reduce ``driveline_pitch``, the share of the pitching that the half-shafts' inner ends follow. Wheel
    speeds are relative to the road.
    Assumes small angles, no steering, roll centers on the ground, vertical wheel travel, no aerodynamic lift, no
    gyroscopic moments, no friction in the differential. Half-shafts are massless: the mass of a stepped bar oscillates
    at 1 kHz and more, and its stiffness is that of its sections in series.
    Source: the model described in doi:10.4271/2017-01-1574; equations of motion by virtual work.
    """
    return _vehicle(driven, torque, located, differential, graded)


@cache
def _vehicle(driven: Driven, torque: Torque, located: bool, differential: Differential, graded: GradeSource) -> Model:
    axles = AXLES if driven == "both" else (driven,)
    side_gears = SIDE_GEARS if torque == "axle" and differential == "open" else ()
    inputs = {"axle": ("drive_torque",), "sides": ("drive_torque_left", "drive_torque_right")}[torque]

    def assemble(e: ModelBuilder, u: Signals) -> None:
        body = _body(e, u, graded)
        torques = _drive_torques(e, u, torque, 2 * len(axles))
        total = Forces()
        for name in AXLES:
            left, right = (at for at in CORNERS if at.axle == name)
            shafts: Mapping[str, Number] = {}
            if name in axles:
                axle = Axle((left, right), 1.0 / len(axles), differential if torque == "axle" else None)
                turned = driven_axle(e, axle, body, torques)
                shafts, total = turned.shafts, total + Forces(pitch=turned.reaction)
            for at in (left, right):
                driven_by = (shafts[at.name], 0.5 / len(axles)) if shafts else None
                total = total + corner(e, u, at, body, driven_by)
        _move(e, u, body, total)
        for at in CORNERS:
            e.sensor(f"wheel_speed{at.name}", e.state(f"wheel_speed{at.name}"), e.rates[f"wheel_speed{at.name}"])
        for at in CORNERS[:2] if axles[0] == "front" else CORNERS[2:]:
            e.sensor(f"shaft_torque_{at.side}", total.shafts[at.name])
        e.sensor("front_load", total.loads["_fl"] + total.loads["_fr"])
        e.sensor("rear_load", total.loads["_rl"] + total.loads["_rr"])

    return Model(
        name="vehicle",
        assemble=assemble,
        parameters=(*BODY, *TIRES, *AIR, *(AXLE_TORQUE if torque == "axle" else ()), *DRIVELINE, *side_gears),
        inputs=(*inputs, "brake_torque", "grade", "wind_speed", "elapsed", *ROAD),
        context=("heading", "temperature", *(("road_begin", "road_end") if located else ())),
    )


def _body(e: ModelBuilder, u: Signals, graded: GradeSource) -> Body:
    """States of the chassis, initially at rest on the first sample's road heights."""
    p = e.p
    front, rear = (u.road_fl + u.road_fr) / 2, (u.road_rl + u.road_rr) / 2
    tilt = (front - rear) / p.wheelbase
    lean = ((u.road_fl - u.road_fr) / p.track_front + (u.road_rl - u.road_rr) / p.track_rear) / 2
    sprung, to_front = sprung_body(p.mass, p.cg_to_front, p.wheelbase, p.unsprung_mass_front, p.unsprung_mass_rear)
    position = e.state("position")
    grade = e("grade", value=read_grade(e, u.grade, graded), position=position)
    return Body(
        speed=e.state("speed"),
        lateral_speed=e.state("lateral_speed"),
        heave=e.state("heave", front - to_front * tilt),
        heave_rate=e.state("heave_rate"),
        pitch=e.state("pitch", tilt),
        pitch_rate=e.state("pitch_rate"),
        roll=e.state("roll", lean),
        roll_rate=e.state("roll_rate"),
        yaw=e.state("yaw"),
        yaw_rate=e.state("yaw_rate"),
        sprung_mass=sprung,
        sprung_to_front=to_front,
        grade=grade,
        lightness=GRAVITY * (1.0 - 1.0 / sqrt(1.0 + grade**2)),
    )


def _drive_torques(e: ModelBuilder, u: Signals, torque: Torque, wheels: int) -> dict[str, Number]:
    """Drive torque at the inner end of each half-shaft, by side, N m."""
    p = e.p
    time = e.state("run_time")
    if torque == "sides":
        return {
            side: e(f"drive_torque_{side}", value=getattr(u, f"drive_torque_{side}"), run_time=time) * (2.0 / wheels)
            for side in ("left", "right")
        }
    force = e(
        drive,
        drive_torque=e("drive_torque", value=u.drive_torque, run_time=time),
        gear_ratio=p.gear_ratio,
        wheel_radius=p.wheel_radius,
        driveline_efficiency=p.driveline_efficiency,
        recuperation_loss=p.recuperation_loss,
    )
    loss = e(spin_loss, viscous=0.0, speed=e.state("speed"), wheel_radius=p.wheel_radius)
    loss = loss + e(dry_loss, dry_loss=0.0, sense=turned(e.state("speed")))
    return dict.fromkeys(("left", "right"), (force * p.wheel_radius - loss) / wheels)


def _move(e: ModelBuilder, u: Signals, body: Body, total: Forces) -> None:
    """Add the rates of the chassis under all forces, and its sensors."""
    p = e.p
    wind = e("wind_speed", value=u.wind_speed)
    flow = {"air_density": p.air_density, "drag_area": p.drag_area}
    drag = e(air, wind=wind, elapsed=u.elapsed, speed=body.speed, **flow)
    drag = drag + e(gust_drag, wind_variance=p.wind_variance, **flow)
    force = (total.forward - drag) / p.mass
    acceleration = force - e(climb, mass=p.mass, grade=body.grade) / p.mass + body.yaw_rate * body.lateral_speed
    heading, side = (cos(body.yaw), sin(body.yaw))
    e.integrate(
        run_time=1.0,
        position=body.speed * heading - body.lateral_speed * side,
        lateral_position=body.speed * side + body.lateral_speed * heading,
        speed=acceleration,
        lateral_speed=total.left / p.mass - body.yaw_rate * body.speed,
        heave=body.heave_rate,
        heave_rate=body.lightness - total.strut / body.sprung_mass,
        pitch=body.pitch_rate,
        pitch_rate=(total.pitch + (p.drag_height - p.cg_height) * drag) / p.pitch_inertia,
        roll=body.roll_rate,
        roll_rate=total.roll / p.roll_inertia,
        yaw=body.yaw_rate,
        yaw_rate=total.yaw / p.yaw_inertia,
    )
    e.state("lateral_position")
    e.sensor("speed", body.speed, acceleration, rate_of_change=acceleration)
    e.sensor("acceleration", force)
    e.rate("jerk", of=acceleration)
