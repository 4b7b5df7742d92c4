"""The gears of a logged engine speed, and the engine's inertia through them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.plant.geared_drive import Array, Car, drives
from vdyn_cli.effects import catalog
from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.physics.models.road_load import ENGINE_TURNS, road_load
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.diagnosis import Diagnosis
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.drives.engine_turns import with_engine_turns, without_engine_share
from vdyn_cli.steps.validate.drives.ratio_changes import ratio_changes

CAR = Car()
TURNS = [g * CAR.final / CAR.radius for g in CAR.gears]  # rad/m
EVERY = 5  # samples of the plant to one of the log: 20 Hz


def as_log(name: str, drive: Mapping[str, Array]) -> Log:
    rng = np.random.default_rng(3)
    time, speed, engine = (drive[n][::EVERY] for n in ("time", "speed", "engine"))
    read = {"speed": np.round(3.6 * speed + rng.normal(0, 0.05, time.size), 1) / 3.6}
    read["motor_speed"] = engine + rng.normal(0.0, 0.2, time.size)
    read |= {"drive_torque": drive["torque"][::EVERY], "brake_torque": np.zeros(time.size)}
    return Log(name, time, read, ())


@pytest.fixture(scope="module")
def logs() -> list[Log]:
    return [as_log(f"drive_{k}", one) for k, one in enumerate(drives(CAR, 1, 2, 45.0))]


def test_each_gear_has_its_angle_per_distance_and_a_slipping_clutch_none(logs: list[Log]) -> None:
    found = with_engine_turns(logs)
    every, speed = (np.concatenate([log[n] for log in found]) for n in (ENGINE_TURNS, "speed"))
    assert np.unique(every[every > 0.0])[::-1] == pytest.approx(TURNS, rel=0.005)
    assert not every[speed * TURNS[0] < 0.85 * 850 * np.pi / 30].any()
    engine = np.concatenate([log["motor_speed"] for log in found])
    in_gear = np.min(np.abs(engine[speed > 4.0, None] / speed[speed > 4.0, None] / TURNS - 1.0), axis=1) < 0.02
    assert (every[speed > 4.0][in_gear] > 0.0).mean() > 0.98


@pytest.mark.parametrize("ratio", ["one", "continuous"])
def test_one_ratio_or_a_continuous_one_has_no_gears(logs: list[Log], ratio: str) -> None:
    def turned(log: Log) -> Array:
        free = 120.0 + 60.0 * np.sin(0.3 * log.time)
        return log["speed"] * TURNS[1] if ratio == "one" else np.maximum(free, log["speed"])

    other = [log.with_channels(motor_speed=turned(log)) for log in logs]
    assert not any(ENGINE_TURNS in log for log in with_engine_turns(other))


def test_the_engine_takes_its_share_of_the_force_by_the_square_of_its_angle_per_distance() -> None:
    inertia, force, mass = 0.2, 1500.0, 1300.0
    time = np.arange(0.0, 10.001, 0.05)
    turns = np.where(time < 5.0, 40.0, 20.0)
    (one,) = (e for e in catalog() if e.name == "engine_inertia")
    values = {"mass": 1240.0, "rotating_mass": 60.0, "gear_ratio": 4.0, "wheel_radius": 0.3}
    values |= dict.fromkeys(("driveline_efficiency", "recuperation_loss", "air_density"), 1.0)
    model = road_load("torque", geared=True)
    values = dict.fromkeys(model.parameters, 0.0) | values | {"engine_inertia": inertia}
    inputs = {"grade": 0.0, "wind_speed": 0.0, "elapsed": time, "drive_torque": np.full(time.size, force * 0.3 / 4.0)}
    context = {"heading": 1.0, "temperature": 293.0}
    drive = Drive(time, {**inputs, ENGINE_TURNS: turns}, {"speed": 1.0}, {}, context)
    speed = Simulator(model, values, (), (one,))(drive, []).outputs["speed"]
    first, second = (force / (mass + inertia * n**2) for n in (40.0, 20.0))
    assert speed[time < 4.9] == pytest.approx(1.0 + first * time[time < 4.9], rel=1e-6)
    assert np.diff(speed)[105:] == pytest.approx(0.05 * second, rel=1e-6)


@pytest.mark.slow
def test_an_engine_s_share_of_the_torque_is_no_other_gear_of_the_torque() -> None:
    """Nor is a share taken from a torque of the engine itself, which accelerates the car more in a lower gear."""
    heavy = [as_log(f"drive_{k}", one) for k, one in enumerate(drives(replace(CAR, engine=0.4), 2, seconds=140.0))]
    known = with_engine_turns(heavy)
    net = without_engine_share([(log.time, log.channels, log["drive_torque"]) for log in known])
    assert not any(change.spans for change in ratio_changes(net))
    taken = np.concatenate([log["drive_torque"] - torque for log, (_, _, torque) in zip(known, net, strict=True)])
    assert taken.max() > 20.0
    ratios = [np.maximum(log[ENGINE_TURNS] * CAR.radius / CAR.final, 1.0) for log in known]
    of_engine = [(log.time, log.channels, log["drive_torque"] / i) for log, i in zip(known, ratios, strict=True)]
    for (_, _, torque), (_, _, before) in zip(without_engine_share(of_engine), of_engine, strict=True):
        assert np.array_equal(torque, before)


def diagnosed(folder: Path, car: Car, seed: int) -> Diagnosis:
    rng = np.random.default_rng(seed)
    lines = []
    for k, one in enumerate(drives(car, seed)):
        time, torque, speed, engine = (one[n][::EVERY] for n in ("time", "torque", "speed", "engine"))
        read = [
            *(time, np.round(torque + rng.normal(0, 0.3, time.size), 1)),
            *(np.round(3.6 * speed + rng.normal(0, 0.05, time.size), 1), np.round(engine * 30 / np.pi)),
        ]
        head = "t [s],T [N m],v [km/h],Engine [rpm]"
        np.savetxt(folder / f"drive_{k}.csv", np.column_stack(read), "%.2f", ",", header=head, comments="")
        lines.append(f"  - {{log: drive_{k}.csv, direction: {'back' if k % 2 else 'out'}}}")
    text = f"""
test: validate
vehicle:
  mass: {car.mass} +- 4 kg
  rotating_mass: {car.wheels / car.radius**2:.1f} +- 6 kg
  wheel_radius: {car.radius} +- 0.001 m
  gear_ratio: {car.final}
  driveline_efficiency: {car.efficiency} +- 0.005
  rolling_resistance: {car.rolling} +- 0.0002
  drag_area: {car.drag_area} +- 0.012 m^2
  air_density: {car.density} kg/m^3
channels:
  time: {{column: "t [s]", unit: s}}
  drive_torque: {{column: "T [N m]", unit: N m}}
  speed: {{column: "v [km/h]", unit: km/h}}
  motor_speed: {{column: "Engine [rpm]", unit: rpm}}
runs:
{chr(10).join(lines)}
settings: {{model: road_load, driven: front}}
"""
    (folder / "validate.yaml").write_text(text, encoding="utf-8")
    found = execute("validate", folder / "validate.yaml").result.diagnosis
    assert found is not None
    return found


@pytest.mark.slow
def test_an_engine_that_the_model_lacks_is_found_with_its_inertia(tmp_path: Path) -> None:
    (cause,) = diagnosed(tmp_path, CAR, 11).causes
    assert cause.effect == "engine_inertia"
    size = cause.unknowns["engine_inertia"]
    assert size.value == pytest.approx(CAR.engine, rel=0.05)
    low, high = size.interval95
    assert high - low < 0.1 * CAR.engine


@pytest.mark.slow
@pytest.mark.thorough
def test_a_torque_measured_behind_the_engine_s_inertia_is_without_it(tmp_path: Path) -> None:
    assert not diagnosed(tmp_path, replace(CAR, engine=0.0), 12).causes
