"""``vdyn check``: runs to keep or to repeat, with the reason and the exit code."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.result_check import validator
from vdyn_cli.commands.run_check import run_check
from vdyn_cli.commands.run_step import write_step
from vdyn_cli.quantities.errors import InputError, merge_lines

ROOT = Path(__file__).resolve().parents[2]
RUNS = 8
HEADER = "Time [s],GPS Speed [km/h]"
Column = np.ndarray[Any, np.dtype[np.float64]]


def quiet(text: str = "") -> None:
    """Print nothing."""


def checked(path: Path, folder: Path, code: int) -> dict[str, Any]:
    """The JSON of a check that ends with a code, after its schema."""
    assert run_check(path, (), str(folder), quiet) == code
    document: dict[str, Any] = json.loads((folder / "check.json").read_text(encoding="utf-8"))
    validator("check").validate(document)
    return document


def campaign(folder: Path, change: Callable[[int, Column, Column], Column]) -> Path:
    """A description of eight coasts, each with a speed that ``change(run, time, speed)`` makes, km/h."""
    generator = np.random.default_rng(3)
    time = np.arange(0.0, 95.0, 0.1)
    lines = []
    for k in range(RUNS):
        speed = 85.0 - 0.62 * (1.0 + 0.01 * generator.standard_normal()) * time
        speed = np.round(change(k, time, speed + 0.05 * generator.standard_normal(time.size)), 3)
        rows = [f"{t:.1f},{v:.3f}" for t, v in zip(time, speed, strict=True)]
        (folder / f"coast_{k}.csv").write_text("\n".join([HEADER, *rows]))
        lines.append(f"  - {{log: coast_{k}.csv, direction: {'out' if k % 2 == 0 else 'back'}, start: {120 * k} s}}")
    path = folder / "coast.yaml"
    path.write_text(
        "test: coastdown\nvehicle: {mass: 1500 kg, rotating_mass: 50 kg, frontal_area: 2.2 m^2}\n"
        "environment: {temperature: 24 degC, pressure: 99 kPa}\nchannels:\n"
        '  time: {column: "Time [s]", unit: s}\n  speed: {column: "GPS Speed [km/h]", unit: km/h}\n'
        "settings: {speed_window: [80 km/h, 30 km/h]}\nruns:\n" + "\n".join(lines) + "\n"
    )
    return path


def frozen(first: float, last: float) -> Callable[[int, Column, Column], Column]:
    """Hold the speed of the third run from one time to another, s."""

    def change(run: int, time: Column, speed: Column) -> Column:
        inside = (time >= first) & (time <= last) & (run == 2)
        return np.where(inside, speed[np.searchsorted(time, first)], speed)

    return change


def test_a_car_that_stands_in_a_log_of_load_transfer_is_to_accelerate(tmp_path: Path) -> None:
    generator = np.random.default_rng(2)
    for name, push in (("drive", 3.0), ("parked", 0.0)):
        time = np.arange(1000) / 50.0
        a = push * np.sin(time) + 0.05 * generator.standard_normal(time.size)
        rate = 0.01 * push * np.cos(time) + 0.001 * generator.standard_normal(time.size)
        rows = np.column_stack([time, a, 8000 - 300 * a, 7000 + 300 * a, rate])
        np.savetxt(tmp_path / f"{name}.csv", rows, delimiter=",", header="t,a,f,r,q", comments="")
    path = tmp_path / "cg.yaml"
    path.write_text(
        "test: cg\nvehicle: {mass: 1530 kg, wheelbase: 2.7 m}\nsettings: {accelerometer: gps}\nchannels:\n"
        "  time: {column: t, unit: s}\n  acceleration: {column: a, unit: m/s^2}\n  front_load: {column: f, unit: N}\n"
        "  rear_load: {column: r, unit: N}\n  pitch_rate: {column: q, unit: rad/s}\n"
        "runs: [{log: drive.csv}, {log: parked.csv}]\n"
    )
    document = checked(path, tmp_path / "out", 1)
    assert [r["verdict"] for r in document["runs"]] == ["keep", "repeat"]
    assert "accelerate and brake with 3 m/s^2" in document["runs"][1]["why"][0]
    assert document["untied"] == ["acceleration", "pitch_rate"], "the mass ties the loads, and nothing the others"


@pytest.mark.slow
def test_a_doubtful_vehicle_is_not_good(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda k, t, v: v)
    path.write_text(path.read_text().replace("rotating_mass: 50", "rotating_mass: 500"))
    document = checked(path, tmp_path / "out", 1)
    assert document["sentence"].startswith("Doubtful: rotating_mass is 33 % of mass")


@pytest.mark.slow
def test_a_lost_signal_does_not_shorten_the_run_and_is_reported_in_the_log_s_unit(tmp_path: Path) -> None:
    def lost(run: int, time: Column, speed: Column) -> Column:
        return np.where(
            (run == 2) & (time >= 40.0) & (time < 44.0), 0.0, np.where((run == 3) & (time == 30.0), 99.0, speed)
        )

    document = checked(campaign(tmp_path, lost), tmp_path, 0)
    notes = {r["run"]: r["why"] for r in document["runs"]}
    assert not any("would be evaluated" in why for why in notes["coast_2.csv"])
    assert "jumps to 99 km/h and back" in notes["coast_3.csv"][0]


@pytest.mark.slow
def test_a_part_that_the_step_leaves_out_is_a_note(tmp_path: Path) -> None:
    """A driver who holds the speed for 8 s: the fit does not use the part before."""

    def held(run: int, time: Column, speed: Column) -> Column:
        later = np.interp(time - 8.0, time, speed)
        return np.where((run == 2) & (time > 40.0), np.where(time < 48.0, speed[time == 40.0], later), speed)

    document = checked(campaign(tmp_path, lambda k, t, v: held(k, t, v) + 0.01 * np.sin(7.0 * t)), tmp_path, 0)
    notes = {r["run"]: r["why"] for r in document["runs"]}
    assert any("would be left out: accelerates" in why for why in notes["coast_2.csv"])


@pytest.mark.slow
@pytest.mark.parametrize(
    "short",
    [
        {2: "to_time: 55 s"},
        pytest.param({k: ("to_time: 55 s", "from_time: 35 s")[k % 2] for k in range(8)}, marks=pytest.mark.slow),
    ],
)
def test_a_coast_that_covers_part_of_the_others_speeds_is_a_note(short: dict[int, str], tmp_path: Path) -> None:
    """A log that ends early does not limit the speeds of the others' comparison; runs split by plan are no note."""
    path = campaign(tmp_path, lambda run, time, speed: speed)
    for k, span in short.items():
        path.write_text(path.read_text().replace(f"coast_{k}.csv,", f"coast_{k}.csv, {span},"))
    document = checked(path, tmp_path / "out", 0)
    coasts, alone = document["coasts"], len(short) == 1
    assert coasts["out"] + coasts["back"] == RUNS - alone
    assert not alone or coasts["speeds"][1] < 31.0
    noted = [r["run"] for r in document["runs"] if "of the speeds of the other runs" in " ".join(r["why"])]
    assert noted == (["coast_2.csv"] if alone else [])


@pytest.mark.slow  # 2 s
def test_a_speed_made_from_a_wheel_s_is_checked(tmp_path: Path) -> None:
    path = campaign(tmp_path, frozen(40.0, 44.0))
    text = path.read_text().replace("speed: {column", "wheel_speed: {column").replace("unit: km/h", "unit: rad/s")
    path.write_text(
        text.replace("frontal_area", "wheel_radius: 0.3 m, frontal_area").replace("GPS Speed [km/h]", "Wheel")
    )
    for log in tmp_path.glob("*.csv"):
        log.write_text(log.read_text().replace("GPS Speed [km/h]", "Wheel"))
    notes = {r["run"]: r["why"] for r in checked(path, tmp_path, 0)["runs"]}
    assert any("wheel_speed" in why for why in notes["coast_2.csv"])


def test_the_sample_coast_downs_are_all_kept(tmp_path: Path) -> None:
    document = checked(ROOT / "configs" / "coastdown.yaml", tmp_path, 0)
    assert [r["verdict"] for r in document["runs"]] == ["keep"] * 8
    assert (document["coasts"]["pairs"], document["coasts"]["alternating"]) == (4, True)
    assert all(abs(r["influence"]) < 0.02 for r in document["coasts"]["runs"])
    assert {p["good"] for p in document["redundancy"]} == {True}
    assert "<svg" in (tmp_path / "check.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_dead_log_leaves_order_and_pairs_of_the_others(tmp_path: Path) -> None:
    """A third run without held speed, in the direction out like the next run."""
    text = (ROOT / "configs" / "coastdown.yaml").read_text(encoding="utf-8")
    logs = ROOT / "sample_logs"
    text = text.replace("../sample_logs/", f"{logs}/").replace(
        "vehicle: vehicle.yaml", f"vehicle: {logs.parent}/configs/vehicle.yaml"
    )
    head, *rows = (logs / "coast_3.csv").read_text(encoding="utf-8").splitlines()
    dead = [",".join([row.split(",")[0], *["0"] * row.count(",")]) for row in rows]
    (tmp_path / "dead.csv").write_text("\n".join([head, *dead]) + "\n", encoding="utf-8")
    line = f"  - {{log: {logs}/coast_3.csv,"
    (tmp_path / "test.yaml").write_text(
        text.replace(line, "  - {log: dead.csv, direction: out, start: 1700 s}\n" + line), encoding="utf-8"
    )
    document = checked(tmp_path / "test.yaml", tmp_path / "out", 1)
    assert [r["verdict"] for r in document["runs"]].count("repeat") == 1
    assert document["coasts"]["alternating"]
    assert document["coasts"]["pairs"] == 4


def test_a_short_frozen_stretch_is_cut_and_the_run_kept(tmp_path: Path) -> None:
    document = checked(campaign(tmp_path, frozen(40.0, 45.0)), tmp_path, 0)
    flags = [(f["run"], f["test"], f["decision"]) for f in document["flags"]]
    assert flags == [("coast_2.csv", "frozen", "cut")]
    assert "frozen" in document["runs"][2]["why"][0]
    said = "No run must be repeated. 1 of 8 runs with notes: coast_2.csv. Not met: "
    assert document["sentence"].startswith(said)
    assert "SAE J2263 scope (80 to 30 km/h)" in document["sentence"]
    page = (tmp_path / "check.html").read_text(encoding="utf-8")
    assert "km/h" in page.split("<svg")[1].split("</svg>")[0]


@pytest.mark.slow  # a check as the one above
def test_a_run_that_lost_too_much_is_to_be_repeated(tmp_path: Path) -> None:
    document = checked(campaign(tmp_path, frozen(20.0, 60.0)), tmp_path, 1)
    assert [r["verdict"] for r in document["runs"]] == ["keep", "keep", "repeat", *["keep"] * (RUNS - 3)]
    assert any("cut" in why or "covers" in why or "half" in why for why in document["runs"][2]["why"])
    assert document["sentence"].startswith("Repeat 1 of 8 runs: coast_2.csv. Not met: ")


@pytest.mark.slow
def test_a_run_that_decelerates_more_than_the_others_is_to_be_repeated(tmp_path: Path) -> None:
    document = checked(campaign(tmp_path, lambda k, t, v: np.where(k == 3, 85.0 - 1.12 * (85.0 - v), v)), tmp_path, 1)
    (repeat,) = (r for r in document["runs"] if r["verdict"] == "repeat")
    assert repeat["run"] == "coast_3.csv"
    assert "gear, traffic or a gust, or its direction is wrong" in str(repeat)
    assert not any("alternate" in sentence for sentence in document["coasts"]["sentences"])


@pytest.mark.slow
def test_a_run_that_decelerates_more_at_some_speeds_and_less_at_others_is_noted(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda k, t, v: np.where(k == 3, np.minimum(17.0 + 0.8 * v, 1.6 * v - 27.0), v))
    noted = [r["run"] for r in checked(path, tmp_path, 0)["runs"] if "but not at all speeds" in str(r["why"])]
    assert noted == ["coast_3.csv"]


@pytest.mark.slow
def test_two_successive_runs_that_decelerate_more_are_noted_at_both(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda k, t, v: np.where(k in {4, 5}, 85.0 - 1.2 * (85.0 - v), v))
    document = checked(path, tmp_path, 0)
    noted = {r["run"]: r["why"][0] for r in document["runs"] if r["why"]}
    assert set(noted) == {"coast_4.csv", "coast_5.csv"}
    assert all("more than the runs before and after both" in why for why in noted.values())


def test_a_column_that_is_missing_is_wrong_input(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda k, t, v: v)
    path.write_text(path.read_text().replace("GPS Speed", "GNSS Speed"))
    with pytest.raises(InputError, match="GNSS Speed"):
        run_check(path, (), "", quiet)


def test_a_description_of_no_step_is_wrong_input(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("test: coastdwn\n")
    with pytest.raises(InputError, match="coastdown"):
        run_check(path, (), "", quiet)


@pytest.mark.parametrize("step", [pytest.param("cg", marks=pytest.mark.slow), "tire"])
def test_logs_of_other_steps_are_checked(step: str, tmp_path: Path) -> None:
    document = checked(ROOT / "configs" / f"{step}.yaml", tmp_path, 0)
    assert {r["verdict"] for r in document["runs"]} == {"keep"}
    assert document["coasts"] is None


def test_a_sign_that_the_step_refuses_is_said_at_the_track(tmp_path: Path) -> None:
    time = np.arange(400) / 50.0
    slip = 0.15 * np.sin(time)
    columns = zip(time, slip, 900.0 * np.tanh(20.0 * slip), -990.0 - 9.0 * np.cos(time), strict=True)
    rows = [",".join(f"{x:.4f}" for x in row) for row in columns]
    (tmp_path / "sweep.csv").write_text("\n".join(["t,s,Fx,Fz", *rows]))
    path = tmp_path / "tire.yaml"
    path.write_text(
        "test: tire\nchannels:\n  time: {column: t, unit: s}\n  slip: {column: s, unit: '1'}\n"
        "  force_x: {column: Fx, unit: N}\n  force_z: {column: Fz, unit: N}\nruns:\n  - {log: sweep.csv}\n"
    )
    document = checked(path, tmp_path / "out", 1)
    assert document["sentence"].startswith("Correct the description first: vdyn tire refuses sweep.csv, force_z: Fz is")
    assert document["runs"][0]["verdict"] == "wrong"
    assert "vdyn tire refuses it: Fz is negative" in document["runs"][0]["why"][0]
    assert document["findings"][0]["remedy"] == "add 'sign: -1' to its channel"


@pytest.mark.slow
def test_runs_that_cannot_be_used_leave_the_others_to_be_judged(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda k, t, v: v * (0.6214 if k == 6 else 1.0))
    text = (tmp_path / "coast_2.csv").read_text()
    (tmp_path / "coast_2.csv").write_text(text.replace("GPS Speed", "GPS Sped"))
    (tmp_path / "coast_4.csv").unlink()
    (tmp_path / "coast_5.csv").write_bytes((tmp_path / "coast_0.csv").read_bytes())
    document = checked(path, tmp_path / "out", 1)
    verdicts = [r["verdict"] for r in document["runs"]]
    assert verdicts == ["keep", "keep", "unreadable", "keep", "unreadable", "wrong", "wrong", "keep"]
    said = "Cannot read 2 of 8 runs: coast_2.csv, coast_4.csv. Correct the entries of 2 of 8 runs: coast_5.csv, coast_6"
    assert document["sentence"].startswith(said)
    assert (document["coasts"]["out"], document["coasts"]["back"]) == (1, 3)
    remedies = [f["remedy"] for f in document["findings"] if f["doubt"]]
    assert len(remedies) == 4
    assert "write its name at this run, 'columns: {speed: NAME}'" in remedies[0]
    lines = path.read_text().splitlines()
    keys = {"coast_2": 'columns: {speed: "GPS Sped [km/h]"}', "coast_6": "units: {speed: mph}"}
    own = (next((key for log, key in keys.items() if log in line), "") for line in lines)
    fixed = [f"{line[:-1]}, {key}}}" if key else line for line, key in zip(lines, own, strict=True)]
    path.write_text("\n".join(line for line in fixed if "coast_4" not in line and "coast_5" not in line))
    assert checked(path, tmp_path / "out2", 0)["good"]


def test_one_error_of_many_lines_is_said_once(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda run, time, speed: speed)
    path.write_text(path.read_text().replace("direction: out", "direction: north"))
    with pytest.raises(InputError) as error:
        run_check(path, (), "", quiet)
    (merged,) = merge_lines(error.value.findings, least=4)
    assert merged.where.endswith("coast.yaml:9, 11, 13, 15")


@pytest.mark.slow
def test_a_wrong_unit_of_the_description_is_no_reason_to_drive_again(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda run, time, speed: speed)
    path.write_text(path.read_text().replace("unit: km/h", "unit: m/s"))
    document = checked(path, tmp_path, 1)
    said = document["sentence"]
    assert said.startswith("Correct the description first: channel 'speed' is read in 'm/s'")
    assert "correct the unit in the description" in said
    assert "repeated" not in said
    assert [(run["verdict"], len(run["why"])) for run in document["runs"]] == [("wrong", 1)] * RUNS
    with pytest.raises(InputError) as refused:
        write_step("coastdown", path, (), tmp_path / "out", None)
    assert "the file states another unit 'km/h'" in refused.value.findings[0].what


def test_a_column_that_increases_in_all_runs_is_no_speed(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda _run, _time, speed: speed[::-1])
    path.write_text(path.read_text().replace("speed_window: [80 km/h, 30 km/h]", "windows: auto"))
    with pytest.raises(InputError, match=r"coast.yaml:6: .*column 'GPS Speed \[km/h\]' increases in all 8 runs"):
        run_check(path, (), "", quiet)


@pytest.mark.slow  # 2 s
def test_logs_that_begin_at_rest_and_end_on_the_move_are_coasts(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda _run, time, speed: np.where(time < 20.0, 4.0 * time, speed))
    path.write_text(path.read_text().replace("speed_window: [80 km/h, 30 km/h]", "windows: auto"))
    checked(path, tmp_path, 0)


def test_a_speed_window_that_no_run_reaches_is_named_at_its_line(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda _run, _time, speed: speed)
    path.write_text(path.read_text().replace("[80 km/h, 30 km/h]", "[300 km/h, 250 km/h]"))
    with pytest.raises(InputError, match=r"coast.yaml:7: 'settings.speed_window': lies outside the logged speeds"):
        run_check(path, (), "", quiet)


def test_a_column_of_another_quantity_is_told_to_be_mapped_anew(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda run, time, speed: speed)
    path.write_text(path.read_text().replace('"Time [s]"', '"GPS Speed [km/h]"'))
    with pytest.raises(InputError, match="map 'time' to its own column: 'km/h' is not a unit of 'time'"):
        run_check(path, (), "", quiet)
