"""The shaft step: drawing, bar and log, alone and against each other; wrong signs and ratios; the shipped examples."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.effects.recovered import added
from tests.plant import shaft as plant
from tests.plant.vehicle import Vehicle, random_vehicle
from tests.steps.shaft.test_shaft_fit import log
from vdyn_cli.effects import Effect, candidates, catalog
from vdyn_cli.inference import Unknown
from vdyn_cli.project.execute import execute
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.shaft import shaft_side
from vdyn_cli.steps.shaft.problem import prepare
from vdyn_cli.steps.shaft.shaft_fit import linear_solution
from vdyn_cli.steps.shaft.shaft_readings import speed_ratio_doubts
from vdyn_cli.steps.shaft.spec import ShaftSpec
from vdyn_cli.steps.shaft.step import STEP

RUN = [{"log": "tip_in.csv", "side": "left"}]


def spec(vehicle: Vehicle | None = None, **more: object) -> ShaftSpec:
    drawn = {}
    if vehicle is not None:
        for side in plant.PATTERN:
            drawn[side] = [
                {"outer_diameter": f"{s.outer_diameter} +- 0.00002 m", "inner_diameter": s.inner_diameter,
                 "length": s.length}
                for s in plant.drawing(vehicle, side)
            ]  # fmt: skip
        more = {"sections": drawn, "shear_modulus": f"{vehicle.shear_modulus} +- 3e8 Pa", **more}
    return ShaftSpec.model_validate({"test": "shaft", **more})


def _joints() -> Effect:
    return next(effect for effect in catalog() if effect.name == "series_compliance")


def test_the_drawing_alone_gives_both_sides() -> None:
    vehicle = random_vehicle(1)
    result = STEP.estimate(spec(vehicle), (), Parameters())
    for side in plant.PATTERN:
        estimate = result.parameters[f"shaft_stiffness_{side}"]
        assert estimate.value == pytest.approx(plant.truth(vehicle)[f"shaft_stiffness_{side}"], rel=1e-6)
        assert 0.003 < estimate.std / estimate.value < 0.01
    correlation = result.parameters.correlation["shaft_stiffness_left"]["shaft_stiffness_right"]
    assert 0.5 < correlation < 1.0
    assert not [name for name in result.parameters if "damping" in name]


def test_the_shear_modulus_may_come_from_the_vehicle_or_be_steels() -> None:
    sections = {"right": [{"outer_diameter": "26 mm", "length": "700 mm"}]}
    vehicle = Parameters({"shear_modulus": Estimate.given(PARAMETERS["shear_modulus"], 80e9, 1e9)})
    stated = STEP.estimate(spec(sections=sections), (), vehicle)
    assumed = STEP.estimate(spec(sections=sections), (), Parameters())
    ratio = stated.parameters["shaft_stiffness_right"].value / assumed.parameters["shaft_stiffness_right"].value
    assert ratio == pytest.approx(80 / 79.3)
    assert assumed.findings[0].where == "shear_modulus"
    # a plain half-shaft raises no eyebrow
    assert not [f for f in stated.findings if "half-shaft of 24 to 28 mm" in f.what]


@pytest.mark.parametrize(("length", "said"), [("60 mm", "times the stiffest plain"), ("3 m", "softer than a plain")])
def test_a_stiffness_unlike_a_half_shafts_is_doubted(length: str, said: str) -> None:
    result = STEP.estimate(spec(sections={"left": [{"outer_diameter": "26 mm", "length": length}]}), (), Parameters())
    assert [f for f in result.findings if said in f.what]


def test_log_and_drawing_that_agree_are_weighted() -> None:
    vehicle = random_vehicle(2)
    result = STEP.estimate(spec(vehicle, runs=RUN), (log(vehicle, 2),), Parameters())
    ways = result.extra["stiffness_by"]["left"]
    left = result.parameters["shaft_stiffness_left"]
    assert left.std < min(way["std"] for way in ways.values())
    assert left.interval95[0] < plant.truth(vehicle)["shaft_stiffness_left"] < left.interval95[1]
    damping = result.parameters["shaft_damping_left"]
    assert damping.value == pytest.approx(vehicle.shaft_damping_left, abs=4 * damping.std)
    assert "shaft_damping_right" not in result.parameters
    assert result.fit.rms == pytest.approx(result.fit.noise_floor, rel=0.1)
    keys = {"loop_left", "torque_residual_left", "compliance_left", "compliance_right", "ways"}
    assert {figure.key for figure in result.figures} == keys


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hidden", "named"), [("series_compliance", True), pytest.param("backlash", False, marks=pytest.mark.thorough)]
)
def test_a_run_with_another_stiffness_is_named(hidden: str, named: bool) -> None:
    """A tenth softer in one of three runs; free play in one run fits no linear shaft, not even in that run."""
    vehicle = random_vehicle(5)
    stiffness = plant.truth(vehicle)["shaft_stiffness_left"]
    size = 1 / (0.9 * stiffness) - 1 / stiffness if named else 4e-3
    logs = [replace(log(vehicle, k, **({hidden: size} if k == 7 else {})), name=f"run_{k}.csv") for k in (5, 6, 7)]
    runs = [{"log": one.name, "side": "left"} for one in logs]
    result = STEP.estimate(spec(runs=runs), logs, Parameters())
    found = [f for f in result.findings if "in this run" in f.what or "another stiffness" in f.what]
    assert [f.where for f in found] == ["run_7.csv"] * named
    assert all(f.got.startswith("-10.") or f.got.startswith("-9.") for f in found)
    assert result.fit.cause.startswith("run_7.csv: stiffness") == named
    assert all(f.fault for f in found)
    if named:
        low, high = result.parameters["shaft_stiffness_left"].interval95
        assert low < 0.901 * stiffness < 0.999 * stiffness < high


def test_joints_in_series_are_found_by_comparing_log_and_drawing() -> None:
    vehicle = random_vehicle(3)
    stiffness = plant.truth(vehicle)["shaft_stiffness_left"]
    softer = 0.5 / stiffness
    result = STEP.estimate(spec(vehicle, runs=RUN), (log(vehicle, 3, series_compliance=softer),), Parameters())
    assert result.parameters["shaft_stiffness_left"].value == pytest.approx(stiffness / 1.5, rel=0.002)
    (finding,) = (f for f in result.findings if "softer than calculated from its drawing" in f.what)
    assert f"{softer:.2g} rad/(N m) in series" in finding.what
    assert "33 %" in finding.what


def test_a_drawing_that_the_log_contradicts_is_reported_also_where_joints_explain_it() -> None:
    vehicle = random_vehicle(3)
    data = (log(vehicle, 3, series_compliance=0.25 / plant.truth(vehicle)["shaft_stiffness_left"]),)
    joints = _joints()
    added = AddedEffects((joints,), (Unknown("series_compliance", 0.0, -2e-6, 2e-4, "rad/(N m)"),))
    problem = prepare(spec(vehicle, runs=RUN), data, Parameters())
    assert problem.sides[0].drawn_bar((joints,)) is not None
    result = problem.publish(added)
    (finding,) = (f for f in result.findings if f.where == "left, log and drawing")
    assert "20 % softer than calculated from its drawing" in finding.what
    assert "an error of the drawing of this size looks the same" in finding.what
    joined = plant.truth(vehicle)["shaft_stiffness_left"] / 1.25
    assert result.parameters["shaft_stiffness_left"].value == pytest.approx(joined, rel=2e-3)


def test_a_log_stiffer_than_the_drawing_contradicts() -> None:
    vehicle = random_vehicle(4)
    data = log(vehicle, 4)
    slower = data["wheel_speed"] + 0.8 * (data["motor_speed"] - data["wheel_speed"])
    stiffer = data.with_channels(twist=0.8 * data["twist"], motor_speed=slower)
    problem = prepare(spec(vehicle, runs=RUN), (stiffer,), Parameters())
    assert problem.sides[0].drawn_bar((_joints(),)) is None
    result = problem.publish()
    (said,) = (f for f in result.findings if "cannot make a shaft stiffer" in f.what)
    assert said.doubt
    found, drawn = result.parameters["shaft_stiffness_left"], plant.truth(vehicle)["shaft_stiffness_left"]
    assert found.interval95[0] < 1.25 * drawn < found.interval95[1]
    assert found.std < 0.01 * drawn


@pytest.mark.slow
def test_no_effect_is_named_where_the_log_is_stiffer_than_a_wrong_drawing(root: Path, tmp_path: Path) -> None:
    text = (root / "configs/shaft.yaml").read_text().replace("../sample_logs", str(root / "sample_logs"))
    bar = "sections:\n  left:\n    - {outer_diameter: 31.00 mm, length: 354 mm}\nchannels:"
    (tmp_path / "shaft.yaml").write_text(re.sub(r"sections:.*?channels:", bar, text, flags=re.DOTALL))
    result = execute("shaft", tmp_path / "shaft.yaml").result
    assert result.diagnosis is not None
    assert result.diagnosis.verdict == "adequate"
    stiffness, damping = (result.parameters[f"shaft_{name}_left"] for name in ("stiffness", "damping"))
    assert stiffness.value == pytest.approx(29294, rel=1e-3)
    assert stiffness.std < 0.005 * stiffness.value  # that of the drawing is 20310 N m/rad
    assert damping.std < 0.02 * damping.value
    assert not stiffness.spans


@pytest.mark.slow
def test_backlash_shows_as_more_than_noise() -> None:
    vehicle = random_vehicle(5)
    result = STEP.estimate(spec(runs=RUN), (log(vehicle, 5, backlash=0.003),), Parameters())
    assert [w for w in result.fit.warnings if "backlash" in w]


def test_a_gain_of_the_torque_is_carried_into_both() -> None:
    vehicle = random_vehicle(6)
    on_time = {"torque_delay": 0}
    plain = STEP.estimate(spec(runs=RUN, settings=on_time), (log(vehicle, 6),), Parameters())
    gain = {**on_time, "torque_gain": 0.01}
    doubted = STEP.estimate(spec(runs=RUN, settings=gain), (log(vehicle, 6),), Parameters())
    for name in ("shaft_stiffness_left", "shaft_damping_left"):
        before, after = plain.parameters[name], doubted.parameters[name]
        assert after.std == pytest.approx(np.hypot(before.std, 0.01 * before.value), rel=1e-6)
    assert doubted.parameters.correlation["shaft_stiffness_left"]["shaft_damping_left"] > 0.3


def test_a_slow_twist_leaves_the_damping_undetermined() -> None:
    rng, time = np.random.default_rng(1), np.arange(2000) / 50
    twist = 0.02 * np.sin(0.3 * time)
    slow = Log("twist.csv", time, {
        "shaft_torque": 15_000 * twist + 2 * rng.standard_normal(time.size),
        "twist": twist + 1e-5 * rng.standard_normal(time.size),
    })  # fmt: skip
    result = STEP.estimate(spec(runs=RUN), (slow,), Parameters())
    assert result.parameters["shaft_stiffness_left"].value == pytest.approx(15_000, rel=0.005)
    assert "shaft_damping_left" not in result.parameters
    assert [f for f in result.findings if f.where == "shaft_damping_left" and "not determined" in f.what]


def test_a_torque_that_is_logged_late_is_not_a_damping() -> None:
    """15 kN m/rad read 5 ms late over a twist of 1 Hz."""
    rng, time = np.random.default_rng(1), np.arange(4000) / 200
    late = Log("twist.csv", time, {
        "shaft_torque": 300 * np.sin(2 * np.pi * (time - 0.005)) + 0.5 * rng.standard_normal(time.size),
        "twist": 0.02 * np.sin(2 * np.pi * time) + 1e-6 * rng.standard_normal(time.size),
    })  # fmt: skip
    (doubt,) = [f for f in STEP.estimate(spec(runs=RUN), (late,), Parameters()).findings if "damping" in f.where]
    assert "significantly negative" in doubt.what
    assert doubt.doubt  # no model error detected, but this
    assert "5.0 ms or more after the twist" in doubt.remedy


def test_the_delay_of_the_torque_is_corrected_and_its_uncertainty_carried_into_the_damping() -> None:
    """A torque 1 ms late lowers the damping by k x 1 ms; a delay that is not stated widens the interval."""
    vehicle = random_vehicle(6)
    data = log(vehicle, 6)
    late = data.with_channels(shaft_torque=np.interp(data.time - 1e-3, data.time, data["shaft_torque"]))
    silent = STEP.estimate(spec(runs=RUN), (late,), Parameters())
    (note,) = [f for f in silent.findings if f.where == "shaft_damping_left"]
    assert "0.98 ms late or early" in note.what  # half a sampling interval, 95 %
    assert "torque_delay" in note.remedy
    true = plant.truth(vehicle)["shaft_damping_left"]
    told = STEP.estimate(spec(runs=RUN, settings={"torque_delay": "1 +- 0.1 ms"}), (late,), Parameters())
    damping, plain = told.parameters["shaft_damping_left"], silent.parameters["shaft_damping_left"]
    stiffness = told.parameters["shaft_stiffness_left"].value
    assert plain.std >= 0.45e-3 * stiffness
    assert damping.interval95[0] < true < damping.interval95[1]
    assert damping.value - plain.value == pytest.approx(1e-3 * stiffness, rel=0.1)
    assert damping.std >= 1e-4 * stiffness
    assert not [f for f in told.findings if f.where == "shaft_damping_left"]


def test_what_cannot_serve_is_refused_with_the_line_to_change() -> None:
    data = log(random_vehicle(7), 7)
    still = data.with_channels(shaft_torque=5 + 1.5 * np.random.default_rng(1).standard_normal(data.time.size))
    geared = data.with_channels(motor_speed=3.267 * data["motor_speed"])
    cases = {
        "write 'gear_ratio: 3.267' under settings": geared,
        "add 'sign: -1' to one of the speeds": data.with_channels(wheel_speed=-data["wheel_speed"]),
        "channel 'motor_speed': stays below 2 %": data.with_channels(motor_speed=0 * data["motor_speed"]),
        "channel 'wheel_speed': stays below 2 %": data.with_channels(wheel_speed=0 * data["wheel_speed"]),
        "(?s)twist: the twist falls .* add 'sign: -1' to its channel, or to shaft_torque": data.with_channels(
            shaft_torque=-data["shaft_torque"]
        ),
        "constant within its noise": still,
        "readings in every channel: 200 are needed": data.between(0.0, 0.1),
    }
    for message, bad in cases.items():
        with pytest.raises(InputError, match=message):
            STEP.estimate(spec(runs=RUN), (bad,), Parameters())
    bare = log(random_vehicle(7), 7, ("shaft_torque", "wheel_speed"))
    with pytest.raises(InputError, match="map 'twist', or 'motor_speed' and 'wheel_speed'"):
        STEP.estimate(spec(runs=RUN), (bare,), Parameters())
    with pytest.raises(InputError, match="neither a drawing nor a log"):
        STEP.estimate(spec(), (), Parameters())


def test_a_wheel_that_is_held_is_not_dead() -> None:
    """Wound up against the brakes, the shaft's twist is what its inner end turns."""
    time = np.arange(0.0, 10.0, 0.005)
    rng = np.random.default_rng(1)
    motor = 6.0 * np.sin(9.0 * time)
    twist = 6.0 / 9.0 * (1.0 - np.cos(9.0 * time)) / 3.0
    torque = 3000.0 * twist + 20.0 * motor / 3.0 + rng.normal(0.0, 1.5, time.size)
    held = Log("held.csv", time, {"motor_speed": motor, "wheel_speed": np.zeros(time.size), "shaft_torque": torque})
    assert not speed_ratio_doubts(held, 3.0)


def test_the_gear_ratio_turns_the_motors_speed_into_the_shafts() -> None:
    vehicle = random_vehicle(8)
    data = log(vehicle, 8)
    geared = data.with_channels(motor_speed=3.267 * data["motor_speed"])
    result = STEP.estimate(spec(runs=RUN, settings={"gear_ratio": 3.267}), (geared,), Parameters())
    stiffness = result.parameters["shaft_stiffness_left"]
    assert stiffness.value == pytest.approx(plant.truth(vehicle)["shaft_stiffness_left"], abs=4 * stiffness.std)


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ({"outer_diameter": "30 mm", "inner_diameter": "30 mm", "length": "0.1 m"}, "inner diameter is not smaller"),
        ({"outer_diameter": "30 mm", "inner_diameter": "25 mm", "end_diameter": "24 mm", "length": 0.1}, "not smaller"),
        ({"outer_diameter": "30 m", "length": "0.1 m"}, "physical"),
        ({"outer_diameter": "30 mm"}, "length"),
    ],
)
def test_an_impossible_section_is_refused(section: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        spec(sections={"left": [section]})


def test_the_sample_logs_give_the_truth(root: Path) -> None:
    inputs = gather(STEP, root / "configs" / "shaft.yaml")
    result = STEP.estimate(inputs.spec, inputs.data, inputs.known)
    for name, truth in {"stiffness_left": 29293.7, "stiffness_right": 16576.9, "damping_left": 60.0}.items():
        low, high = result.parameters[f"shaft_{name}"].interval95
        assert low < truth < high
        assert high - low < 0.06 * truth


def test_the_torsion_rod_of_the_example_is_11_7(root: Path) -> None:
    inputs = gather(STEP, root / "configs" / "torsion_rod.yaml")
    result = STEP.estimate(inputs.spec, inputs.data, inputs.known)
    assert result.parameters["shaft_stiffness_left"].value == pytest.approx(11.7, abs=0.05)
    ways = result.extra["stiffness_by"]["left"]
    assert ways["drawing"]["value"] == pytest.approx(11.71, abs=0.005)
    assert ways["bar"]["value"] == pytest.approx(11.67, abs=0.005)


def test_a_drawing_alone_is_not_diagnosed(tmp_path: Path) -> None:
    drawing = "test: shaft\nsections:\n  left:\n    - {outer_diameter: 30 mm, length: 400 mm}\n"
    (tmp_path / "shaft.yaml").write_text(drawing, encoding="utf-8")
    document = execute("shaft", tmp_path / "shaft.yaml").document
    assert document["diagnosis"] is None
    assert "shaft_stiffness_left" in document["parameters"]


@pytest.mark.slow
def test_the_fit_without_effects_is_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    vehicle, fits = random_vehicle(2), []
    monkeypatch.setattr(shaft_side, "linear_solution", lambda runs: fits.append(runs) or linear_solution(runs))
    described = spec(vehicle, runs=RUN, settings={"torque_delay": 0})  # an uncertain one has shifted logs fitted, too
    problem = STEP.prepare(described, (log(vehicle, 2),), Parameters())
    (backlash,) = (e for e in candidates(STEP.situations) if e.name == "backlash")
    for effects in ((), (backlash,)):
        problem.regression(added(*effects))
    problem.publish()
    assert len(fits) == 1


@pytest.mark.slow
@pytest.mark.parametrize(("noise", "count"), [(0.0, 2), (0.4, 1)])
def test_a_free_law_over_a_rate_needs_a_rate_less_noisy_than_its_knots(noise: float, count: int) -> None:
    """Noisy readings choose their knot by their noise: clean logs were then told to lack a law over the rate."""
    vehicle = random_vehicle(2)
    read = log(vehicle, 2, ("shaft_torque", "motor_speed", "wheel_speed"))
    rough = noise * np.random.default_rng(3).standard_normal(read.time.size)
    problem = prepare(spec(runs=RUN), [read.with_channels(motor_speed=read["motor_speed"] + rough)], Parameters())
    assert [len(found) for found in (problem.profiles, problem.parts)] == [count, count]
