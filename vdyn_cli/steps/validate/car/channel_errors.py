"""Unknown errors of the channels of a mass on a road: slip of driven wheels, pitch of the body, latencies of loggers.

Under a drive force F, the driven wheels and the parts that turn with them run faster than the road by the slip
F/(S m g), where S is the driven tires' slip stiffness over weight. The impulse that this takes is missing in the car's
speed, which becomes

    V (1 - mr/(m + mr) F/(S m g)).

The model of a mass on a road has no slip and no parameter S. Its body does not pitch either: that of a car squats by an
angle k V'/g as it accelerates, by which an accelerometer reads k V' more. On a level road that is a gain of the sensor;
on hills, whose gravity a gain also scales, it would be a wrong rotating mass.

Only the differences of latencies matter, so that those of the other channels are relative to that of the drive torque:
their variances are twice that of one latency, half of it in common. As further unknown, the latency of the torque would
be determined by the noise of the logged torque.

A value that the logger holds was sampled anywhere in the row h before it appears. It is then late by 0 to h, evenly
distributed, with the mean square h^2/3, beside the latency of the sensor. The prior has the mean zero of an exporter
that repeats samples of its rows.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from math import hypot, sqrt

from vdyn_cli.effects import effect
from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.inference import Unknown
from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.validate.car.simulation import SimulationSetup
from vdyn_cli.steps.validate.noise import inertia_of
from vdyn_cli.steps.validate.policy import VALIDATE_POLICY
from vdyn_cli.steps.validate.road.road_slope import LATENCIES


@effect(
    on="speed",
    unknowns=(Quantity("slip_impulse", "", "slip of the driven wheels per drive force over weight", "i", -1.0, 1.0),),
    reference="impulse of the parts that turn with the driven wheels",
)
def slip_impulse(speed: Law, s: Signals, q: Signals) -> Number:
    """The car's speed without the impulse that slipping wheels have taken."""
    return speed(s) * (1.0 - q.slip_impulse * s.traction)


@effect(
    on="acceleration",
    unknowns=(Quantity("body_pitch", "", "gravity along a pitching accelerometer per acceleration", "k", -1.0, 1.0),),
    reference="pitch gradient of a sprung body",
)
def body_pitch(acceleration: Law, s: Signals, q: Signals) -> Number:
    """The specific force with the gravity along an accelerometer in a body that pitches as the car accelerates."""
    return acceleration(s) + q.body_pitch * s.rate_of_change


def with_channel_errors(
    setup: SimulationSetup, covered: Collection[str], start: Mapping[str, float]
) -> SimulationSetup:
    """The setup of a mass on a road with slip, pitch and latencies as unknowns with a prior; that of a vehicle as is.

    Parameters
    ----------
    covered : names of the latencies that an effect in the model replaces; these are left out.
    start : values at which they start, by name; their prior means where omitted.
    """
    if setup.model.name == "vehicle":
        return setup
    values = setup.prior.values
    slip = max(1.0 - values["mass"] / inertia_of(values), 0.0) / VALIDATE_POLICY.slip_stiffness
    held = setup.sensors.held
    torque = max((row for n, row in held.items() if n.startswith("drive_torque")), default=0.0)
    common = _spread(torque)  # the latency of the torque
    rows = {e: held.get(n, 0.0) for n, e in LATENCIES.items() if n in setup.sensors.channels and e.name not in covered}
    late = {e: hypot(_spread(row), common) for e, row in rows.items()}
    known = {slip_impulse: (slip, VALIDATE_POLICY.slip_spread * slip)} if slip > 0.0 else {}
    if "acceleration" in setup.sensors.channels:
        known[body_pitch] = (0.0, VALIDATE_POLICY.body_pitch)
    known |= {e: (0.0, std) for e, std in late.items()}
    unknowns = tuple(
        Unknown(
            *(e.name, start.get(e.name, mean), -1.0, 1.0, next(iter(e.unknowns.values())).unit, (mean, std)),
            nuisance=True,
            prior_stated=False,
            prior_correlation={o.name: common**2 / (std * late[o]) for o in late if o is not e} if e in late else {},
        )
        for e, (mean, std) in known.items()
    )
    return replace(setup, added=AddedEffects(tuple(known), unknowns) + setup.added)


def _spread(row: float) -> float:
    """The root of the mean square, s, of the latency of a channel whose values are held for rows of ``row`` s."""
    return sqrt(VALIDATE_POLICY.logger_latency**2 + row**2 / 3.0)
