"""Drives against a mass on a road, by logs of a plant with slipping wheels, uneven roads and a held speed."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.signal import lfilter

from tests.plant.slipping_drive import Array, Car, drives
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.diagnosis import Diagnosis
from vdyn_cli.quantities.result import Result

CAR = Car()
EVERY = 20  # samples of the plant to one of the log: 50 Hz


def diagnosed(
    folder: Path, car: Car, logs: Mapping[str, Array], held: int = 1, seed: int = 0, zero: float | None = None
) -> Diagnosis:
    """The diagnosis of :func:`validated`."""
    found = validated(folder, car, logs, held, seed, zero).diagnosis
    assert found is not None
    return found


def validated(
    folder: Path, car: Car, logs: Mapping[str, Array], held: int = 1, seed: int = 0, zero: float | None = None
) -> Result:
    """The result of logs of a car described as ``CAR``, whose speed channel repeats values for some rows.

    ``zero`` : m/s^2, of an accelerometer; None: there is none.
    """
    rng = np.random.default_rng(seed)
    time = logs["time"][::EVERY]
    for k, (torque, speed) in enumerate(zip(logs["torque"][:, ::EVERY], logs["speed"][:, ::EVERY], strict=True)):
        read = np.round(3.6 * speed + rng.normal(0.0, 0.06, speed.size), 2)
        read = read[np.arange(read.size) // held * held]
        columns = [time, np.round(torque + rng.normal(0.0, 0.1, torque.size), 1), read]
        if zero is not None:
            columns.append(logs["felt"][k, ::EVERY] + zero + rng.normal(0.0, 0.05, torque.size))
        head = ",".join(["t [s]", "T [N m]", "v [km/h]", "a [m/s^2]"][: len(columns)])
        np.savetxt(folder / f"drive_{k}.csv", np.column_stack(columns), "%.3f", ",", header=head, comments="")
    vehicle = {
        "mass": f"{CAR.mass} +- 4 kg",
        "rotating_mass": f"{CAR.turning} +- 2 kg",
        "wheel_radius": f"{CAR.radius} +- 0.0005 m",
        "gear_ratio": str(car.ratio),
        "driveline_efficiency": f"{car.efficiency} +- 0.003",
        "rolling_resistance": f"{CAR.rolling} +- 0.0002",
        "drag_area": f"{CAR.drag_area} +- 0.012 m^2",
        "air_density": f"{CAR.density} kg/m^3",
    }
    units = {"time": ("t [s]", "s"), "drive_torque": ("T [N m]", "N m"), "speed": ("v [km/h]", "km/h")}
    if zero is not None:
        units["acceleration"] = ("a [m/s^2]", "m/s^2")
    description = {
        "test": "validate",
        "vehicle": vehicle,
        "channels": {n: {"column": c, "unit": u} for n, (c, u) in units.items()},
        "runs": [{"log": f"drive_{k}.csv", "direction": ("out", "back")[k % 2]} for k in range(len(logs["torque"]))],
        "settings": {"model": "road_load"},
    }
    path = folder / "test.yaml"
    path.write_text(yaml.safe_dump(description), encoding="utf-8")
    return execute("validate", path).result


@pytest.mark.slow  # a diagnosis of 3 s
@pytest.mark.parametrize(("seed", "held"), [(1, 1), (2, 5)])
def test_slip_an_uneven_road_and_a_held_speed_are_no_findings(tmp_path: Path, seed: int, held: int) -> None:
    assert diagnosed(tmp_path, CAR, drives(CAR, seed), held).verdict == "adequate"


@pytest.mark.slow  # a diagnosis of 3 s
def test_tires_that_hardly_slip_are_no_finding(tmp_path: Path) -> None:
    """With the stiff tires of light vehicles, or with all wheels driven, the speed does not lag."""
    car = replace(CAR, stiffness=2000.0)
    assert diagnosed(tmp_path, car, drives(car, 60), seed=60).verdict == "adequate"


def _with_load_in_newtons(folder: Path, stated: float, measured: float) -> Diagnosis:
    """The diagnosis of a car of ``CAR.mass`` with this stated mass, whose F0 was measured at another mass, kg."""
    validated(folder, CAR, drives(CAR, 11), seed=11)
    path = folder / "test.yaml"
    description = yaml.safe_load(path.read_text(encoding="utf-8"))
    vehicle, weight = description["vehicle"], measured * 9.80665
    del vehicle["rolling_resistance"], vehicle["drag_area"]
    vehicle["road_load_f0"] = f"{CAR.rolling * weight} +- {0.0002 * weight} N"
    vehicle["road_load_f2"] = f"{0.5 * CAR.density * CAR.drag_area} +- {0.006 * CAR.density} N/(m/s)^2"
    vehicle["mass"] = f"{stated} +- 4 kg"
    path.write_text(yaml.safe_dump(description), encoding="utf-8")
    found = execute("validate", path).result.diagnosis
    assert found is not None
    return found


@pytest.mark.slow  # a diagnosis of 5 s
def test_a_wrong_mass_beside_a_road_load_in_newtons_is_not_taken_for_rotating_mass_alone(tmp_path: Path) -> None:
    """Coast-downs measured F0 and F2 in N: another mass changes only the inertia, as rotating mass does."""
    (answers,) = _with_load_in_newtons(tmp_path, CAR.mass / 1.08, CAR.mass).ambiguous
    assert {"mass_error", "rotating_mass"} <= set(answers)


@pytest.mark.slow  # a diagnosis of 5 s
@pytest.mark.thorough  # 5 s
def test_a_load_beside_a_road_load_in_newtons_is_found(tmp_path: Path) -> None:
    """F0 was measured at the stated mass: 25 % more mass also rolls with 25 % more resistance."""
    stated = CAR.mass / 1.25
    found = _with_load_in_newtons(tmp_path, stated, stated)
    named = {*(c.effect for c in found.causes), *(e for one in found.ambiguous for e in one)}
    assert "payload" in named
    assert "mass_error" not in named


@pytest.mark.slow
def test_a_load_that_some_drives_carry_is_named_with_its_size_and_held_out_gain(tmp_path: Path) -> None:
    """Left out as odd drives, they would leave a simulation of whichever drives remain."""
    first, later = drives(CAR, 11), drives(replace(CAR, mass=1.12 * CAR.mass), 11)
    half = len(first["speed"]) // 2
    logs = {n: v if v.ndim == 1 else np.concatenate([v[:half], later[n][half:]]) for n, v in first.items()}
    found = diagnosed(tmp_path, CAR, logs, seed=11)
    assert found.extended == ("changed_load",)
    low, high = found.causes[0].unknowns["changed_load"].interval95
    assert low <= 0.12 <= high
    assert found.gain is not None
    assert found.gain.after < 0.6 * found.gain.before


@pytest.mark.slow  # a diagnosis of 3 s
def test_gears_that_take_their_share_under_recuperation_are_no_finding(tmp_path: Path) -> None:
    """The stated efficiency holds in both directions: the wheels then give more force than the torque shows."""
    car = replace(CAR, efficiency=0.94, recuperated=0.06)
    assert diagnosed(tmp_path, car, drives(car, 8), seed=8).verdict == "adequate"


@pytest.mark.slow
def test_a_speed_of_driven_wheels_is_named(tmp_path: Path) -> None:
    logs = dict(drives(CAR, 9))
    logs["speed"] = logs["wheel"]
    found = diagnosed(tmp_path, CAR, logs, seed=9)
    assert [c.effect for c in found.causes] == ["driven_wheel_slip"]
    low, high = found.causes[0].unknowns["driven_wheel_slip"].interval95
    assert low <= 1.0 / (CAR.stiffness * CAR.driven) <= high


@pytest.mark.slow  # a diagnosis of 3 s
def test_a_wrong_zero_of_the_accelerometer_is_named(tmp_path: Path) -> None:
    """Far beyond the 0.02 m/s^2 of its prior; a tilt shifts the reading by as much."""
    found = diagnosed(tmp_path, CAR, drives(CAR, 6), seed=6, zero=0.25)
    (answers,) = found.ambiguous
    assert set(answers) == {"accelerometer_offset", "accelerometer_tilt"}


@pytest.mark.slow
def test_a_small_zero_of_the_accelerometer_is_no_finding(tmp_path: Path) -> None:
    assert diagnosed(tmp_path, CAR, drives(CAR, 7), seed=7, zero=0.02).verdict == "adequate"


@pytest.mark.thorough
@pytest.mark.slow  # a diagnosis of 3 s
@pytest.mark.parametrize("share", [0.7, 1.4])
def test_a_wrong_rolling_resistance_is_an_answer(tmp_path: Path, share: float) -> None:
    """The torque's zero and, where the resistance is larger than stated, drags cause the same force."""
    found = diagnosed(tmp_path, (car := replace(CAR, rolling=share * CAR.rolling)), drives(car, 3))
    (answers,) = found.ambiguous
    assert {"rolling_error", "torque_offset"} <= set(answers)
    assert ("brake_drag" in answers) == (share > 1.0)


@pytest.mark.thorough
@pytest.mark.slow  # a diagnosis of 3 s
def test_more_drag_is_named_beside_them(tmp_path: Path) -> None:
    car = replace(CAR, drag_area=CAR.drag_area + 0.2)
    found = diagnosed(tmp_path, car, drives(car, 3), 5)
    assert [c.effect for c in found.causes] == ["extra_drag_area"]


@pytest.mark.thorough
@pytest.mark.slow  # twelve minutes of driving
def test_tires_that_warm_up_over_the_day_are_found_where_no_start_is_stated(tmp_path: Path) -> None:
    """Each log begins at zero: the drives follow one another in their listed order. Two of three days are named.

    Of seed 5 the wheels' slip is significant beside it (p = 0.0075), of six others not.
    """
    days = [diagnosed(tmp_path, CAR, drives(CAR, seed, 8, 90.0, cold=0.5)) for seed in (5, 6, 7)]
    named = [d for d in days if [c.effect for c in d.causes] == ["tire_warmup"]]
    assert len(named) >= 2
    for found in named:
        low, high = found.causes[0].unknowns["tire_warmup"].interval95
        assert low <= 0.5 <= high


@pytest.mark.slow  # a diagnosis of 4 to 9 s
@pytest.mark.parametrize(
    ("seed", "drift"),
    [(102, -0.04), *(pytest.param(*one, marks=pytest.mark.thorough) for one in ((104, -0.15), (105, 0.3)))],
)
def test_a_torque_whose_zero_drifts_in_each_drive_is_named(tmp_path: Path, seed: int, drift: float) -> None:
    """The smallest reads 2.4 N m too little after a minute; the drives have at most 63 N m."""
    logs = dict(drives(CAR, seed))
    logs["torque"] = logs["torque"] + drift * logs["time"]
    found = diagnosed(tmp_path, CAR, logs, seed=seed)
    assert [c.effect for c in found.causes] == ["torque_drift"]
    low, high = found.causes[0].unknowns["torque_drift"].interval95
    assert low <= drift <= high


@pytest.mark.slow
def test_a_torque_that_is_wrong_only_under_recuperation_is_named(tmp_path: Path) -> None:
    """A controller that holds the efficiency of driving for both directions: its torque reads 20 % too high."""
    logs = dict(drives(replace(CAR, recuperated=0.06), 6))
    logs["torque"] = np.where(logs["torque"] < 0.0, 1.2, 1.0) * logs["torque"]
    found = diagnosed(tmp_path, CAR, logs)
    assert [c.effect for c in found.causes] == ["overrun_gain"]
    low, high = found.causes[0].unknowns["overrun_gain"].interval95
    assert low <= 0.2 <= high


def _late(samples: int, folder: Path, car: Car = CAR) -> Diagnosis:
    """The diagnosis of drives whose torque is logged this many ms late."""
    logs = dict(drives(car, 4))
    logs["torque"] = np.roll(logs["torque"], samples, axis=1)
    logs["torque"][:, :samples] = logs["torque"][:, samples : samples + 1]
    return diagnosed(folder, car, logs)


@pytest.mark.slow
def test_a_late_torque_is_found(tmp_path: Path) -> None:
    """By more than loggers usually are. A low-pass filter of that time leaves more."""
    found = _late(150, tmp_path)
    named = {*(c.effect for c in found.causes), *(e for one in found.ambiguous for e in one)}
    assert named == {"torque_delay", "speed_delay"}


@pytest.mark.slow
@pytest.mark.parametrize("late", [20, 60])
def test_a_usual_latency_is_a_note(tmp_path: Path, late: int) -> None:
    """That of 60 ms changes the predicted speed by a fifth of its uncertainty."""
    found = _late(late, tmp_path)
    assert found.verdict == "adequate"
    delay = re.search(r"A drive torque with a wrong delay of (\S+) \+- (\S+) s is part of the fit", found.sentence)
    assert delay is not None
    assert abs(float(delay[1]) - 1e-3 * late) < float(delay[2])
    assert ("channels of a logger may differ by up to 0.097 s" in found.sentence) == (late > 20)


@pytest.mark.slow  # two diagnoses of 3 s
@pytest.mark.parametrize(("late", "named"), [(50, set()), (250, {"torque_delay", "speed_delay"})])
def test_a_held_speed_may_be_one_row_late(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, late: int, named: set[str]
) -> None:
    """A sensor of 5 Hz in a log of 10 Hz, sampled half a row before its value appears; a longer delay is an error."""
    monkeypatch.setattr(sys.modules[__name__], "EVERY", 100)
    logs = dict(drives(CAR, 4))
    logs["speed"] = np.roll(logs["speed"], late, axis=1)
    logs["speed"][:, :late] = logs["speed"][:, late : late + 1]
    found = diagnosed(tmp_path, CAR, logs, held=2)
    assert {*(c.effect for c in found.causes), *(e for one in found.ambiguous for e in one)} == named
    if not named:
        assert found.verdict == "adequate"
        note = r"speed channel with a wrong delay of (\S+) .* channels of a logger may differ by up to 0.15 s"
        delay = re.search(note, found.sentence)
        assert delay is not None
        assert float(delay[1]) == pytest.approx(0.05, abs=0.02)


@pytest.mark.slow  # a diagnosis of 3 s
@pytest.mark.thorough  # beside a filter: in every run
def test_more_drag_is_named_alone_beside_a_latency(tmp_path: Path) -> None:
    found = _late(30, tmp_path, replace(CAR, drag_area=CAR.drag_area + 0.2))
    assert [c.effect for c in found.causes] == ["extra_drag_area"]
    assert "is part of the fit" in found.sentence


@pytest.mark.slow  # a diagnosis of 3 s
@pytest.mark.thorough  # 8 s each
@pytest.mark.parametrize("seed", [4, 6])
def test_more_drag_and_a_filtered_speed_are_named(tmp_path: Path, seed: int) -> None:
    """A filter of 0.15 s: a linearization about no latency leaves its square, which looks like further effects."""
    car = replace(CAR, drag_area=CAR.drag_area + 0.2)
    logs = dict(drives(car, seed))
    decay = np.exp(-1e-3 / 0.15)
    start = decay * logs["speed"][:, :1]
    logs["speed"] = lfilter([1.0 - decay], [1.0, -decay], logs["speed"], axis=1, zi=start)[0]
    found = diagnosed(tmp_path, car, logs)
    named = {c.effect: c.unknowns for c in found.causes}
    assert {"extra_drag_area", "speed_filter"} <= named.keys() <= {"extra_drag_area", "speed_filter", "speed_delay"}
    assert named["extra_drag_area"]["extra_drag_area"].value == pytest.approx(0.2, abs=0.06)
    assert named["speed_filter"]["speed_filter"].value == pytest.approx(0.15**2, abs=0.004)


@pytest.mark.slow
@pytest.mark.thorough
def test_a_zero_beyond_its_plausible_range_is_stated_where_the_drives_are_missed(tmp_path: Path) -> None:
    hub = replace(CAR, ratio=1.0)
    logs = dict(drives(hub, 12, 4, 150.0))
    logs["torque"] = logs["torque"] - 85.0
    result = validated(tmp_path, hub, logs, seed=12)
    found = result.diagnosis
    assert found is not None
    assert found.verdict == "unknown"
    assert "windows" not in result.sentence
    assert re.search(r"wrong zero \(-8\d\.\d \+- \S+ N m at no torque, beyond the plausible range\)", found.sentence)


@pytest.mark.slow  # a diagnosis of 5 s
@pytest.mark.thorough  # 7 s
def test_a_wrong_radius_is_also_in_a_speed_computed_from_that_of_a_wheel(tmp_path: Path) -> None:
    """A radius stated 4 % too large: the force is 4 % too small, and the speed reads 4 % too high."""
    logs = drives(CAR, 21)
    validated(tmp_path, CAR, {**logs, "speed": logs["speed"] / CAR.radius / 3.6}, seed=21)
    path = tmp_path / "test.yaml"
    description = yaml.safe_load(path.read_text(encoding="utf-8"))
    description["vehicle"]["wheel_radius"] = f"{1.04 * CAR.radius} +- 0.0005 m"
    del description["channels"]["speed"]
    description["channels"]["wheel_speed"] = {"column": "wheel [rad/s]", "unit": "rad/s"}
    for log in tmp_path.glob("*.csv"):
        log.write_text(log.read_text(encoding="utf-8").replace("v [km/h]", "wheel [rad/s]", 1), encoding="utf-8")
    path.write_text(yaml.safe_dump(description), encoding="utf-8")
    result = execute("validate", path).result
    found = result.diagnosis
    assert found is not None
    assert "wheel_radius" in {*(c.effect for c in found.causes), *(e for one in found.ambiguous for e in one)}
    (radius,) = [t for t in found.ranking if t.effect == "wheel_radius"]
    low, high = radius.unknowns["wheel_radius_error"].interval95
    assert low < 1.0 / 1.04 - 1.0 < high
    assert not [f for f in result.findings if "do not include" in f.what]


@pytest.mark.slow  # a diagnosis of 8 s
@pytest.mark.thorough  # 14 s
def test_tires_that_warm_up_in_each_drive_are_named_whatever_their_time(tmp_path: Path) -> None:
    """Six drives of six days, with half more rolling resistance at first, which decays in 100 s; nominal: 300 s."""
    car = replace(CAR, cooled=0.5)
    found = diagnosed(tmp_path, car, drives(car, 31, 6, 150.0), seed=31)
    assert [c.effect for c in found.causes] == ["run_warmup"]
    low, high = found.causes[0].unknowns["run_warmup"].interval95
    assert low < 0.5 < high
