"""The time by which a car lags a mass on a road: its driven wheels slip before the tires push.

Under a drive force F the driven wheels, and what turns with them, run faster than the road by the slip F/(S m g), S
being the driven tires' force over slip and weight. The impulse mr V F/(S m g) that this takes is missing in the car's
speed, which with F = m a lags by

    tau = mr/(m + mr) V/(S g)

some milliseconds, in proportion to speed. A mass on a road does not slip, and S is none of its parameters.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vdyn_cli.inference import Unknown
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.steps.step_policy import STEP_POLICY
from vdyn_cli.steps.validate.noise import inertia_of
from vdyn_cli.steps.validate.road_slope import SPEED_LAG
from vdyn_cli.steps.validate.simulation import SimulationSetup


def slip_lag(setup: SimulationSetup) -> float:
    """The lag of a mass on a road, s, at the rms speed of the drives."""
    values = setup.prior.values
    turning = 1.0 - values["mass"] / inertia_of(values)
    speed = np.concatenate([s.outputs["speed"] for s in setup.segments])
    return float(turning * np.sqrt(np.nanmean(speed**2)) / (STEP_POLICY.slip_stiffness * GRAVITY))


def with_slip_lag(setup: SimulationSetup) -> SimulationSetup:
    """The setup of a mass on a road with about this lag as an unknown; of a vehicle, whose tires slip, as it is."""
    lag = 0.0 if setup.model.name == "vehicle" else slip_lag(setup)
    if lag <= 0.0:
        return setup
    known = lag, STEP_POLICY.slip_spread * lag
    one = Unknown("", lag, -1.0, 1.0, "s", known, nuisance=True, prior_stated=False)
    unknowns = tuple(replace(one, name=n) for n in SPEED_LAG.unknowns)
    return replace(setup, effects=(SPEED_LAG, *setup.effects), extra=(*unknowns, *setup.extra))
