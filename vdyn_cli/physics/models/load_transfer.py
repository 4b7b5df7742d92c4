"""Load transfer as a static model: the moment balance from loads and motion."""

from __future__ import annotations

from vdyn_cli.engine.maths import where
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import ModelBuilder, Number, Signals
from vdyn_cli.physics.laws.aerodynamic_lift import lift
from vdyn_cli.physics.laws.air_drag import air
from vdyn_cli.physics.laws.axle_loads import load_moment, motion_moment
from vdyn_cli.physics.laws.grade_resistance import climb
from vdyn_cli.quantities.constants import GRAVITY

# Share by which the front loads are too low relative to the rear ones. The comparison with the weight needs it. It is
# not in the moments, where it is collinear with ``cg_to_rear``.
EXCESS_GAIN = "front_excess_gain"
SOUGHT = ("cg_height", "cg_to_rear", "pitch_inertia")
GIVEN = (
    *("mass", "wheelbase", "antenna_height", "antenna_offset", "drag_area", "drag_height", "air_density", "spin"),
    *("unsprung_mass_front", "unsprung_mass_rear", "tire_vertical_compliance", "reads_gravity", "contact_lead"),
    *("slip_compliance", "tire_relaxation_length", "brake_share_front", "pitch_axis", EXCESS_GAIN),
)
ZEROS = (
    *("front_load_zero", "rear_load_zero", "acceleration_zero"),
    *("front_load_bend_zero", "rear_load_bend_zero", "acceleration_rate_zero", "acceleration_bend_zero"),
)
MOMENTS = ("loads", "motion", "inertial")  # their sum is zero where loads and motion agree
SPEED_RATE = "speed_rate"  # m/s^2, acceleration corrected for gravity, to compare with the logged speed
CARRIED = "carried"  # N, upward force of road and air on the vehicle: the weight, except for heave
UNIT = "unit"  # N, true load per newton read, to compare the moments with the loads' noise
HEAVES = ("sprung_heave", "damped_heave")  # rad/s^2
HEAVE_LEVERS = ("heave_spring", "heave_damper")  # m
# m^2/s^3, m/s^4, twice; the rates of the first two, m^2/s^4, m/s^5
SLIDING = ("push_speed_rate", "push_bend", "swing_speed_rate", "swing_bend", "push_rate_speed_rate", "push_rate_bend")
SLIP = ("slip_compliance", "tire_relaxation_length")  # -, m
MOTION = (
    *("acceleration", "acceleration_rate", "pitch", "pitch_rate", "pitch_acceleration"),
    *("speed", "rolling", "swing", "pitch_bend", *SLIDING),
)


def _lift(e: ModelBuilder, u: Signals, rear: float) -> Number:
    """Lift at one axle; ``rear`` is 1 at the rear axle, 0 at the front one."""
    return e(lift, speed=u.speed, wind=0.0, lift_area=0.0, air_density=e.p.air_density, rear=rear)


def _with_motion(e: ModelBuilder, u: Signals) -> Signals:
    """The signals with the component of gravity along the road, ``weight`` N, the corrected acceleration, ``rate``
    m/s^2, two derivatives of the logged one, ``reading_rate`` and ``reading_bend``, and the drag, N."""
    p = e.p
    weight = e(climb, mass=p.mass, grade=e("grade", value=0.0))
    read = e("acceleration", value=u.acceleration) - p.acceleration_zero
    drag = e(air, speed=u.speed, wind=0.0, drag_area=p.drag_area, air_density=p.air_density)
    reading_rate = u.acceleration_rate - p.acceleration_rate_zero + GRAVITY * p.reads_gravity * u.pitch_rate
    reading_bend = u.push_bend - p.acceleration_bend_zero + GRAVITY * p.reads_gravity * u.pitch_bend
    rate = read - p.reads_gravity * weight / p.mass
    return u.but(weight=weight, rate=rate, reading_rate=reading_rate, reading_bend=reading_bend, drag=drag)


def _moments(e: ModelBuilder, u: Signals, front: Number, rear: Number, front_bend: Number, rear_bend: Number) -> None:
    """The moments as separate sensors, because loads, pitch and acceleration may come from loggers with other clocks.

    ``inertial`` is the share of the acceleration as it was logged, with gravity, in the moment of the motion.

    ``u`` has the signals of ``_with_motion``. ``front``, ``rear`` N are the upward forces on the axles, including lift;
    their bends, N/s^2, are second derivatives of the loads, which deflect the tires. ``reads_gravity`` is 1 where the
    accelerometer measures gravity along the road, else 0. ``contact_lead`` m is the distance of a rolling tire's
    contact force ahead of its hub, rolling resistance times radius, which gives the moment of the resistance.
    ``rolling`` is 1 where the wheels roll, and 0 at rest, where this moment vanishes.

    The tires slide at vs = V k + sigma k' with the slip k = b a / g, b ``slip_compliance`` (slip per friction, 1/(B C
    D)) and the relaxation length sigma: vs' = b / g ((V a)' + sigma a''). Its inputs are ``push_speed_rate`` and
    ``push_bend`` by the logged acceleration, ``swing_speed_rate`` and ``swing_bend`` by the pitch. With all tires alike
    this holds for any distribution of the force, if the axles' loads are equal.

    The body turns about an axis ``pitch_axis`` m below its center of gravity.
    """
    p = e.p
    e.sensor(
        MOMENTS[0],
        e(
            load_moment,
            front_load=front,
            rear_load=rear,
            front_axle_acceleration=-front_bend * p.tire_vertical_compliance,
            rear_axle_acceleration=-rear_bend * p.tire_vertical_compliance,
            mass=p.mass,
            unsprung_front=p.unsprung_mass_front,
            unsprung_rear=p.unsprung_mass_rear,
            wheelbase=p.wheelbase,
            cg_to_rear=p.cg_to_rear - p.contact_lead * u.rolling,
        ),
    )
    e.sensor(UNIT, e("wheel_force", "_unit", value=1.0, rear=0.0, push=0.0, braking=0.0, brake_share_front=0.0))
    rate = u.rate
    felt = GRAVITY * p.reads_gravity * u.pitch  # logged with the acceleration, so as late as it is
    e.sensor(SPEED_RATE, rate, rate_of_change=u.reading_rate, second_derivative=u.reading_bend)
    pushed, swung, pushed_rate = (
        p.slip_compliance / GRAVITY * (with_speed + p.tire_relaxation_length * bend)
        for with_speed, bend in (
            (u.push_speed_rate, u.push_bend),
            (u.swing_speed_rate, u.swing_bend),
            (u.push_rate_speed_rate, u.push_rate_bend),
        )
    )
    lever = p.mass * p.cg_height + p.spin
    inertial = lever * (rate + felt) + p.spin * pushed
    motion = e(
        motion_moment,
        acceleration=rate,
        pitch=u.pitch,
        pitch_rate=u.pitch_rate,
        pitch_acceleration=u.pitch_acceleration,
        climb=u.weight,
        drag=u.drag,
        drag_height=p.drag_height,
        mass=p.mass,
        cg_height=p.cg_height,
        pitch_inertia=p.pitch_inertia,
        antenna_height=p.antenna_height,
        antenna_offset=p.antenna_offset,
        spin=p.spin,
        sliding_rate=pushed + swung,
        pitch_axis=p.pitch_axis,
    )
    e.sensor(MOMENTS[1], motion - inertial)
    inertial_rate = lever * u.reading_rate + p.spin * pushed_rate
    e.sensor(MOMENTS[2], inertial, rate_of_change=inertial_rate, second_derivative=lever * u.reading_bend)


def _both(e: ModelBuilder, u: Signals) -> None:
    p, u = e.p, _with_motion(e, u)
    # The longitudinal force at the road. ``swing``, m/s^2, a rough value of the term of the pitch acceleration, decides
    # its sign, so that the balance stays linear in the pitch acceleration.
    push = p.mass * (u.rate + (p.antenna_height - p.cg_height) * u.pitch_acceleration) + u.weight + u.drag
    pushed = {"push": push, "braking": where(u.rate + u.swing < 0, 1.0, 0.0), "brake_share_front": p.brake_share_front}
    front = e("wheel_force", "_front", value=u.front_load - p.front_load_zero, rear=0.0, **pushed) + _lift(e, u, 0.0)
    rear = e("wheel_force", "_rear", value=u.rear_load - p.rear_load_zero, rear=1.0, **pushed) + _lift(e, u, 1.0)
    bends = u.front_load_bend - p.front_load_bend_zero, u.rear_load_bend - p.rear_load_bend_zero
    _moments(e, u, front, rear, *bends)
    e.sensor(CARRIED, front + rear + p.front_excess_gain * front)


def _front(e: ModelBuilder, u: Signals) -> None:
    u = _with_motion(e, u)
    front = e("wheel_force", "_front", value=u.front_load - e.p.front_load_zero) + _lift(e, u, 0.0)
    p = e.p
    heave = p.heave_lever * u.pitch_acceleration + p.heave_spring * u.sprung_heave + p.heave_damper * u.damped_heave
    rear = p.mass * (GRAVITY + heave) - front
    bend = u.front_load_bend - p.front_load_bend_zero
    _moments(e, u, front, rear, bend, -bend)


LOAD_TRANSFER = Model(
    "load_transfer",
    _both,
    (*SOUGHT, *GIVEN, *ZEROS),
    ("front_load", "rear_load", "front_load_bend", "rear_load_bend", *MOTION),
    ("heading",),
)

# The paper's equation (5) has no heave. Here the body heaves by ``heave_lever`` m per rad of pitch, and its springs and
# dampers add the accelerations ``sprung_heave`` and ``damped_heave``, rad/s^2, per meter of their levers.
FRONT_LOAD_TRANSFER = Model(
    "front_load_transfer",
    _front,
    (*SOUGHT, *GIVEN, "heave_lever", *HEAVE_LEVERS, *(z for z in ZEROS if not z.startswith("rear"))),
    ("front_load", "front_load_bend", *HEAVES, *MOTION),
    ("heading",),
)
