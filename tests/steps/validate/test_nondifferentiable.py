"""Free play in drives: its size and each drive's zero of the torque are found by trying."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.bench.hidden_logs import make
from tests.plant.hidden import Scenario
from vdyn_cli.effects import catalogue
from vdyn_cli.inference import Unknown
from vdyn_cli.project.inputs import Inputs, gather
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.steps import load_step
from vdyn_cli.steps.validate import flanks
from vdyn_cli.steps.validate.nondifferentiable import (
    DISAGREE,
    _Explained,
    _plain,
    profile_estimates,
    likely_size,
    with_best_zeros,
)
from vdyn_cli.steps.validate.whitening import whiten_drives
from vdyn_cli.steps.validate.step import trial_of
from vdyn_cli.steps.validate.simulation import TORQUE_ZERO, SimulationSetup

PLAY = 1.5e-3
ZERO = -0.006  # N m, that the plant's torque sensor has in the one drive


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Inputs:
    return one_drive(tmp_path_factory.mktemp("play"))


def one_drive(folder: Path) -> Inputs:
    """One drive of a car with play."""
    made = make(Scenario("validate", {"backlash": PLAY}, 41), folder)
    found = gather(load_step("validate"), made.description, ())
    spec = found.spec.model_copy(update={"runs": found.spec.runs[:1]})
    return replace(found, spec=spec, data=found.data[:1])


@pytest.fixture(scope="module")
def setups(drive: Inputs) -> Callable[[float], SimulationSetup]:
    """It, simulated with play of any size."""
    return lambda size: simulated(drive, size)


def simulated(drive: Inputs, size: float) -> SimulationSetup:
    play = next(e for e in catalogue() if e.name == "backlash")
    return trial_of(drive.spec, drive.data, drive.known, [play], [Unknown("backlash", size, 0.0, 0.06, "rad")])[0]


def test_the_size_is_found(setups: Callable[[float], SimulationSetup]) -> None:
    size, rise = likely_size(setups, 3e-4, 4e-3)
    assert size == pytest.approx(PLAY, rel=0.15)
    assert rise > 5.0


def test_a_drive_begins_at_the_zero_with_which_its_flanks_rest_as_the_real_ones(
    setups: Callable[[float], SimulationSetup],
) -> None:
    setup = with_best_zeros(setups(PLAY))
    (zero,) = setup.torque_zeros
    assert zero == pytest.approx(ZERO, abs=0.1)
    assert setup.start(0)[len(setup.shared) + setup.own.index(TORQUE_ZERO)] == zero
    assert setup.unknowns()[1][TORQUE_ZERO] == np.array([zero])


@pytest.mark.parametrize(("std", "count"), [(0.1, 3), (0.66, 5), (50.0, 25)])
def test_the_likeliest_zero_is_tried_and_others_to_either_side(std: float, count: int) -> None:
    zeros = _Explained(np.zeros((1, 1)), 0.7, std).zeros
    assert zeros.size == count
    assert zeros[count // 2] == pytest.approx(0.7)
    assert count == 25 or np.diff(zeros).max() <= 0.5


def test_of_zeros_that_let_gears_rest_alike_the_likeliest_is_taken(setups: Callable[[float], SimulationSetup]) -> None:
    """Without play there are no flanks: what is left is what the drive tells of the zero."""
    plain = _plain(setups(0.0))
    own, explained = setups(0.0), plain.explained[0]
    middle, side = (plain.cost(own, 0, explained.zero + off * explained.std) for off in (0.0, 1.5))
    assert side - middle == pytest.approx(0.5 * 1.5**2, abs=0.1)


def test_a_car_that_is_begun_off_its_parameters_costs_as_much(setups: Callable[[float], SimulationSetup]) -> None:
    """What is known of a parameter moves with it, or what explains it away would cost what it is off."""
    plain = _plain(setups(0.0))
    own, zero = setups(0.0), plain.explained[0].zero
    prior = own.prior
    heavier = own.begun_at({"mass": prior.values["mass"] + prior.std[prior.names.index("mass")]})
    assert heavier.at
    assert plain.cost(heavier, 0, zero) == pytest.approx(plain.cost(own, 0, zero), abs=0.1)


def test_without_play_nothing_is_tried(setups: Callable[[float], SimulationSetup]) -> None:
    setup = setups(0.0)
    assert with_best_zeros(setup) is setup


def test_a_size_is_known_no_better_than_drives_tell_it_from_sizes_about_it(
    setups: Callable[[float], SimulationSetup],
) -> None:
    ((size, spread),) = profile_estimates(setups(PLAY)).values()
    assert size == pytest.approx(PLAY, abs=3 * spread)
    assert 0.005 * PLAY < spread <= 0.2 * PLAY
    assert profile_estimates(setups(0.0)) == {}


def stubbed(monkeypatch: pytest.MonkeyPatch, *costs: Callable[[float], float]) -> list[float]:
    """Drives that cost so much by the size of their play; the sizes that are tried."""
    tried = []

    def zeros(plain: object, setup: SimulationSetup, few: bool = False) -> tuple[tuple[float, ...], tuple[float, ...]]:
        tried.append(setup.extra[0].start)
        return (0.0,) * len(costs), tuple(cost(tried[-1]) for cost in costs)

    monkeypatch.setattr(flanks, "_plain", lambda setup: None)
    monkeypatch.setattr(flanks, "_zeros", zeros)
    return tried


def finite(below: float, best: float = PLAY) -> Callable[[float], float]:
    """The cost of a drive whose play is known to a fifteenth, where it is small enough to be simulated."""

    def cost(size: float) -> float:
        if size > below:
            raise ResultError(Finding("simulation", "is not finite"))
        return 0.5 * ((size - best) / 1e-4) ** 2

    return cost


@pytest.mark.parametrize("begun", [0.9, 1.0, 1.1])
@pytest.mark.parametrize("below", [np.inf, 1.65e-3])
def test_a_size_beside_the_best_comes_back_to_it_from_sizes_that_can_be_simulated(
    monkeypatch: pytest.MonkeyPatch, setups: Callable[[float], SimulationSetup], begun: float, below: float
) -> None:
    tried = stubbed(monkeypatch, finite(below))
    ((size, spread),) = profile_estimates(setups(begun * PLAY)).values()
    assert max(tried) == pytest.approx(1.2 * begun * PLAY)
    assert size == pytest.approx(PLAY)
    assert spread == pytest.approx(DISAGREE * 1e-4)


@pytest.mark.parametrize("apart", [0.0, 1e-4, 3e-4])
def test_drives_that_disagree_tell_less_than_they_say(
    monkeypatch: pytest.MonkeyPatch, setups: Callable[[float], SimulationSetup], apart: float
) -> None:
    """Two drives' worth of what other drives showed, and the two by which these three differ."""
    stubbed(monkeypatch, *(finite(np.inf, PLAY + k * apart) for k in (-1, 0, 1)))
    ((size, spread),) = profile_estimates(setups(PLAY)).values()
    assert size == pytest.approx(PLAY)
    wider = np.sqrt((2 * DISAGREE**2 + 2 * (apart / 1e-4) ** 2) / 4)
    assert spread == pytest.approx(wider * 1e-4 / np.sqrt(3))


def test_a_drive_that_tells_nothing_does_not_disagree(
    monkeypatch: pytest.MonkeyPatch, setups: Callable[[float], SimulationSetup]
) -> None:
    stubbed(monkeypatch, *(finite(np.inf) for _ in range(3)), lambda size: 0.5 * size / PLAY)
    ((size, spread),) = profile_estimates(setups(PLAY)).values()
    assert size == pytest.approx(PLAY, rel=0.01)
    assert spread == pytest.approx(np.sqrt(2 * DISAGREE**2 / 5) * 1e-4 / np.sqrt(3), rel=0.01)


def test_where_next_to_no_size_can_be_simulated_none_is_told(
    monkeypatch: pytest.MonkeyPatch, setups: Callable[[float], SimulationSetup]
) -> None:
    stubbed(monkeypatch, finite(0.87 * PLAY))
    assert profile_estimates(setups(PLAY)) == {"backlash": (PLAY, pytest.approx(0.2 * PLAY))}


def test_sizes_that_are_not_possible_are_neither_tried_nor_told(
    monkeypatch: pytest.MonkeyPatch, setups: Callable[[float], SimulationSetup]
) -> None:
    most = setups(0.0).extra[0].upper
    tried = stubbed(monkeypatch, lambda size: ((size - 1.1 * most) / (0.1 * most)) ** 2)
    ((size, _),) = profile_estimates(setups(most)).values()
    assert max(tried) == most
    assert size == pytest.approx(most)


def test_a_torque_whose_zero_is_known_has_none_to_try(setups: Callable[[float], SimulationSetup]) -> None:
    def exact(size: float) -> SimulationSetup:
        setup = setups(size)
        return replace(setup, zeros={**setup.zeros, "drive_torque": 0.0})

    assert not with_best_zeros(exact(PLAY)).torque_zeros
    size, _ = likely_size(exact, 1e-3, 2e-3)
    assert 1e-3 <= size <= 2e-3
    assert profile_estimates(exact(PLAY))


def test_a_zero_that_is_hardly_known_is_found_where_the_drive_has_it(drive: Inputs) -> None:
    """Half a newton metre decides on which flank gears rest, whatever a data sheet allows."""
    log = drive.data[0]
    off = {n: v + 1.1 if n == "drive_torque" else v for n, v in log.channels.items()}
    shifted = replace(drive, data=(replace(log, channels=off),))

    def wide(size: float) -> SimulationSetup:
        setup = simulated(shifted, size)
        return replace(setup, zeros={**setup.zeros, "drive_torque": 5.0})

    (zero,) = with_best_zeros(wide(PLAY)).torque_zeros
    assert zero == pytest.approx(1.1 + ZERO, abs=0.15)


def test_play_that_was_found_before_is_weighed_by_the_car_without_it(drive: Inputs) -> None:
    before = Estimate(PLAY, 2e-5, (PLAY - 4e-5, PLAY + 4e-5), "rad", "free play", "shaft")
    known = replace(drive.known, extensions={"backlash": {"backlash": before}})
    setup = with_best_zeros(trial_of(drive.spec, drive.data, known)[0])
    assert _plain(setup).whitened.setup.prior.values["backlash"] == 0.0
    (asked,) = with_best_zeros(simulated(drive, PLAY)).torque_zeros
    assert setup.torque_zeros == pytest.approx((asked,), abs=0.2)
    assert whiten_drives(setup, calm=True).oscillations == (None,), (
        "when a gap is crossed is not known well enough for what follows"
    )
    assert whiten_drives(simulated(drive, PLAY), calm=True).oscillations != (None,)


def test_a_size_that_cannot_be_simulated_is_left_out(setups: Callable[[float], SimulationSetup]) -> None:
    class Failing:
        def __call__(self, size: float) -> SimulationSetup:
            if size > 1.7e-3:
                raise ResultError(Finding("simulation", "is not finite"))
            return setups(size)

    size, _ = likely_size(Failing(), 1e-3, 2.2e-3)
    assert 1e-3 <= size <= 1.7e-3
