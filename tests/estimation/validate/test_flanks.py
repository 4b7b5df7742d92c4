"""Free play in drives: its size and each drive's zero of the torque are found by trying."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.bench.hidden_logs import make
from tests.plant.hidden import Scenario
from vdyn_cli.effects import catalogue
from vdyn_cli.estimation.validate.flanks import evenly, likely_size, rested
from vdyn_cli.estimation.validate.trial import TORQUE_ZERO, Trial
from vdyn_cli.fit import Unknown
from vdyn_cli.inputs import gather
from vdyn_cli.steps import load_step
from vdyn_cli.steps.validate import trial_of

PLAY = 1.5e-3


@pytest.fixture(scope="module")
def trials(tmp_path_factory: pytest.TempPathFactory) -> Callable[[float], Trial]:
    """One drive of a car with play, simulated with play of any size."""
    made = make(Scenario("validate", {"backlash": PLAY}, 41), tmp_path_factory.mktemp("play"))
    inputs = gather(load_step("validate"), made.description, ())
    spec = inputs.spec.model_copy(update={"runs": inputs.spec.runs[:1]})
    play = next(e for e in catalogue() if e.name == "backlash")

    def trial(size: float) -> Trial:
        return trial_of(spec, inputs.data[:1], inputs.known, [play], [Unknown("backlash", size, 0.0, 0.06, "rad")])[0]

    return trial


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
