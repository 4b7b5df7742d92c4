"""A driven axle of the vehicle: motor and carrier, the differential, and a half-shaft to each wheel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from vdyn_cli.engine.model_builder import ModelBuilder, Number
from vdyn_cli.physics.laws.differential import FOLLOW, side_gears
from vdyn_cli.physics.laws.torsion_shaft import rest_twist, shaft
from vdyn_cli.physics.models.vehicle_parts import Body, Corner

Differential = Literal["open", "locked"]


@dataclass(frozen=True)
class Axle:
    """A driven axle.

    Parameters
    ----------
    corners : its left and its right wheel.
    share : its share of ``driveline_inertia``.
    differential : connection of its two half-shafts; None where each has its own motor.
    """

    corners: tuple[Corner, Corner]
    share: float
    differential: Differential | None

    @property
    def name(self) -> str:
        """'front' or 'rear'."""
        return self.corners[0].axle


@dataclass(frozen=True)
class AxleTorques:
    """Torque of each half-shaft by corner, and the nose-up moment of the motor's inertia on the body, N m."""

    shafts: Mapping[str, Number]
    reaction: Number


def driven_axle(e: ModelBuilder, axle: Axle, body: Body, torques: Mapping[str, Number]) -> AxleTorques:
    """Add the motion of the driveline from the motor to the wheels' hubs.

    Open:    Jd wc' = Td - Tl - Tr     d' as in ``side_gears``, inner ends at wc +- (d + t d')
    Locked:  Jd wc' = Td - Tl - Tr     inner ends at wc
    Motors:  Jd / 2 wi' = Ti - Ts      on each side

    Parameters
    ----------
    torques : drive torque at the inner end of each half-shaft, by side, N m, including that for the driveline's
        inertia.

    Notes
    -----
    ``driveline_inertia`` Jd is that of all parts that turn when both inner ends have the same speed: motors and gears,
    carrier and side gears. With Jc = Jd - 2 Js before the side gears, the kinetic energy 1/2 Jc ((wl + wr) / 2)^2 +
    1/2 Js (wl^2 + wr^2) is 1/2 Jd wc^2 + Js d^2.
    The motor is mounted on the body. Its rotor turns 1 / a times as fast as the wheels about a parallel axis, with
    a = ``motor_reaction`` (negative: opposite to them; 0: longitudinal), so that a moment a Jd wc' acts on the body in
    addition to the half-shafts' torque; with a = 1 the sum is the drive torque. The state is wc - a pitch', with which
    the kinetic energy does not depend on the body's motion; ``pitch_inertia`` does not include the rotor.
    """
    twists = {at.name: _twist(e, at, torques[at.side]) for at in axle.corners}
    if axle.differential is None:
        return _motors(e, axle, body, torques, twists)
    return _one_motor(e, axle, body, torques["left"] + torques["right"], twists)


def _one_motor(
    e: ModelBuilder, axle: Axle, body: Body, drive_torque: Number, twists: Mapping[str, Number]
) -> AxleTorques:
    """Carrier, side gears and half-shafts."""
    p, (left, right) = e.p, axle.corners
    carrier = e.state(f"carrier_speed_{axle.name}", e.state("speed") / p.wheel_radius)
    inner = carrier + _carried(e, body)
    apart: Number = 0.0
    if axle.differential == "open":
        d = e.state(f"side_gear_speed_{axle.name}")
        rate = e(
            side_gears,
            f"_{axle.name}",
            torque_left=_torque(e, left, body, twists, inner + d)[0],
            torque_right=_torque(e, right, body, twists, inner - d)[0],
            side_gear_inertia=p.side_gear_inertia,
            stiffness=(p.shaft_stiffness_left + p.shaft_stiffness_right) / 2,
            damping=(p.shaft_damping_left + p.shaft_damping_right) / 2,
        )
        e.integrate(**{f"side_gear_speed_{axle.name}": rate})
        apart = d + FOLLOW * rate
    shafts, total = {}, 0.0
    for at, speed in ((left, inner + apart), (right, inner - apart)):
        shafts[at.name], twist_rate = _torque(e, at, body, twists, speed)
        e.integrate(**{f"twist{at.name}": twist_rate})
        total = total + shafts[at.name]
    e.integrate(**{f"carrier_speed_{axle.name}": (drive_torque - total) / (p.driveline_inertia * axle.share)})
    return AxleTorques(shafts, p.motor_reaction * (drive_torque - total))


def _motors(
    e: ModelBuilder, axle: Axle, body: Body, torques: Mapping[str, Number], twists: Mapping[str, Number]
) -> AxleTorques:
    """A motor on each side, each with half of the axle's inertia, and no differential."""
    p, shafts, reaction = e.p, {}, 0.0
    for at in axle.corners:
        inner = e.state(f"inner_speed{at.name}", e.state("speed") / p.wheel_radius)
        torque, twist_rate = _torque(e, at, body, twists, inner + _carried(e, body))
        rest = torques[at.side] - torque
        inertia = p.driveline_inertia * axle.share / 2
        e.integrate(**{f"twist{at.name}": twist_rate, f"inner_speed{at.name}": rest / inertia})
        shafts[at.name] = torque
        reaction = reaction + p.motor_reaction * rest
    return AxleTorques(shafts, reaction)


def _carried(e: ModelBuilder, body: Body) -> Number:
    """Difference between the speed of an inner end relative to the body and its state, rad/s."""
    return e.p.driveline_pitch * e.p.motor_reaction * body.pitch_rate


def _twist(e: ModelBuilder, at: Corner, torque: Number) -> Number:
    stiffness = getattr(e.p, f"shaft_stiffness_{at.side}")
    return e.state(f"twist{at.name}", e(rest_twist, at.name, torque=torque, stiffness=stiffness))


def _torque(
    e: ModelBuilder, at: Corner, body: Body, twists: Mapping[str, Number], inner: Number
) -> tuple[Number, Number]:
    """Torque (N m) and rate of twist (rad/s) of a half-shaft whose inner end turns at ``inner`` rad/s in the body."""
    p, name = e.p, at.name
    turning = e.state(f"wheel_speed{name}", e.state("speed") / p.wheel_radius)
    twist_rate = inner - (turning + p.driveline_pitch * body.pitch_rate)
    torque = e(
        shaft,
        name,
        twist=twists[name],
        twist_rate=twist_rate,
        stiffness=getattr(p, f"shaft_stiffness_{at.side}"),
        damping=getattr(p, f"shaft_damping_{at.side}"),
    )
    return torque, twist_rate
