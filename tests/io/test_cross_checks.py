"""Channels that measure the same motion are compared; values impossible for a vehicle are refused."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.descriptions import described
from vdyn_cli.commands.run_step import write_step
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.io.file_units import contradiction
from vdyn_cli.io.quality.cross_checks import with_cross_checks
from vdyn_cli.io.reader import Column
from vdyn_cli.project.inputs import gather
from vdyn_cli.project.result_document import to_json
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import FORMAT, Estimate, Parameters, to_document
from vdyn_cli.steps import load_step

TIME = np.arange(0.0, 30.0, 0.02)
SPEED = 15.0 + 5.0 * np.sin(0.6 * TIME)
CHANNELS = {
    "speed": SPEED,
    "position": np.cumsum(SPEED) * 0.02,
    "acceleration": 3.0 * np.cos(0.6 * TIME),
}


def log(**scales: float) -> Log:
    noise = np.random.default_rng(0)
    values = {n: scales.get(n, 1.0) * v + 0.02 * noise.standard_normal(v.size) for n, v in CHANNELS.items()}
    return Log("a.csv", TIME, values)


def test_channels_that_agree_say_nothing() -> None:
    assert not with_cross_checks(log()).findings
    sloping = log().with_channels(acceleration=CHANNELS["acceleration"] + 0.3)
    assert not with_cross_checks(sloping).findings


@pytest.mark.parametrize("channel", ["speed", "position", "acceleration"])
def test_a_scale_a_tenth_off_is_noticed_and_another_unit_refused(channel: str) -> None:
    assert with_cross_checks(log(**{channel: 1.1})).findings
    with pytest.raises(InputError, match="contradict each other"):
        with_cross_checks(log(**{channel: 1.609}))


def test_a_position_from_a_column_of_speed_is_one_mistake() -> None:
    column = Column("Speed [km/h]", "m", si_unit="m")
    wrong = replace(log(position=3.6), findings=(contradiction("a.csv", "position", column, "km/h"),))
    with pytest.raises(InputError, match=r"^[^\n]*another unit 'km/h'\n    -> map 'position' to its own column[^\n]*$"):
        with_cross_checks(wrong)


def test_distance_is_compared_up_to_the_last_sample() -> None:
    assert not with_cross_checks(log(speed=0.975)).findings
    assert with_cross_checks(log(speed=0.965)).findings


def test_the_sign_of_an_accelerometer_mounted_backwards_is_reported() -> None:
    with pytest.raises(InputError, match="add 'sign: -1' to the channel acceleration"):
        with_cross_checks(log(acceleration=-1.0))


def wheels(**readings: np.ndarray) -> Log:
    turning = SPEED / 0.31
    every = {f"wheel_speed_{w}": readings.get(w, turning) for w in ("fl", "fr", "rl", "rr")}
    return Log("a.csv", TIME, every)


def test_wheels_of_an_axle_that_turn_alike_say_nothing() -> None:
    bend = np.where((TIME > 5) & (TIME < 6), 1.3, 1.0)
    assert not with_cross_checks(wheels(fr=SPEED / 0.31 * 1.004 * bend)).findings


@pytest.mark.parametrize(
    ("reading", "says"),
    [
        (1.02 * SPEED / 0.31, "wheel_speed_rl is 0.980 times wheel_speed_rr"),
        (np.where(TIME < 20, SPEED / 0.31, 70.0), "wheel_speed_rl and wheel_speed_rr differ by more than 20 %"),
    ],
)
def test_a_wheel_speed_that_is_wrong_is_a_fault_of_the_data(reading: np.ndarray, says: str) -> None:
    (finding,) = with_cross_checks(wheels(rr=reading)).findings
    assert finding.what.startswith(says)
    assert finding.fault
    assert finding.doubt


@pytest.mark.parametrize(
    ("step", "changes", "says"),
    [
        ("coastdown", [("unit: km/h", "unit: mph")], r"contradict each other(.|\n)*km/h read as mph"),
        ("cg", [("unit: N}", "unit: kN}")], "lies outside"),
        ("cg", [("FL Fz", "X"), ("RL Fz", "FL Fz"), ("X", "RL Fz"), ("FR Fz", "X"), ("RR Fz", "FR Fz"), ("X", "RR Fz")],
         "swap the columns"),
        ("cg", [("launch_2.csv", "launch_1.csv")], "listed twice"),
        ("cg", [("unit: m/s^2", "unit: g")], "contradict each other|lies outside"),
    ],
)  # fmt: skip
def test_a_wrong_description_of_good_logs_is_refused(
    step: str, changes: list[tuple[str, str]], says: str, tmp_path: Path, root: Path
) -> None:
    with pytest.raises(InputError, match=says) as refused:
        write_step(step, described(tmp_path, root, step, *changes), (), tmp_path / "out", None)
    assert len({finding.remedy.partition("{")[0] for finding in refused.value.findings}) == 1  # one cause


def test_a_speed_that_stood_still_is_reported_beside_what_it_contradicts() -> None:
    stuck = Finding(
        "a.csv, column 'V'", "holds one value all through: sensor failed or not connected", fault=True, doubt=True
    )
    still = replace(log(), findings=(stuck,)).with_channels(speed=np.full(TIME.size, 12.0))
    with pytest.raises(InputError) as refused:
        with_cross_checks(still)
    assert stuck in refused.value.findings
    assert not any("sign" in f.remedy for f in refused.value.findings)


def test_a_shaft_torque_that_reads_nothing_beside_one_that_does_did_not_measure() -> None:
    torque, nothing = 200.0 * np.sin(TIME), np.zeros(TIME.size)
    found = log().with_channels(shaft_torque_left=nothing, shaft_torque_right=torque)
    (finding,) = with_cross_checks(found).findings
    assert finding.fault
    assert finding.what.startswith("shaft_torque_left is 0 in the whole log and shaft_torque_right is not")
    for left in (torque, nothing):  # both measure, or neither
        assert not with_cross_checks(log().with_channels(shaft_torque_left=left, shaft_torque_right=left)).findings


@pytest.mark.slow
def test_loads_that_are_not_the_weight_are_doubted_and_those_of_a_wheel_too_many_refused(
    tmp_path: Path, root: Path
) -> None:
    given = (root / "configs" / "vehicle.yaml").read_text()
    path = described(tmp_path, root, "cg")
    path.write_text(path.read_text().replace(str(root / "configs" / "vehicle.yaml"), "vehicle.yaml"))
    (tmp_path / "vehicle.yaml").write_text(given.replace("mass: 1588 +- 2 kg ", "mass: 1400 kg "))
    warnings = write_step("cg", path, (), tmp_path / "out", None).result.fit.warnings
    assert re.search(r"the axles carry 13\.. % more", warnings[0])
    (tmp_path / "vehicle.yaml").write_text(given.replace("mass: 1588 +- 2 kg ", "mass: 1250 kg "))
    with pytest.raises(InputError, match=r"the axles carry 27\.. % more"):
        write_step("cg", path, (), tmp_path / "out", None)


@pytest.mark.slow
def test_a_doubt_is_reported_before_anything_else(root: Path, tmp_path: Path) -> None:
    """A scale that is wrong by some percent is absorbed by the fit and not detected; the result is still doubtful."""
    text = (root / "configs" / "coastdown.yaml").read_text().replace("../sample_logs", str(root / "sample_logs"))
    text = text.replace("vehicle: vehicle.yaml", f"vehicle: {root / 'configs' / 'vehicle.yaml'}")
    text = text.replace('{column: "Position [m]", unit: m}', '{column: "Position [m]", unit: m, scale: 0.9144}')
    assert "scale: 0.9144" in text
    description = tmp_path / "scaled.yaml"
    description.write_text(f"{text}diagnose: {{effects: [headwind, road_grade]}}\n")
    outcome = write_step("coastdown", description, (), tmp_path, POLICY.level)
    (warning,) = [w for w in outcome.result.fit.warnings if "contradict" in w]
    assert "coast_1.csv and 7 more" in warning
    assert outcome.document["diagnosis"]["doubt"]
    page = (tmp_path / "coastdown.html").read_text(encoding="utf-8")
    assert 'class="verdict good"' not in page


def known_mass(value: float, source: str = "cg") -> str:
    entry = {"value": value, "std": 2.0, "interval95": [value - 4.0, value + 4.0], "unit": "kg", "source": source}
    entry["meaning"] = "mass"
    return json.dumps({"format": FORMAT, "parameters": {"mass": entry}})


def test_a_value_that_a_parameter_file_contradicts_is_reported(tmp_path: Path, root: Path) -> None:
    """A parameter file has priority over the description; a contradiction between the two is reported."""
    described(tmp_path, root, "coastdown")
    text = (tmp_path / "coastdown.yaml").read_text()
    (tmp_path / "parameters.json").write_text(known_mass(1636.0))
    (tmp_path / "coastdown.yaml").write_text(text)
    found = gather(load_step("coastdown"), tmp_path / "coastdown.yaml", [tmp_path / "parameters.json"]).findings
    assert [f.what for f in found] == [
        "mass = 1588 kg is not used: a --known file of the step 'cg' gives 1636 kg, 17 standard deviations away"
    ]
    (tmp_path / "parameters.json").write_text(known_mass(1589.0))
    assert not gather(load_step("coastdown"), tmp_path / "coastdown.yaml", [tmp_path / "parameters.json"]).findings


def test_a_value_that_an_earlier_description_gave_does_not_replace_a_stated_one(tmp_path: Path, root: Path) -> None:
    described(tmp_path, root, "coastdown")
    (tmp_path / "parameters.json").write_text(known_mass(1636.0, "given"))
    inputs = gather(load_step("coastdown"), tmp_path / "coastdown.yaml", [tmp_path / "parameters.json"])
    assert inputs.known["mass"].value == 1588.0
    assert not inputs.findings


def test_a_file_that_knows_effects_alone_is_taken(tmp_path: Path, root: Path) -> None:
    """A validation publishes no parameters but names the effect that it found."""
    described(tmp_path, root, "coastdown")
    play = Estimate(1e-3, 2e-5, (9.6e-4, 1.04e-3), "rad", "free play", "backlash")
    found = Parameters(extensions={"backlash": {"backlash": play}})
    path = tmp_path / "validate.json"
    path.write_text(to_json({"format": FORMAT, **to_document(found)}), encoding="utf-8")
    known = gather(load_step("coastdown"), tmp_path / "coastdown.yaml", [path]).known
    assert known.extensions == found.extensions
    assert "mass" in known


def test_an_accelerometer_that_pitches_with_the_body_may_read_more_than_the_speed_tells() -> None:
    """A share of gravity in proportion to the acceleration: what the setting ``accelerometer: body`` declares."""
    push = 3.0 * np.sin(2 * np.pi * TIME / 8)
    speed = 20.0 + np.concatenate([[0.0], np.cumsum(np.diff(TIME) * (push[1:] + push[:-1]) / 2)])
    log = Log("run.csv", TIME, {"speed": speed, "acceleration": 1.08 * push})
    assert with_cross_checks(log).findings
    assert not with_cross_checks(log, tilts=True).findings


@pytest.mark.parametrize(("seed", "gain", "told"), [(1, 1.0, False), (2, 1.0, False), (3, 1.0, False), (1, 1.3, True)])
def test_noise_of_a_speed_that_hardly_changes_is_no_wrong_scale(seed: int, gain: float, told: bool) -> None:
    """A torque that alternates once a second changes the speed within its second, and hardly between seconds."""
    rng, turning = np.random.default_rng(seed), 2 * np.pi * 0.9
    acceleration = 2.0 * np.cos(turning * TIME) + 0.2 * np.cos(0.8 * TIME)
    speed = 14.0 + 2.0 / turning * np.sin(turning * TIME) + 0.25 * np.sin(0.8 * TIME) + rng.normal(0, 0.05, TIME.size)
    log = with_cross_checks(Log("wheel.csv", TIME, {"speed": speed, "acceleration": gain * acceleration}), refuse=False)
    assert any("contradict each other" in finding.what for finding in log.findings) == told


def test_a_constant_channel_has_no_scale() -> None:
    """A position that did not move ended as a division by zero; its own finding says that it is constant."""
    still = log().with_channels(position=np.full(TIME.size, 3.0))
    assert not with_cross_checks(still).findings
