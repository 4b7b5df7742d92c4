"""Causes hidden in coast-down logs, through the command as a tester runs it: found, named, sized, or honestly refused.

The whole matrix of causes, vehicles and campaigns is a command under tests/bench; these few cases keep watch.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

from tests.bench import cases
from tests.bench.hidden_logs import damage
from tests.plant import coast
from tests.plant.hidden import WARM
from tests.plant.sensors import ACCELEROMETER
from tests.plant.vehicle import AIR_DENSITY, GRAVITY, random_vehicle
from vdyn_cli.cli import app
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.reader import Column
from vdyn_cli.quantities.parameter_json import read_document

SEED = 1
EIGHT = coast.WIDE.but(rate=5.0)
MILD_TO_WARM = WARM.but(rate=5.0, runs=10, temperatures=(12.0, 15.0, 18.0, 22.0, 26.0, 28.0, 25.0, 20.0, 16.0, 12.0))

TIMED = {"time": Column("Time [s]", "s", "s"), "speed": Column("GPS Speed [km/h]", "km/h", "m/s")}


def described(folder: Path, effects: Mapping[str, float], day: coast.Day = EIGHT, **more: Any) -> Path:
    """Logs with effects hidden in them and their description, the position not mapped."""
    path = cases.coast_downs(random_vehicle(SEED), SEED, folder, day, False, effects)
    description = yaml.safe_load(path.read_text(encoding="utf-8"))
    del description["channels"]["position"]
    path.write_text(yaml.safe_dump({**description, **more}), encoding="utf-8")
    return path


def vdyn(*arguments: object) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a command."""
    done = CliRunner().invoke(app, [str(a) for a in arguments])
    code = done.exit_code
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        code = getattr(done.exception, "exit_code", 70)
        return code, done.stdout, str(done.exception)
    return code, done.stdout, done.stderr


def document(path: Path, *options: str) -> dict[str, Any]:
    code, text, error = vdyn("coastdown", path, "-o", "-", "-q", *options)
    assert code == 0, error
    found: dict[str, Any] = json.loads(text)
    return found


@pytest.fixture(scope="module")
def windy(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], str, Path]:
    """A day of headwind through the command, run once: the document, the printed result, and the folder of results."""
    folder = tmp_path_factory.mktemp("windy")
    code, shown, error = vdyn("coastdown", described(folder, {"headwind": 2.0}), "-o", folder / "out")
    assert code == 0, error
    assert "note: " in error
    assert "note: " not in shown
    return json.loads((folder / "out" / "coastdown.json").read_text(encoding="utf-8")), shown, folder / "out"


HIDDEN = {
    "headwind": ({"headwind": 2.0}, EIGHT),
    "a slope": ({"road_grade": 0.002}, EIGHT),
    "tires warming up": ({"tire_warmup": 0.3}, EIGHT),
    "warm air": ({"temperature_rolling": 0.008}, MILD_TO_WARM),
    # Eight coasts leave only 2.8 standard errors between it and brakes that let go within a time nobody knows.
    "rolling with speed": ({"speed_dependent_rolling": 2e-4}, EIGHT.but(runs=16)),
    "wind and warm-up": ({"headwind": 2.0, "tire_warmup": 0.45}, EIGHT),
}
SLOW, THOROUGH = [pytest.mark.slow], [pytest.mark.slow, pytest.mark.thorough]
OFTEN = {"headwind": [], "tires warming up": SLOW}


@pytest.mark.parametrize("case", [pytest.param(case, marks=OFTEN.get(case, THOROUGH)) for case in HIDDEN])
def test_what_is_hidden_is_named_with_its_size_and_gains_on_held_out_runs(
    case: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    effects, day = HIDDEN[case]
    shared = case == "headwind"
    made = request.getfixturevalue("windy")[0] if shared else document(described(tmp_path, effects, day))
    told = made["diagnosis"]
    assert told["verdict"] == "named"
    assert {c["effect"] for c in told["causes"]} == set(effects) == set(told["extended"])
    for found in told["causes"]:
        low, high = found["unknowns"][found["effect"]]["interval95"]
        assert low < effects[found["effect"]] < high
        assert found["p_value"] <= 0.05
    gain = told["gain"]
    assert gain["held_out"] is True
    assert gain["after"] < gain["before"]
    assert gain["interval95"][0] < gain["before"] - gain["after"] < gain["interval95"][1]
    truth = coast.truth(random_vehicle(SEED))
    for name, value in truth.items():
        entry = made["parameters"][name]
        assert abs(entry["value"] - value) < max(4 * entry["std"], 1e-9)
        assert entry["baseline"] != entry["value"]


@pytest.mark.slow  # a whole diagnosis; the sample day's is one of the fast tests
def test_nothing_hidden_is_adequate(tmp_path: Path) -> None:
    path = described(tmp_path, {})
    made = document(path)
    told = made["diagnosis"]
    assert told["verdict"] == "adequate"
    assert told["causes"] == told["extended"] == told["ambiguous"] == []
    assert made["extensions"] == {}
    plain = document(path, "--no-diagnose")
    assert plain["diagnosis"] is None
    assert plain["parameters"] == made["parameters"]
    assert plain["provenance"]["command"].endswith("--no-diagnose")


@pytest.mark.slow
def test_a_drag_that_no_effect_describes_is_learned_as_a_law_of_the_resistance(tmp_path: Path) -> None:
    told = document(described(tmp_path, {"drag_bump": 25.0}))["diagnosis"]
    assert told["verdict"] == "named"
    assert [c["effect"] for c in told["causes"]] == ["learned_road_load"]
    assert told["part"]["element"] == told["learned"]["element"] == "road_load"
    assert told["extended"] == ["learned_road_load"]  # unasked, for the decelerations contradict the baseline
    assert told["where"]
    assert told["next_test"]


@pytest.mark.slow
def test_brakes_that_let_go_slower_than_they_usually_do_are_still_brakes(tmp_path: Path) -> None:
    hidden = {"brake_drag_fading": 200.0, "brake_drag_fading_time": 45.0}
    made = document(described(tmp_path, hidden, EIGHT.but(runs=16)))
    (found,) = made["diagnosis"]["causes"]
    assert found["effect"] == "brake_drag_fading"
    for name, size in hidden.items():
        low, high = found["unknowns"][name]["interval95"]
        assert low < size < high


@pytest.mark.slow
def test_intervals_include_a_brake_that_releases_more_slowly_than_exponentially(tmp_path: Path) -> None:
    vehicle = random_vehicle(SEED)
    day = coast.Day(runs=12, start_speed=32.0, end_speed=4.0, rate=5.0)
    made = document(described(tmp_path, {"slow_release": 180.0}, day))
    told = made["diagnosis"]
    assert "brake_drag_fading" in [
        *(c["effect"] for c in told["causes"]),
        *(e for some in told["ambiguous"] for e in some),
    ]
    for row in made["road_load"]["force"]:
        speed = row["speed_kmh"] / 3.6
        true = vehicle.rolling_resistance * vehicle.mass * GRAVITY + 0.5 * AIR_DENSITY * vehicle.drag_area * speed**2
        low, high = row["interval95"]
        assert low < true < high


@pytest.mark.slow
def test_a_force_at_high_speed_is_an_answer_beside_the_brake_that_imitates_it(tmp_path: Path) -> None:
    """All runs begin at the same speed, so that it falls off with time as well: 61 N at 100 km/h."""
    vehicle, size = random_vehicle(SEED), 1.0  # N s^2/m^2
    made = document(described(tmp_path, {"fast_drag": size}, coast.Day(runs=10, start_speed=32.0, end_speed=4.0)))
    for row in made["road_load"]["force"]:
        speed = row["speed_kmh"] / 3.6
        if speed > 32.0:  # not driven
            continue
        true = vehicle.rolling_resistance * vehicle.mass * GRAVITY + 0.5 * AIR_DENSITY * vehicle.drag_area * speed**2
        low, high = row["interval95"]
        assert low < true + size * max(speed - 20.0, 0.0) ** 2 < high
    told = made["diagnosis"]
    assert told["verdict"] == "ambiguous"
    assert {"brake_drag_fading", "learned_road_load"} <= {e for some in told["ambiguous"] for e in some}
    assert any("from different speeds" in test["manoeuvre"] for test in told["next_test"])


@pytest.mark.slow
def test_an_accelerometer_with_a_wrong_gain_is_no_matter_of_the_car(tmp_path: Path) -> None:
    vehicle, day = random_vehicle(SEED), EIGHT.but(acceleration=ACCELEROMETER.but(gain=0.2))
    channels = {**cases.COAST_CHANNELS, "acceleration": ("Long Accel [m/s^2]", "m/s^2")}
    made = document(cases.coast_downs(vehicle, SEED, tmp_path, day, False, {}, channels))
    told = made["diagnosis"]
    assert told["verdict"] == "data_fault"
    (size,) = (c["unknowns"]["accelerometer_gain_error"] for c in told["causes"] if c["effect"] == "accelerometer_gain")
    assert size["interval95"][0] < 0.2 < size["interval95"][1]
    low, high = made["parameters"]["drag_area"]["interval95"]
    assert low < vehicle.drag_area < high


@pytest.mark.slow
def test_a_slope_can_be_asked_for_beside_an_accelerometer_that_tells_it(tmp_path: Path) -> None:
    vehicle, day = random_vehicle(SEED), EIGHT.but(acceleration=ACCELEROMETER)
    channels = {**cases.COAST_CHANNELS, "acceleration": ("Long Accel [m/s^2]", "m/s^2")}
    path = cases.coast_downs(vehicle, SEED, tmp_path, day, False, {"road_grade": 1e-3}, channels)
    asked = {"diagnose": {"effects": ["headwind", "road_grade"], "extend": ["road_grade"]}}
    path.write_text(yaml.safe_dump({**yaml.safe_load(path.read_text(encoding="utf-8")), **asked}), encoding="utf-8")
    told = document(path)["diagnosis"]
    assert told["extended"] == ["road_grade"]
    low, high = told["causes"][0]["unknowns"]["road_grade"]["interval95"]
    assert low < 1e-3 < high


@pytest.mark.slow  # a whole diagnosis, after cuts that are tested with the ledger
def test_where_a_sensor_stood_still_is_cut_and_the_rest_names_the_wind(tmp_path: Path) -> None:
    path = described(tmp_path, {"headwind": 2.0})
    damage(sorted(tmp_path.glob("*.csv")), "stuck")
    made = document(path)
    assert made["diagnosis"]["verdict"] == "named"
    assert made["diagnosis"]["extended"] == ["headwind"]
    assert {row["test"] for row in made["quality"]["ledger"]} == {"frozen"}


@pytest.mark.slow
def test_what_stood_still_may_be_cut_out(tmp_path: Path) -> None:
    path = described(tmp_path, {})
    damage(sorted(tmp_path.glob("*.csv")), "stuck")
    description = yaml.safe_load(path.read_text(encoding="utf-8"))
    ends = [read_log(tmp_path / run["log"], TIMED).time for run in description["runs"]]
    for run, time in zip(description["runs"], ends, strict=True):
        run["to_time"] = float(time[int(0.39 * time.size)])
    path.write_text(yaml.safe_dump(description), encoding="utf-8")
    made = document(path)
    assert made["diagnosis"]["verdict"] == "adequate"
    assert not any(f["fault"] for f in made["findings"])


@pytest.mark.parametrize("runs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_too_few_are_never_given_a_name(runs: int, tmp_path: Path) -> None:
    told = document(described(tmp_path, {"headwind": 2.0}, EIGHT.but(runs=runs)))["diagnosis"]
    assert told["verdict"] == "not_testable"
    assert told["causes"] == told["extended"] == []
    (test,) = told["next_test"]
    assert test["runs"] >= 8
    assert "coast-downs" in test["manoeuvre"]


@pytest.mark.slow  # a diagnosis of 3 s
def test_a_wind_along_runs_of_one_direction_stands_beside_what_imitates_it(tmp_path: Path) -> None:
    told = document(described(tmp_path, {"headwind": 2.0}, EIGHT.but(one_way=True)))["diagnosis"]
    assert told["verdict"] == "ambiguous"
    assert told["extended"] == []
    assert {"headwind", "speed_dependent_rolling"} <= {name for one in told["ambiguous"] for name in one}
    pairs, each = told["next_test"][:2]
    assert "out and back" in pairs["manoeuvre"]
    assert "one each way" in each["manoeuvre"]
    assert each["expected_t"] > 6


@pytest.mark.parametrize("what", ["runs of 2 s", "a speed that stands still"])
def test_logs_that_hold_nothing_are_refused_in_words(what: str, tmp_path: Path) -> None:
    path = described(tmp_path, {})
    for log in sorted(tmp_path.glob("*.csv")):
        head, *rows = list(csv.reader(log.read_text(encoding="utf-8").splitlines()))
        column = head.index("GPS Speed [km/h]")
        if what == "runs of 2 s":
            rows = rows[:10]
        for row in rows if what != "runs of 2 s" else ():
            row[column] = "50.0"
        with log.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows([head, *rows])
    code, text, error = vdyn("coastdown", path, "-o", "-")
    assert code == 1
    refused = json.loads(text)
    assert "coastdown_0.csv: rejected" in refused["sentence"]
    assert not refused["parameters"]
    assert "bug" not in error
    assert "coastdown_0.csv: rejected" in error


def test_a_wind_stays_with_its_day(windy: tuple[dict[str, Any], str, Path]) -> None:
    _, shown, out = windy
    assert "A headwind of" in shown
    assert "headwind" not in read_document(out / "coastdown.json").parameters.extensions


@pytest.mark.slow
def test_an_effect_of_the_car_goes_with_its_parameters(tmp_path: Path) -> None:
    path = described(tmp_path, {"speed_dependent_rolling": 2e-4}, diagnose={"extend": ["speed_dependent_rolling"]})
    code, _, error = vdyn("coastdown", path, "-o", tmp_path / "out", "-q")
    assert code == 0, error
    found = read_document(tmp_path / "out" / "coastdown.json").parameters.extensions["speed_dependent_rolling"]
    assert found["speed_dependent_rolling"].unit == "s/m"
    assert found["speed_dependent_rolling"].std > 0
    made = json.loads((tmp_path / "out" / "coastdown.json").read_text(encoding="utf-8"))["parameters"]
    vehicle = random_vehicle(SEED)
    force = sum(made[f"road_load_f{k}"]["value"] * (60 / 3.6) ** k for k in range(3))
    truth = coast.truth(vehicle)
    tires = vehicle.mass * 9.80665 * (truth["rolling_resistance"] + 2e-4 * 60 / 3.6)
    air = 0.5 * 1.225 * truth["drag_area"] * (60 / 3.6) ** 2
    assert force == pytest.approx(tires + air, rel=0.03)
    assert made["road_load_f1"]["value"] > 0.5 * vehicle.mass * 9.80665 * 2e-4


@pytest.mark.slow
def test_a_stricter_level_is_kept(tmp_path: Path) -> None:
    path = described(tmp_path, {"headwind": 2.0})
    made = document(path, "--level", "1e-5")
    assert made["diagnosis"]["verdict"] == "not_testable"
    assert "cannot reach the level" in made["diagnosis"]["sentence"]
    assert "--level 1e-05" in made["provenance"]["command"]


def test_an_effect_that_does_not_exist_is_refused_with_those_that_do(tmp_path: Path) -> None:
    path = described(tmp_path, {}, diagnose={"effects": ["headwind", "gremlins"]})
    code, text, error = vdyn("coastdown", path, "-o", "-")
    assert code == 2
    assert text == ""
    assert "gremlins" in error
    assert "headwind" in error.split("candidate effects:")[1]


@pytest.mark.slow
def test_no_effects_is_no_diagnosis(tmp_path: Path) -> None:
    made = document(described(tmp_path, {"headwind": 2.0}, diagnose={"effects": "none"}))
    assert made["diagnosis"] is None


@pytest.mark.slow
@pytest.mark.thorough  # the learned law of the resistance is like it
def test_drag_above_a_nominal_coefficient_is_found(tmp_path: Path) -> None:
    """What a data sheet says of the drag takes part with its spread: a rig's drag shows against nothing else.

    With the drag estimated it would be told nowhere. Whatever scales the forces contradicts the data sheet alike, so
    that the rig is one of a set.
    """
    nominal = random_vehicle(SEED).drag_coefficient
    fix = {"drag_coefficient": f"{nominal!r} +- {0.02 * nominal!r}"}
    found = document(described(tmp_path, {"extra_drag_area": 0.1}, settings={"fix": fix}))
    diagnosis = found["diagnosis"]
    answers = {cause["effect"] for cause in diagnosis["causes"]} | {n for one in diagnosis["ambiguous"] for n in one}
    assert diagnosis["verdict"] == "ambiguous"
    assert "extra_drag_area" in answers
    assert not answers & {"headwind", "road_grade", "driveline_drag", "brake_drag"}
    (said,) = (f for f in found["findings"] if f["where"] == "vehicle.drag_area")
    assert "the given value and the runs together" in said["what"]
