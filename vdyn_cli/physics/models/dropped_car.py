"""A quarter or half car released above its rest position: motion on springs, dampers and tires."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import ModelBuilder, Number, Signals
from vdyn_cli.physics.laws.suspension import damper, spring
from vdyn_cli.physics.laws.tire_vertical import tire_vertical
from vdyn_cli.physics.models.half_car import BODY_OF, sprung_body
from vdyn_cli.quantities.constants import GRAVITY

AXLES = ("front", "rear")


def sought(axles: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the parameters that a drop determines: of each axle on the rig, and of the tires."""
    kinds = ("suspension_stiffness", "suspension_damping")
    return (*(f"{kind}_{end}" for kind in kinds for end in axles), "tire_vertical_stiffness")


def given(axles: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the parameters that must be known: masses; for both axles also lengths and the body's pitch inertia."""
    if len(axles) == 1:
        return ("sprung_mass", f"unsprung_mass_{axles[0]}")
    return ("mass", "sprung_pitch_inertia", "cg_to_front", "wheelbase", "unsprung_mass_front", "unsprung_mass_rear")


def motions(axles: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the coordinates of the body, then of each axle; each has a rate as further state."""
    body = ("heave", "pitch") if len(axles) == 2 else ("heave",)
    return (*body, *(f"wheel_{end}" for end in axles))


@cache
def dropped_car(axles: tuple[str, ...]) -> Model:
    """One axle with two degrees of freedom, or the half car with four, from any initial state, relative to rest.

    Ms z'' = -S,   mu y'' = S + Fz - F0,   S = K (z - y) + C (z' - y'),   Fz = max(0, F0 - Kt y)

    for one axle; for two, the half car of ``models.half_car`` on a level road.

    Parameters
    ----------
    axles : those on the rig: ("front",), ("rear",) or both.

    Returns
    -------
    Model with outputs body_height_<axle> and wheel_height_<axle>, m above rest, the body's above each axle.

    Notes
    -----
    ``sprung_mass`` of one axle is the mass on its springs. Gravity is in the loads at rest F0, so that a wheel may be
    in the air initially. Source: as ``models.half_car``.
    """

    def assemble(e: ModelBuilder, u: Signals) -> None:
        p = e.p
        state = {n: (e.state(n), e.state(f"{n}_rate")) for n in motions(axles)}
        z, w = state["heave"]
        if len(axles) == 1:
            sprung, shares = p.sprung_mass, {axles[0]: 1.0}
            arms: dict[str, Number] = {axles[0]: 0.0}
            pitch, turn = 0.0, 0.0
            mass = p.sprung_mass + getattr(p, f"unsprung_mass_{axles[0]}")
        else:
            sprung, to_front = sprung_body(*(getattr(p, name) for name in BODY_OF))
            share = p.cg_to_front / p.wheelbase
            shares, arms = {"front": 1.0 - share, "rear": share}, {"front": to_front, "rear": to_front - p.wheelbase}
            pitch, turn = state["pitch"]
            mass = p.mass
        pulls = {}
        for end in axles:
            body = (z + arms[end] * pitch, w + arms[end] * turn)
            struts = {"share": 1.0, "alone": len(axles) == 1}
            pulls[end] = _axle(e, end, body, state[f"wheel_{end}"], mass * GRAVITY * shares[end], struts)
        e.integrate(heave=w, heave_rate=-sum(pulls.values()) / sprung)
        if len(axles) == 2:
            moment = -sum(arms[end] * pull for end, pull in pulls.items())
            e.integrate(pitch=turn, pitch_rate=moment / p.sprung_pitch_inertia)

    return Model("dropped car", assemble, (*sought(axles), *given(axles)), ("elapsed",))


def _axle(
    e: ModelBuilder,
    end: str,
    body: tuple[Number, Number],
    wheel: tuple[Number, Number],
    static: Number,
    struts: Mapping[str, Number],
) -> Number:
    """Add one axle's motion; returns the downward force of its springs and dampers on the body relative to rest, N.

    ``struts`` : further signals of the laws of spring and damper.
    """
    p, at, (y, v) = e.p, f"_{end}", wheel
    which = {} if struts["alone"] else {"rear": float(end == "rear")}
    load = e(
        tire_vertical,
        at,
        static_load=static,
        stiffness=p.tire_vertical_stiffness,
        damping=0.0,
        compression=-y,
        compression_rate=-v,
        share=1.0,
        **which,
    )
    strut = e(spring, at, stiffness=getattr(p, f"suspension_stiffness{at}"), stroke=body[0] - y, **struts)
    strut = strut + e(damper, at, damping=getattr(p, f"suspension_damping{at}"), stroke_rate=body[1] - v, **struts)
    e.integrate(**{f"wheel{at}": v, f"wheel{at}_rate": (strut + load - static) / getattr(p, f"unsprung_mass{at}")})
    e.sensor(f"body_height{at}", body[0], body[1])
    e.sensor(f"wheel_height{at}", y, v)
    return strut
