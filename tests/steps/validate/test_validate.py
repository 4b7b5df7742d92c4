"""Drives against the model: inside the band with the true parameters, outside with a wrong one; clear errors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from tests.export.cases import LEARNED, LEARNED_LAW, LEARNED_SIZES
from tests.steps.validate.validate_cases import described, inputs, known_file, prepared, true_parameters
from vdyn_cli.commands.run_step import write_step
from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep, setup_of
from vdyn_cli.effects import catalog
from vdyn_cli.inference import Unknown
from vdyn_cli.project.execute import RefusedResultError, execute
from vdyn_cli.project.inputs import Inputs
from vdyn_cli.quantities.errors import InputError, ResultError
from vdyn_cli.quantities.law_definition import LawDefinition
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import load_step
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.failure import UnpublishedError
from vdyn_cli.steps.validate.car.prior import carried_effects, dropped_effects
from vdyn_cli.steps.validate.drives.complete_inputs import OUTPUTS
from vdyn_cli.steps.validate.fit.whitening import whiten_drives
from vdyn_cli.steps.validate.noise import DEPARTURE
from vdyn_cli.steps.validate.spec import ValidateSettings


def validated(root: Path, folder: Path, drives: tuple[int, ...] = (1,), wrong: Any = None, **settings: Any) -> Result:
    found = inputs(root, folder, true_parameters(wrong), drives, **settings)
    return prepared(found).publish()


@pytest.fixture(scope="module")
def right(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Result:
    return validated(root, tmp_path_factory.mktemp("right"), (1, 2))


def numbers(result: Result) -> Any:
    return result.extra["validation"]


@pytest.mark.slow
def test_with_the_true_parameters_every_output_stays_within_its_band(right: Result) -> None:
    found = numbers(right)
    assert found["verdict"] == "inside"
    assert set(found["outputs"]) == {*OUTPUTS, "jerk"}
    for name, output in found["outputs"].items():
        assert output["outside"] <= output["limit"] + 0.01, name
        assert output["outside"] < 0.07, name
    assert found["statistic"]["chance"] > 0.01
    assert not right.fit.warnings
    assert right.fit.rms < 1.5 * right.fit.noise_floor
    assert "stay within the prediction band" in right.sentence


@pytest.mark.slow
def test_errors_are_near_the_sensors_noise_and_gusts_are_found(right: Result) -> None:
    found = numbers(right)
    assert found["noise"]["gust"] == pytest.approx(0.6, rel=0.5)
    for name in ("shaft_torque_left", "shaft_torque_right"):
        output = found["outputs"][name]
        assert output["sensor_noise"] == pytest.approx(1.5, rel=0.15)
        assert output["rms"] < 1.3 * output["sensor_noise"]
    assert set(found["outputs"]["speed"]["regimes"]) == set(
        ("launch", "acceleration", "cruise", "coast", "braking", "low speed")
    )


def test_what_makes_the_band_is_named(right: Result) -> None:
    shares = numbers(right)["outputs"]["speed"]["shares"]
    assert list(shares)[:4] == sorted(shares, key=lambda n: -shares[n])[:4]
    assert set(list(shares)[:3]) <= {"wheel_radius", "mass", "drag_area", "driveline_efficiency", "driveline_inertia"}
    assert sum(shares.values()) == pytest.approx(1.0, abs=0.03)
    radius = numbers(right)["outputs"]["wheel_speed_rl"]["shares"]["wheel_radius"]
    assert radius > 0.2


def test_it_publishes_no_parameters_and_shows_what_it_found(right: Result) -> None:
    assert len(right.parameters) == 0
    assert {t.key for t in right.tables} == {"outputs", "regimes", "shares", "parameters", "modes"}
    assert {"band_speed", "band_acceleration", "band_jerk", "tip_in"} <= {f.key for f in right.figures}
    assert {c.channel for c in right.comparisons} == {*OUTPUTS, "jerk"}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wheel_radius", "tire_relaxation_length"])
def test_a_parameter_wrong_by_three_standard_deviations_shows(root: Path, tmp_path: Path, name: str) -> None:
    result = validated(root, tmp_path, (2,), wrong={name: 3.0})
    found = numbers(result)
    assert found["parameters"][name]["strain"] == pytest.approx(-3.0, abs=0.6)
    assert found["strained"] == [name]
    assert found["verdict"] == "strained"
    assert name.replace("_", " ") in result.fit.warnings[0]
    assert name.replace("_", " ") in result.sentence


@pytest.mark.slow
def test_a_parameter_wrong_by_far_is_reported_first(root: Path, tmp_path: Path) -> None:
    result = validated(root, tmp_path, (2,), wrong={"mass": 20.0})
    found = numbers(result)
    assert found["verdict"] != "inside"
    assert result.fit.warnings


def test_the_regression_is_the_door_for_effects(root: Path, tmp_path: Path) -> None:
    found = inputs(root, tmp_path, true_parameters(), (1,), model="road_load")
    regression = prepared(found).regression()
    shared = [u.name for u in regression.shared]
    assert {"mass", "drag_area", "rolling_resistance"} <= set(shared)
    assert all(u.prior is not None for u in regression.shared)
    drag = next(u for u in regression.shared if u.name == "drag_area")
    assert drag.prior_correlation["rolling_resistance"] == pytest.approx(-0.57)
    start = regression.start()
    rows = regression.rows(0, regression.local(start, 0))
    step = 1e-3 * next(u.prior[1] for u in regression.shared if u.name == "mass" and u.prior)
    moved = start.copy()
    moved[shared.index("mass")] += step
    change = (regression.rows(0, regression.local(moved, 0)).residual - rows.residual) / step
    assert change == pytest.approx(rows.jacobian[:, shared.index("mass")], abs=1e-3 * np.abs(change).max())


@pytest.mark.slow
def test_its_lines_may_go_through_parameters_that_are_not_at_their_prior(root: Path, tmp_path: Path) -> None:
    """Priors stay; a start far from the prior is limited to five standard deviations."""
    found = inputs(root, tmp_path, true_parameters(), (1,))
    problem = prepared(found)
    at_prior = problem.regression()
    inertia = next(u for u in at_prior.shared if u.name == "driveline_inertia")
    assert inertia.prior is not None
    mean, std = inertia.prior
    for requested, taken in ((mean + std, mean + std), (mean + 50 * std, mean + 5 * std)):
        moved = problem.regression(start={"driveline_inertia": requested})
        there = next(u for u in moved.shared if u.name == "driveline_inertia")
        assert there.start == pytest.approx(taken)
        assert there.prior == inertia.prior


def test_how_a_car_leaves_rest_is_not_known_to_the_millimetre(root: Path, tmp_path: Path) -> None:
    found = inputs(root, tmp_path, true_parameters(), (1,))
    w = whiten_drives(prepared(found).baseline, averaged=True)
    (one,) = w.whitenings
    rows = len(one.layout.bins.time)
    covariance = one.factor[:rows] @ one.factor[:rows].T
    assert one.layout.section(one.layout.bins).min() > 0
    assert np.sqrt(covariance.min()) > 0.9 * DEPARTURE


@pytest.mark.slow
def test_free_play_is_weighed_by_what_some_play_does(root: Path, tmp_path: Path) -> None:
    """It has no slope at zero: its sensitivity is a secant over a relevant amplitude."""
    found = inputs(root, tmp_path, true_parameters(), (1,))
    play = next(e for e in catalog() if e.name == "backlash")
    size = play.probes[len(play.probes) // 3]
    base = prepared(found).baseline
    setups = [
        base.with_effects(AddedEffects((play,), (Unknown("backlash", start, 0.0, 0.06, "rad"),)))
        for start in (0.0, size)
    ]
    without, with_it = (one.first[0] for one in setups)
    column = without.sensitivities["shaft_torque_left"][:, len(setups[0].prior.names) + len(setups[0].sensors.gain_std)]
    apart = with_it.values["shaft_torque_left"] - without.values["shaft_torque_left"]
    assert np.abs(apart).max() > 1.0
    assert column * size == pytest.approx(apart, abs=0.05 * np.abs(apart).max())


def test_what_earlier_steps_found_beside_the_parameters_is_simulated_and_not_sought_again(
    root: Path, tmp_path: Path
) -> None:
    found = inputs(root, tmp_path, true_parameters(), (1,), model="road_load")
    size = Estimate(0.4, 0.02, (0.36, 0.44), "m^2", "drag of what was mounted", "coastdown")
    extended = replace(found.known, extensions={"extra_drag_area": {"extra_drag_area": size}})
    plain = prepared(found).baseline
    setup = prepared(replace(found, known=extended)).baseline
    assert "extra_drag_area" in setup.prior.names
    assert setup.prior.std[setup.prior.names.index("extra_drag_area")] == 0.02
    speeds = [t.first[0].values["speed"][-1] for t in (plain, setup)]
    assert speeds[1] < speeds[0] - 0.5
    step = load_step("validate")
    with_drag = PreparedStep(step, found.spec, extended, step.prepare(found.spec, found.data, extended))
    candidates = setup_of(with_drag).candidates
    assert "extra_drag_area" not in candidates
    assert "headwind" in candidates


@pytest.mark.parametrize("model", ["road_load", pytest.param("vehicle", marks=pytest.mark.slow)])
def test_a_law_that_an_earlier_step_learned_is_simulated(root: Path, tmp_path: Path, model: str) -> None:
    found = inputs(root, tmp_path, true_parameters(), (1,), model=model)
    law = LawDefinition.model_validate(LEARNED_LAW)
    sizes = {n: Estimate(v, 0.05 * v, (0.9 * v, 1.1 * v), "", "", "coastdown") for n, v in LEARNED_SIZES.items()}
    extended = replace(found.known, extensions={LEARNED: sizes}, laws={LEARNED: law})
    plain = prepared(found).baseline
    problem = prepared(replace(found, known=extended))
    assert [e.name for e in carried_effects(problem.model, problem.known)] == [LEARNED]
    assert not dropped_effects(problem.model, problem.known)
    without, with_it = (t.first[0].values["speed"] for t in (plain, problem.baseline))
    assert np.max(without - with_it) > 0.05


def test_an_effect_of_an_earlier_step_that_the_model_cannot_take_is_reported(root: Path, tmp_path: Path) -> None:
    found = inputs(root, tmp_path, true_parameters(), (1,), model="road_load")
    size = Estimate(0.4, 0.02, (0.36, 0.44), "N", "of another test", "bump")
    extensions = {"suspension_friction": {"suspension_friction": size}, "seal_drag": {"seal_drag": size}}
    problem = prepared(replace(found, known=replace(found.known, extensions=extensions)))
    dropped = dropped_effects(problem.model, problem.known)
    assert [f.where for f in dropped] == ["extensions.suspension_friction", "extensions.seal_drag"]
    assert "this model does not have the part that it changes" in dropped[0].what
    assert "no such effect is installed" in dropped[1].what
    assert not any(f.minor for f in dropped)


def test_a_mass_on_a_road_follows_the_drives_too(root: Path, tmp_path: Path) -> None:
    result = validated(root, tmp_path, (1, 2, 3), model="road_load")
    found = numbers(result)
    assert set(found["outputs"]) == {"speed", "acceleration", "jerk"}
    assert found["outputs"]["speed"]["rms"] < 0.3
    assert found["outputs"]["speed"]["outside"] < found["outputs"]["speed"]["limit"] + 0.01


def changed(found: Inputs, **channels: Any) -> tuple[Log, ...]:
    log = found.data[0]
    made = {n: f(log[n].copy()) if callable(f) else f for n, f in channels.items()}
    return (log.with_channels(**made), *found.data[1:])


def refusal(found: Inputs, logs: tuple[Log, ...]) -> str:
    with pytest.raises(InputError) as caught:
        prepared(replace(found, data=logs)).publish()
    return str(caught.value)


def test_gaps_in_the_torque_are_refused_and_in_outputs_skipped(root: Path, tmp_path: Path) -> None:
    found = inputs(root, tmp_path, true_parameters())

    def holed(values: np.ndarray) -> np.ndarray:
        values[1000:1040] = np.nan
        return values

    said = refusal(found, changed(found, drive_torque=holed))
    assert "channel 'drive_torque'" in said
    assert "40 values are missing" in said
    road = replace(found, spec=found.spec.model_copy(update={"settings": ValidateSettings(model="road_load")}))
    logs = changed(road, speed=holed, acceleration=holed)
    assert numbers(prepared(replace(road, data=logs)).publish())["outputs"]["speed"]["rms"] < 0.5


def test_of_torque_and_speed_of_different_length_the_common_time_is_used(root: Path, tmp_path: Path) -> None:
    found = inputs(root, tmp_path, true_parameters(), model="road_load")

    def short(values: np.ndarray) -> np.ndarray:
        values[3000:] = np.nan
        return values

    result = prepared(replace(found, data=changed(found, drive_torque=short))).publish()
    (said,) = [f for f in result.findings if "does not cover the time of the speed" in f.what]
    assert said.doubt
    assert all(c.time[-1] <= 30.0 for c in result.comparisons if c.run.startswith("drive_1"))


@pytest.mark.slow
def test_torque_and_speed_of_different_drives_are_refused_as_clocks_apart(root: Path, tmp_path: Path) -> None:
    """Two loggers with files of different drives over one course: at best a delay comes close."""
    path = described(root, tmp_path, model="road_load")
    data = yaml.safe_load(path.read_text())
    channels, reading = data.pop("channels"), {}
    torque = {n: channels.pop(n) for n in ("drive_torque", "brake_torque")}
    shared = {"time": channels["time"], "speed": channels["speed"]}
    data["loggers"] = [{"channels": channels, "reading": reading}, {"channels": {**shared, **torque}}]
    mixed = [[str(root / "sample_logs" / f"drive_{k}.csv") for k in pair] for pair in ((1, 3), (2, 3))]
    data["runs"] = [{"logs": logs, "direction": way} for logs, way in zip(mixed, ("out", "back"), strict=True)]
    path.write_text(yaml.safe_dump(data))
    with pytest.raises(RefusedResultError, match="does not produce this speed") as caught:
        execute("validate", path, (known_file(tmp_path, true_parameters()),))
    assert all("belong to one drive and one clock" in f.remedy for f in caught.value.findings)
    document = caught.value.record.document
    assert not document["parameters"]
    assert document["diagnosis"]["verdict"] == "unknown"
    assert not document["diagnosis"]["causes"]


def test_a_torque_of_the_wrong_sign_is_reported(root: Path, tmp_path: Path) -> None:
    found = inputs(root, tmp_path, true_parameters(), model="road_load")
    with pytest.raises(UnpublishedError, match="add 'sign: -1'"):
        prepared(replace(found, data=changed(found, drive_torque=lambda v: -v))).publish()


def test_a_hole_in_the_clock_is_refused(root: Path, tmp_path: Path) -> None:
    found = inputs(root, tmp_path, true_parameters())
    log = found.data[0]
    keep = np.r_[0:2000, 2200 : log.time.size]
    cut = Log(log.name, log.time[keep], {n: v[keep] for n, v in log.channels.items()})
    said = refusal(found, (cut,))
    assert "no samples for 2" in said
    assert f"write 'to_time: {log.time[1999]:.6g} s'" in said
    assert f"with 'from_time: {log.time[2200]:.6g} s'" in said


def test_missing_parameters_are_listed_with_the_step_that_gives_them(root: Path, tmp_path: Path) -> None:
    without = ("cg_height", "tire_B", "shaft_stiffness_left", "wheel_inertia", "drag_area", "suspension_damping_rear")
    found = inputs(root, tmp_path, true_parameters(without=without))
    said = refusal(found, found.data)
    for name, step in zip(without, ("cg", "tire", "shaft", "inertia", "coastdown", "bump"), strict=True):
        assert f"{name} (" in said
        assert f"'vdyn {step}'" in said


def test_parameters_outside_what_is_physical_are_refused(root: Path, tmp_path: Path) -> None:
    parameters = true_parameters()
    wild = replace(parameters["wheel_radius"], value=30.8)
    odd = replace(parameters["tire_C"], value=float("nan"))
    with pytest.raises(InputError, match=r"parameter 'wheel_radius': lies outside 0.05 to 1 m"):
        inputs(root, tmp_path, replace(parameters, estimates={**parameters.estimates, "wheel_radius": wild}))
    found = inputs(root, tmp_path, parameters)
    known = replace(parameters, estimates={**parameters.estimates, "tire_C": odd})
    assert "parameter 'tire_C'" in refusal(replace(found, known=known), found.data)


def test_a_step_too_large_is_refused_and_writes_nothing(root: Path, tmp_path: Path) -> None:
    path = described(root, tmp_path, step="20 ms")
    known = known_file(tmp_path, true_parameters())
    with pytest.raises(InputError, match="is longer than 2 ms"):
        write_step("validate", path, (known,), tmp_path / "out", None)
    assert not (tmp_path / "out").exists()


def test_a_model_that_no_step_follows_is_an_answer_that_is_not_good(root: Path, tmp_path: Path) -> None:
    """Each value is physical, but a wheel as light as a coin on shafts of a truck oscillates too fast for any step."""
    parameters = true_parameters()
    odd = {"wheel_inertia": 0.005, "shaft_stiffness_left": 1e6, "shaft_stiffness_right": 1e6, "tire_D": 0.06}
    changed = {n: replace(parameters[n], value=v) for n, v in odd.items()}
    path = described(root, tmp_path)
    known = known_file(tmp_path, replace(parameters, estimates={**parameters.estimates, **changed}))
    with pytest.raises(ResultError, match="step"):
        write_step("validate", path, (known,), tmp_path / "out", None)
    assert {"validate.html", "validate.json"} <= {p.name for p in (tmp_path / "out").iterdir()}


def test_left_and_right_torques_drive_the_same_car(root: Path, tmp_path: Path) -> None:
    found = inputs(root, tmp_path, true_parameters())
    log = found.data[0]
    each = 0.5 * log["drive_torque"] * 3.267
    channels = {n: v for n, v in log.channels.items() if n != "drive_torque"}
    sides = Log(log.name, log.time, {**channels, "drive_torque_left": each, "drive_torque_right": each})
    one = prepared(found).baseline
    two = prepared(replace(found, data=(sides,))).baseline
    start = 1.0 * np.r_[one.vector.theta, 0.0, np.zeros(len(one.sensors.with_zero))]
    whole = one.simulate(0, start, slopes=False).values["speed"]
    other = two.simulate(0, np.r_[two.vector.theta, 0.0, np.zeros(len(two.sensors.with_zero))], slopes=False).values[
        "speed"
    ]
    assert whole == pytest.approx(other, abs=0.02)
