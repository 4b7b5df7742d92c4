"""Runs that differ from the others in unit or sign; one finding for one cause."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.descriptions import described
from vdyn_cli.description.yaml_source import load_yaml
from vdyn_cli.project.checks.check import check
from vdyn_cli.project.checks.run_unit_checks import other_units, with_run_signs
from vdyn_cli.project.execute import execute
from vdyn_cli.project.inputs import gather
from vdyn_cli.project.planned.day_plan import plan
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps import load_step
from vdyn_cli.steps.sign_conventions import wrong_sign


def coasts(*factors: float) -> list[Log]:
    t = np.arange(0.0, 60.0, 0.1)
    return [Log(f"run_{k}.csv", t, {"speed": f * (20.0 - 0.25 * t)}) for k, f in enumerate(factors)]


def test_a_run_in_another_unit_is_named_with_both_units() -> None:
    (finding,) = other_units(coasts(1.0, 1.0, 1 / 3.6, 1.0))
    assert finding.where.startswith("run_2.csv")
    assert "m/s among km/h" in finding.what
    assert not list(other_units(coasts(1.0, 0.9, 1.1, 1.0)))
    assert not list(other_units(coasts(1.0, 1 / 3.6)))
    assert len(list(other_units(coasts(1.0, 0.92, 1.0, 0.95 / 3.6)))) == 1  # it is 5 % slower, as runs are
    late = Log("late.csv", np.arange(20.0), {"speed": np.linspace(20.0 / 2.237, 5.3, 20)})  # the others end at 5 m/s
    assert not list(other_units([*coasts(1.0, 1.0, 1.0), late]))


@pytest.mark.parametrize(("in_other_unit", "reported"), [(False, 0), (True, 1)])
def test_an_acceleration_shows_whether_a_slow_run_has_another_unit(in_other_unit: bool, reported: int) -> None:
    time, logs = np.arange(0.0, 30.0, 0.1), []
    for k, factor in enumerate((1.0, 1.05, 1 / 1.609344, 0.97)):
        rate = 4.0 * np.sin(0.5 * time) * (1.0 if in_other_unit and k == 2 else factor)
        speed = factor * (5.0 + 8.0 * (1.0 - np.cos(0.5 * time)))
        logs.append(Log(f"run_{k}.csv", time, {"speed": speed, "acceleration": rate}))
    assert len(list(other_units(logs))) == reported


@pytest.mark.parametrize(
    ("text", "one_of_two", "every"),
    [
        ("{}", "add 'signs: {speed: -1}' to this run", "add 'sign: -1' to its channel"),
        (
            "channels: {speed: {column: v, sign: -1}}",
            "add 'signs: {speed: -1}' to this run",
            "remove 'sign: -1' from its channel (day.yaml:1)",
        ),
        ("channels: {speed: {column: v, sign: 1}}", "add 'signs", "add 'sign: -1' to its channel"),
        ("loggers: [{channels: {speed: {column: v, sign: -1}}}]", "add 'signs", "remove 'sign: -1' from its channel"),
        ("runs: [{log: run_1.csv, signs: {speed: -1}}]", "remove 'signs: {speed: -1}' from this run", "remove 'signs"),
    ],
)
def test_a_wrong_sign_is_removed_or_added_where_it_is_wrong(
    text: str, one_of_two: str, every: str, tmp_path: Path
) -> None:
    (tmp_path / "day.yaml").write_text(text)
    source = load_yaml(tmp_path / "day.yaml")
    wrong = wrong_sign("run_1.csv", "speed", "speed is negative")
    (turned,) = with_run_signs([wrong], coasts(1.0, -1.0), source)
    assert turned.remedy.startswith(one_of_two)
    assert with_run_signs([wrong], coasts(-1.0), source)[0].remedy.startswith(every)
    assert with_run_signs([wrong], (), source) == (wrong,)


def test_a_unit_of_time_stated_for_a_run_has_priority_over_the_file(root: Path, tmp_path: Path) -> None:
    head, *rows = (root / "sample_logs" / "coast_1.csv").read_text(encoding="utf-8").splitlines()
    assert "[s]" in head
    cells = [row.split(",") for row in rows]
    written = [head, *(",".join([f"{1e3 * float(time):.6g}", *others]) for time, *others in cells)]
    (tmp_path / "ms.csv").write_text("\n".join(written), encoding="utf-8")
    log = f"{root / 'sample_logs' / 'coast_1.csv'}"
    remedy = r"'units: {time: ms}'"
    with pytest.raises(InputError, match=remedy):
        gather(load_step("coastdown"), described(tmp_path, root, "coastdown", (log, "ms.csv")))
    path = described(tmp_path, root, "coastdown", (log, "ms.csv"), ("start: 0 s", "start: 0 s, units: {time: ms}"))
    ms = gather(load_step("coastdown"), path).logs[0]
    assert ms.duration == pytest.approx(float(cells[-1][0]) - float(cells[0][0]), abs=1.0)
    (note,) = [f for f in ms.findings if "states another unit 's'" in f.what]
    assert not note.doubt
    assert f"{path.name}:12" in note.what
    path = described(tmp_path, root, "coastdown", ('"Time [s]", unit: s', '"Time [s]", unit: ms'))
    with pytest.raises(InputError, match=remedy):
        gather(load_step("coastdown"), path)


def test_every_command_names_the_run_whose_sign_is_wrong(root: Path, tmp_path: Path) -> None:
    path = described(tmp_path, root, "coastdown", ("start: 0 s}", "start: 0 s, signs: {speed: -1}}"))
    for command in (check, plan, lambda path: execute("coastdown", path)):
        with pytest.raises(InputError, match=r"coast_1.csv(.|\n)*remove 'signs: \{speed: -1\}' from this run"):
            command(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("speed_window: [74 km/h, 21 km/h]", "speed_window: [70, 25]", "write [70 km/h, 25 km/h], highest first"),
        ("temperature: 24 degC", "temperature: 24", "write '24 degC'"),
        ('column: "GPS Speed [km/h]", unit: km/h', 'column: "GPS Speed [km/h]", unit: kg', "'kg' is not a unit"),
    ],
)
def test_one_wrong_key_draws_one_finding(old: str, new: str, message: str, tmp_path: Path, root: Path) -> None:
    path = described(tmp_path, root, "coastdown", (old, new))
    with pytest.raises(InputError) as refused:
        gather(load_step("coastdown"), path)
    assert len(refused.value.findings) == 1
    assert message in str(refused.value)


def test_a_sign_of_one_run_is_turned(tmp_path: Path, root: Path) -> None:
    plain = gather(load_step("coastdown"), described(tmp_path, root, "coastdown"))
    path = described(tmp_path, root, "coastdown", ("coast_2.csv,", "coast_2.csv, signs: {position: -1},"))
    turned = gather(load_step("coastdown"), path)
    np.testing.assert_array_equal(turned.logs[1]["position"], -plain.logs[1]["position"])
    np.testing.assert_array_equal(turned.logs[0]["position"], plain.logs[0]["position"])


@pytest.mark.parametrize("reference", ["wheel_speed", "position"])
def test_a_run_that_was_driven_slower_is_in_the_same_unit(reference: str) -> None:
    """Three drives to 97 km/h and one to 60: another sensor also measured the lower speed."""

    def drive(k: int, factor: float, unit: float) -> Log:
        t = np.arange(0.0, 60.0, 0.1)
        speed = factor * (20.0 - 0.25 * t)
        seen = speed / 0.31 if reference == "wheel_speed" else np.cumsum(speed) * 0.1
        return Log(f"run_{k}.csv", t, {"speed": unit * speed, reference: seen})

    slower, mph = 1 / 1.609344, 1 / 1.609344
    assert not list(other_units([drive(k, f, 1.0) for k, f in enumerate((1.0, slower, 1.0, 1.0))]))
    (finding,) = other_units([drive(k, 1.0, u) for k, u in enumerate((1.0, mph, 1.0, 1.0))])
    assert finding.where.startswith("run_1.csv")


@pytest.mark.parametrize("viscous", [0.0, 600.0])
def test_a_slower_drive_is_in_the_same_unit_where_its_torque_agrees(viscous: float) -> None:
    """Four drives, one in a town: a torque causes the same acceleration of the 1200 kg car in all of them.

    ``viscous`` : N s/m, of a driveline that takes more of the torque at high speed.
    """

    def drive(k: int, factor: float, unit: float) -> Log:
        t = np.arange(0.0, 60.0, 0.1)
        rate = factor * np.repeat([1.2, 0.6, 0.1, -0.4, -0.8, 0.3], t.size // 6)
        speed = 3.0 * factor + np.cumsum(rate) * 0.1
        torque = np.maximum(1200 * rate + 150 + viscous * speed + 0.4 * speed**2, 0.0) * 0.31
        noise = np.random.default_rng(k).normal(0.0, 0.05, t.size)
        return Log(f"run_{k}.csv", t, {"speed": unit * (speed + noise), "drive_torque": torque})

    mph = 1 / 1.609344
    assert not list(other_units([drive(k, f, 1.0) for k, f in enumerate((1.0, mph, 1.0, 1.0))]))
    (finding,) = other_units([drive(k, 1.0, u) for k, u in enumerate((1.0, mph, 1.0, 1.0))])
    assert finding.where.startswith("run_1.csv")


def logged(folder: Path, name: str, unit: str, factor: float) -> str:
    begin = 20.0 + 0.1 * int(name[1])
    rows = (f"{t:.1f},{factor * (begin - 0.25 * t):.3f}" for t in np.arange(0.0, 60.0, 0.1))
    (folder / name).write_text("\n".join([f"Time [s],Speed [{unit}]", *rows]) + "\n")
    return name


HEAD = (
    "test: coastdown\nvehicle: {mass: 1500 kg, rotating_mass: 50 kg, frontal_area: 2.2 m^2}\n"
    "environment: {temperature: 24 degC, pressure: 99 kPa}\n"
)


def mixed(folder: Path, more: str) -> Path:
    """Four coast-downs, the third in mph in a column with another name; ``more`` is added to its run."""
    names = [logged(folder, f"c{k}.csv", *(("mph", 2.236936) if k == 2 else ("km/h", 3.6))) for k in range(4)]
    own = f', columns: {{speed: "Speed [mph]"}}{more}'
    runs = [f"{{log: {name}{own if k == 2 else ''}}}" for k, name in enumerate(names)]
    (folder / "c.yaml").write_text(
        HEAD + "channels:\n  time: {column: 'Time [s]', unit: s}\n"
        "  speed: {column: 'Speed [km/h]', unit: km/h}\nruns:\n" + "".join(f"  - {r}\n" for r in runs)
    )
    return folder / "c.yaml"


def test_a_run_has_a_unit_of_its_own(tmp_path: Path) -> None:
    logs = gather(load_step("coastdown"), mixed(tmp_path, ", units: {speed: mph}")).logs
    np.testing.assert_allclose(logs[2]["speed"] - 0.1, logs[1]["speed"], atol=1e-3)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("", r"another unit 'mph'(?s:.*)write 'units: \{speed: mph\}' at this run"),
        (", units: {speed: furlong}", r"c.yaml:10: .*'furlong' is not a unit of speed"),
        (", units: {position: m}", r"channel 'position' is not mapped"),
        (", units: {speed: km/h}", r"write 'units: \{speed: mph\}' at this run if its file is in mph"),
    ],
)
def test_a_run_whose_file_states_another_unit_is_refused(more: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message) as refused:
        gather(load_step("coastdown"), mixed(tmp_path, more))
    assert len(refused.value.findings) == 1


def two_speeds(folder: Path, units: str) -> Path:
    """Two coast-downs by two loggers of one speed each; the first logger's second log is in mph."""
    names = [logged(folder, f"c{k}{n}.csv", *u) for k in (0, 1) for n, u in ((1, CAR[k]), (2, ("km/h", 3.6)))]
    channels = "{time: {column: 'Time [s]', unit: s}, speed: {column: 'Speed [km/h]', unit: km/h}}"
    (folder / "c.yaml").write_text(
        f"{HEAD}loggers:\n"
        f"  - {{channels: {channels}}}\n  - {{channels: {channels}, delay: 0 s}}\n"
        f"runs:\n  - {{logs: [{names[0]}, {names[1]}]}}\n"
        f"  - {{logs: [{names[2]}, {names[3]}], columns: [{{speed: 'Speed [mph]'}}, null], units: {units}}}\n"
    )
    return folder / "c.yaml"


CAR = (("km/h", 3.6), ("mph", 2.236936))


def test_a_run_has_a_unit_for_one_of_its_loggers(tmp_path: Path) -> None:
    logs = gather(load_step("coastdown"), two_speeds(tmp_path, "[{speed: mph}, null]")).logs
    np.testing.assert_allclose(logs[1]["speed"] - 0.1, logs[0]["speed"], atol=1e-3)


@pytest.mark.parametrize(
    ("units", "message"),
    [
        ("{}", r"write 'units: \[\{speed: mph\}, null\]' at this run"),
        ("[{speed: mph}]", r"'units' has 1 of the 2 entries, one for each log: write null"),
        ("[null, {position: m}]", r"c.yaml:9: channel 'position' is not mapped"),
        ("[{speed: furlong}, null]", r"c.yaml:9: .*'furlong' is not a unit of speed"),
        ("[{speed: [3]}, null]", r"c.yaml:9: 'runs.1.units.0.speed' must be a text"),
    ],
)
def test_a_wrong_unit_for_one_of_the_loggers_is_refused(units: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        gather(load_step("coastdown"), two_speeds(tmp_path, units))


def test_a_finding_with_further_values_is_written_as_a_message() -> None:
    wrong = wrong_sign("run_1.csv", "speed", "speed is negative")
    assert Finding(**wrong.to_json()) == Finding("run_1.csv, speed", "speed is negative", "", wrong.remedy)
