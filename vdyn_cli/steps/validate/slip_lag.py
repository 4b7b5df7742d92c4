"""The time by which a car lags a mass on a road because its driven wheels slip.

Under a drive force F, the driven wheels and the parts that turn with them run faster than the road by the slip
F/(S m g), where S is the driven tires' slip stiffness over weight. This takes the impulse mr V F/(S m g), so that the
car's speed, with F = m a, lags by

    tau = mr/(m + mr) V/(S g),

some milliseconds, in proportion to speed. The model of a mass on a road has no slip and no parameter S.
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
    """The lag tau of the car behind a mass on a road, s, by the module's equation at the rms speed of the drives."""
    values = setup.prior.values
    turning = 1.0 - values["mass"] / inertia_of(values)
    speed = np.concatenate([s.outputs["speed"] for s in setup.segments])
    return float(turning * np.sqrt(np.nanmean(speed**2)) / (STEP_POLICY.slip_stiffness * GRAVITY))


def with_slip_lag(setup: SimulationSetup) -> SimulationSetup:
    """The setup of a mass on a road with this lag as an unknown with a prior; a vehicle, whose tires slip, as is."""
    lag = 0.0 if setup.model.name == "vehicle" else slip_lag(setup)
    if lag <= 0.0:
        return setup
    known = lag, STEP_POLICY.slip_spread * lag
    one = Unknown("", lag, -1.0, 1.0, "s", known, nuisance=True, prior_stated=False)
    unknowns = tuple(replace(one, name=n) for n in SPEED_LAG.unknowns)
    return replace(setup, effects=(SPEED_LAG, *setup.effects), extra=(*unknowns, *setup.extra))
