"""Integration steps of a simulated drive, and sensitivities to added effects."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.steps.validate.validate_cases import inputs, true_parameters
from vdyn_cli.effects import catalog
from vdyn_cli.inference import Unknown
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.validate.car.integration_step import SHORTEST_STEP, with_accurate_step
from vdyn_cli.steps.validate.car.simulation import Car, SimulationSetup
from vdyn_cli.steps.validate.problem import ValidateProblem

SIDES = ("shaft_stiffness_left", "shaft_stiffness_right")


@pytest.fixture(scope="module")
def setup(root: Path, tmp_path_factory: pytest.TempPathFactory) -> SimulationSetup:
    """The first seconds of a drive, in which the shafts oscillate."""
    found = inputs(root, tmp_path_factory.mktemp("steps"), true_parameters())
    return ValidateProblem(found.spec, tuple(log.between(0.0, 8.0) for log in found.data), found.known).baseline


@pytest.fixture(scope="module")
def car(setup: SimulationSetup) -> Car:
    return setup.point.car


def stiffer(car: Car, times: float) -> Car:
    values = {n: v * times if n in SIDES else v for n, v in car.prior.values.items()}
    return replace(car, step=0.002, prior=replace(car.prior, values=values))


def test_a_car_is_followed_in_steps_of_two_milliseconds(car: Car) -> None:
    assert car.step == 0.002
    assert with_accurate_step(car) is car


@pytest.mark.parametrize(("times", "step"), [(10.0, 0.002), (100.0, 0.001), (300.0, SHORTEST_STEP)])
def test_much_stiffer_shafts_want_shorter_steps(car: Car, times: float, step: float) -> None:
    """With the longest steps the simulation would diverge."""
    assert with_accurate_step(stiffer(car, times)).step == step


def test_shafts_that_no_step_can_follow_are_reported(car: Car) -> None:
    with pytest.raises(ResultError, match="not a finite number"):
        with_accurate_step(stiffer(car, 1000.0))


def test_an_effect_added_to_a_drive_that_begins_in_motion_has_the_sensitivities_of_that_drive(
    root: Path, tmp_path: Path
) -> None:
    found = inputs(root, tmp_path, true_parameters())
    logs = tuple(log.between(4.0, 7.0) for log in found.data[:1])
    moving = ValidateProblem(found.spec, logs, found.known).baseline
    slope, size = next(e for e in catalog() if e.name == "road_grade"), 1e-4
    assert moving.vector.first_speed(0) > 3.0

    def added(at: float) -> SimulationSetup:
        return moving.with_effects(AddedEffects((slope,), (Unknown("road_grade", at, -1.0, 1.0, "", None),)))

    start = added(0.0)
    told = start.first[0].sensitivities["speed"][:, start.vector.shared.index("road_grade")]
    ends = [s.simulate(0, s.vector.start(0), slopes=False).values["speed"] for s in (added(size), added(-size))]
    assert told == pytest.approx((ends[0] - ends[1]) / (2 * size), abs=1e-3 * float(np.abs(told).max()))
    assert np.abs(told).max() > 10.0


def test_a_chord_keeps_the_bare_cars_sensitivities_to_parameters_and_takes_the_others_exactly(
    setup: SimulationSetup,
) -> None:
    slope = next(e for e in catalog() if e.name == "road_grade")
    exact = setup.with_effects(AddedEffects((slope,), (Unknown("road_grade", 0.02, -1.0, 1.0, "", None),)))
    chord, parameters = replace(exact, chord=True), len(setup.prior.names)
    for one, other, bare in zip(chord.first, exact.first, setup.first, strict=True):
        speed, whole, before = (s.sensitivities["speed"] for s in (one, other, bare))
        assert one.values["speed"] == pytest.approx(other.values["speed"], abs=1e-12)
        assert speed[:, parameters:] == pytest.approx(whole[:, parameters:], rel=1e-9, abs=1e-9)
        assert np.array_equal(speed[:, :parameters], before[:, :parameters])
        assert not np.allclose(whole[:, :parameters], before[:, :parameters], rtol=1e-3)
