"""Errors of the clocks of two loggers, different in each run, do not bias the center of gravity."""

from dataclasses import replace

import numpy as np
import pytest

from tests.effects.recovered import given
from tests.plant import cg as plant
from tests.plant.vehicle import random_vehicle
from tests.steps.cg.test_cg import SPEC, logs
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.cg.problem import prepare
from vdyn_cli.steps.cg.run_clocks import DELAY, run_clocks

LATE, STD = (0.020, -0.015, 0.008, -0.025), 0.02  # s; interpolation at half a sample smooths the noise
LOADS = ("front_load", "rear_load")


def _with_clock(log: Log, late: float, *names: str, std: float = STD) -> Log:
    """A log whose channels come from another logger, ``late`` s after the others."""
    moved = {n: np.interp(log.time - late, log.time, log[n]) for n in names}
    samples = {n: (log.time + late, log[n]) for n in names}
    clocks = {**log.clock_std, **dict.fromkeys(names, std)}
    return replace(log.with_channels(**moved), samples=samples, clock_std=clocks)


@pytest.mark.parametrize(
    ("names", "sign"),
    [(LOADS, 1.0), pytest.param(("pitch_rate", "acceleration"), -1.0, marks=pytest.mark.slow)],
)
def test_the_delay_of_each_run_is_estimated_with_the_center_of_gravity(names: tuple[str, ...], sign: float) -> None:
    vehicle = random_vehicle(3)
    late = tuple(_with_clock(log, by, *names) for log, by in zip(logs(vehicle, 3), LATE, strict=True))
    solution = prepare(SPEC, late, given(plant.known(vehicle))).baseline
    assert solution.per_run[DELAY] == pytest.approx(sign * np.array(LATE), abs=0.01)
    assert solution.values["cg_height"] == pytest.approx(vehicle.cg_height, abs=3 * solution.std["cg_height"])
    assert solution.std["cg_height"] < 0.03 * vehicle.cg_height


def test_only_channels_of_different_loggers_have_a_delay() -> None:
    log = logs(random_vehicle(3), 3)[0]
    everything = (*LOADS, "pitch_rate", "acceleration")
    assert not run_clocks((log,)).unknowns
    assert not run_clocks((_with_clock(log, 0.0, *everything),)).unknowns
    loads = run_clocks((_with_clock(log, 0.0, *LOADS),))
    assert loads.effects[0].on == ("loads_clock",)
    assert loads.unknowns[0].prior == (0.0, STD)
    third = run_clocks((_with_clock(_with_clock(log, 0.0, *everything), 0.0, "pitch_rate", std=0.03),))
    assert third.effects[0].on == ("loads_clock", "inertial_clock")
