"""Channels that are constants, or another channel times constants of the vehicle."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from vdyn_cli.project.execute import execute
from vdyn_cli.project.inputs import Inputs, gather
from vdyn_cli.project.reading.channel_sources import Scaling, with_known_channels
from vdyn_cli.project.reading.input_uncertainty import with_input_uncertainty
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.result import Result
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps import load_step, published
from vdyn_cli.steps.scaled_channel import FORCE_OF_POWER, ScaledChannel

FRICTION, STIFF, SPEED = 1.0, 12.0, 10.0


def sweeps(folder: Path, channels: dict[str, Any], **vehicle: str) -> Path:
    """A tire test with two sweeps of an ordinary tire at 4 kN, with the columns Fx, om, I (Fx = 40 N/A times I)."""
    time = np.arange(0.0, 8.0, 0.02)
    rng = np.random.default_rng(3)
    entries = []
    for k, sign in enumerate((1.0, -1.0)):
        slip = sign * np.interp(time, [0, 8], [0.0, 0.35])
        force = 4000.0 * FRICTION * np.sin(1.6 * np.arctan(STIFF * slip)) + 5.0 * rng.standard_normal(time.size)
        turn = SPEED * (1 + slip) / 0.3 + 0.01 * rng.standard_normal(time.size)
        table = np.column_stack([time, force, turn, force / 40.0])
        np.savetxt(folder / f"sweep_{k}.csv", table, delimiter=",", header="t,Fx,om,I", comments="", fmt="%.5f")
        entries.append({"log": f"sweep_{k}.csv"})
    usual = {
        "time": {"column": "t", "unit": "s"},
        "force_x": {"column": "Fx", "unit": "N"},
        "wheel_speed": {"column": "om", "unit": "rad/s"},
        "force_z": {"constant": "4 kN"},
        "vehicle_speed": {"constant": "36 km/h"},
    }
    mapped = {n: c for n, c in {**usual, **channels}.items() if c}
    description = {"test": "tire", "vehicle": {"wheel_radius": "0.3 m", **vehicle}, "channels": mapped, "runs": entries}
    (folder / "tire.yaml").write_text(yaml.safe_dump(description))
    return folder / "tire.yaml"


def test_a_constant_is_a_channel_of_every_run_in_si(tmp_path: Path) -> None:
    logs = gather(load_step("tire"), sweeps(tmp_path, {})).logs
    assert [set(log["force_z"]) for log in logs] == [{4000.0}, {4000.0}]
    assert np.allclose(logs[0]["vehicle_speed"], 10.0)
    assert len(logs[0]["force_z"]) == len(logs[0].time)


def test_a_step_finds_the_truth_with_constant_channels(tmp_path: Path) -> None:
    found = execute("tire", sweeps(tmp_path, {}), (), None).result.parameters
    assert found["tire_D"].value == pytest.approx(FRICTION, abs=4 * found["tire_D"].std)


@pytest.mark.parametrize(
    ("stated", "expected"),
    [
        ({"constant": "4 t"}, "'t' is not a unit of force (N)"),
        ({"constant": "4e9 N"}, "lies outside"),
        ({"constant": "much"}, "is not a number with a unit"),
        ({"constant": "4 kN", "unit": "N"}, "unknown key 'unit'"),
        ({"column": "Fz"}, "'channels.force_z.unit' is missing"),
    ],
)
def test_a_wrong_constant_is_named_with_its_line(tmp_path: Path, stated: dict[str, str], expected: str) -> None:
    with pytest.raises(InputError) as error:
        gather(load_step("tire"), sweeps(tmp_path, {"force_z": stated}))
    assert expected in str(error.value)
    assert all(f.where.startswith("tire.yaml:") for f in error.value.findings)


def test_the_clock_is_no_constant(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the channel 'time' cannot be a constant"):
        gather(load_step("tire"), sweeps(tmp_path, {"time": {"constant": 1}}))


def test_the_number_1_is_a_unit(tmp_path: Path) -> None:
    slip = {"slip": {"column": "om", "unit": 1}, "wheel_speed": None, "vehicle_speed": None}
    log = gather(load_step("tire"), sweeps(tmp_path, slip)).logs[0]
    assert 30 < np.max(log["slip"]) < 50


def coast(folder: Path, channels: dict[str, Any], **vehicle: str) -> Inputs:
    """Coasts at 1 m/s^2 from 20 m/s, of which om = V / 0.3 m is logged, as read by the step."""
    time = np.arange(0.0, 15.0, 0.1)
    np.savetxt(
        folder / "coast.csv",
        np.column_stack([time, (20.0 - time) / 0.3 * 30 / np.pi]),
        delimiter=",",
        header="t,rpm",
        comments="",
    )
    mapped = {"time": {"column": "t", "unit": "s"}, "wheel_speed": {"column": "rpm", "unit": "rpm"}, **channels}
    mapped = {n: c for n, c in mapped.items() if c}
    known = {"mass": "1500 kg", "air_density": 1.2, **vehicle}
    description = {"test": "coastdown", "vehicle": known, "channels": mapped, "runs": [{"log": "coast.csv"}]}
    (folder / "coast.yaml").write_text(yaml.safe_dump(description))
    return gather(load_step("coastdown"), folder / "coast.yaml")


def test_the_speed_of_a_coast_is_that_of_a_wheel_times_its_radius(tmp_path: Path) -> None:
    found = coast(tmp_path, {}, wheel_radius="0.3 +- 0.001 m")
    assert found.logs[0]["speed"][0] == pytest.approx(20.0)
    (note,) = [f for f in found.findings if f.where == "speed"]
    assert "wheel_speed times wheel_radius 0.3 +- 0.001 m" in note.what
    assert "slip" in note.what


def test_a_radius_without_a_standard_deviation_is_taken_as_exact_and_said_to_be(tmp_path: Path) -> None:
    (note,) = [f for f in coast(tmp_path, {}, wheel_radius="0.3 m").findings if f.where == "speed"]
    assert "taken as exact" in note.what
    assert "wheel_radius: 0.3 +- <standard deviation> m" in note.remedy


def test_a_wheel_speed_without_a_radius_asks_for_it(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"channel 'speed' from wheel_speed: wheel_radius .* is needed"):
        coast(tmp_path, {})


def test_without_speed_and_wheel_speed_both_ways_are_offered(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="or map 'wheel_speed' and give wheel_radius"):
        coast(tmp_path, {"wheel_speed": None})


def test_a_wheel_speed_beside_a_speed_is_not_used_and_said_so(tmp_path: Path) -> None:
    speed = {"speed": {"column": "t", "unit": "m/s"}}
    found = coast(tmp_path, speed, wheel_radius="0.3 m").findings
    assert any("'wheel_speed' is not used" in f.what for f in found)


def test_the_uncertainty_of_a_constant_is_in_the_intervals_as_a_scale(tmp_path: Path) -> None:
    """A force computed as current times a constant known to 2 %: D has that error, B and C do not."""
    tire = load_step("tire")
    by_current = ScaledChannel("force_x", "motor_current", ("torque_constant",), "A force by a current.")
    step = replace(tire, scaled=(by_current,))
    current = {"force_x": None, "motor_current": {"column": "I", "unit": "A"}}
    inputs = gather(step, sweeps(tmp_path, current, torque_constant="40 +- 0.8 N m/A"))
    result = published(step.prepare(inputs.spec, inputs.data, inputs.known))
    assert isinstance(result, Result)
    wider = with_input_uncertainty(result, inputs)
    before, after = result.parameters["tire_D"], wider.parameters["tire_D"]
    assert after.value == before.value
    assert after.std == pytest.approx(np.hypot(before.std, 0.02 * before.value), rel=0.02)
    half = 0.5 * (after.interval95[1] - after.interval95[0])
    assert half == pytest.approx(1.96 * 0.02, rel=0.1)
    assert wider.sentence.startswith("The tire's peak friction is 1.000 (95 %: 0.961 to 1.039)")
    assert "include the uncertainty of torque_constant" in wider.sentence
    b = result.parameters["tire_B"], wider.parameters["tire_B"]
    assert b[1].std == pytest.approx(b[0].std, rel=0.05)


def test_the_gear_ratio_of_the_settings_is_that_of_a_torque_by_current(tmp_path: Path) -> None:
    """The shaft's torque is 9 times that of the motor, whose speed is logged, too."""
    rows = np.column_stack([np.arange(400) * 0.005, np.full(400, 10.0), np.full(400, 90.0), np.full(400, 10.0)])
    np.savetxt(tmp_path / "tip.csv", rows, delimiter=",", header="t,I,motor,wheel", comments="", fmt="%.5f")
    units = {"time": ("t", "s"), "motor_current": ("I", "A"), "motor_speed": ("motor", "rad/s")}
    channels = {n: {"column": c, "unit": u} for n, (c, u) in {**units, "wheel_speed": ("wheel", "rad/s")}.items()}
    description = {"test": "shaft", "channels": channels, "runs": [{"log": "tip.csv", "side": "left"}]}
    vehicle = {"vehicle": {"torque_constant": "0.35 N m/A"}, "settings": {"gear_ratio": 9}}
    (tmp_path / "shaft.yaml").write_text(yaml.safe_dump({**description, **vehicle}))
    inputs = gather(load_step("shaft"), tmp_path / "shaft.yaml")
    assert np.allclose(inputs.logs[0]["shaft_torque"], 10.0 * 0.35 * 9)
    assert any("gear_ratio 9" in f.what for f in inputs.findings)


def test_a_power_per_speed_is_a_force_where_the_vehicle_is_fast_enough() -> None:
    speed = np.array([0.0, 1.9, 2.5, 10.0])
    log = Log("ride.csv", np.arange(4.0), {"speed": speed, "drive_power": np.full(4, 200.0)})
    efficiency = Estimate.given(PARAMETERS["driveline_efficiency"], 0.95, 0.01)
    power = Scaling(FORCE_OF_POWER, {"driveline_efficiency": efficiency})
    force = with_known_channels(log, {}, [power])["drive_force"]
    assert np.isnan(force[:2]).all()
    assert force[2:] == pytest.approx([76.0, 19.0])
    assert power.note().what.startswith("is drive_power times driveline_efficiency 0.95 +- 0.01, per speed")
