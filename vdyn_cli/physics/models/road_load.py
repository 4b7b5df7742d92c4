"""The car as a mass on a road, with drive force, air drag, rolling resistance, slope and inertia."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Literal

from vdyn_cli.engine.maths import sqrt
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import ModelBuilder, Number, Signals
from vdyn_cli.physics.laws.air_drag import air, gust_drag
from vdyn_cli.physics.laws.brake import brake
from vdyn_cli.physics.laws.driveline import drive, driveline, spin_loss
from vdyn_cli.physics.laws.engine import turning_engine
from vdyn_cli.physics.laws.grade_resistance import GradeSource, climb, read_grade, slope
from vdyn_cli.physics.laws.rolling_resistance import rolling
from vdyn_cli.physics.laws.wheel import read_gain
from vdyn_cli.quantities.constants import GRAVITY

# Sense of friction (``standstill_friction``): the car rolls forward in all rows of the runs. A simulated speed below
# zero is an error, and friction that changed its sign there would make the derivatives discontinuous.
FORWARD = 1.0

DriveSignal = Literal["coasting", "torque", "force"]
Resistances = Literal["coefficients", "forces", "coasted"]

CAR = ("mass", "rotating_mass", "rolling_resistance", "rolling_speed", "drag_area", "air_density", "wind_variance")
DRIVELINE = ("gear_ratio", "wheel_radius", "driveline_efficiency", "recuperation_loss")
SENSED = ("accelerometer_slope",)
DRIVES: dict[DriveSignal, tuple[str, ...]] = {"coasting": (), "torque": ("drive_torque",), "force": ("drive_force",)}
RADIUS, READ, ROAD_ENDS = ("wheel_radius",), ("read_radius",), ("road_begin", "road_end")
CHANGED = ("changed",)
ENGINE_TURNS = "engine_turns"
ACCELEROMETER = ("accelerometer_zero", "accelerometer_scale", "road_slope")


# Each option is an independent choice by which the model is cached.
@cache
def road_load(
    driven: DriveSignal = "coasting",
    accelerometer: bool = False,
    located: bool = False,
    sensed: bool = False,
    specific_force: bool = False,
    resistances: Resistances = "coefficients",
    rolled: bool = False,
    changed: bool = False,
    graded: GradeSource = "stated",
    geared: bool = False,
) -> Model:
    """The longitudinal model.

    (M + mr) V' = F - Fd - Rr - Fb - Fs - M g sin(grade)

    with drive force F, air drag Fd, rolling resistance Rr, brake force Fb, spin loss Fs, and mr = sum J/r^2.

    Parameters
    ----------
    driven : measured drive: "coasting" (F = 0), "torque" (input drive_torque, N m) or "force" (input drive_force, N).
    accelerometer : resistances by the measured speed (input ``speed``), and a second output, the specific force
        f = (1 + k) (V' + g sin(grade)) + zero; M f + mr V' = F - Fd - Rr does not contain the slope. road_slope is the
        mean slope beyond the grade, uphill on the way out.
    located : the grade depends on the road's coordinate, heading times the input ``position`` (m), which increases in
        the direction of driving. It is an input: integrating a wrong speed would shift the hills.
    sensed : an input is the slope beyond the grade by an accelerometer (``SENSED``).
    specific_force : a second output is the specific force V' + g sin(grade) of the simulated motion.
    resistances : stated as "coefficients" (rolling resistance changes with the mass), "forces" (N, no change), or
        "coasted": from decelerations times the stated mass (the drag area changes as well).
    rolled : whether the speed was computed from a wheel's, by a radius that is the context ``read_radius`` (m).
    changed : whether the car was changed between two runs: the context ``changed`` is 1 with the change, else 0.
    graded : source of the grade (``read_grade``).
    geared : an input is the angle of the engine per distance, rad/m, in its gear (``ENGINE_TURNS``).

    Returns
    -------
    Model with outputs speed (m/s) and, with accelerometer or specific_force, acceleration (m/s^2).

    Notes
    -----
    Assumes rolling forward: friction keeps its sign below zero speed. Inputs: grade, wind_speed (m/s), elapsed (s since
    the first run began). Context: heading (+1 out, -1 back, 0 unknown), temperature (K); located also road_begin and
    road_end (m), the range of the runs. wind_variance (m^2/s^2), of gusts, adds drag. run_time: s since the log began.
    Source: doi:10.4271/2017-01-1574, equations (1) to (4), with the rotating mass added.
    """
    road = (*(("position",) if located else ()), *(SENSED if sensed else ()))

    def assemble(e: ModelBuilder, u: Signals) -> None:
        state = e.state("speed", 15.0)
        speed = e("measured_speed", value=u.speed) if accelerometer else state
        grade = _grade(e, u, road, graded, accelerometer)
        force, read = _drive_force(e, u, driven, speed), e(read_gain, wheel_radius=e.p.wheel_radius) if rolled else 1.0
        mass = e("laden_mass", value=e.p.mass) if resistances == "forces" else e.p.mass
        resisted = _resistance(e, u, (speed, grade, mass), resistances) + e(climb, mass=mass, grade=grade)
        turning = _turning_mass(e, u) if geared else e.p.rotating_mass
        rate = (force - resisted) / (mass + turning)
        e.integrate(run_time=1.0, speed=rate)
        traction = (force - turning * rate) / (mass * GRAVITY)
        e.sensor("speed", read * state, read * rate, traction=traction, rate_of_change=read * rate)
        if accelerometer or specific_force:
            e.sensor("acceleration", _specific_force(e, rate, grade, accelerometer), rate_of_change=rate)

    return Model(
        name="road load",
        assemble=assemble,
        parameters=(*CAR, *_driveline(driven, rolled), *(ACCELEROMETER if accelerometer else ())),
        inputs=("grade", "wind_speed", "elapsed", *DRIVES[driven], *_measured(accelerometer, geared), *road),
        context=_context(located, rolled, changed),
    )


def _turning_mass(e: ModelBuilder, u: Signals) -> Number:
    """The rotating mass with that of the engine in its gear, kg."""
    return e.p.rotating_mass + e(turning_engine, engine_inertia=0.0, engine_turns=u.engine_turns)


def _specific_force(e: ModelBuilder, rate: Number, grade: Number, read: bool) -> Number:
    """The specific force of a motion, m/s^2; ``read``: by an accelerometer with a scale error and a zero."""
    specific = rate + GRAVITY * grade / sqrt(1.0 + grade**2)
    return (1.0 + e.p.accelerometer_scale) * specific + e.p.accelerometer_zero if read else specific


def _grade(e: ModelBuilder, u: Signals, road: Sequence[str], graded: GradeSource, sloped: bool) -> Number:
    """The grade in the direction of driving, on which effects of the inputs ``road`` act; ``sloped``: + road_slope."""
    logged = read_grade(e, u.grade, graded)
    grade: Number = e("grade", value=logged, **{name: getattr(u, name) for name in road})
    if sloped:
        grade = e(slope, grade=grade, road_slope=e.p.road_slope)
    return grade


def _measured(accelerometer: bool, geared: bool) -> tuple[str, ...]:
    return (*(("speed",) if accelerometer else ()), *((ENGINE_TURNS,) if geared else ()))


def _context(located: bool, rolled: bool, changed: bool) -> tuple[str, ...]:
    own = (*(ROAD_ENDS if located else ()), *(READ if rolled else ()), *(CHANGED if changed else ()))
    return ("heading", "temperature", *own)


def _driveline(driven: DriveSignal, rolled: bool) -> tuple[str, ...]:
    return DRIVELINE if driven == "torque" else RADIUS if rolled else ()


def _drive_force(e: ModelBuilder, u: Signals, driven: DriveSignal, speed: Number) -> Number:
    if driven == "torque":
        timed = {"run_time": e.state("run_time"), "elapsed": u.elapsed}
        torque = e("drive_torque", value=u.drive_torque, speed=speed, **timed)
        radius, ratio = e.p.wheel_radius, e.p.gear_ratio
        force = e(
            drive,
            drive_torque=torque,
            gear_ratio=ratio,
            wheel_radius=radius,
            driveline_efficiency=e.p.driveline_efficiency,
            recuperation_loss=e.p.recuperation_loss,
            whole=1.0,
        )
        return force - e(spin_loss, viscous=0.0, speed=speed, wheel_radius=radius) / radius
    return e("drive_force", value=u.drive_force) if driven == "force" else 0.0


def _resistance(e: ModelBuilder, u: Signals, motion: tuple[Number, Number, Number], stated: Resistances) -> Number:
    """Sum of all resistances except the slope, N, of a ``motion`` with speed, grade and mass."""
    p, (speed, grade, mass) = e.p, motion
    mass = e("road_load_mass", value=mass) if stated == "forces" else mass
    drag_area = e("coasted_drag_area", value=p.drag_area) if stated == "coasted" else p.drag_area
    day = {"elapsed": u.elapsed, "run_time": e.state("run_time"), "speed": speed}
    wind = e("wind_speed", value=u.wind_speed)
    drag = e(air, air_density=p.air_density, drag_area=drag_area, wind=wind, **day)
    day |= {"sense": FORWARD, "share": 1.0}
    drag = drag + e(gust_drag, air_density=p.air_density, drag_area=drag_area, wind_variance=p.wind_variance)
    tires = e(
        rolling,
        rolling_resistance=e("stated_rolling", value=p.rolling_resistance),
        rolling_speed=p.rolling_speed,
        load=mass * GRAVITY / sqrt(1.0 + grade**2),
        **day,
    )
    spin = e(driveline, driveline_drag=0.0, driveline_viscous=0.0, **day)
    return drag + tires + spin + e(brake, brake_force=0.0, **day)
