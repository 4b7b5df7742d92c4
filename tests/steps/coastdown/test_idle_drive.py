"""A mapped torque that stays at zero does not make coast-downs a drive."""

from __future__ import annotations

import numpy as np
import pytest

from tests.coast_cases import known, logs_of, spec_of
from tests.plant import coast
from tests.plant.vehicle import REFERENCE
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.coastdown.coasts.idle_drive import is_idle
from vdyn_cli.steps.coastdown.input_checks import sign_findings
from vdyn_cli.steps.coastdown.preparation import prepare

RUNS = coast.campaign(REFERENCE, 1)
LOGS = logs_of(RUNS)
GIVEN = {n: Given(float(getattr(REFERENCE, n))) for n in ("mass", "rotating_mass", "gear_ratio", "wheel_radius")}
PER_TORQUE = REFERENCE.gear_ratio / REFERENCE.wheel_radius


def noise(size: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(0.0, 0.3, size)


IDLE = [log.with_channels(drive_torque=noise(log.time.size, k)) for k, log in enumerate(LOGS)]


def test_a_torque_of_zero_leaves_coast_downs_as_they_are() -> None:
    plain, problem = (prepare(spec_of(RUNS), logs, known(REFERENCE)) for logs in (LOGS, IDLE))
    assert problem.campaign.drive == "coasting"
    assert [s.log.time.size for s in problem.selection.segments] == [s.log.time.size for s in plain.selection.segments]
    (note,) = set(problem.findings) - set(plain.findings)
    assert "drive_torque is zero within its noise in all runs" in note.what


@pytest.mark.parametrize("pushed", [lambda t: 12.0 + 0.0 * t, lambda t: 60.0 * ((t > 20.0) & (t < 25.0))])
def test_a_torque_that_pushes_the_car_in_one_run_is_a_drive(pushed) -> None:  # type: ignore[no-untyped-def]
    log = IDLE[3]
    driven = log.with_channels(drive_torque=log["drive_torque"] + pushed(log.time - log.time[0]) / PER_TORQUE)
    assert is_idle(IDLE, "torque", GIVEN)
    assert not is_idle([*IDLE[:3], driven], "torque", GIVEN)


def test_the_sign_of_a_torque_that_cannot_change_the_speed_is_not_tested() -> None:
    """Noise that resembles the deceleration by chance: 0.6 % of the force that it would need."""
    time = np.arange(0.0, 120.0, 0.1)
    rate = -0.2 + 0.1 * np.sin(time / 5.0)
    log = Log("run_1.csv", time, {"speed": 30.0 + np.cumsum(rate) * 0.1})
    alike = log.with_channels(drive_torque=-rate)
    wrong = log.with_channels(drive_torque=-rate * REFERENCE.mass / PER_TORQUE)
    assert sign_findings(wrong, "torque", GIVEN)
    assert not sign_findings(alike, "torque", GIVEN)


def test_runs_are_evaluated_in_the_order_of_their_starts() -> None:
    """A description may list all runs out first: a change of the car is sought between successive runs."""
    listed = [k for way in ("out", "back") for k, run in enumerate(RUNS) if run.direction == way]
    spec = spec_of([RUNS[k] for k in listed])
    problem = prepare(spec, logs_of([RUNS[k] for k in listed]), known(REFERENCE))
    starts = [run.start for run in problem.campaign.runs]
    assert starts == sorted(starts)
    assert [s.name for s in problem.selection.segments] == [r.name for r in problem.campaign.runs]
