"""The simulators of a load-transfer run, each reduced to the outputs that are used."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.simulate import Drive, Simulated, Simulator
from vdyn_cli.physics.models.load_transfer import CARRIED, MOMENTS, SPEED_RATE, UNIT
from vdyn_cli.quantities.arrays import Array


@dataclass(frozen=True)
class LoadSimulators:
    """The balance with the unknowns of a fit and, for the noise, the zeros of all channels.

    Parameters
    ----------
    moments : outputs all moments, and the true load per newton read.
    turned : outputs the moments that a pitch acceleration changes.
    corrected : outputs the corrected acceleration, and the load of both axles where both are logged.
    """

    moments: Simulator
    turned: Simulator
    corrected: Simulator

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknowns, which all three simulators share."""
        return self.moments.unknowns


def load_simulators(
    model: Model, values: Mapping[str, float], unknowns: Sequence[str], effects: Sequence[Effect], both_axles: bool
) -> LoadSimulators:
    """The simulators of a model with effects, its other parameters at ``values``.

    Parameters
    ----------
    both_axles : whether the loads of both axles are logged.
    """

    def of(*outputs: str) -> Simulator:
        return Simulator(replace(model, outputs=outputs), values, unknowns, effects)

    turned, corrected = (MOMENTS[1:2], (SPEED_RATE, CARRIED)) if both_axles else (MOMENTS[:2], (SPEED_RATE,))
    return LoadSimulators(of(*MOMENTS, UNIT), of(*turned), of(*corrected))


def simulated(simulator: Simulator, drive: Drive, theta: Array) -> Simulated:
    """A simulation at a run's local unknowns ``theta``, with all zeros of the channels equal to zero."""
    return simulator(drive, np.append(theta, np.zeros(len(simulator.unknowns) - theta.size)))
