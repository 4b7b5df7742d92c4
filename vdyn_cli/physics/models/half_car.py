"""The half car: a body on two axles that roll over a bump one after the other."""

from __future__ import annotations

from functools import cache
from typing import Any, Literal

from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import ModelBuilder, Number, Signals
from vdyn_cli.physics.laws.road import Hump, Shape, half_sine, haversine, road, straight_lines
from vdyn_cli.physics.laws.suspension import damper, spring
from vdyn_cli.physics.laws.tire_vertical import tire_vertical
from vdyn_cli.physics.models.longitudinal_hubs import Hub, LongitudinalMotion, hub_states
from vdyn_cli.quantities.constants import GRAVITY

SOUGHT = (
    "suspension_stiffness_front",
    "suspension_stiffness_rear",
    "suspension_damping_front",
    "suspension_damping_rear",
    "tire_vertical_stiffness",
)
LONGITUDINAL = (
    *("longitudinal_lever", "hub_compliance_front", "hub_compliance_rear"),
    *("support_slope_front", "support_slope_rear"),
)
GIVEN = (
    *("mass", "sprung_pitch_inertia", "cg_to_front", "wheelbase", "unsprung_mass_front", "unsprung_mass_rear"),
    *("bump_height", "bump_width", "antenna_offset", "outboard_mass"),
    *LONGITUDINAL,
)
CROSSING = ("distance_front", "speed_scale", "speed_ramp")
BODY = ("heave", "heave_rate", "pitch", "pitch_rate")
ROLLING = 1.28  # the wheels, 1.1 kg m^2 and 0.31 m, turn as their hubs move: 11.5 kg beside the 41 kg of a corner
SLOPE_STEP = 5e-4  # m, difference step for the slope of the road

# Of a wheel of 0.31 m over the paper's bump, 7 cm high and 48 cm long, within 0.01 mm.
USUAL_CIRCLE = Hump(0.55, (0.86152, 0.29241, -0.22770, 0.08711, -0.01332))

Points = tuple[tuple[float, float], ...]


def sprung_body(
    mass: Number, cg_to_front: Number, wheelbase: Number, unsprung_mass_front: Number, unsprung_mass_rear: Number
) -> tuple[Number, Number]:
    """Mass of the sprung body, kg, and distance of its center behind the front axle, m.

    Ms = M - mf - mr,   Ms lf = M cg_to_front - mr L   (moments about the front axle)

    with the car's mass M, the unsprung masses mf and mr (kg) and the wheelbase L (m).
    """
    sprung = mass - unsprung_mass_front - unsprung_mass_rear
    return sprung, (mass * cg_to_front - unsprung_mass_rear * wheelbase) / sprung


BODY_OF = ("mass", "cg_to_front", "wheelbase", "unsprung_mass_front", "unsprung_mass_rear")


@cache
def half_car(shape: Literal["haversine", "half_sine"] = "haversine") -> Model:
    """The half car on a bump of this shape, and the path of a usual wheel over the paper's bump (``half_car_over``)."""
    return half_car_over(half_sine if shape == "half_sine" else haversine, USUAL_CIRCLE)


@cache
def half_car_on_profile(points: Points, circle: Points | None = None) -> Model:
    """The half car on a measured profile, (position, height) in m; ``bump_height`` and ``bump_width`` scale it.

    ``circle`` : points of the path of a rolling wheel's lowest point.
    """
    return half_car_over(straight_lines(points), straight_lines(circle) if circle else None, points[-1][0])


@cache
def half_car_over(shape: Shape, circle: Shape | None = None, length: float = 1.0) -> Model:
    """Heave and pitch of the body and two axles, with tires that lift off, relative to rest.

    Ms z'' = -Sf - Sr,   Is th'' = -lf Sf + lr Sr + s Ms V',   mf zf'' = Sf + Fzf - F0f,   mr zr'' = Sr + Fzr - F0r

    with th nose-up; Sf = spring + damper over the stroke z + lf th - zf, Sr over z - lr th - zr; Fz the load between
    tires and road, F0 that at rest. The slope of the road brakes the car (V' of the body) and pushes the hubs fore and
    aft (``longitudinal_hubs``); their forces meet the body s = ``longitudinal_lever`` m below its center.

    Parameters
    ----------
    shape : of the bump. length : of the bump, in bump widths.
    circle : shape of the path of a rolling wheel's lowest point over it; None: no effect can use it.

    Returns
    -------
    Model with outputs front_load, rear_load (N), vertical_acceleration (m/s^2, of the body ``antenna_offset`` m ahead
    of its center, zero at rest) and pitch_rate (rad/s); states of the body and the axles, and ``position`` m along the
    road, where the bump begins at ``distance_front``; the rear axle meets it a ``wheelbase`` later.

    Notes
    -----
    Inputs: speed m/s and elapsed s; speed_scale (relative) and speed_ramp (m/s^2, times elapsed) correct the speed.
    ``mass`` and ``cg_to_front`` are the whole car's, ``sprung_pitch_inertia`` is that of the body about its center,
    which is lf behind the front axle (``sprung_body``). ``outboard_mass`` is the mass of an axle's wheels
    outside the load sensors: 0 where the loads are those on the road, else a sensor reads Fz - m (g + z'').
    s is the height of the body's center above the wheels' centers, less what the support angles of the suspension
    (anti-dive, anti-squat) take off. Assumes small angles, wheels that roll freely or
    at constant torque, equal wheels of an axle.
    Source: doi:10.4271/2017-01-1574, equations (8) to (15).
    """
    bump: dict[str, Any] = {"shape": shape}
    if circle is not None:
        bump["circle_shape"] = circle

    def assemble(e: ModelBuilder, u: Signals) -> None:
        p = e.p
        z, w, pitch, turn = (e.state(name) for name in BODY)
        x = e.state("position")
        speed = e("speed", value=u.speed) * (1.0 + p.speed_scale) + p.speed_ramp * u.elapsed
        sprung, to_front = sprung_body(*(getattr(p, name) for name in BODY_OF))
        share = p.cg_to_front / p.wheelbase
        ahead = x - p.distance_front + p.longitudinal_lever * pitch, speed + p.longitudinal_lever * turn
        front, hub = _axle(e, "front", (z + to_front * pitch, w + to_front * turn), ahead, (bump, length), 1.0 - share)
        arm = to_front - p.wheelbase
        behind = ahead[0] - p.wheelbase, ahead[1]
        rear, hub_rear = _axle(e, "rear", (z + arm * pitch, w + arm * turn), behind, (bump, length), share)
        motion = LongitudinalMotion(sprung, p.sprung_pitch_inertia, p.longitudinal_lever, (hub, hub_rear))
        heave_acceleration = -(front + rear) / sprung
        pitch_acceleration = motion.pitch_acceleration(-(to_front * front + arm * rear))
        motion.integrate(e, pitch_acceleration)
        e.integrate(heave=w, heave_rate=heave_acceleration, pitch=turn, pitch_rate=pitch_acceleration, position=speed)
        e.sensor("vertical_acceleration", heave_acceleration + p.antenna_offset * pitch_acceleration, rest=0.0)
        e.sensor("pitch_rate", turn, pitch_acceleration, rest=0.0)

    return Model("half_car", assemble, (*SOUGHT, *GIVEN, *CROSSING), ("speed", "elapsed"))


def _axle(
    e: ModelBuilder,
    end: str,
    body: tuple[Number, Number],
    crossing: tuple[Number, Number],
    bump: tuple[dict[str, Any], float],
    share: Number,
) -> tuple[Number, Hub]:
    """Add one axle; returns its hubs, and the downward force of springs and dampers on the body, N."""
    offset, rate = hub_states(e, end)
    past, speed = crossing[0] + offset, crossing[1] + rate  # m beyond the start of the bump, m/s
    shapes, length = bump  # length in bump widths
    p, at = e.p, f"_{end}"
    stiffness, damping = getattr(p, f"suspension_stiffness{at}"), getattr(p, f"suspension_damping{at}")
    mass, rigid = getattr(p, f"unsprung_mass{at}"), p.tire_vertical_stiffness
    # If the body is not at rest initially, its wheels are displaced against the tires' stiffness.
    follow = stiffness / (stiffness + rigid)
    y = e.state(f"wheel{at}", follow * body[0])
    v = e.state(f"wheel_rate{at}", follow * body[1])

    def level(position: Number) -> Number:
        size = {"height": p.bump_height, "width": p.bump_width, "length": length * p.bump_width}
        return e(road, at, position=position, **shapes, **size)

    slope = (level(past + SLOPE_STEP) - level(past - SLOPE_STEP)) / (2 * SLOPE_STEP)
    static = p.mass * GRAVITY * share
    load = e(
        tire_vertical,
        at,
        static_load=static,
        stiffness=rigid,
        damping=0.0,
        compression=level(past) - y,
        compression_rate=slope * speed - v,
        share=1.0,
        rear=float(end == "rear"),
    )
    strut = e(spring, at, stiffness=stiffness, stroke=body[0] - y, share=1.0)
    strut = strut + e(damper, at, damping=damping, stroke_rate=body[1] - v, share=1.0)
    hub = Hub(offset, rate, ROLLING * mass, getattr(p, f"hub_compliance{at}"), load * slope)
    strut = strut - getattr(p, f"support_slope{at}") * hub.backward
    acceleration = (strut + load - static) / mass
    e.integrate(**{f"wheel{at}": v, f"wheel_rate{at}": acceleration})
    outboard = p.outboard_mass * GRAVITY
    e.sensor(f"{end}_load", load - outboard - p.outboard_mass * acceleration, rest=static - outboard)
    return strut, hub
