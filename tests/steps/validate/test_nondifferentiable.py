"""Free play in drives: its amplitude and the torque's zero in each drive are found by a grid search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.bench.hidden_logs import make
from tests.plant.hidden import Scenario
from vdyn_cli.effects import catalog
from vdyn_cli.inference import Unknown
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps import load_step
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.validate.car.simulation import SimulationSetup
from vdyn_cli.steps.validate.car.unknowns import TORQUE_ZERO
from vdyn_cli.steps.validate.fit import nondifferentiable
from vdyn_cli.steps.validate.fit.nondifferentiable import (
    DISAGREE,
    DifferentiableReference,
    _Explained,
    likely_size,
    profile_estimates,
    with_best_zeros,
)
from vdyn_cli.steps.validate.fit.whitening import whiten_drives
from vdyn_cli.steps.validate.problem import ValidateProblem

pytestmark = pytest.mark.slow  # each test simulates whole drives many times
PLAY = 1.5e-3
ZERO = 0.090  # N m, that the plant's torque sensor has in the one drive


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> ValidateProblem:
    return one_drive(tmp_path_factory.mktemp("play"))


def one_drive(folder: Path) -> ValidateProblem:
    """One drive of a car with play."""
    made = make(Scenario("validate", {"backlash": PLAY}, 43), folder)
    found = gather(load_step("validate"), made.description, ())
    spec = found.spec.model_copy(update={"runs": found.spec.runs[:1]})
    return ValidateProblem(spec, found.data[:1], found.known)


def with_torque_zero(drive: ValidateProblem, std: float, offset: float = 0.0) -> ValidateProblem:
    """The problem with another spread of the drive torque's zero, N m, and with a zero in its log."""
    settings = drive.spec.settings
    zeros = settings.zeros.model_copy(update={"drive_torque": Given(std)})
    spec = drive.spec.model_copy(update={"settings": settings.model_copy(update={"zeros": zeros})})
    off = {n: v + offset if n == "drive_torque" else v for n, v in drive.logs[0].channels.items()}
    return replace(drive, spec=spec, logs=(replace(drive.logs[0], channels=off),))


@pytest.fixture(scope="module")
def reference(drive: ValidateProblem) -> DifferentiableReference:
    return drive.reference


@pytest.fixture(scope="module")
def setups(drive: ValidateProblem) -> Callable[[float], SimulationSetup]:
    """The setups of that drive with play of any amplitude."""
    return lambda size: simulated(drive, size)


def simulated(drive: ValidateProblem, size: float) -> SimulationSetup:
    play = next(e for e in catalog() if e.name == "backlash")
    return drive.baseline.with_effects(AddedEffects((play,), (Unknown("backlash", size, 0.0, 0.06, "rad"),)))


def test_the_size_is_found(setups: Callable[[float], SimulationSetup], reference: DifferentiableReference) -> None:
    size, rise = likely_size(setups, reference, 3e-4, 4e-3)
    assert size == pytest.approx(PLAY, rel=0.15)
    assert rise > 5.0


def test_a_drive_begins_at_the_zero_with_which_its_flanks_rest_as_the_real_ones(
    setups: Callable[[float], SimulationSetup],
    reference: DifferentiableReference,
) -> None:
    setup = with_best_zeros(setups(PLAY), reference)
    (zero,) = setup.point.torque_zeros
    assert zero == pytest.approx(ZERO, abs=0.1)
    assert setup.vector.start(0)[setup.vector.torque_zero_place] == zero
    assert setup.vector.unknowns()[1][TORQUE_ZERO] == np.array([zero])


@pytest.mark.parametrize(("std", "count"), [(0.1, 3), (0.66, 5), (50.0, 25)])
def test_the_likeliest_zero_is_tried_and_others_to_either_side(std: float, count: int) -> None:
    zeros = _Explained(np.zeros((1, 1)), 0.7, std, 0.0).zeros
    assert zeros.size == count
    assert zeros[count // 2] == pytest.approx(0.7)
    assert count == 25 or np.diff(zeros).max() <= 0.5


def test_of_zeros_that_let_gears_rest_alike_the_likeliest_is_taken(
    setups: Callable[[float], SimulationSetup], reference: DifferentiableReference
) -> None:
    """Without play the flanks do not matter: the cost is that of the zero alone."""
    own, explained = setups(0.0), reference.explained[0]
    middle, side = (reference.cost(own, 0, explained.zero + off * explained.std) for off in (0.0, 1.5))
    assert side - middle == pytest.approx(0.5 * 1.5**2, abs=0.1)


def test_a_car_that_is_begun_off_its_parameters_costs_as_much(
    setups: Callable[[float], SimulationSetup], reference: DifferentiableReference
) -> None:
    """The prior rows move with the parameter; otherwise its distance from the prior would be counted twice."""
    own, zero = setups(0.0), reference.explained[0].zero
    prior = own.prior
    heavier = own.begun_at({"mass": prior.values["mass"] + prior.std[prior.names.index("mass")]})
    assert heavier.point.at
    assert reference.cost(heavier, 0, zero) == pytest.approx(reference.cost(own, 0, zero), abs=0.1)


def test_without_play_nothing_is_tried(
    setups: Callable[[float], SimulationSetup], reference: DifferentiableReference
) -> None:
    setup = setups(0.0)
    assert with_best_zeros(setup, reference) is setup


def test_a_size_is_known_no_better_than_drives_tell_it_from_sizes_about_it(
    setups: Callable[[float], SimulationSetup],
    reference: DifferentiableReference,
) -> None:
    ((size, spread),) = profile_estimates(setups(PLAY), reference).values()
    assert size == pytest.approx(PLAY, abs=3 * spread)
    assert 0.005 * PLAY < spread <= 0.2 * PLAY
    assert profile_estimates(setups(0.0), reference) == {}


def stubbed(monkeypatch: pytest.MonkeyPatch, *costs: Callable[[float], float]) -> list[float]:
    """Drives with a given cost by amplitude of play; records the amplitudes that are tried."""
    tried = []

    def zeros(plain: object, setup: SimulationSetup, few: bool = False) -> tuple[tuple[float, ...], tuple[float, ...]]:
        tried.append(setup.added.unknowns[0].start)
        return (0.0,) * len(costs), tuple(cost(tried[-1]) for cost in costs)

    monkeypatch.setattr(nondifferentiable, "_zeros", zeros)
    return tried


def finite(below: float, best: float = PLAY) -> Callable[[float], float]:
    """The cost of a drive with play known to a fifteenth; infinite where it is too large to be simulated."""

    def cost(size: float) -> float:
        if size > below:
            raise ResultError(Finding("simulation", "is not finite"))
        return 0.5 * ((size - best) / 1e-4) ** 2

    return cost


@pytest.mark.parametrize("begun", [0.9, 1.0, 1.1])
@pytest.mark.parametrize("below", [np.inf, 1.65e-3])
def test_a_size_beside_the_best_comes_back_to_it_from_sizes_that_can_be_simulated(
    monkeypatch: pytest.MonkeyPatch,
    setups: Callable[[float], SimulationSetup],
    begun: float,
    below: float,
    reference: DifferentiableReference,
) -> None:
    tried = stubbed(monkeypatch, finite(below))
    ((size, spread),) = profile_estimates(setups(begun * PLAY), reference).values()
    assert max(tried) == pytest.approx(1.2 * begun * PLAY)
    assert size == pytest.approx(PLAY)
    assert spread == pytest.approx(DISAGREE * 1e-4)


def test_large_play_is_found_although_all_that_is_smaller_fits_worse_than_none(
    monkeypatch: pytest.MonkeyPatch, setups: Callable[[float], SimulationSetup], reference: DifferentiableReference
) -> None:
    misfit = float(reference.freedom)  # twice what noise leaves
    stubbed(monkeypatch, lambda size: misfit + (50.0 * ((size - 0.02) / 0.005) ** 2 - 100.0 if size else 0.0))
    size, rise = likely_size(setups, reference, 1e-4, 0.06)
    assert size == pytest.approx(0.02, rel=0.05)
    assert rise > 90.0


def test_large_play_is_not_tried_where_the_car_without_it_leaves_noise_alone(
    monkeypatch: pytest.MonkeyPatch, setups: Callable[[float], SimulationSetup], reference: DifferentiableReference
) -> None:
    tried = stubbed(monkeypatch, lambda size: 0.45 * reference.freedom + 1e5 * size)
    assert likely_size(setups, reference, 1e-4, 0.06)[1] < 0.0
    assert max(tried) < 5e-3


def test_no_play_is_tried_where_the_car_without_it_leaves_no_more_than_the_noise_of_its_rows(
    setups: Callable[[float], SimulationSetup], reference: DifferentiableReference
) -> None:
    assert reference.misfit
    quiet = replace(reference)
    left = sum(w.factor.shape[0] for w in reference.whitened.whitenings)
    vars(quiet)["explained"] = tuple(replace(one, left=float(left)) for one in reference.explained)
    assert not quiet.misfit
    assert likely_size(setups, quiet, 1e-4, 0.06) == (1e-4, 0.0)


def test_secants_are_taken_over_the_amplitudes_of_the_setup(drive: ValidateProblem) -> None:
    probed = simulated(drive, 0.0)
    (probe,), (other,) = probed.first, replace(probed, secants={"backlash": 2e-3}).first
    np.testing.assert_array_equal(probe.values["speed"], other.values["speed"])
    assert not np.array_equal(probe.sensitivities["speed"], other.sensitivities["speed"])


@pytest.mark.parametrize("apart", [0.0, 1e-4, 3e-4])
def test_drives_that_disagree_tell_less_than_they_say(
    monkeypatch: pytest.MonkeyPatch,
    setups: Callable[[float], SimulationSetup],
    apart: float,
    reference: DifferentiableReference,
) -> None:
    """Birge's ratio from a prior worth two drives and the two degrees of freedom of three drives."""
    stubbed(monkeypatch, *(finite(np.inf, PLAY + k * apart) for k in (-1, 0, 1)))
    ((size, spread),) = profile_estimates(setups(PLAY), reference).values()
    assert size == pytest.approx(PLAY)
    wider = np.sqrt((2 * DISAGREE**2 + 2 * (apart / 1e-4) ** 2) / 4)
    assert spread == pytest.approx(wider * 1e-4 / np.sqrt(3))


def test_a_drive_that_tells_nothing_does_not_disagree(
    monkeypatch: pytest.MonkeyPatch, setups: Callable[[float], SimulationSetup], reference: DifferentiableReference
) -> None:
    stubbed(monkeypatch, *(finite(np.inf) for _ in range(3)), lambda size: 0.5 * size / PLAY)
    ((size, spread),) = profile_estimates(setups(PLAY), reference).values()
    assert size == pytest.approx(PLAY, rel=0.01)
    assert spread == pytest.approx(np.sqrt(2 * DISAGREE**2 / 5) * 1e-4 / np.sqrt(3), rel=0.01)


def test_where_next_to_no_size_can_be_simulated_none_is_reported(
    monkeypatch: pytest.MonkeyPatch, setups: Callable[[float], SimulationSetup], reference: DifferentiableReference
) -> None:
    stubbed(monkeypatch, finite(0.87 * PLAY))
    assert profile_estimates(setups(PLAY), reference) == {"backlash": (PLAY, pytest.approx(0.2 * PLAY))}


def test_sizes_that_are_not_possible_are_neither_tried_nor_reported(
    monkeypatch: pytest.MonkeyPatch, setups: Callable[[float], SimulationSetup], reference: DifferentiableReference
) -> None:
    most = setups(0.0).added.unknowns[0].upper
    tried = stubbed(monkeypatch, lambda size: ((size - 1.1 * most) / (0.1 * most)) ** 2)
    ((size, _),) = profile_estimates(setups(most), reference).values()
    assert max(tried) == most
    assert size == pytest.approx(most)


def test_a_torque_whose_zero_is_known_has_none_to_try(drive: ValidateProblem) -> None:
    exact = with_torque_zero(drive, 0.0)
    assert not with_best_zeros(simulated(exact, PLAY), exact.reference).point.torque_zeros
    size, _ = likely_size(lambda size: simulated(exact, size), exact.reference, 1e-3, 2e-3)
    assert 1e-3 <= size <= 2e-3
    assert profile_estimates(simulated(exact, PLAY), exact.reference)


def test_a_zero_that_is_hardly_known_is_found_where_the_drive_has_it(drive: ValidateProblem) -> None:
    """Half a newton metre decides on which flank gears rest, whatever tolerance a data sheet states."""
    wide = with_torque_zero(drive, 5.0, offset=1.1)
    (zero,) = with_best_zeros(simulated(wide, PLAY), wide.reference).point.torque_zeros
    assert zero == pytest.approx(1.1 + ZERO, abs=0.15)


def test_play_that_was_found_before_is_weighted_by_the_car_without_it(drive: ValidateProblem) -> None:
    before = Estimate(PLAY, 2e-5, (PLAY - 4e-5, PLAY + 4e-5), "rad", "free play", "shaft")
    known = replace(drive.known, extensions={"backlash": {"backlash": before}})
    later = replace(drive, known=known)
    setup = with_best_zeros(later.baseline, later.reference)
    assert later.reference.whitened.setup.prior.values["backlash"] == 0.0
    (requested,) = with_best_zeros(simulated(drive, PLAY), drive.reference).point.torque_zeros
    assert setup.point.torque_zeros == pytest.approx((requested,), abs=0.2)
    whitened = whiten_drives(setup, averaged=True)
    assert whitened.whitenings[0].oscillation is None, "when a gap is crossed is not known well enough for what follows"
    assert whiten_drives(simulated(drive, PLAY), averaged=True).whitenings[0].oscillation is not None


def test_effects_of_no_size_keep_the_zeros_of_the_car_they_are_added_to(drive: ValidateProblem) -> None:
    before = Estimate(PLAY, 2e-5, (PLAY - 4e-5, PLAY + 4e-5), "rad", "free play", "shaft")
    later = replace(drive, known=replace(drive.known, extensions={"backlash": {"backlash": before}}))
    rested = with_best_zeros(later.baseline, later.reference)
    drag = next(e for e in catalog() if e.name == "brake_drag")
    added = rested.with_effects(AddedEffects((drag,), tuple(Unknown(n, 0.0) for n in drag.unknowns)))
    assert with_best_zeros(added, later.reference) is added
    assert added.point.without_effects is rested


def test_a_size_that_cannot_be_simulated_is_left_out(
    setups: Callable[[float], SimulationSetup], reference: DifferentiableReference
) -> None:
    class Failing:
        def __call__(self, size: float) -> SimulationSetup:
            if size > 1.7e-3:
                raise ResultError(Finding("simulation", "is not finite"))
            return setups(size)

    size, _ = likely_size(Failing(), reference, 1e-3, 2.2e-3)
    assert 1e-3 <= size <= 1.7e-3
