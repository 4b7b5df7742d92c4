"""A gain that changes in mid-run is found against the simulation; a missing effect is not taken for such a change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vdyn_cli.project.checks.simulated_gains import simulated_gain_findings
from vdyn_cli.quantities.result import Comparison

N = 600
T = 0.02 * np.arange(N)


def run(name: str, gain: float = 1.0, bend: float = 0.0, seed: int = 0) -> Comparison:
    """A channel measured with a gain that changes at 6 s, and a law that bends where it is negative."""
    rng = np.random.default_rng(seed)
    true = 1000.0 * np.sin(np.pi * T / 6.0)  # positive to 6 s, negative from there
    measured = true * np.where(T > 6.0, gain, 1.0) + bend * np.minimum(true, 0.0) + rng.normal(0.0, 10.0, N)
    factor = float(measured @ true / (true @ true))
    return Comparison(name, "force_x", "N", T, "time in s", measured, factor * true)


def test_healthy_runs_have_no_change() -> None:
    assert not list(simulated_gain_findings([run(f"run_{k}.csv", seed=k) for k in range(5)]))


@pytest.mark.parametrize("gain", [0.9, 1.1])
def test_a_gain_that_changes_in_one_run_of_several_is_found_where_it_changes(gain: float) -> None:
    (found,) = simulated_gain_findings([run(f"run_{k}.csv", gain if k == 3 else 1.0, seed=k) for k in range(5)])
    assert found.where == "run_3.csv"
    assert found.fault
    assert found.doubt
    assert float(found.what.split(" at ")[1].split()[0]) == pytest.approx(6.0, abs=0.5)
    assert float(found.what.split("by ")[1].split(" %")[0]) == pytest.approx(100.0 * (gain - 1.0), abs=1.0)


def test_a_law_that_differs_with_the_sign_in_every_run_is_no_sensor() -> None:
    assert not list(simulated_gain_findings([run(f"run_{k}.csv", bend=0.1, seed=k) for k in range(5)]))


def test_a_simulated_speed_whose_error_grows_within_seconds_is_no_sensor() -> None:
    """In one of five drives the simulation without a loss runs ahead, within 1.5 of 12 s."""
    runs = []
    for k in range(5):
        true = 15.0 + 5.0 * np.sin(np.pi * T / 1.5 + k)
        ahead = 1.0 + 0.1 / (1.0 + np.exp(-(T - 6.0) / 0.3)) * (k == 2)
        noise = np.random.default_rng(k).normal(0.0, 0.02, N)
        runs.append(Comparison(f"run_{k}.csv", "speed", "m/s", T, "time in s", true + noise, true * ahead))
    assert not list(simulated_gain_findings(runs))


def swerved(name: str, seconds: float, seed: int) -> Comparison:
    """A coast of 170 s at 20 Hz that loses 0.7 m/s within some seconds from 62 s on, as by steering."""
    time = 0.05 * np.arange(3400)
    simulated = 30.0 * np.exp(-time / 110.0)
    lost = 0.7 * np.clip((time - 62.0) / max(seconds, 1e-9), 0.0, 1.0) * simulated / simulated[1240]
    noise = np.random.default_rng(seed).normal(0.0, 0.01, time.size)
    return Comparison(name, "speed", "m/s", time, "time in s", simulated - lost + noise, simulated)


@pytest.mark.parametrize(("seconds", "found"), [(0.0, 1), (5.0, 0)])
def test_a_coast_that_is_steered_or_braked_for_seconds_has_no_faulty_sensor(seconds: float, found: int) -> None:
    runs = [swerved("run_5.csv", seconds, 5)]
    for k in range(4):
        calm = swerved(f"run_{k}.csv", 5.0, k)
        runs.append(replace(calm, measured=calm.simulated + np.random.default_rng(k).normal(0.0, 0.01, calm.x.size)))
    assert len(list(simulated_gain_findings(runs))) == found


def test_a_single_run_tells_no_sensor_from_a_law_that_differs_with_the_sign() -> None:
    assert not list(simulated_gain_findings([run("run.csv", 1.1)]))
    there_and_back = 1000.0 * np.sin(np.pi * T / 1.5)
    measured = there_and_back * np.where(T > 6.0, 1.1, 1.0)
    one = Comparison("run.csv", "shaft_torque", "N m", T, "time in s", measured, there_and_back)
    assert list(simulated_gain_findings([one]))


def test_a_single_run_whose_gain_drifts_is_a_doubt_and_no_fault() -> None:
    there_and_back = 1000.0 * np.sin(np.pi * T / 1.5)
    measured = there_and_back * (1.0 + 0.1 * T / T[-1])
    noise = np.random.default_rng(0).normal(0.0, 5.0, N)
    one = Comparison("run.csv", "shaft_torque", "N m", T, "time in s", measured + noise, 1.05 * there_and_back)
    (found,) = simulated_gain_findings([one])
    assert found.doubt
    assert not found.fault
    assert "gradually" in found.what


@pytest.mark.parametrize(("gain", "hill"), [(1.0, 0.15), (1.1, 0.0)])
def test_a_hill_that_begins_is_no_change_of_an_accelerometers_gain(gain: float, hill: float) -> None:
    """A car that coasts at 0.9 to 1.1 m/s^2 comes to a hill of 1.5 %; or it varies by more, and its gain changes."""
    runs = []
    for k in range(5):
        true = -1.0 + (0.1 if hill else 0.8) * np.sin(np.pi * T / 1.5)
        after = (T > 6.0) & (k == 2)
        measured = true * np.where(after, gain, 1.0) - hill * after + np.random.default_rng(k).normal(0.0, 0.02, N)
        runs.append(Comparison(f"run_{k}.csv", "acceleration", "m/s^2", T, "time in s", measured, true))
    assert [f.where for f in simulated_gain_findings(runs)] == (["run_2.csv"] if gain != 1.0 else [])
