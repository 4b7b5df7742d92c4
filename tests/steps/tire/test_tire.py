"""The tire step on the plant's slip sweeps: recovery, errors in the slip, a peak out of reach, upside-down channels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import curve_fit

from tests.effects.recovered import added
from tests.plant import tire as plant
from tests.plant.vehicle import Vehicle, random_vehicle
from vdyn_cli.physics.models.tire_curve import SHAPE, peak_slip
from vdyn_cli.quantities.errors import Finding, InputError, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.tire import problem
from vdyn_cli.steps.tire.fitted_curve import fitted_curve
from vdyn_cli.steps.tire.slip_sweeps import slip_sweeps
from vdyn_cli.steps.tire.spec import TireSpec
from vdyn_cli.steps.tire.step import STEP

SPEC = TireSpec(test="tire")


def logs(vehicle: Vehicle, seed: int, **options: object) -> tuple[Log, ...]:
    found = []
    for i, record in enumerate(plant.campaign(vehicle, seed, **options)):  # type: ignore[arg-type]
        time, wheel, speed, force, load = record.values()
        channels = {"wheel_speed": wheel, "vehicle_speed": speed / 3.6, "force_x": force, "force_z": load}
        found.append(Log(f"slip_{i + 1}.csv", time, channels))
    return tuple(found)


def known(vehicle: Vehicle, std: float = 0.0) -> Parameters:
    return Parameters({"wheel_radius": Estimate.given(PARAMETERS["wheel_radius"], vehicle.wheel_radius, std)})


def run(vehicle: Vehicle, seed: int, **options: object) -> Result:
    return STEP.estimate(SPEC, logs(vehicle, seed, **options), known(vehicle))


@pytest.mark.parametrize("seed", [1, *(pytest.param(n, marks=pytest.mark.slow) for n in (4, 9))])
def test_the_curve_is_recovered_near_the_bound(seed: int) -> None:
    vehicle = random_vehicle(seed)
    result = run(vehicle, seed)
    information = plant.information(vehicle, seed)
    bounds = {**information.bound(), "tire_longitudinal_stiffness": plant.stiffness_bound(vehicle, information)}
    for name, truth in plant.truth(vehicle).items():
        estimate = result.parameters[name]
        assert abs(estimate.value - truth) < 4 * bounds[name], name
        assert estimate.std == pytest.approx(bounds[name], rel=0.7), name


def test_friction_that_falls_far_beyond_the_peak_does_not_mislead_the_start() -> None:
    vehicle = replace(random_vehicle(4), tire_C=1.9, tire_E=-1.0)
    result = run(vehicle, 4)
    assert result.parameters["tire_C"].value == pytest.approx(vehicle.tire_C, abs=0.02)
    assert result.parameters["tire_B"].value == pytest.approx(vehicle.tire_B, rel=0.05)


@pytest.mark.slow  # 2 s
def test_least_squares_on_noisy_slip_flattens_the_curve_and_this_does_not() -> None:
    vehicle = Vehicle(tire_B=12.0)
    data = []
    for i, log in enumerate(logs(vehicle, 3)):
        noise = np.random.default_rng(i).normal(0.0, 0.02, log.time.size)
        values = log["wheel_speed"] * vehicle.wheel_radius / log["vehicle_speed"] - 1 + noise
        data.append(Log(log.name, log.time, {"slip": values, "force_x": log["force_x"], "force_z": log["force_z"]}))
    slip, force, load = (np.concatenate([d[n] for d in data]) for n in ("slip", "force_x", "force_z"))
    naive, _ = curve_fit(plant.friction, slip, force / load, p0=[12, 1.6, 1, 0.3])
    assert naive[0] * naive[1] * naive[2] < 0.85 * vehicle.tire_longitudinal_stiffness
    slope = STEP.estimate(SPEC, tuple(data), Parameters()).parameters["tire_longitudinal_stiffness"]
    assert slope.interval95[0] < vehicle.tire_longitudinal_stiffness < slope.interval95[1]


@pytest.mark.slow
def test_a_peak_out_of_reach_leaves_the_slope_alone() -> None:
    vehicle = random_vehicle(7)
    result = run(vehicle, 7, peak=False)
    assert list(result.parameters) == ["tire_longitudinal_stiffness"]
    low, high = result.parameters["tire_longitudinal_stiffness"].interval95
    assert low < vehicle.tire_longitudinal_stiffness < high
    assert (high - low) / 2 < 0.15 * vehicle.tire_longitudinal_stiffness
    assert any("only the product" in w for w in result.fit.warnings)
    assert "do not determine its peak" in result.sentence
    assert set(result.withheld) == set(SHAPE)


@pytest.mark.slow
def test_the_reason_is_stated_why_a_curve_with_a_free_form_cannot_be_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(bare: object) -> None:
        raise ResultError(Finding("fit", "tire_C lies at its upper bound"))

    monkeypatch.setattr(problem, "_free_forms", refused)
    short, whole = (run(random_vehicle(7), 7, peak=peak).fit.warnings for peak in (False, True))
    assert any("free form cannot be fitted (tire_C lies at its upper bound)" in w for w in short)
    assert not any("free form" in w for w in whole)


@pytest.mark.slow
def test_the_radius_deviation_is_carried_into_the_slope() -> None:
    vehicle = random_vehicle(3)
    wrong = vehicle.but(wheel_radius=vehicle.wheel_radius * 1.02)
    data = logs(vehicle, 3)
    blind = STEP.estimate(SPEC, data, known(wrong)).parameters["tire_longitudinal_stiffness"]
    aware = STEP.estimate(SPEC, data, known(wrong, 0.02 * wrong.wheel_radius)).parameters["tire_longitudinal_stiffness"]
    truth = vehicle.tire_longitudinal_stiffness
    assert aware.interval95[0] < truth < aware.interval95[1]
    assert abs(aware.value - truth) < 0.5 * abs(blind.value - truth)


@pytest.mark.parametrize(("channel", "says"), [("force_z", "Fz is negative"), ("force_x", "positive at negative slip")])
def test_an_upside_down_channel_is_noticed_with_the_line_to_add(channel: str, says: str) -> None:
    vehicle = random_vehicle(3)
    turned = tuple(log.with_channels(**{channel: -log[channel]}) for log in logs(vehicle, 3))
    with pytest.raises(InputError, match=says) as caught:
        STEP.estimate(SPEC, turned, known(vehicle))
    assert "sign: -1" in str(caught.value)


def test_the_sweeps_of_a_tire_that_carries_a_hundredth_of_a_car_are_used_alike() -> None:
    data = logs(random_vehicle(3), 3)
    small = [d.with_channels(force_x=0.01 * d["force_x"], force_z=0.01 * d["force_z"]) for d in data]
    used = (slip_sweeps(each, SPEC.settings, known(random_vehicle(3))) for each in (data, small))
    for car, robot in zip(*used, strict=True):
        np.testing.assert_array_equal(car["slip"], robot["slip"])


def test_samples_of_a_lifted_tire_are_left_out_however_many_they_are() -> None:
    data = logs(random_vehicle(3), 3)[0]
    lifted = np.arange(data.time.size) % 5 < 3
    load = np.where(lifted, 10.0 * np.cos(data.time), data["force_z"])
    (used,) = slip_sweeps([data.with_channels(force_z=load)], SPEC.settings, known(random_vehicle(3)))
    assert np.isnan(used["slip"][lifted]).all()
    assert np.isfinite(used["slip"][~lifted]).mean() > 0.9


def test_what_is_missing_is_said() -> None:
    vehicle = random_vehicle(3)
    data = logs(vehicle, 3)
    with pytest.raises(InputError, match="wheel_radius"):
        STEP.estimate(SPEC, data, Parameters())
    bare = tuple(Log(d.name, d.time, {k: d[k] for k in ("force_x", "force_z")}) for d in data)
    with pytest.raises(InputError, match="slip cannot be computed"):
        STEP.estimate(SPEC, bare, known(vehicle))
    standing = tuple(d.with_channels(vehicle_speed=np.zeros(d.time.size)) for d in data)
    with pytest.raises(InputError, match="fewer than"):
        STEP.estimate(SPEC, standing, known(vehicle))
    still = tuple(d.with_channels(slip=np.full(d.time.size, 0.01)) for d in data)
    with pytest.raises(InputError, match="the slip is constant"):
        STEP.estimate(SPEC, still, known(vehicle))
    with pytest.raises(InputError, match="no run is given"):
        STEP.estimate(SPEC, (), known(vehicle))


def test_gaps_are_left_out() -> None:
    vehicle = random_vehicle(5)
    holed = []
    for log in logs(vehicle, 5):
        force = log["force_x"].copy()
        force[200:230] = np.nan
        holed.append(log.with_channels(force_x=force))
    value = STEP.estimate(SPEC, tuple(holed), known(vehicle)).parameters["tire_D"]
    assert value.interval95[0] - value.std < vehicle.tire_D < value.interval95[1] + value.std


def test_the_peak_of_the_formula() -> None:
    slip = np.linspace(0.001, 0.5, 200_001)
    friction = plant.friction(slip, 12.0, 1.6, 1.0, 0.3)
    assert peak_slip(12.0, 1.6, 0.3) == pytest.approx(slip[np.argmax(friction)], abs=1e-4)
    assert peak_slip(12.0, 0.9, 0.3) == float("inf")
    assert set(SHAPE) < set(STEP.gives)


@pytest.mark.slow
@pytest.mark.thorough
def test_a_sweep_over_a_wet_patch_is_pointed_at() -> None:
    """Where slip is large the road is wet in one of the sweeps: no curve has such a shape, and the others make one."""
    vehicle = random_vehicle(2)
    data = list(logs(vehicle, 2))
    slip = data[1]["wheel_speed"] * vehicle.wheel_radius / data[1]["vehicle_speed"] - 1
    data[1] = data[1].with_channels(force_x=np.where(np.abs(slip) > 0.03, 0.3, 1.0) * data[1]["force_x"])
    with pytest.raises(ResultError) as refused:
        STEP.estimate(SPEC, tuple(data), known(vehicle))
    assert refused.value.findings[0].where == data[1].name
    assert "contradicts the other sweeps" in refused.value.findings[0].what


def test_the_curve_without_effects_is_fitted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    vehicle, fits = random_vehicle(1), []
    monkeypatch.setattr(problem, "fitted_curve", lambda *args: fits.append(args) or fitted_curve(*args))
    prepared = STEP.prepare(SPEC, logs(vehicle, 1), known(vehicle))
    for _ in range(2):
        prepared.publish()
        prepared.regression()
    assert sum(not fit.free for (fit,) in fits) == 1


@pytest.mark.slow
def test_zeros_of_the_force_that_scatter_between_sweeps_are_not_in_the_curve() -> None:
    vehicle = random_vehicle(2)
    plain = logs(vehicle, 2)
    zeros = 5.0 * (-1.0) ** np.arange(len(plain))
    data = tuple(
        log.with_channels(force_x=log["force_x"] + zero) for log, zero in zip(plain, zeros.tolist(), strict=True)
    )
    fit = problem.prepare(SPEC, data, known(vehicle)).fit
    solution, blind = fit.minima()[0], replace(fit, force_zero=0.0).minima()[0]
    assert np.abs(solution.per_run["force_zero"] - zeros).max() < 4.0
    assert solution.cost < blind.cost - 5.0
    low, high = solution.interval95["tire_D"]
    assert low < vehicle.tire_D < high


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 3])
def test_intervals_hold_every_curve_that_sweeps_to_the_peak_do_not_reject(seed: int) -> None:
    vehicle = Vehicle(tire_B=9.5, tire_C=1.435, tire_D=0.93, tire_E=0.25)
    data = []
    for log in logs(vehicle, seed):
        slip = log["wheel_speed"] * vehicle.wheel_radius / log["vehicle_speed"] - 1
        short = np.abs(np.convolve(slip, np.ones(9) / 9, "same")) < 0.25
        data.append(log.with_channels(force_x=np.where(short, log["force_x"], np.nan)))
    ready = problem.prepare(SPEC, tuple(data), known(vehicle))
    shapes = [minimum.values["tire_C"] for minimum in ready.fit.minima()]
    assert max(shapes) - min(shapes) > 0.3
    result = ready.publish()
    for name in SHAPE:
        low, high = result.parameters[name].interval95
        assert low < getattr(vehicle, name) < high, name
    low, high = result.parameters["tire_C"].interval95
    assert low < min(shapes)
    assert max(shapes) < high
    assert any("curves" in warning for warning in result.fit.warnings)


def test_profiles_do_not_move_the_points_of_the_curve() -> None:
    """Projected onto a fit with profiles, clean sweeps to 3 % of slip were unknown at p = 0.0016."""
    vehicle = random_vehicle(4)
    prepared = problem.prepare(SPEC, logs(vehicle, 4, peak=False), known(vehicle))
    free = prepared.profiles
    wide = [replace(u, prior=(0.0, u.upper)) for u in added(*free).unknowns]
    plain, whole = prepared.regression(), prepared.regression(AddedEffects(free, tuple(wide)))
    start = np.array([u.start for u in plain.shared])
    beside = np.r_[start, np.zeros(len(whole.shared) - start.size)]
    assert np.allclose(whole.rows(0, beside).residual, plain.rows(0, start).residual, atol=1e-2)
