"""Covariance of a speed in gusts compared with many simulated gusts, and recovery of the gusts' amplitudes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.inference.gusty import restricted_likelihood
from tests.plant.wind import Wind, gusts
from vdyn_cli.inference import gust_covariance as gust_noise
from vdyn_cli.inference.bins import Bins, cut
from vdyn_cli.inference.gust_covariance import RunNoise, Surroundings
from vdyn_cli.inference.restricted_likelihood import NoisyRun, find_sizes, log_evidence, typical_sizes
from vdyn_cli.quantities.constants import GRAVITY

Array = NDArray[np.float64]

STEP = 0.1
TIME = np.arange(0.0, 60.0, STEP)
PULL = np.linspace(0.012, 0.005, TIME.size)  # 1/s, as of a coast
SIZES = {"speed_noise": 1.0, "gust": 0.6, "gust_time": 8.0, "run_wind": 0.3, "run_force": 2e-3}
SIZES |= {"speed_drift": 0.05, "speed_drift_time": 2.0}
SIZES |= {"acceleration_noise": 1.0, "road": 2e-3, "road_time": 5.0, "road_mean": 1e-3, "push": 0.02, "push_time": 4.0}
LAWS = (gust_noise.speed_noise, gust_noise.speed_and_force_noise, gust_noise.force_noise)


def surroundings(bins: Bins | None = None) -> Surroundings:
    bins = bins or cut(TIME, 1.0)
    pull = bins.mean(PULL)
    return Surroundings(bins, pull, pull, 0.95, 0.03, 0.004, 0.05, 0.01, filtered=True)


def moved(wind: Array, force: Array) -> Array:
    """dv of dv' = -pull dv - pull w + a, by small steps, (n, runs)."""
    speed = np.zeros_like(wind)
    for k in range(len(wind) - 1):
        speed[k + 1] = speed[k] + STEP * (-PULL[k] * (speed[k] + wind[k]) + force[k])
    return speed


def test_the_covariance_is_that_of_many_gusty_runs() -> None:
    runs, rng = 4000, np.random.default_rng(5)
    wind = gusts(Wind(0.6, 8.0), runs, TIME.size, STEP, rng) + 0.3 * rng.standard_normal(runs)
    force = np.broadcast_to(2e-3 * rng.standard_normal(runs), wind.shape)
    speed = moved(wind, force) + 0.03 * rng.standard_normal(wind.shape)
    bins = cut(TIME, 1.0)
    found = np.cov(bins.mean(speed))
    walk = Surroundings(bins, bins.mean(PULL), bins.mean(PULL), 0.95, 0.03)
    model = gust_noise.speed_noise(walk).covariance(SIZES)
    assert np.abs(found - model).max() < 0.06 * model.max()
    late = slice(-20, None)
    assert np.allclose(np.diag(found)[late], np.diag(model)[late], rtol=0.08)


@pytest.mark.parametrize("law", LAWS)
def test_covariances_are_positive_and_their_slopes_are_derivatives(law: object) -> None:
    noise: RunNoise = law(surroundings(cut(TIME, 4.0)))  # type: ignore[operator]
    covariance = noise.covariance(SIZES)
    assert np.linalg.eigvalsh(covariance).min() > 0
    weight = np.random.default_rng(1).standard_normal(covariance.shape)
    weight = weight + weight.T
    vector = weight[0]
    slopes, pushed = noise.derivatives(SIZES, weight, vector)
    assert set(slopes) == set(pushed) == set(noise.sources)
    for name, slope in slopes.items():
        up, down = ({**SIZES, name: SIZES[name] * np.exp(s)} for s in (1e-4, -1e-4))
        by_difference = (noise.covariance(up) - noise.covariance(down)) / 2e-4
        assert slope == pytest.approx(np.sum(weight * by_difference), rel=1e-5, abs=1e-12)
        assert pushed[name] == pytest.approx(by_difference @ vector, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize(
    ("law", "channels"), [(LAWS[0], ("speed",)), (LAWS[1], ("speed", "acceleration")), (LAWS[2], ("acceleration",))]
)
def test_plain_least_squares_knows_the_white_parts_alone(law: object, channels: tuple[str, ...]) -> None:
    here = surroundings(cut(TIME, 4.0))
    if law is not gust_noise.speed_noise:
        here = replace(here, fade=np.zeros_like(here.fade))
    full, white = law(here), gust_noise.white_noise(here, channels)  # type: ignore[operator]
    assert np.allclose(white.push, full.push, rtol=2e-3)
    only = {**dict.fromkeys(SIZES, 1e-12), "gust_time": 8.0, "road_time": 5.0, "push_time": 5.0}
    only |= {"speed_drift_time": 2.0}
    only |= {"speed_noise": 1.3, "acceleration_noise": 0.7}
    assert np.allclose(white.factor(only) ** 2, np.diag(full.covariance(only) - full.known), atol=1e-15)
    assert np.allclose(full.factor(SIZES) @ full.factor(SIZES).T, full.covariance(SIZES))


def test_a_slope_moves_the_speed_and_leaves_the_specific_force() -> None:
    here = surroundings(cut(TIME, 4.0))
    noise = gust_noise.speed_and_force_noise(here)
    only = {**{n: 1e-12 for n in SIZES}, "road_time": 5.0, "gust_time": 8.0, "road": 0.01}
    variance = np.diag(noise.covariance(only) - noise.known)
    half = variance.size // 2
    assert np.sqrt(variance[half:].max()) == pytest.approx(GRAVITY * 0.01 * 0.05, rel=1e-6)
    assert np.sqrt(variance[half - 1]) > 1.0


def drawn(seed: int, runs: int) -> list[NoisyRun]:
    """Runs with two shared unknowns (a constant force, a speed-like one) and a start speed each."""
    rng, noise = np.random.default_rng(seed), gust_noise.speed_noise(surroundings(cut(TIME, 2.0)))
    factor = np.linalg.cholesky(noise.covariance(SIZES))
    own = np.ones((factor.shape[0], 1))
    shared = np.column_stack([noise.push, noise.push**2 / 60])
    return [NoisyRun(factor @ rng.standard_normal(len(factor)), shared, own, noise) for _ in range(runs)]


def test_restricted_likelihood_has_the_slopes_it_says() -> None:
    runs = drawn(3, 3)
    names = runs[0].noise.sources
    known = np.array([0.0, 4.0])
    value, slopes = restricted_likelihood(runs, SIZES, known)
    assert np.isfinite(value)
    for name in names:
        up, down = (
            restricted_likelihood(runs, {**SIZES, name: SIZES[name] * np.exp(s)}, known)[0] for s in (1e-4, -1e-4)
        )
        assert slopes[name] == pytest.approx((up - down) / 2e-4, rel=1e-3, abs=1e-4)


def test_the_sizes_of_the_noise_are_found_again() -> None:
    found = [find_sizes(drawn(seed, 8), typical_sizes(drawn(0, 1)[0].noise)) for seed in range(20)]
    expected = {"speed_noise": 0.05, "speed_drift": 0.05, "speed_drift_time": 0.1, "gust": 0.12, "gust_time": 0.25}
    for name, tolerance in {**expected, "run_wind": 0.4}.items():
        middle = np.exp(np.mean([np.log(f[name]) for f in found]))
        assert middle == pytest.approx(SIZES[name], rel=tolerance)


def test_the_noise_is_not_taken_for_smaller_because_unknowns_were_fitted() -> None:
    """White noise alone: the variance is the sum of squares over rows less unknowns, not over rows."""
    rng = np.random.default_rng(11)
    noise = gust_noise.white_noise(surroundings(cut(TIME, 2.0)), ("speed",))
    level = np.sqrt(np.diag(noise.covariance({"speed_noise": 1.0})))
    n, s = level.size, 12
    shared, residual = rng.standard_normal((n, s)), level * rng.standard_normal(n)
    white, scaled = shared / level[:, None], residual / level
    left = scaled - white @ np.linalg.lstsq(white, scaled, rcond=None)[0]
    run = NoisyRun(residual, shared, np.zeros((n, 0)), noise)
    found = find_sizes([run], {"speed_noise": 1.0})["speed_noise"]
    assert found == pytest.approx(np.sqrt(left @ left / (n - s)), rel=0.02)
    assert found > 1.1 * np.sqrt(left @ left / n)


def test_a_start_that_counts_for_too_much_is_still_left_open() -> None:
    """Near a corner, simulated derivatives may be far too large; amplitudes are then those of an unknown start."""
    runs = drawn(2, 3)
    absurd = [replace(run, own=1e7 * run.own) for run in runs]
    start = typical_sizes(runs[0].noise)
    assert find_sizes(absurd, start)["gust"] == pytest.approx(find_sizes(runs, start)["gust"], rel=1e-3)


def test_noise_that_cannot_be_weighed_is_no_crash() -> None:
    run = drawn(2, 1)[0]
    broken = replace(run, noise=replace(run.noise, known=-np.eye(len(run.residual))))
    with pytest.raises(ArithmeticError, match="not positive definite"):
        find_sizes([broken], typical_sizes(run.noise))


@pytest.mark.parametrize(("force", "shown"), [(0.0, False), (0.02, True)])
def test_the_evidence_shows_a_force_of_the_later_runs_only_where_it_acts(force: float, shown: bool) -> None:
    """A tenth of a car's resistance, m/s^2, which without it counts as a force that differs from run to run."""
    runs, start = drawn(3, 8), typical_sizes(drawn(0, 1)[0].noise)
    columns = [0.02 * run.noise.push * (k >= 4) for k, run in enumerate(runs)]
    runs = [replace(r, residual=r.residual - force / 0.02 * c) for r, c in zip(runs, columns, strict=True)]
    none = np.zeros(runs[0].shared.shape[1])
    with_force = [replace(r, shared=np.column_stack([r.shared, c])) for r, c in zip(runs, columns, strict=True)]
    gain = log_evidence(with_force, start, np.r_[none, 1.0]) - log_evidence(runs, start, none)
    assert (gain > 4.0) is shown
    assert (gain < 0.0) is not shown


def test_a_slope_changes_the_speed_and_hardly_the_specific_force() -> None:
    s = replace(surroundings(), fade=np.zeros(surroundings().bins.time.size))
    both, size = gust_noise.slope_response_of_both(s), s.bins.time.size
    assert both[:size] == pytest.approx(gust_noise.slope_response(s))
    assert both[size:] == pytest.approx(9.80665 * 0.05 * np.eye(size))
