"""Free play in drives: its size and each drive's zero of the torque are found by trying."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.bench.hidden_logs import make
from tests.plant.hidden import Scenario
from vdyn_cli.effects import catalogue
from vdyn_cli.errors import Finding, ResultError
from vdyn_cli.estimation.validate.flanks import evenly, likely_size, rested
from vdyn_cli.estimation.validate.trial import TORQUE_ZERO, Trial
from vdyn_cli.fit import Unknown
from vdyn_cli.inputs import Inputs, gather
from vdyn_cli.parameters import Estimate
from vdyn_cli.steps import load_step
from vdyn_cli.steps.validate import trial_of

PLAY = 1.5e-3


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Inputs:
    """One drive of a car with play."""
    made = make(Scenario("validate", {"backlash": PLAY}, 41), tmp_path_factory.mktemp("play"))
    found = gather(load_step("validate"), made.description, ())
    spec = found.spec.model_copy(update={"runs": found.spec.runs[:1]})
    return replace(found, spec=spec, data=found.data[:1])


@pytest.fixture(scope="module")
def trials(drive: Inputs) -> Callable[[float], Trial]:
    """It, simulated with play of any size."""
    return lambda size: simulated(drive, size)


def simulated(drive: Inputs, size: float) -> Trial:
    play = next(e for e in catalogue() if e.name == "backlash")
    return trial_of(drive.spec, drive.data, drive.known, [play], [Unknown("backlash", size, 0.0, 0.06, "rad")])[0]


def test_the_size_is_found(trials: Callable[[float], Trial]) -> None:
    size, rise = likely_size(trials, 3e-4, 4e-3)
    assert size == pytest.approx(PLAY, rel=0.15)
    assert rise > 5.0


def test_a_drive_begins_at_the_zero_with_which_its_flanks_rest_as_the_real_ones(
    trials: Callable[[float], Trial],
) -> None:
    trial = rested(trials(PLAY))
    (zero,) = trial.torque_zeros
    assert abs(zero) <= 4.5 * trial.zeros["drive_torque"]
    assert trial.start(0)[len(trial.shared) + trial.own.index(TORQUE_ZERO)] == zero
    assert trial.unknowns()[1][TORQUE_ZERO] == np.array([zero])


def test_without_play_nothing_is_tried(trials: Callable[[float], Trial]) -> None:
    trial = trials(0.0)
    assert rested(trial) is trial


def test_a_size_is_known_no_better_than_drives_tell_it_from_sizes_about_it(trials: Callable[[float], Trial]) -> None:
    ((size, spread),) = evenly(trials(PLAY)).values()
    assert size == pytest.approx(PLAY, abs=3 * spread)
    assert 0.005 * PLAY < spread <= 0.2 * PLAY
    assert evenly(trials(0.0)) == {}


def test_a_torque_whose_zero_is_known_has_none_to_try(trials: Callable[[float], Trial]) -> None:
    def exact(size: float) -> Trial:
        trial = trials(size)
        return replace(trial, zeros={**trial.zeros, "drive_torque": 0.0})

    assert not rested(exact(PLAY)).torque_zeros
    size, _ = likely_size(exact, 1e-3, 2e-3)
    assert 1e-3 <= size <= 2e-3
    assert evenly(exact(PLAY))


def test_a_zero_that_is_hardly_known_is_found_where_the_drive_has_it(drive: Inputs) -> None:
    """Half a newton metre decides on which flank gears rest, whatever a data sheet allows."""
    log = drive.data[0]
    off = {n: v + 1.1 if n == "drive_torque" else v for n, v in log.channels.items()}
    shifted = replace(drive, data=(replace(log, channels=off),))

    def wide(size: float) -> Trial:
        trial = simulated(shifted, size)
        return replace(trial, zeros={**trial.zeros, "drive_torque": 5.0})

    (zero,) = rested(wide(PLAY)).torque_zeros
    assert zero == pytest.approx(1.1, abs=0.8)


def test_play_that_was_found_before_is_weighed_by_the_car_without_it(drive: Inputs) -> None:
    before = Estimate(PLAY, 2e-5, (PLAY - 4e-5, PLAY + 4e-5), "rad", "free play", "shaft")
    known = replace(drive.known, extensions={"backlash": {"backlash": before}})
    trial = rested(trial_of(drive.spec, drive.data, known)[0])
    (asked,) = rested(simulated(drive, PLAY)).torque_zeros
    assert trial.torque_zeros == pytest.approx((asked,), abs=0.2)


def test_a_size_that_cannot_be_simulated_is_left_out(trials: Callable[[float], Trial]) -> None:
    class Failing:
        def __call__(self, size: float) -> Trial:
            if size > 1.7e-3:
                raise ResultError(Finding("simulation", "is not finite"))
            return trials(size)

    size, _ = likely_size(Failing(), 1e-3, 2.2e-3)
    assert 1e-3 <= size <= 1.7e-3
