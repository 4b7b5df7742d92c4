"""``vdyn init``: which parts of which logs are runs, when they started, and in which direction."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from tests.commands.drafts import WAVE, draft, table
from vdyn_cli.io.channel_survey import ChannelFacts
from vdyn_cli.io.reader import ChannelInfo
from vdyn_cli.project.drafting.run_direction import logged_directions, named_directions
from vdyn_cli.quantities.errors import InputError


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


def test_the_starts_that_the_heads_of_the_logs_state_are_those_of_the_runs(tmp_path: Path) -> None:
    for k, start in enumerate(("09:59:58", "10:01:38")):
        head = ["Datum: 27.11.2026", f"Startzeit: {start}", "Zeit [s];v [km/h]"]
        rows = [f"{0.1 * i:.1f};{80 - k - 0.1 * i:.1f}" for i in range(300)]
        (tmp_path / f"run_{k}.csv").write_text("\n".join([*head, *rows]))
    _, description = draft("coastdown", *sorted(tmp_path.iterdir()))
    assert [run["start"] for run in description["runs"]] == ["0.0 s", "100.0 s"]


def test_a_time_of_day_beside_the_clock_gives_the_starts_and_replaces_a_clock_that_restarts(tmp_path: Path) -> None:
    clock = np.arange(600) / 10.0
    paths = []
    for k in range(3):  # the last log has two recordings
        time = np.r_[clock, clock] if k == 2 else clock
        day = 300.5 * k + (np.r_[clock, 100.0 + clock] if k == 2 else clock)
        rows = [f"{t:.1f};09:{s // 60:02.0f}:{s % 60:04.1f};{100 - k - t:.2f}" for t, s in zip(time, day, strict=True)]
        paths.append(tmp_path / f"run_{k}.csv")
        paths[-1].write_text("\n".join(["Zeit [s];Uhrzeit;v [km/h]", *rows]))
    _, description = draft("coastdown", *paths)
    assert [run["start"] for run in description["runs"]][:3] == ["0.0 s", "300.5 s", "601.0 s"]
    assert description["channels"]["time"]["column"] == "Zeit [s]"
    assert [run.get("columns") for run in description["runs"]] == [None, None, {"time": "Uhrzeit"}, {"time": "Uhrzeit"}]


@pytest.mark.parametrize("clock", ["time", "ms_today", "time_ms"])
def test_the_coasts_of_a_log_in_milliseconds_are_selected_in_seconds(clock: str, tmp_path: Path) -> None:
    time = np.arange(0.0, 240.0, 0.1)
    speed = 30.0 + 10.0 * np.abs((time % 120.0) / 60.0 - 1.0)  # slows for 60 s, accelerates for 60 s, twice
    rows = [f"{1000 * t:.0f},{v:.3f}" for t, v in zip(time, speed, strict=True)]
    (tmp_path / "run.csv").write_text("\n".join([f"{clock},speed_kmh", *rows]) + "\n")
    runs = draft("coastdown", tmp_path / "run.csv")[1]["runs"]
    ends = [float(run["to_time"].split()[0]) for run in runs]
    assert ends == pytest.approx([60.0, 180.0], abs=3.0)


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


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (("coast_out_1", "coast_back_1"), ["out", "back"]),
        (("Hinfahrt1", "Rückfahrt1"), ["out", "back"]),
        (("runSouth1", "runNorth1", "runSouth2"), ["out", "back", "out"]),
        (("run_1_out", "run_2_out"), [None, None]),
        (("coast_out_1", "coast_2"), [None, None]),
    ],
)
def test_directions_come_from_the_names_of_the_logs_if_all_tell_one(
    names: tuple[str, ...], expected: list[str | None], tmp_path: Path
) -> None:
    time = np.arange(600) * 0.1
    speeds = {name: 80.0 - (1.0 + 0.01 * k) * time for k, name in enumerate(names)}
    logs = [table(tmp_path / f"{n}.csv", Time_s=time, **{"Speed_km/h": v}) for n, v in speeds.items()]
    assert [run.get("direction") for run in draft("coastdown", *logs)[1]["runs"]] == expected


@pytest.mark.parametrize(
    ("names", "driven"),
    [
        (("back_2", "back_4", "out_1", "out_3"), ("out_1", "back_2", "out_3", "back_4")),
        (("back_1", "back_2", "out_1", "out_2"), ("out_1", "back_1", "out_2", "back_2")),
        (("run_1", "run_10", "run_2"), ("run_1", "run_2", "run_10")),
        (("run", "run (2)", "run (1)"), ("run", "run (1)", "run (2)")),
    ],
)
def test_runs_follow_the_numbers_of_their_logs(names: tuple[str, ...], driven: tuple[str, ...], tmp_path: Path) -> None:
    time = np.arange(600) * 0.1
    speeds = {name: 80.0 - (1.0 + 0.01 * k) * time for k, name in enumerate(names)}
    logs = [table(tmp_path / f"{n}.csv", Time_s=time, **{"Speed_km/h": v}) for n, v in speeds.items()]
    found, description = draft("coastdown", *logs)
    assert [run["log"] for run in description["runs"]] == [f"{name}.csv" for name in driven]
    assert "taken as driven in this order without pauses" in found.text


def test_the_side_of_each_run_is_to_be_decided_once(tmp_path: Path) -> None:
    time = np.arange(600) / 1000.0
    paths = [table(tmp_path / f"{k}.csv", Time_s=time, Motor_rpm=900 + k * time) for k in (1, 2)]
    found, _ = draft("shaft", *paths)
    assert found.undecided[-2:] == ("side of each run", "gear_ratio")
    paths = [p.rename(tmp_path / f"GW_{side}_1.csv") for p, side in zip(paths, ("links", "rechts"), strict=True)]
    assert [run["side"] for run in draft("shaft", *paths)[1]["runs"]] == ["left", "right"]


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
    (found,) = logged_directions([[facts(name, (10.0, 10.01)) for name in columns_]])
    assert found.direction == ("out" if tells else "")


def test_a_heading_that_may_be_in_radians_tells_no_direction() -> None:
    for name, tells in (("cog_rad", False), ("course", False), ("heading_deg", True)):
        (found,) = logged_directions([[facts(name, (1.5, 1.6))]])
        assert bool(found.direction) == tells


@pytest.mark.parametrize("falls", [True, False], ids=["coast-downs", "drives"])
def test_the_drafted_windows_of_logs_with_a_torque_are_those_of_the_test(falls: bool, tmp_path: Path) -> None:
    """Of a drive only the driven parts: where the torque is below zero, the brakes may be applied, too."""
    time = np.arange(600) * 0.1
    speed = 80.0 - time if falls else 50.0 + 20.0 * WAVE
    log = table(tmp_path / "run.csv", Time_s=time, **{"Speed_km/h": speed, "Motor Torque_Nm": 0.1 * WAVE})
    found, description = draft("coastdown", log)
    assert description["settings"]["windows"] == ("auto" if falls else "powered")
    assert {"gear_ratio", "wheel_radius", "mass"} <= set(found.undecided)  # the torque needs them
    assert {"gear_ratio", "wheel_radius", "mass", "rotating_mass"} <= set(draft("validate", log)[0].undecided)


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (("drive-27-N.csv", "drive-28-S.csv", "drive-29-N.csv"), ("out", "back", "out")),
        (("run1_WB.csv", "run2_EB.csv"), ("out", "back")),
        (("test_s.csv", "other_s.csv"), ("", "")),
    ],
)
def test_a_letter_of_the_compass_in_the_names_of_logs(names: tuple[str, ...], expected: tuple[str, ...]) -> None:
    assert tuple(one.direction for one in named_directions(names)) == expected


def test_logs_in_which_the_speed_only_rises_are_doubted(tmp_path: Path) -> None:
    time = np.arange(600) * 0.1
    log = table(tmp_path / "run.csv", Time_s=time, Speed_kmperh=20.0 + time)
    assert "# speed: 'Speed [km/h]' decreases for 10 s in none of the logs" in draft("coastdown", log)[0].text


def test_a_log_that_turns_back_has_no_direction(tmp_path: Path) -> None:
    """From first to last place it goes 600 m east, on the way 2.5 km."""
    east = np.concatenate([np.linspace(0.0, 0.03, 300), np.linspace(0.03, 0.008, 300)])
    speed = np.concatenate([20.0 + 0.02 * np.arange(300), 26.0 - 0.03 * np.arange(300)])
    log = table(
        tmp_path / "run.csv",
        Time_s=np.arange(600) * 0.2,
        Speed_mpers=speed,
        Latitude_deg=45 + 0 * east,
        Longitude_deg=9.0 + east,
    )
    assert "direction" not in draft("coastdown", log)[1]["runs"][0]


def test_a_log_without_a_value_is_no_run(tmp_path: Path) -> None:
    time = np.arange(600.0)
    coast = table(tmp_path / "coast.csv", time_s=time, speed_kmperh=60.0 - time / 15.0)
    dead = table(tmp_path / "dead.csv", time_s=time, speed_kmperh=np.full(600, np.nan))
    found, description = draft("coastdown", coast, dead)
    assert ([run["log"] for run in description["runs"]], found.left) == (["coast.csv"], ("dead.csv",))
    with pytest.raises(InputError, match="no column but the time has values"):
        draft("coastdown", dead)
