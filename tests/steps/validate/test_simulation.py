"""How long the steps of a simulated drive may be."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.steps.validate.validate_cases import inputs, true_parameters
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.validate.problem import ValidateProblem
from vdyn_cli.steps.validate.simulation import SHORTEST_STEP, SimulationSetup, with_accurate_step

SIDES = ("shaft_stiffness_left", "shaft_stiffness_right")


@pytest.fixture(scope="module")
def setup(root: Path, tmp_path_factory: pytest.TempPathFactory) -> SimulationSetup:
    """The first seconds of a drive: the shafts swing where it sets off."""
    found = inputs(root, tmp_path_factory.mktemp("steps"), true_parameters())
    return ValidateProblem(found.spec, tuple(log.between(0.0, 8.0) for log in found.data), found.known).baseline


def stiffer(setup: SimulationSetup, times: float) -> SimulationSetup:
    values = {n: v * times if n in SIDES else v for n, v in setup.prior.values.items()}
    return replace(setup, step=0.002, prior=replace(setup.prior, values=values))


def test_a_car_is_followed_in_steps_of_two_milliseconds(setup: SimulationSetup) -> None:
    assert setup.step == 0.002
    assert with_accurate_step(setup) is setup


@pytest.mark.parametrize(("times", "step"), [(10.0, 0.002), (100.0, 0.001), (300.0, SHORTEST_STEP)])
def test_much_stiffer_shafts_want_shorter_steps(setup: SimulationSetup, times: float, step: float) -> None:
    """In the longest ones they would leave the numbers."""
    assert with_accurate_step(stiffer(setup, times)).step == step


def test_shafts_that_no_step_can_follow_are_reported(setup: SimulationSetup) -> None:
    with pytest.raises(ResultError, match="not a finite number"):
        with_accurate_step(stiffer(setup, 1000.0))
