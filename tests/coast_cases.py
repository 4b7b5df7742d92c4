"""Coast-down days of the truth plant as a tester hands them to the step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.plant import coast
from tests.plant.coast import Day, Run
from tests.plant.vehicle import Vehicle
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.coastdown.spec import CoastdownSpec
from vdyn_cli.steps.coastdown.step import STEP

Array = NDArray[np.float64]
COLUMNS = {
    "speed": ("GPS Speed [km/h]", 1 / 3.6),
    "acceleration": ("Long Accel [m/s^2]", 1.0),
    "drive_torque": ("Drive Torque [N m]", 1.0),
}


def known(vehicle: Vehicle, day: Day = coast.DAY, **changed: float | None) -> Parameters:
    """What the tester states; None leaves a parameter out."""
    values = {**coast.known(vehicle, day), **changed}
    return Parameters({n: Estimate.given(PARAMETERS[n], v) for n, v in values.items() if v is not None})


def log_of(run: Run, name: str, channels: Sequence[str] = ("speed",)) -> Log:
    found = {c: run.record[COLUMNS[c][0]] * COLUMNS[c][1] for c in channels}
    return Log(name, run.record["Time [s]"], found)


def logs_of(runs: Sequence[Run], channels: Sequence[str] = ("speed",)) -> list[Log]:
    return [log_of(run, f"run_{k}.csv", channels) for k, run in enumerate(runs, start=1)]


def spec_of(runs: Sequence[Run], **more: Any) -> CoastdownSpec:
    entries = [
        {"log": f"run_{k}.csv", "direction": run.direction, "start": run.start} for k, run in enumerate(runs, start=1)
    ]
    return CoastdownSpec.model_validate({"test": "coastdown", "runs": entries, **more})


def solve_day(
    vehicle: Vehicle,
    seed: int,
    day: Day = coast.DAY,
    effects: Mapping[str, float] | None = None,
    channels: Sequence[str] = ("speed",),
    **more: Any,
) -> Result:
    """A whole campaign through the step."""
    runs = coast.campaign(vehicle, seed, day, effects)
    return STEP.estimate(spec_of(runs, **more), logs_of(runs, channels), known(vehicle, day))


def off(result: Result, name: str, truth: float) -> float:
    """Error in standard deviations."""
    found = result.parameters[name]
    return (found.value - truth) / found.std
