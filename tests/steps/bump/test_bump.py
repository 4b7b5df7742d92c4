"""The bump step on the plant's crossings: recovery, where the bump is, given numbers that are uncertain, traps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
import yaml

from tests.effects.recovered import given as stated
from tests.plant import bump as plant
from tests.plant.obstacle import Bump
from tests.plant.vehicle import REFERENCE, Vehicle, random_vehicle
from tests.plant.write_csv import csv_bytes
from vdyn_cli.effects.asymmetric_damping import asymmetric_damping
from vdyn_cli.effects.suspension_friction import suspension_friction
from vdyn_cli.effects.tire_damping import tire_damping
from vdyn_cli.inference import Unknown, solve
from vdyn_cli.physics.models.half_car import SOUGHT
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.bump.half_car_fit import BumpFit, BumpRows
from vdyn_cli.steps.bump.known_car import car_numbers
from vdyn_cli.steps.bump.measured_profile import BumpData
from vdyn_cli.steps.bump.problem import prepare
from vdyn_cli.steps.bump.spec import BumpSpec
from vdyn_cli.steps.bump.step import STEP
from vdyn_cli.steps.bump.text import changing_speed

BODY = ("vertical_acceleration", "pitch_rate")
SPEC = BumpSpec(test="bump", bump={"height": "70 mm", "width": "480 mm"})  # type: ignore[arg-type]
SEED = 4
VEHICLE = random_vehicle(SEED)


def spec(runs: dict[str, object] | None = None, bump: dict[str, object] | None = None, **settings: object) -> BumpSpec:
    size = {"height": 0.07, "width": 0.48}
    listed = [{"log": f"bump_{k}.csv", **runs} for k in range(4)] if runs else []
    return BumpSpec.model_validate({"test": "bump", "bump": bump or size, "runs": listed, "settings": settings})


def logs(vehicle: Vehicle = VEHICLE, seed: int = SEED, **options: object) -> tuple[Log, ...]:
    found = []
    for k, record in enumerate(plant.campaign(vehicle, seed, **options)):  # type: ignore[arg-type]
        time, front, rear, speed, acceleration, pitch_rate = record.values()
        channels = {"front_load": front, "rear_load": rear, "speed": speed / 3.6}
        channels |= {"vertical_acceleration": acceleration, "pitch_rate": np.radians(pitch_rate)}
        found.append(Log(f"bump_{k}.csv", time, channels))
    return tuple(found)


LOGS = logs()


def known(vehicle: Vehicle = VEHICLE, **std: float) -> Parameters:
    return stated(plant.known(vehicle), **std)


def run(
    data: tuple[Log, ...] = LOGS, how: BumpSpec = SPEC, vehicle: Vehicle = VEHICLE, given: Parameters | None = None
) -> Result:
    return STEP.estimate(how, BumpData(data), given or known(vehicle))


def changed(change: Callable[[Log], Log], data: tuple[Log, ...] = LOGS) -> tuple[Log, ...]:
    return tuple(change(log) for log in data)


def only(names: tuple[str, ...], data: tuple[Log, ...] = LOGS) -> tuple[Log, ...]:
    return changed(lambda log: Log(log.name, log.time, {n: log[n] for n in names}), data)


def missed(result: Result, vehicle: Vehicle = VEHICLE, deviations: float = 4.5) -> list[str]:
    """The parameters that are further than so many of their own standard deviations from the truth."""
    found = {n: (truth, result.parameters[n]) for n, truth in plant.truth(vehicle).items()}
    return [n for n, (truth, e) in found.items() if not abs(e.value - truth) < deviations * e.std]


@pytest.fixture(scope="module")
def bound() -> dict[str, float]:
    """The Cramer-Rao bound of LOGS."""
    return plant.information(VEHICLE, SEED).bound()


@pytest.mark.slow
def test_springs_dampers_and_tires_are_recovered_near_the_bound(bound: dict[str, float]) -> None:
    result = run()
    for name, truth in plant.truth(VEHICLE).items():
        estimate = result.parameters[name]
        assert abs(estimate.value - truth) < 4 * bound[name], name
        assert estimate.std == pytest.approx(bound[name], rel=0.8), name
    assert result.fit.interval_unit == "block"
    assert result.fit.rms == pytest.approx(result.fit.noise_floor, rel=0.05)
    assert not result.fit.warnings


@pytest.mark.slow  # fast: the sample's car
@pytest.mark.parametrize("seed", [1, 6, 9])
def test_other_cars_are_recovered(seed: int) -> None:
    vehicle = random_vehicle(seed)
    assert not missed(run(logs(vehicle, seed), vehicle=vehicle), vehicle)


def test_a_car_that_brakes_on_the_bump_is_a_doubt() -> None:
    """1.2 m/s^2 move 0.2 m / 2.5 m of the inertia force, 125 N; 2 % of the rear axle's load are 112 N."""
    time = np.arange(0.0, 3.0, 0.01)
    values = {"mass": 1300.0, "cg_to_front": 1.1, "wheelbase": 2.5, "longitudinal_lever": 0.2}
    ground = np.array([0.0, 0.25, 0.5]), np.array([0.0, 0.06, 0.0])

    def doubts(rate: float, road: tuple[np.ndarray, np.ndarray] = ground) -> tuple[Finding, ...]:
        speed = SimpleNamespace(value=5.0 + rate * time)
        crossing = SimpleNamespace(run="run.csv", time=time, origin=0.0, distance=3.0, speed=speed)
        fit = SimpleNamespace(known=SimpleNamespace(values=values), crossings=(crossing,))
        return tuple(changing_speed(cast(BumpFit, fit), road))

    (found,) = doubts(-1.2)
    assert found.doubt
    assert "slows down by 1.2 m/s^2" in found.what
    assert "125 N" in found.got
    assert not doubts(-1.0)
    assert not doubts(-1.2, (ground[0], np.array([0.0, 0.06, 0.05])))


@pytest.mark.slow
def test_without_noise_there_is_hardly_a_bias(bound: dict[str, float]) -> None:
    crossings = plant.runs(SEED)
    data = []
    for k, record in enumerate(plant.noise_free(VEHICLE, crossings)):
        channels = dict(zip(("front_load", "rear_load", "speed", *BODY), record.values(), strict=True))
        # A trace of noise, so that the channels' weights stand in their usual proportion.
        noise = np.random.default_rng(k)
        sizes = dict(zip(channels, (0.17, 0.17, 2e-4, 3e-4, 9e-6), strict=True))
        shaken = {n: v + sizes[n] * noise.standard_normal(v.size) for n, v in channels.items()}
        data.append(Log(f"bump_{k}", crossings[k].times, shaken))
    found = run(tuple(data)).parameters
    assert all(abs(found[n].value - truth) < 0.3 * bound[n] for n, truth in plant.truth(VEHICLE).items())


def test_the_sample_logs_give_the_sample_car(root: Path) -> None:
    inputs = gather(STEP, root / "configs" / "bump.yaml")
    from_cg = {"cg_to_front": (1.25, 1e-3), "pitch_inertia": (2200.0, 4.0), "cg_height": (0.61, 2e-3)}
    more = {n: Estimate.given(PARAMETERS[n], *at) for n, at in from_cg.items()}
    result = STEP.estimate(inputs.spec, inputs.data, inputs.known.updated(Parameters(more)))
    assert not missed(result, REFERENCE)
    assert set(result.parameters) == set(SOUGHT) == set(STEP.gives)
    for comparison in result.comparisons:
        assert comparison.measured.shape == comparison.simulated.shape == comparison.x.shape
    names = {m: result.extra["modes"][m]["frequency"] for m in ("bounce", "pitch", "wheel_hop_front", "wheel_hop_rear")}
    assert names["bounce"] < names["pitch"] < 2 < 9 < names["wheel_hop_front"] < names["wheel_hop_rear"] < 15
    assert "kN/m" in result.sentence
    assert {t.key for t in result.tables} == {"modes", "crossings", "misfit", "budget"}


def test_half_sine() -> None:
    bump = {"height": 0.05, "width": 0.4, "shape": "half_sine"}
    assert not missed(run(logs(bump=Bump(0.05, 0.4, "half_sine")), spec(bump=bump)))


@pytest.mark.slow
def test_a_measured_profile_is_read_from_its_file(tmp_path: Path) -> None:
    x = np.linspace(0.0, 0.5, 51)
    height = 0.06 * np.sin(np.pi * x / 0.5) ** 2 + 0.012 * np.sin(4 * np.pi * x / 0.5) * x
    bump = Bump(shape="profile", table=np.array([x, height]))
    rows = "\n".join(f"{1e3 * a:.1f};{1e3 * b:.6f}" for a, b in zip(x, height, strict=True))
    (tmp_path / "bump.csv").write_text(f"x [mm];z [mm]\n{rows}\n", encoding="utf-8")
    columns = {n: {"column": c, "unit": "mm"} for n, c in (("distance", "x [mm]"), ("height", "z [mm]"))}
    path = described(tmp_path, bump={"shape": "profile", "profile": "bump.csv", "columns": columns}, road=bump)
    inputs = gather(STEP, path)
    assert tmp_path / "bump.csv" in inputs.files
    assert not missed(STEP.estimate(inputs.spec, inputs.data, inputs.known))


@cache
def files() -> tuple[bytes, ...]:
    """The logs of a campaign over the usual bump."""
    return tuple(csv_bytes(record) for record in plant.campaign(VEHICLE, SEED))


def described(folder: Path, bump: dict[str, object], road: Bump | None = None) -> Path:
    """Logs and a description on disk."""
    entries = []
    logs = files() if road is None else [csv_bytes(one) for one in plant.campaign(VEHICLE, SEED, bump=road)]
    for k, text in enumerate(logs):
        (folder / f"bump_{k}.csv").write_bytes(text)
        entries.append({"log": f"bump_{k}.csv"})
    units = dict(zip(("front_load", "rear_load", "speed", *BODY), ("N", "N", "km/h", "m/s^2", "deg/s"), strict=True))
    channels = {n: {"column": c, "unit": units[n]} for n, c in zip(units, plant.SENSORS, strict=True)}
    channels["time"] = {"column": "Time [s]", "unit": "s"}
    text = {"test": "bump", "vehicle": plant.known(VEHICLE), "bump": bump, "channels": channels, "runs": entries}
    path = folder / "bump.yaml"
    path.write_text(yaml.safe_dump(text), encoding="utf-8")
    return path


@pytest.mark.parametrize("told", [None, *(pytest.param(d, marks=pytest.mark.slow) for d in (0.4, 5.6, 9.0))])
def test_the_bump_is_found_wherever_it_is_stated_to_be(told: float | None) -> None:
    result = run(how=spec(runs=None if told is None else {"distance_front": told}))
    assert not missed(result)
    places = [run["distance_front"] for run in result.extra["crossings"]]
    assert np.allclose(places, [c.distance for c in plant.runs(SEED)], atol=5e-3)
    assert bool([f for f in result.findings if "show the bump" in f.what]) == (told is not None)


def test_the_nearer_of_two_bumps_is_used_if_its_distance_is_stated() -> None:
    twice = []
    for log in LOGS:
        step = log.time[-1] + 0.002
        time = np.concatenate([log.time, log.time + step])
        twice.append(Log(log.name, time, {n: np.concatenate([log[n], log[n]]) for n in log.channels}))
    length = np.array([np.trapezoid(log["speed"], log.time) for log in LOGS])
    stated = [{"log": log.name, "distance_front": way + 3.0} for log, way in zip(LOGS, length.tolist(), strict=True)]
    size = {"height": 0.07, "width": 0.48}
    second = run(tuple(twice), BumpSpec.model_validate({"test": "bump", "bump": size, "runs": stated}))
    places = np.array([run["distance_front"] for run in second.extra["crossings"]])
    assert np.allclose(places - length, 3.0, atol=0.2)


def test_a_crossing_ends_where_the_car_meets_another_bump() -> None:
    """Of bumps a few meters apart, the response to the second one was fitted as that to the first."""
    twice = []
    for log in LOGS:
        meets = np.interp(3.0, np.cumsum(log["speed"]) * 0.002, log.time)
        first, second = log.between(0.0, meets + 1.2), log.between(meets - 0.3, np.inf)
        time = np.concatenate([first.time, second.time - second.time[0] + first.time[-1] + 0.002])
        twice.append(Log(log.name, time, {n: np.concatenate([first[n], second[n]]) for n in log.channels}))
    problem = prepare(spec({"distance_front": 3.0}), BumpData(tuple(twice)), known())
    for log, crossing in zip(LOGS, problem.fit.crossings, strict=True):
        meets = np.interp(3.0, np.cumsum(log["speed"]) * 0.002, log.time)
        assert crossing.time[-1] == pytest.approx(meets + 1.4, abs=0.25)


def test_the_bump_is_found_by_a_car_that_slows_down_on_it() -> None:
    crossing = replace(plant.runs(SEED)[0], speed=3.0, speed_up=-0.8, distance=2.0)
    (record,) = plant.noise_free(VEHICLE, [crossing])
    rng = np.random.default_rng(SEED)
    channels = dict(zip(("front_load", "rear_load", "speed"), list(record.values())[:3], strict=True))
    sizes = {"front_load": 20.0, "rear_load": 20.0, "speed": 0.02}
    noisy = {n: v + sizes[n] * rng.standard_normal(v.size) for n, v in channels.items()}
    found = prepare(SPEC, BumpData((Log("slowing", crossing.times, noisy),)), known()).fit
    assert found.crossings[0].distance == pytest.approx(2.0, abs=0.05)
    assert found.road is None


def test_loads_alone_will_do_and_gaps_and_clipped_peaks_are_left_out() -> None:
    def damaged(log: Log) -> Log:
        front, speed = np.minimum(log["front_load"], 16_000.0), log["speed"].copy()
        front[300:330], speed[400:440] = np.nan, np.nan
        return log.with_channels(front_load=front, speed=speed)

    result = run(changed(damaged, only(("front_load", "rear_load", "speed"))))
    assert not missed(result)
    assert any("at the sensor's limit" in f.what for f in result.findings)


@pytest.mark.slow
def test_the_paper_s_weighting() -> None:
    """w = 1 weighs both loads alike, as their noise does; a small w leaves the rear axle to the others."""
    data = only(("front_load", "rear_load", "speed"))
    plain, paper, front = (run(data, spec(**s)).parameters for s in ({}, {"rear_weight": 1.0}, {"rear_weight": 1e-4}))
    for name in SOUGHT:
        assert paper[name].value == pytest.approx(plain[name].value, rel=2e-4)
    assert front["suspension_damping_rear"].std > 5 * plain["suspension_damping_rear"].std
    assert not run(data, spec(rear_weight=9.0)).fit.warnings


@pytest.mark.slow
def test_uncertain_given_numbers_are_carried_into_the_intervals() -> None:
    off = {"unsprung_mass_front": 4.0, "unsprung_mass_rear": 4.0, "sprung_pitch_inertia": 40.0, "wheelbase": 3e-3}
    wrong = known()
    wrong = wrong.updated(stated({n: wrong[n].value + 1.2 * std for n, std in off.items()}))
    doubtful = stated({n: e.value for n, e in wrong.items()}, **off)
    exact, blind, aware = (run(given=given).parameters for given in (None, wrong, doubtful))
    truth = plant.truth(VEHICLE)
    missed = [n for n in SOUGHT if not blind[n].interval95[0] < truth[n] < blind[n].interval95[1]]
    assert len(missed) >= 3
    for name in SOUGHT:
        assert abs(aware[name].value - truth[name]) < 4.5 * aware[name].std, name
    assert np.mean([aware[n].std / exact[n].std for n in SOUGHT]) > 1.2


def test_the_body_s_pitch_inertia_comes_from_the_car_s() -> None:
    given = {n: e for n, e in known(REFERENCE).items() if n not in ("sprung_pitch_inertia", "sprung_mass")}
    more = {"mass": 1588.0, "pitch_inertia": 2200.0, "cg_height": 0.61, "wheel_radius": 0.308}
    every = {**given, **stated(more)}
    found, said = car_numbers(Parameters(every))
    assert found["sprung_pitch_inertia"].value == pytest.approx(REFERENCE.sprung_pitch_inertia, rel=1e-9)
    assert not said
    del every["cg_height"]
    guessed, said = car_numbers(Parameters(every))
    assert guessed["sprung_pitch_inertia"].value == pytest.approx(REFERENCE.sprung_pitch_inertia, rel=5e-3)
    assert guessed["sprung_pitch_inertia"].std > 5.0
    assert "of the whole car" in said[0].what


def test_cg_to_rear_serves_as_well() -> None:
    given = {n: e for n, e in known().items() if n != "cg_to_front"}
    given["cg_to_rear"] = Estimate.given(PARAMETERS["cg_to_rear"], VEHICLE.cg_to_rear, 2e-3)
    found, _ = car_numbers(Parameters(given))
    assert found["cg_to_front"].value == pytest.approx(VEHICLE.cg_to_front)
    assert found["cg_to_front"].std == 2e-3


@pytest.mark.slow
def test_an_effect_can_be_added_and_is_found() -> None:
    data = BumpData(logs(effects={"asymmetric_damping": 0.3}))
    plain = STEP.estimate(SPEC, data, known())
    assert plain.fit.rms > 5 * plain.fit.noise_floor
    assert any("times the sensor's noise" in w for w in plain.fit.warnings)
    name, _ = asymmetric_damping.unknowns
    regression = prepare(SPEC, data, known()).regression(
        AddedEffects((asymmetric_damping,), (Unknown(name, 0.0, -0.9, 0.9),))
    )
    solution = solve(regression, tolerance=1e-3)
    assert solution.values[name] == pytest.approx(0.3, abs=2e-3)
    truth = plant.truth(VEHICLE)
    assert all(solution.values[n] == pytest.approx(truth[n], rel=5e-3) for n in SOUGHT)


@pytest.mark.slow
def test_a_gentle_bump_leaves_the_tire_to_the_unsprung_mass() -> None:
    result = run(logs(bump=Bump(0.01, 4.0)), spec(bump={"height": 0.01, "width": 4.0}))
    (words,) = [w for w in result.fit.warnings if w.startswith("tire_vertical_stiffness depends on")]
    assert "does not excite wheel hop" in words
    tire, spring = (result.parameters[n] for n in ("tire_vertical_stiffness", "suspension_stiffness_front"))
    assert tire.std / tire.value > 5 * spring.std / spring.value


@pytest.mark.slow
def test_a_car_that_was_loaded_otherwise_is_noticed() -> None:
    heavier = known().updated(stated({"sprung_mass": VEHICLE.sprung_mass + 60.0}))
    findings = run(given=heavier).findings
    assert [f.where for f in findings if "at rest above the load" in f.what] == ["front_load", "rear_load"]


@pytest.mark.slow
def test_effects_linearized_one_by_one_have_the_columns_of_all_at_once() -> None:
    problem = prepare(SPEC, BumpData(LOGS[:1]), known())
    effects = (asymmetric_damping, suspension_friction, tire_damping, problem.profiles[1])
    unknowns = tuple(Unknown(n, 0.0) for e in effects for n in e.unknowns)
    fit = replace(problem.fit, added=AddedEffects(effects, unknowns))
    theta = fit.regression().start()
    theta[[u.name for u in fit.shared].index("suspension_friction")] = 80.0
    one_by_one, at_once = BumpRows(fit).linearized(0, theta), fit.simulate(0, theta)
    for channel in fit.channels:
        columns = at_once.sensitivities[channel]
        assert np.array_equal(one_by_one.outputs[channel], at_once.outputs[channel])
        assert one_by_one.sensitivities[channel] == pytest.approx(columns, abs=1e-10 * float(np.max(np.abs(columns))))
