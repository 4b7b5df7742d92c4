"""The noise of a slip is counted in full, also where its speed has a slower clock than the forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vdyn_cli.effects import catalog
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.steps.tire.binned_sweep import binned_sweep
from vdyn_cli.steps.tire.problem import prepare
from vdyn_cli.steps.tire.slip_sweeps import slip_sweeps
from vdyn_cli.steps.tire.spec import TireSettings, TireSpec
from vdyn_cli.steps.tire.tire_regression import _swept

NOISE, SPEED = 0.05, 20.0  # m/s


@pytest.mark.parametrize("every", [1, 5, 10])
def test_the_variance_of_a_bin_is_that_of_its_mean(every: int) -> None:
    random, time = np.random.default_rng(7), np.arange(40_000) / 100.0
    own = time[::every]
    read = SPEED + NOISE * random.standard_normal(own.size)
    speed = np.interp(time, own, read)
    force = 1000.0 + random.standard_normal(time.size)
    channels = {"slip": SPEED / speed - 1, "force_x": force, "force_z": 4.0 * force, "vehicle_speed": speed}
    log = Log("sweep.csv", time, channels, samples={"vehicle_speed": (own, read)} if every > 1 else {})
    sweep = binned_sweep(log)
    expected = float(np.sqrt(np.mean(sweep.slip_variance)))
    assert float(np.std(sweep.slip)) == pytest.approx(expected, rel=0.15)


def test_a_speed_that_was_interpolated_in_the_file_counts_by_its_own_samples() -> None:
    random, time = np.random.default_rng(9), np.arange(4_000) / 100.0
    own = time[::5]
    speed = np.interp(time, own, SPEED + NOISE * random.standard_normal(own.size))
    rim = SPEED / 0.3 * (1.0 + 0.1 * np.sin(time))
    force = 4e3 * (0.3 * rim / SPEED - 1.0)
    channels = {"wheel_speed": rim, "vehicle_speed": speed, "force_x": force, "force_z": np.full(time.size, 4e3)}
    radius = Parameters({"wheel_radius": Estimate.of("wheel_radius", 0.3, 0.0, (0.3, 0.3), "given")})
    (log,) = slip_sweeps([Log("sweep.csv", time, channels)], TireSettings(), radius)
    sweep = binned_sweep(log)
    error = sweep.slip - sweep.samples.means(0.3 * rim / SPEED - 1.0)
    assert float(np.std(error)) == pytest.approx(float(np.sqrt(np.mean(sweep.slip_variance))), rel=0.15)


@pytest.mark.parametrize("acceleration", [0.0, 0.4])
@pytest.mark.parametrize("every", [1, 20])
def test_a_speed_grows_where_the_vehicle_accelerates_and_not_by_its_noise(acceleration: float, every: int) -> None:
    random, time = np.random.default_rng(8), np.arange(2_000) / 100.0
    speed = SPEED + acceleration * time
    own = time[::every]
    read = speed[::every] + NOISE * random.standard_normal(own.size)
    channels = {"slip": np.full(time.size, 0.05), "force_x": speed, "force_z": speed}
    channels["vehicle_speed"] = np.interp(time, own, read)
    sweep = binned_sweep(Log("sweep.csv", time, channels, samples={"vehicle_speed": (own, read)}))
    assert sweep.speed is not None
    assert sweep.speed_growth * sweep.speed == pytest.approx(acceleration, abs=0.02)


def _sweep(scatter: float, seed: int) -> tuple[np.ndarray, Log]:
    """The true load, N, and a sweep with 20 N of noise in the load, which scatters slowly by ``scatter`` N."""
    random, time = np.random.default_rng(seed), np.arange(4_000) / 100.0
    load = 4200.0 + scatter * np.sin(time)
    force = 0.8 * load + 15.0 * random.standard_normal(time.size)
    channels = {"slip": np.full(time.size, 0.05), "force_x": force}
    return load, Log("sweep.csv", time, channels | {"force_z": load + 20.0 * random.standard_normal(time.size)})


@pytest.mark.parametrize("scatter", [0.0, 300.0])
def test_noise_of_the_load_does_not_look_like_friction_that_decreases_with_it(scatter: float) -> None:
    slopes = []
    for seed in range(20):
        sweep = binned_sweep(_sweep(scatter, seed)[1])
        friction, load = sweep.force / sweep.load, sweep.load - sweep.load.mean()
        slopes.append(float(friction @ load / max(load @ load, 1.0)))
    assert abs(np.mean(slopes)) < 1e-5 + 3 * np.std(slopes) / 20**0.5  # readings as they are: 1.9e-4 per N


def test_a_varying_load_is_kept() -> None:
    true, log = _sweep(300.0, 1)
    sweep = binned_sweep(log)
    error = sweep.load - np.interp(sweep.time, log.time, true)
    assert float(np.std(error)) == pytest.approx(20.0 / 40**0.5, rel=0.25)


def test_the_time_swept_before_a_sweep_counts_every_sample() -> None:
    sweeps = [binned_sweep(_sweep(0.0, seed)[1]) for seed in range(2)]
    duration = sweeps[0].span[1] - sweeps[0].span[0]
    assert duration == pytest.approx(39.99)
    assert _swept(sweeps, sweeps[1])[0] == pytest.approx(duration + sweeps[1].time[0])


def test_the_slopes_of_a_slip_that_lags_are_free_of_its_noise() -> None:
    """Noise of both is a bias of the relaxation length, which a delay compensates."""
    random, time = np.random.default_rng(5), np.arange(12_000) / 100.0
    slip = 0.22 * np.sin(2 * np.pi * time / 3.0)
    force, speed = 4000.0 * slip, np.full(time.size, 13.0)
    channels = {"slip": slip, "force_x": force, "force_z": np.full(time.size, 4000.0), "vehicle_speed": speed}
    clean = binned_sweep(Log("sweep.csv", time, channels))
    samples = replace(clean.samples, slip=slip + 0.004 * random.standard_normal(time.size))
    sweeps = [one.lagged(0.35, 0.0) for one in (replace(clean, samples=samples), clean)]
    acting = [one.samples.means(one.samples.lagged(0.35, 0.0)[0]) for one in sweeps]
    noise, of_slope = acting[0] - acting[1], sweeps[0].slip_gradient - sweeps[1].slip_gradient
    assert abs(noise @ of_slope) < 0.2 * (noise @ noise)  # 0.8 with the slopes of the slip as it was read


@pytest.mark.parametrize("step", [0.0, 8.0])
def test_a_growing_radius_needs_sweeps_at_different_speeds(step: float) -> None:
    random, time = np.random.default_rng(4), np.arange(400) / 100.0
    slip = 0.3 * np.sin(time)
    channels = {"slip": slip, "force_x": 4e3 * np.tanh(10.0 * slip), "force_z": np.full(time.size, 4e3)}
    speeds = [SPEED + k * step + NOISE * random.standard_normal(time.size) for k in range(2)]
    logs = [Log(f"{k}.csv", time, channels | {"vehicle_speed": speed}) for k, speed in enumerate(speeds)]
    problem = prepare(TireSpec.model_validate({"test": "tire"}), logs, Parameters({}))
    grows = {e.name for e in applicable(problem.model, catalog())} & {"rolling_radius_growth"}
    assert bool(grows) == (step > 0.0)
    assert [signal for signal, _ in problem.model.unvaried] == ([] if grows else ["speed", "sliding"])
