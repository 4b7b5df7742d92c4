"""``vdyn init``: correct or undecided for every known log; its drafts can be completed and run."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from tests.io.stored_logs import FORMATS, write
from vdyn_cli.commands.run_init import run_init
from vdyn_cli.description.yaml_source import load_yaml
from vdyn_cli.io.channel_survey import ChannelFacts
from vdyn_cli.io.reader import ChannelInfo
from vdyn_cli.project.drafting import description_draft
from vdyn_cli.project.drafting.description_draft import DescriptionDraft, draft_description
from vdyn_cli.project.drafting.run_direction import logged_directions
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.steps import load_step

SAMPLES = {
    "coastdown": [f"coast_{i}" for i in range(1, 9)],
    "cg": [f"launch_{i}" for i in range(1, 5)],
    "bump": [f"bump_{i}" for i in range(1, 5)],
    "inertia": [f"wheel_{i}" for i in range(1, 4)],
    "tire": [f"slip_{i}" for i in range(1, 6)],
    "shaft": ["tip_in"],
    "validate": [f"drive_{i}" for i in range(1, 4)],
}


@pytest.fixture(scope="module", autouse=True)
def _each_log_is_surveyed_once() -> Iterator[None]:
    """The facts about a log are the same for every step."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(description_draft, "survey", cache(description_draft.survey))
        yield


def draft(step: str, *paths: Path) -> tuple[DescriptionDraft, dict[str, Any]]:
    found = draft_description(load_step(step), paths, paths[0].parent)
    return found, yaml.safe_load(found.text)


def columns(channels: Mapping[str, Mapping[str, Any]]) -> dict[str, tuple[str, str]]:
    return {n: (c["column"], c["unit"].replace("N m", "Nm")) for n, c in channels.items()}


@pytest.mark.parametrize("step", SAMPLES)
def test_the_sample_logs_are_mapped_as_their_descriptions_map_them(step: str, root: Path) -> None:
    _, found = draft(step, *(root / "sample_logs" / f"{n}.csv" for n in SAMPLES[step]))
    expected = load_yaml(root / "configs" / f"{step}.yaml").data
    assert columns(found["channels"]) == columns(expected["channels"])
    assert [Path(r["log"]).stem for r in found["runs"]] == SAMPLES[step]


@pytest.mark.parametrize("step", SAMPLES)
def test_a_draft_that_is_filled_in_is_a_description(step: str, root: Path, tmp_path: Path) -> None:
    found = draft_description(load_step(step), [root / "sample_logs" / f"{n}.csv" for n in SAMPLES[step]], tmp_path)
    filled = re.sub(r'"\?"(.*such as )(.+)', r"\2 #\1", found.text).replace('side: "?"', "side: left")
    assert '"?"' not in filled.partition("\n")[2]
    (tmp_path / "test.yaml").write_text(filled, encoding="utf-8")
    inputs = gather(load_step(step), tmp_path / "test.yaml")
    assert len(inputs.logs) == len(SAMPLES[step])


def test_a_swinging_wheel_is_a_pendulum(root: Path) -> None:
    found, description = draft("inertia", root / "sample_logs" / "pendulum.csv")
    assert columns(description["pendulum"]["channels"]) == {
        "time": ("Time [s]", "s"),
        "angular_rate": ("Angular Rate [rad/s]", "rad/s"),
    }
    assert found.undecided == ("kind", "mass", "pivot_distance")


I3 = {
    "time": ("Time [s]", "s"),
    "speed": ("Velocity [km/h]", "km/h"),
    "drive_torque": ("Motor Torque [Nm]", "Nm"),
    "acceleration": ("Longitudinal Acceleration [m/s^2]", "m/s^2"),
    "elevation": ("Elevation [m]", "m"),
}
SWINGING = {"time": ("time", "s"), "angular_rate": ("angular_velocity", "?")}
# The channels of any step in each file; a step may map these and no others. Units that are not stated: "?".
TRUTH: dict[str, dict[str, tuple[str, str]]] = {
    "can_speed": {"time": ("t", "s"), "speed": ("v_mps", "m/s")},
    "gnss": {"time": ("t", "s"), "speed": ("speed_mps", "m/s"), "elevation": ("alt_m", "m")},
    "imu_acc_mps2": {"time": ("t", "s"), "acceleration": ("forward", "m/s^2")},
    "imu_gyro_radps": {"time": ("t", "s")},
    "wheel_speed_mps": {"time": ("t", "s")},
    "bicycle-wheel-axial-inertia-rate-gyro-measurement": SWINGING,
    "bicycle-wheel-radial-inertia-rate-gyro-measurement": SWINGING,
}


@pytest.mark.parametrize("step", SAMPLES)
def test_every_file_of_the_measurements_is_mapped_right_or_not_at_all(step: str, shared_data: Path) -> None:
    paths = [p for p in sorted(shared_data.glob("*/*")) if p.suffix in (".csv", ".gz", ".txt")]
    logs = 0
    for path in paths:
        known = I3 if path.parent.name == "bmw_i3" else TRUTH.get(path.stem)
        if known is None:
            with pytest.raises(InputError):
                draft(step, path)
            continue
        logs += 1
        found, description = draft(step, path)
        channels = (description.get("pendulum") or description)["channels"]
        mapped = {n: c for n, c in columns(channels).items() if c[0] != "?"}
        possible = {**known, **({"vehicle_speed": known["speed"]} if "speed" in known else {})}
        assert mapped.items() <= possible.items(), (path.name, mapped)
        # Every channel that the step uses and the file contains is found; a constant one is reported.
        usable = set(load_step(step).channels()) & set(possible)
        if "angular_rate" not in known:
            constant = set(re.findall(r"# (\w+): '.*' is constant at", found.text))
            assert set(mapped) == usable - constant, path.name
            assert not constant - {"elevation"}, path.name
        open_ones = {n for n, c in columns(channels).items() if "?" in c}
        assert all(any(n in key for key in found.undecided) for n in open_ones), path.name
    assert logs > 20


def test_the_trips_of_a_season_are_runs_although_their_headers_differ(shared_data: Path) -> None:
    paths = sorted((shared_data / "bmw_i3").glob("Trip*.csv.gz"))
    _, found = draft("validate", *paths)
    assert columns(found["channels"]) == {n: c for n, c in I3.items() if n != "elevation"}
    assert len(found["runs"]) == len(paths)


def test_logs_of_one_drive_are_loggers(shared_data: Path) -> None:
    names = ("can_speed", "gnss", "imu_acc_mps2", "imu_gyro_radps")
    found, description = draft("coastdown", *(shared_data / "comma2k19_segment" / f"{n}.csv" for n in names))
    assert [columns(one["channels"]) for one in description["loggers"]] == [TRUTH[n] for n in names[:3]]
    assert [Path(p).stem for p in description["runs"][0]["logs"]] == list(names[:3])
    assert "left out: imu_gyro_radps.csv" in found.text
    assert "its clock is aligned by channels 'speed' and 'acceleration'" in found.text


def log_name(names: str, logger: str, run: int) -> str:
    """The name of a log; ``other`` counts downwards on the car's bus."""
    return names.format(logger=logger, run=run, letter="abcd"[run - 1], other=7 - run if logger == "can" else run)


def write_loggers(folder: Path, begins: Sequence[float], names: str) -> list[Path]:
    """Four coast-downs, each by the car's bus and by a receiver with a heading; all clocks count from ``begins``."""
    paths = []
    for run, begin in enumerate(begins, 1):
        time = np.arange(0.0, 60.0, 0.1)
        speed = 72.0 - 0.7 * time
        heading = 30.0 if run % 2 else 210.0
        tables = {
            "can": {"Time [s]": time + begin, "Vehicle Speed [km/h]": speed},
            "vbox3": {"t [s]": time + begin + 3.0, "GPS Speed [km/h]": speed, "Heading [deg]": heading + 0.0 * time},
        }
        for logger, table in tables.items():
            path = folder / log_name(names, logger, run)
            np.savetxt(path, np.column_stack(list(table.values())), "%.3f", ",", header=",".join(table), comments="")
            paths.append(path)
    return sorted(paths)


@pytest.mark.parametrize(
    ("begins", "names"),
    [
        ((0.0, 0.0, 0.0, 0.0), "{logger}_run{run}_2026.csv"),
        ((0.0, 0.0, 0.0, 0.0), "{logger}_{letter}.csv"),
        ((1.7e9, 1.7e9 + 200.0, 1.7e9 + 400.0, 1.7e9 + 600.0), "{logger}_{other}.csv"),
    ],
)
def test_each_run_has_a_log_of_each_logger(tmp_path: Path, begins: Sequence[float], names: str) -> None:
    found, description = draft("coastdown", *write_loggers(tmp_path, begins, names))
    assert [columns(one["channels"])["speed"][0] for one in description["loggers"]] == [
        "Vehicle Speed [km/h]",
        "GPS Speed [km/h]",
    ]
    pairs = sorted(tuple(Path(log).name for log in run["logs"]) for run in description["runs"])
    wanted = [(log_name(names, "can", run), log_name(names, "vbox3", run)) for run in (1, 2, 3, 4)]
    assert pairs == sorted(wanted)
    ways = {Path(run["logs"][1]).name: run["direction"] for run in description["runs"]}
    by_run = [ways[pair[1]] for pair in wanted]
    assert by_run in (["out", "back"] * 2, ["back", "out"] * 2)  # out is that of the first in the order of the names
    starts = [run.get("start") for run in description["runs"]]
    assert [one is not None for one in starts] == [begins[0] > 0.0] * 4  # only clocks that count from an epoch tell it
    assert not any("direction" in key for key in found.undecided)


def test_files_of_one_folder_are_of_one_run(tmp_path: Path) -> None:
    """A phone's app writes a folder for each recording, with a file of the same name for each sensor."""
    paths = []
    for path in write_loggers(tmp_path, (0.0,) * 4, "{logger}_run{run}.csv"):
        logger, run = path.stem.split("_")
        (tmp_path / f"recording {run}").mkdir(exist_ok=True)
        paths.append(path.rename(tmp_path / f"recording {run}" / f"{logger}.csv"))
    runs = draft("coastdown", *paths)[1]["runs"]
    assert len(runs) == 4
    assert all(len({Path(log).parent for log in run["logs"]}) == 1 == len(run["logs"]) - 1 for run in runs)


@pytest.mark.parametrize("lost", ["can_run2.csv", "vbox3_run4.csv"])
def test_a_log_without_the_other_logger_s_is_left_out(tmp_path: Path, lost: str) -> None:
    paths = [p for p in write_loggers(tmp_path, (0.0,) * 4, "{logger}_run{run}.csv") if p.name != lost]
    found, description = draft("coastdown", *paths)
    pairs = {tuple(Path(log).name for log in run["logs"]) for run in description["runs"]}
    lone = lost.replace("can", "vbox3") if lost.startswith("can") else lost.replace("vbox3", "can")
    runs = [k for k in (1, 2, 3, 4) if str(k) not in lost.replace("vbox3", "")]
    assert pairs == {(f"can_run{k}.csv", f"vbox3_run{k}.csv") for k in runs}
    assert re.search(rf'{lone}"}}  # left out: no matching log of the other logger', found.text)


def test_a_log_in_another_unit_is_a_run_with_keys_of_its_own(tmp_path: Path) -> None:
    for k in range(4):
        unit, factor = ("mph", 1 / 1.609344) if k == 2 else ("km/h", 1.0)
        rows = [f"{t:.1f},{factor * (72.0 + k - 0.7 * t):.3f}" for t in np.arange(0.0, 60.0, 0.1)]
        (tmp_path / f"run_{k}.csv").write_text("\n".join([f"t [s],Speed [{unit}]", *rows]) + "\n")
    runs = draft("coastdown", *sorted(tmp_path.glob("*.csv")))[1]["runs"]
    assert [run.get("units") for run in runs] == [None, None, {"speed": "mph"}, None]
    assert runs[2]["columns"] == {"speed": "Speed [mph]"}


@pytest.mark.parametrize("both", [False, True])
def test_a_log_in_another_unit_belongs_to_its_logger_s_others(tmp_path: Path, both: bool) -> None:
    """A key of a run applies to all its loggers, so that it is not written if another logger has the same channel."""
    paths = write_loggers(tmp_path, (0.0,) * 4, "{logger}_run{run}.csv")
    for path in paths:
        text = path.read_text()
        text = text if both or "can" in path.name else text.replace("GPS Speed", "Lateral Speed Left")
        path.write_text(text)
    odd = tmp_path / "can_run3.csv"
    lines = odd.read_text().splitlines()
    rows = [f"{t},{float(v) / 3.6:.4f}" for t, v in (line.split(",") for line in lines[1:])]
    odd.write_text("\n".join([lines[0].replace("km/h", "m/s"), *rows]) + "\n")
    found, description = draft("coastdown", *paths)
    units = {Path(run["logs"][0]).name: run.get("units") for run in description["runs"]}
    assert units.pop("can_run3.csv", None) == (None if both else {"speed": "m/s"})
    assert list(units.values()) == [None] * 3
    assert ('can_run3.csv"}  # left out' in found.text) == both


def test_logs_of_two_loggers_that_cannot_be_matched_are_not(tmp_path: Path) -> None:
    found, description = draft("coastdown", *write_loggers(tmp_path, (0.0,) * 4, "{logger}_{other}.csv"))
    assert "loggers" not in description
    assert "neither their clocks nor their names show which are of one" in found.text


def test_rivals_and_groups_of_an_mdf_file(tmp_path: Path) -> None:
    time = np.arange(0.0, 60.0, 0.1)
    tables = [
        {"time": time, "Speed": 20.0 + np.sin(time), "Motor Torque": 50.0 * np.cos(time)},
        {"time": time[::2], "Speed": 20.1 + np.sin(time[::2]), "Accel X": 0.1 * np.cos(time[::2])},
    ]
    units = {"Speed": "m/s", "Motor Torque": "Nm", "Accel X": "m/s^2"}
    path = write("mf4", tmp_path / "run", tables, units)
    found, description = draft("validate", path)
    assert columns(description["channels"]) == {
        "time": ("time", "s"),
        "speed": ("?", "?"),
        "drive_torque": ("Motor Torque", "Nm"),
        "acceleration": ("Accel X", "m/s^2"),
    }
    assert "not decided between 'logger 1: Speed' (19 to 21 m/s) and 'logger 2: Speed' (19.1 to 21.1 m/s)" in found.text
    assert "speed" in found.undecided


@pytest.mark.parametrize("kind", FORMATS)
def test_a_coast_down_of_every_format_is_described(kind: str, tmp_path: Path) -> None:
    time = np.arange(0.0, 60.0, 0.1)
    path = write(kind, tmp_path / "run", [{"time": time, "Speed": 30.0 - 0.3 * time}], {"time": "s", "Speed": "m/s"})
    assert draft("coastdown", path)[1]["channels"]["speed"]["column"] == "Speed"


@pytest.mark.parametrize(
    ("header", "why"),
    [
        ("Time [s],Speed [N m]", "is in N m, which is not a unit of speed (m/s)"),
        ("Time [s],Speed [km/s]", "which is impossible for a vehicle"),
        ("Time [s],Wheel Speed [km/h]", "no column has such a name"),
        ("Time [s],Speed (motor) [km/h]", "no column has such a name"),
        ("Time [s],GPS Speed [km/h],CAN Speed [km/h]", "between 'GPS Speed [km/h]' (50 to 56 km/h) and"),
    ],
)
def test_what_could_be_wrong_is_not_mapped(header: str, why: str, tmp_path: Path) -> None:
    width = header.count(",")
    rows = [",".join([f"{0.1 * i:.1f}", *(f"{50 + (i * (k + 3)) % 7}" for k in range(width))]) for i in range(300)]
    (tmp_path / "run.csv").write_text("\n".join([header, *rows]) + "\n")
    found, description = draft("coastdown", tmp_path / "run.csv")
    assert columns(description["channels"])["speed"] == ("?", "?")
    assert why in found.text


def table(path: Path, **columns_: Any) -> Path:
    """A log of columns; the last word of each name is its unit in brackets."""
    named = [n.rsplit("_", 1) for n in columns_]
    header = ",".join(f"{n} [{unit.replace('per', '/')}]" if unit else n for n, unit in named)
    np.savetxt(path, np.column_stack(list(columns_.values())), delimiter=",", header=header, comments="", fmt="%.12g")
    return path


WAVE = np.sin(np.arange(600) / 30.0)


@pytest.mark.parametrize(
    ("step", "columns_", "expected"),
    [
        ("tire", {"FXW_N": 900 * WAVE, "FZW_N": -4000 + 9 * WAVE, "KAPPA_%": 9 * WAVE}, ("slip", "KAPPA [%]")),
        (
            "cg",
            {"Fz FL_N": 4000 + WAVE, "Acc Long_mpers2": WAVE, "GyroY_degpers": WAVE},
            ("pitch_rate", "GyroY [deg/s]"),
        ),
        ("cg", {"Fz FL_N": 4000 + WAVE, "Acc Long_mpers2": WAVE}, ("acceleration", "Acc Long [m/s2]")),
        ("cg", {"Fz FL_N": 4000 + WAVE, "G Force Long_G": WAVE}, ("acceleration", "G Force Long [G]")),
        ("inertia", {"MY_Nm": 90 * WAVE, "VFZG_kmperh": 50 + WAVE}, ("vehicle_speed", "VFZG [km/h]")),
        (
            "coastdown",
            {"Speed_mph": 60 - WAVE, "Accel X_g": 0.3 * WAVE, "Accel Y_g": 0.1 * WAVE},
            ("acceleration", "Accel X [g]"),
        ),
    ],
)
def test_names_and_units_of_rigs_and_phones_are_known(
    step: str, columns_: dict[str, Any], expected: tuple[str, str], tmp_path: Path
) -> None:
    time = np.arange(600) / 10.0
    _, description = draft(step, table(tmp_path / "a.csv", **{"time_s": time, **columns_}))
    channel, column = expected
    assert description["channels"][channel]["column"] == column
    assert "?" not in description["channels"][channel]["unit"]


def test_one_quantity_in_two_units_is_one_channel(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    rows = [f"{k / 10},{100 - k / 10:.3f},{(100 - k / 10) / 1.609344:.3f}" for k in range(600)]
    path.write_text("\n".join(["TIME_s,SPEED_KPH,SPEED_MPH", *rows]) + "\n")
    assert draft("coastdown", path)[1]["channels"]["speed"] == {"column": "SPEED_KPH", "unit": "km/h"}
    path = tmp_path / "other.csv"
    rows = [f"{k / 10},{100 - k / 10:.3f},{(101 - k / 10) / 1.609344:.3f}" for k in range(600)]
    path.write_text("\n".join(["TIME_s,SPEED_KPH,SPEED_MPH", *rows]) + "\n")
    assert draft("coastdown", path)[1]["channels"]["speed"]["column"] == "?"


def test_the_speed_of_an_axle_serves_where_no_other_is_logged(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    rows = [f"{k / 10},{940 - k:.1f}" for k in range(600)]
    path.write_text("\n".join(["Time[s],WheelSpeedFrontAxle[rpm]", *rows]) + "\n")
    _, description = draft("coastdown", path)
    assert description["channels"]["wheel_speed"] == {"column": "WheelSpeedFrontAxle[rpm]", "unit": "rpm"}
    assert "speed" not in description["channels"]
    assert description["vehicle"]["wheel_radius"] == "?"
    path = tmp_path / "wheel.csv"
    path.write_text("\n".join(["Time[s],wheel_rpm", *rows]) + "\n")
    assert draft("coastdown", path)[1]["channels"]["wheel_speed"] == {"column": "wheel_rpm", "unit": "rpm"}
    path = tmp_path / "front.csv"
    path.write_text("\n".join(["Time[s],N Front[rpm]", *rows]) + "\n")
    assert "map 'wheel_speed' instead: by their unit: \"N Front[rpm]\"" in draft("coastdown", path)[0].text


@pytest.mark.parametrize("name", ["Wheel Rotation FL", "Wheel speed FL"])
def test_the_speed_of_one_wheel_is_offered(name: str, tmp_path: Path) -> None:
    columns_ = {"Time_s": np.arange(600) / 10.0, "FX_N": 900 * WAVE, "FZ_N": 4000 + WAVE, f"{name}_rpm": 700 + WAVE}
    found, data = draft("tire", table(tmp_path / "a.csv", **columns_, **{"Speed_kmperh": 80 + WAVE}))
    assert f"# wheel_speed: '{name} [rpm]' is that of one wheel: map it if that wheel was tested" in found.text
    assert "wheel_speed" not in data["channels"]


def test_a_needed_channel_without_a_name_is_offered_by_unit(tmp_path: Path) -> None:
    columns_ = {"time_s": np.arange(600) / 10.0, "Q7_Nm": 90 * WAVE, "N_1permin": 300 + WAVE, "T_degC": 50 + WAVE}
    found, _ = draft("inertia", table(tmp_path / "a.csv", **columns_))
    assert re.search(r'hub_torque: .*# needed: .*; by their unit: "Q7 \[Nm\]"\n', found.text)
    assert re.search(r'wheel_speed: .*# needed: .*; by their unit: "N \[1/min\]"\n', found.text)


def test_logs_of_a_clock_that_runs_on_have_starts(tmp_path: Path) -> None:
    """Seconds since midnight, or since the logger was switched on; logs that all begin at zero give no start times."""
    time = np.arange(600) / 10.0
    for begin, step, starts in ((62400.0, 300.5, ["0.0 s", "300.5 s"]), (0.0, 0.0, [None, None])):
        paths = [
            table(tmp_path / f"{begin:.0f}_{k}.csv", SECONDS_s=begin + k * step + time, Speed_mph=60 - time - 0.1 * k)
            for k in range(2)
        ]
        _, description = draft("coastdown", *paths)
        assert [run.get("start") for run in description["runs"]] == starts


def test_an_axis_that_varies_less_than_the_one_beside_it_is_not_decided(tmp_path: Path) -> None:
    """A phone may lie in any orientation."""
    axes = {"Speed_mph": 60 - WAVE, "Accel X_g": 0.05 * WAVE, "Accel Y_g": 0.3 * WAVE}
    found, _ = draft("coastdown", table(tmp_path / "a.csv", **{"time_s": np.arange(600) / 10.0, **axes}))
    assert "acceleration: not decided between 'Accel X [g]' by its name and 'Accel Y [g]', which varies" in found.text
    assert "acceleration" not in found.mapped


def test_a_second_clock_since_1970_gives_the_starts(tmp_path: Path) -> None:
    time = np.arange(600) / 10.0
    paths = [
        table(
            tmp_path / f"run_{k}.csv",
            **{"Time_": time, "UTC Time_": 1.758e9 + 300.5 * k + time, "Speed_mph": 60 - time},
        )
        for k in range(2)
    ]
    _, description = draft("coastdown", *paths)
    assert [run["start"] for run in description["runs"]] == ["0.0 s", "300.5 s"]


def test_an_existing_file_is_not_overwritten(root: Path, tmp_path: Path) -> None:
    said: list[str] = []
    run_init("tire", [root / "sample_logs" / "slip_1.csv"], str(tmp_path / "tire.yaml"), said.append)
    assert said[1:] == [
        "mapped: time, force_x, force_z, wheel_speed, vehicle_speed",
        "to decide: wheel_radius",
    ]
    with pytest.raises(InputError, match="is not overwritten"):
        run_init("tire", [root / "sample_logs" / "slip_1.csv"], str(tmp_path / "tire.yaml"), said.append)
    with pytest.raises(InputError, match="reads no logs"):
        run_init("area", [root / "sample_logs" / "slip_1.csv"], "-", said.append)


@pytest.mark.parametrize(
    "name", ["GPS (2D speed) [m/s]", "Speed m/s", "Speed (OBD)(m/s)", "v_GPS (m/s)", "speed_meters_per_sec"]
)
def test_words_and_units_behind_a_name_are_read(name: str, tmp_path: Path) -> None:
    rows = [f"{t:.1f},{30.0 - 0.3 * t:.2f}" for t in np.arange(0.0, 60.0, 0.1)]
    (tmp_path / "run.csv").write_text("\n".join([f"Time [s],{name}", *rows]) + "\n")
    assert columns(draft("coastdown", tmp_path / "run.csv")[1]["channels"])["speed"] == (name, "m/s")


def test_rivals_of_one_name_state_the_devices_below_the_header(tmp_path: Path) -> None:
    """As RaceChrono writes them: speeds of the receiver and of the car in columns of one name."""
    rows = "".join(
        f"{t / 10:.1f},0,1,{t / 10},{3 * t},{30 - 0.02 * t:.2f},{20 - 0.01 * t:.2f},1.2\n" for t in range(300)
    )
    head = "timestamp,fragment_id,lap_number,elapsed_time,distance_traveled,speed,speed,speed_accuracy\n"
    head += "unix time,,,s,m,m/s,m/s,m/s\n,,,,,100: gps,200: obd,100: gps\n"
    (tmp_path / "lap.csv").write_text(head + rows)
    text = draft("coastdown", tmp_path / "lap.csv")[0].text
    assert "not decided between 'speed#1' from 100: gps (24.02 to 30 m/s) and 'speed#2' from 200: obd" in text


def test_the_corner_of_a_single_wheel_s_sensor_is_ignored(tmp_path: Path) -> None:
    rows = "".join(f"{t / 500},{-200 + t},{700 - t},{-60 + 0.1 * t},{40 + 0.1 * t},{0.001 * t}\n" for t in range(300))
    (tmp_path / "wheel.csv").write_text('Time,RR_Fx,RR_Fz,RR_My,"RR_Wheel,Speed",RR_Ax\n' + rows)
    found = draft("inertia", tmp_path / "wheel.csv")[1]["channels"]
    expected = {"hub_torque": "RR_My", "wheel_speed": "RR_Wheel,Speed", "acceleration": "RR_Ax"}
    assert {name: found[name]["column"] for name in expected} == expected
    four = (tmp_path / "wheel.csv").read_text().replace("RR_Ax", "RL_Ax")
    (tmp_path / "wheels.csv").write_text(four)
    assert draft("inertia", tmp_path / "wheels.csv")[1]["channels"]["wheel_speed"]["column"] == "?"


@pytest.mark.parametrize("clock", ["time", "ms_today", "time_ms"])
def test_the_coasts_of_a_log_in_milliseconds_are_selected_in_seconds(clock: str, tmp_path: Path) -> None:
    time = np.arange(0.0, 240.0, 0.1)
    speed = 30.0 + 10.0 * np.abs((time % 120.0) / 60.0 - 1.0)  # slows for 60 s, accelerates for 60 s, twice
    rows = [f"{1000 * t:.0f},{v:.3f}" for t, v in zip(time, speed, strict=True)]
    (tmp_path / "run.csv").write_text("\n".join([f"{clock},speed_kmh", *rows]) + "\n")
    runs = draft("coastdown", tmp_path / "run.csv")[1]["runs"]
    ends = [float(run["to_time"].split()[0]) for run in runs]
    assert ends == pytest.approx([60.0, 180.0], abs=3.0)


@pytest.mark.parametrize("first", ["Elapsed Distance", "elapsed_km", "Elapsed Energy [kWh]"])
def test_what_else_elapses_is_no_clock(first: str, tmp_path: Path) -> None:
    rows = [f"{2.0 * t:.2f},{t:.1f},{30.0 - 0.3 * t:.2f}" for t in np.arange(0.0, 60.0, 0.1)]
    (tmp_path / "run.csv").write_text("\n".join([f"{first},Elapsed (s),Speed m/s", *rows]) + "\n")
    assert draft("coastdown", tmp_path / "run.csv")[1]["channels"]["time"]["column"] == "Elapsed (s)"


def test_a_german_abbreviation_of_speed_is_known(tmp_path: Path) -> None:
    rows = "".join(f"{100 * k};{60.0 - 0.1 * k:.1f}\n".replace(".", ",") for k in range(200))
    (tmp_path / "lauf.csv").write_text("Zeit [ms];GPS-Geschw. [mph]\n" + rows)
    _, description = draft("coastdown", tmp_path / "lauf.csv")
    assert columns(description["channels"])["speed"] == ("GPS-Geschw. [mph]", "mph")


def sweep(folder: Path) -> Path:
    """A slip sweep as a flat-track machine writes it: a clock named ET, loads negative, units with hyphens."""
    time = np.arange(600) / 50.0
    slip = 0.15 * np.sin(time)
    force = 1000.0 * np.tanh(20.0 * slip)
    load = -1000.0 - 5.0 * np.cos(time)
    rows = [f"{t:.2f}\t40.2\t{s:.4f}\t{f:.1f}\t{z:.2f}\t2" for t, s, f, z in zip(time, slip, force, load, strict=True)]
    path = folder / "sweep.dat"
    head = ["Made by a machine\tRim=7", "ET\tV\tSR\tFX\tFZ\tMX", "sec\tkph\tnone\tN\tN\tN-m"]
    path.write_text("\n".join([*head, *rows]) + "\n")
    return path


def test_a_machine_s_sweep_is_mapped_with_its_sign(tmp_path: Path) -> None:
    drawn, data = draft("tire", sweep(tmp_path))
    assert data["channels"]["time"] == {"column": "ET", "unit": "sec"}
    assert data["channels"]["force_z"] == {"column": "FZ", "unit": "N", "sign": -1}
    assert "a load is positive here" in drawn.text


def coast(path: Path, bearing: float, course: str, rise: float = -0.15) -> Path:
    """A log of 60 s in a direction, with a heading, or with latitude and longitude in degrees or in minutes of arc."""
    time = np.arange(600) / 10.0
    speed = 25.0 + (rise * time if rise < 0.0 else 3.0 * np.sin(time))
    way = np.cumsum(speed) / 10.0 / 111_200.0
    scale = 60.0 if course == "minutes" else 1.0
    north, east = np.cos(np.radians(bearing)), np.sin(np.radians(bearing)) / np.cos(np.radians(48.0))
    table = {"time [s]": time, "speed [m/s]": speed}
    if course == "heading":
        table["Heading [deg]"] = (bearing + 2.0 * np.sin(time)) % 360.0
    elif course:
        table |= {"latitude": (48.0 + north * way) * scale, "longitude": (11.0 + east * way) * scale}
    rows = np.column_stack(list(table.values()))
    np.savetxt(path, rows, delimiter=",", fmt="%.8f", header=",".join(table), comments="")
    return path


@pytest.mark.parametrize("course", ["heading", "degrees", "minutes"])
def test_directions_come_from_a_logged_heading_or_from_positions(course: str, tmp_path: Path) -> None:
    bearings = (359.0, 178.0, 5.0, 90.0)
    paths = [coast(tmp_path / f"run_{k}.csv", b, course) for k, b in enumerate(bearings)]
    found, description = draft("coastdown", *paths)
    assert [run.get("direction") for run in description["runs"]] == ["out", "back", "out", None]
    assert "neither along nor against" in found.text
    assert "direction of each run" in found.undecided


def test_a_drive_is_no_run_of_a_coast_down(tmp_path: Path) -> None:
    paths = [coast(tmp_path / f"run_{k}.csv", 0.0, "", rise) for k, rise in enumerate((-0.15, 1.0, -0.2))]
    found, description = draft("coastdown", *paths)
    assert [run["log"] for run in description["runs"]] == ["run_0.csv", "run_2.csv"]
    assert 'run_1.csv"}  # left out: not a coast-down: the speed decreases for at most' in found.text


def test_of_a_folder_the_logs_that_are_no_runs_stand_as_comments(tmp_path: Path) -> None:
    """Also if the first log is not a run; two kinds of logs over the same time are not loggers of one run."""
    runs = [coast(tmp_path / f"run_{k}.csv", bearing, "heading") for k, bearing in enumerate((20.0, 200.0, 25.0))]
    time = np.arange(600) / 10.0
    tables = {
        "air.csv": ("time [s],probe", 4.0 + np.sin(time)),
        "dead.csv": ("time [s],speed [m/s]", 0.0 * time),
        "phone_0.csv": ("t [s],Speed (mph)", 50.0 - 0.3 * time),
        "phone_1.csv": ("t [s],Speed (mph)", 50.0 - 0.3 * time),
    }
    for name, (header, values) in tables.items():
        np.savetxt(tmp_path / name, np.column_stack([time, values]), delimiter=",", header=header, comments="")
    (tmp_path / "cut_off.csv").write_text("time [s],speed [m/s]\n")
    others = [tmp_path / name for name in (*tables, "cut_off.csv")]
    found, description = draft("coastdown", *others, *runs)
    assert [(run["log"], run["direction"]) for run in description["runs"]] == [
        ("run_0.csv", "out"),
        ("run_1.csv", "back"),
        ("run_2.csv", "out"),
    ]
    assert sorted(found.left) == sorted(path.name for path in others)
    for said in (
        "no speed: no column has such",
        "is constant at 0",
        "than run_0.csv (time)",
        "has no rows of data",
    ):
        assert said in found.text
    with pytest.raises(InputError, match=r"no\.csv: no such file"):
        draft("coastdown", *runs, tmp_path / "no.csv")
    with pytest.raises(InputError, match="has no rows of data"):
        draft("coastdown", tmp_path / "cut_off.csv")


def test_copies_and_logs_with_a_wrong_clock_or_half_a_speed_stand_as_comments(root: Path, tmp_path: Path) -> None:
    logs = []
    for k in (1, 2, 3, 4):
        logs.append(tmp_path / f"coast_{k}.csv")
        shutil.copy(root / "sample_logs" / logs[-1].name, logs[-1])
    head, *rows = logs[0].read_text(encoding="utf-8").splitlines()
    cells = [row.split(",") for row in logs[2].read_text(encoding="utf-8").splitlines()[1:]]
    half = [
        ",".join([time, speed if k < 0.4 * len(cells) else "", *rest]) for k, (time, speed, *rest) in enumerate(cells)
    ]
    cells = [row.split(",") for row in logs[3].read_text(encoding="utf-8").splitlines()[1:]]
    slow = [",".join([f"{1e3 * float(time):.6g}", *rest]) for time, *rest in cells]
    for name, lines in (("twice.csv", [r for row in rows for r in (row, row)]), ("half.csv", half), ("ms.csv", slow)):
        logs.append(tmp_path / name)
        logs[-1].write_text("\n".join([head, *lines]), encoding="utf-8")
    del logs[2:4]
    found, description = draft("coastdown", *logs)
    assert [run["log"].rpartition("/")[2] for run in description["runs"]] == ["coast_1.csv", "coast_2.csv"]
    for why in (
        "the same recording as coast_1.csv",
        "speed is recorded from 0",
        "its time is not in s; if it is in ms",
    ):
        assert why in found.text


def test_each_coast_down_of_a_long_log_is_a_run(tmp_path: Path) -> None:
    """A logger left running: out and back in one file, with braking and a stop between, each with its own heading."""
    legs = [np.linspace(25.0, 6.0, 400), np.linspace(6.0, 0.0, 20), np.zeros(100), np.linspace(0.0, 25.0, 80)]
    speed = np.concatenate([*legs, *legs[:3], legs[3], *legs[:3]])
    heading = np.repeat([30.0, 210.0, 30.0], [550, 600, speed.size - 1150])
    columns_ = {"time_s": np.arange(speed.size) / 4.0, "speed_mpers": speed, "Heading_deg": heading}
    _, description = draft("coastdown", table(tmp_path / "long.csv", **columns_))
    runs = description["runs"]
    assert [run["direction"] for run in runs] == ["out", "back", "out"]
    windows = [[float(run[key].split()[0]) for key in ("from_time", "to_time")] for run in runs]
    assert np.all(np.diff(np.ravel(windows)) >= 0.0)
    assert [begin for begin, _ in windows] == pytest.approx([0.0, 145.0, 295.0], abs=5.0)
    assert all(105.0 <= end - 150.0 * k <= 130.0 for k, (_, end) in enumerate(windows))  # in the rest


@pytest.mark.parametrize(("way", "keys"), [(1.0, {}), (-1.0, {"sign": -1})])
def test_a_speed_that_is_negative_on_the_way_back_belongs_to_a_coast_down(
    way: float, keys: Mapping[str, int], tmp_path: Path
) -> None:
    time = np.arange(0.0, 40.0, 0.1)
    back = [False, True, False, True]
    logs = [
        table(tmp_path / f"run_{k}.csv", **{"time_s": time, "speed_mpers": way * (1 - 2 * b) * (26.0 - k - 0.4 * time)})
        for k, b in enumerate(back)
    ]
    _, data = draft("coastdown", *logs)
    assert data["channels"]["speed"] == {"column": "speed [m/s]", "unit": "m/s"} | keys
    assert [run.get("signs") for run in data["runs"]] == [{"speed": -1} if b else None for b in back]


def test_a_coast_down_of_one_hertz_with_a_gap_is_a_run(tmp_path: Path) -> None:
    time = np.delete(np.arange(70.0), np.s_[30:36])
    paths = [tmp_path / f"run_{k}.csv" for k in range(2)]
    for path, speed in zip(paths, (25.0 - 0.2 * time, 20.0 + 3.0 * np.sin(time)), strict=True):
        np.savetxt(path, np.column_stack([time, speed]), delimiter=",", header="time [s],speed [m/s]", comments="")
    _, description = draft("coastdown", *paths)
    assert [run["log"] for run in description["runs"]] == ["run_0.csv"]


def test_the_first_of_two_columns_of_one_name_is_drafted_as_it_is_read(tmp_path: Path) -> None:
    time = np.arange(600) / 10.0
    table = np.column_stack([time, 25.0 - 0.2 * time, 25.0 - 0.2 * time])
    path = tmp_path / "run.csv"
    np.savetxt(path, table, delimiter=",", header="time [s],speed [m/s],speed [m/s]", comments="", fmt="%.3f")
    _, description = draft("coastdown", path)
    assert description["channels"]["speed"]["column"] == "speed [m/s]#1"


def facts(column: str, ends: tuple[float, float]) -> ChannelFacts:
    info = ChannelInfo(column, "", 10.0, (0.0, 60.0))
    return ChannelFacts(info, column, "varies", 600, min(ends), max(ends), ends=ends, angle=1j)


@pytest.mark.parametrize(
    ("columns_", "tells"),
    [
        (("heading_deg",), True),
        (("GPS Heading",), True),
        (("bearing",), True),
        (("Heading Rate [deg/s]",), False),
        (("lat", "lon"), True),
        (("GPS_Latitude", "GPS_Longitude"), True),
        (("Lat Accel", "Long Accel"), False),
        (("Lat. Acc", "Long. Acc"), False),
        (("Lateral", "Longitudinal"), False),
    ],
)
def test_names_of_headings_and_positions_are_known(columns_: tuple[str, ...], tells: bool) -> None:
    (found,) = logged_directions([[facts(name, (0.0, 0.01)) for name in columns_]])
    assert found.direction == ("out" if tells else "")


def test_a_pipeline_is_written_by_hand(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"written by hand.*\n.*copy configs/pipeline.yaml"):
        run_init("pipeline", [tmp_path / "a.csv"], "-", print)
