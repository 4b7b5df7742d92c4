"""The exported C compiles without warnings and gives the results of the Python model."""

from __future__ import annotations

import re
import subprocess

import numpy as np
import pytest

from tests.engine.c_host import Compiled, build
from tests.export.cases import (
    BRAKE_DRAG,
    HEADWIND,
    LEARNED,
    LEARNED_LAW,
    LEARNED_SIZES,
    SPEED_SCALE,
    given,
    simulated,
    stop_and_go,
)
from vdyn_cli.effects import catalog
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.export import ExportOptions, make
from vdyn_cli.export.exported_vehicle import exported_vehicle
from vdyn_cli.physics.models.vehicle import vehicle


def test_the_worked_example_compiles_without_a_warning_and_runs(tmp_path):
    made = make(given(tmp_path), "c", ExportOptions("car"))
    assert list(made.files) == ["car.h", "car.c", "car_main.c"]
    for name, data in made.files.items():
        (tmp_path / name).write_bytes(data)
    program = build(tmp_path, ["car.c", "car_main.c"], "car")
    done = subprocess.run([program], capture_output=True, text=True, check=True)
    header, *rows = done.stdout.splitlines()
    assert header == "time_s,drive_torque_Nm,speed_mps,shaft_torque_left_Nm,jerk_mps3"
    speed = np.array([float(row.split(",")[2]) for row in rows])
    assert speed[:10] == pytest.approx(0.0, abs=1e-9)
    assert 4.0 < speed.max() < 7.0
    assert abs(speed[-1]) < 0.01
    text = b"".join(made.files.values()).decode()
    assert not re.search(r"\b(malloc|calloc|realloc)\b", text)
    assert set(re.findall(r"#include (\S+)", text)) == {"<math.h>", "<stdio.h>", '"car.h"'}


@pytest.mark.parametrize(
    ("driven", "differential", "speed"),
    [
        ("front", "open", 0.0),
        pytest.param("rear", "open", 0.0, marks=pytest.mark.slow),
        ("both", "open", 11.0),
        ("front", "locked", 0.0),
    ],
)
def test_c_has_the_bits_of_python_through_standstill_and_braking(tmp_path, driven, differential, speed):
    car = exported_vehicle(given(tmp_path), driven, differential)
    assert f"Driven: {driven}, {differential} differential" in car.program("car", "a car").source
    compiled = Compiled(car.program("car", "a car"), tmp_path)
    time, inputs = stop_and_go()
    got = compiled.simulate(time, inputs, compiled.defaults(), (speed,))
    expected = simulated(car, time, inputs, speed)
    assert list(got) == list(expected)
    for name, values in expected.items():
        np.testing.assert_array_equal(got[name], values, err_msg=name)
    assert expected["speed"].max() > 5.0
    assert abs(expected["speed"][-1]) < 0.05  # the brakes hold it on the slope


def test_an_accepted_effect_is_in_the_model_and_a_sensor_fault_is_not(tmp_path):
    plain = exported_vehicle(given(tmp_path), "front")
    car = exported_vehicle(given(tmp_path, causes=[BRAKE_DRAG, SPEED_SCALE, HEADWIND]), "front")
    assert [one.effect for one in car.accepted] == ["brake_drag"]
    assert "excluded speed_scale: a sensor fault, not a vehicle property" in car.notes
    assert "excluded headwind: it is a property of the test day, not of the vehicle" in car.notes
    program = car.program("car", "a car")
    assert "brake_drag" in program.parameters
    assert "speed_scale" not in program.parameters
    compiled = Compiled(program, tmp_path)
    assert compiled.defaults()["brake_drag"] == 38.0
    time, inputs = stop_and_go(5.0)
    got = compiled.simulate(time, inputs, compiled.defaults(), (0.0,))
    np.testing.assert_array_equal(got["speed"], simulated(car, time, inputs, 0.0)["speed"])
    freed = compiled.simulate(time, inputs, {**compiled.defaults(), "brake_drag": 0.0}, (0.0,))
    without = simulated(plain, time, inputs, 0.0)["speed"]
    np.testing.assert_array_equal(freed["speed"], without)
    assert got["speed"][-1] < without[-1] - 0.01


@pytest.mark.parametrize("verdict", ["adequate", "ambiguous", "unknown"])
def test_an_effect_that_was_not_named_stays_out(tmp_path, verdict):
    assert exported_vehicle(given(tmp_path, causes=[BRAKE_DRAG], verdict=verdict), "front").accepted == ()


def test_an_effect_that_the_vehicle_does_not_know_is_left_out_and_said(tmp_path):
    strange = {"effect": "full_moon", "unknowns": {"tide": {"value": 1.0}}}
    car = exported_vehicle(given(tmp_path, causes=[strange]), "front")
    assert car.accepted == ()
    assert "excluded full_moon: not an effect of this version" in car.notes


def test_defaults_are_the_estimates_and_comments_say_what_was_assumed(tmp_path):
    car = exported_vehicle(given(tmp_path), "front")
    program = car.program("car", "a car")
    assert Compiled(program, tmp_path).defaults()["mass"] == 1430.0
    assert "double mass; /* kg, vehicle mass as tested */" in program.header
    assert re.search(r"double brake_share_front; /\* .*assumed: .*\*/", program.header)
    for name in (*program.states, *program.inputs, *program.parameters, *program.outputs):
        assert re.search(rf"double {name}; /\* \S+.*, \S+", program.header), name


def test_extensions_that_an_earlier_step_left_are_in_the_model(tmp_path):
    car = exported_vehicle(
        given(tmp_path, extensions={"brake_drag": {"brake_drag": 21.0}}, verdict="adequate"), "front"
    )
    assert car.values["brake_drag"] == 21.0
    assert "included brake_drag: brake_drag = 21 N" in car.notes


def test_a_learned_law_is_in_the_c_model_with_the_bits_of_python(tmp_path):
    plain = exported_vehicle(given(tmp_path), "front")
    learned = given(tmp_path, extensions={LEARNED: LEARNED_SIZES}, laws={LEARNED: LEARNED_LAW}, verdict="adequate")
    car = exported_vehicle(learned, "front")
    assert [one.effect for one in car.accepted] == [LEARNED], car.notes
    compiled = Compiled(car.program("car", "a car"), tmp_path)
    time, inputs = stop_and_go(5.0)
    got = compiled.simulate(time, inputs, compiled.defaults(), (0.0,))
    np.testing.assert_array_equal(got["speed"], simulated(car, time, inputs, 0.0)["speed"])
    assert got["speed"][-1] < simulated(plain, time, inputs, 0.0)["speed"][-1] - 0.01


def test_every_effect_that_lasts_can_be_exported(tmp_path):
    lasting = [effect for effect in applicable(vehicle("front"), catalog()) if effect.lasts]
    assert len(lasting) > 5
    sizes = {
        effect.name: {
            name: effect.nominal.get(name, 0.02 * quantity.upper) for name, quantity in effect.unknowns.items()
        }
        for effect in lasting
    }
    car = exported_vehicle(given(tmp_path, extensions=sizes), "front")
    assert [one.effect for one in car.accepted] == [effect.name for effect in lasting]
    compiled = Compiled(car.program("car", "a car"), tmp_path)
    time, inputs = stop_and_go(3.0)
    got = compiled.simulate(time, inputs, compiled.defaults(), (0.0,))
    for name, values in simulated(car, time, inputs, 0.0).items():
        np.testing.assert_array_equal(got[name], values, err_msg=name)
