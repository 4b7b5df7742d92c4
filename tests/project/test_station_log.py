"""A weather station's log with coast-downs: the values that ``vdyn init`` takes from it, and the wind in the step."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from tests.coast_cases import known, logs_of, spec_of
from tests.plant import coast
from tests.plant.vehicle import REFERENCE
from vdyn_cli.io.channel_survey import survey
from vdyn_cli.io.clocks.written_times import time_between
from vdyn_cli.project.drafting.description_draft import draft_description
from vdyn_cli.project.drafting.station_log import is_station
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps import load_step
from vdyn_cli.steps.coastdown.campaign_checks.regulation_limits import TestDay, regulation_limits
from vdyn_cli.steps.coastdown.preparation import prepare

MORNING = datetime(2026, 5, 18, 11, 55, 0)
NAMES = "DATE_TIME,Temperature,Relative Humidity,Barometric Pressure,Station Pressure,Wind Speed,Compass True Direction"


def station(path: Path, rows: int = 240, hours: float = 0.0, heading: str = "90") -> Path:
    """Wind of 9 km/h from the east, and air that warms by 3 K an hour."""
    lines = ["Device Name,WX", "Serial,1", NAMES, "yyyy-MM-dd hh:mm:ss a,°C,%,mb,mb,km/h,Deg,Data Type,Notes"]
    for k in range(rows):
        moment = MORNING + timedelta(seconds=10.0 * k, hours=hours)
        lines.append(f"{moment:%Y-%m-%d %I:%M:%S %p},{20.0 + k / 120:.2f},46,1020,1002.1,9.0,{heading},point,")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def coasts(folder: Path, dated: bool = True, bearings: tuple[float, ...] = (30.0, 210.0, 30.0)) -> list[Path]:
    """Runs of 60 s, 10 minutes apart."""
    paths = []
    for k, bearing in enumerate(bearings):
        begin = MORNING + timedelta(minutes=2 + 10 * k)
        lines = ["Time,Speed (km/h),Heading"]
        for t in range(61):
            clock = f"{begin + timedelta(seconds=t):%Y-%m-%d %H:%M:%S}" if dated else f"{t}.0"
            lines.append(f"{clock},{90.0 - t * (1.0 + 0.01 * k):.2f},{bearing + np.sin(t):.2f}")
        paths.append(folder / f"run_{k}.csv")
        paths[-1].write_text("\n".join(lines) + "\n", encoding="utf-8")
    return paths


def drafted(folder: Path, *paths: Path) -> tuple[str, dict[str, Any]]:
    text = draft_description(load_step("coastdown"), paths, folder).text
    return text, yaml.safe_load(text)


def test_a_station_gives_air_and_wind_of_each_run(tmp_path: Path) -> None:
    text, data = drafted(tmp_path, *coasts(tmp_path), station(tmp_path / "wx.csv"))
    assert data["environment"]["pressure"] == "100.21 +- 0.01 kPa"
    assert data["environment"]["humidity"] == "46 +- 1 %"
    assert "mean of 'Station Pressure' of wx.csv during the runs" in text
    assert [run["start"] for run in data["runs"]] == ["0.0 s", "600.0 s", "1200.0 s"]
    along, across = 2.5 * np.cos(np.radians(60.0)), 2.5 * np.sin(np.radians(60.0))
    for run, sign in zip(data["runs"], (1.0, -1.0, 1.0), strict=True):
        assert float(run["wind_speed"].split()[0]) == pytest.approx(sign * along, abs=0.03)
        assert float(run["crosswind"].split()[0]) == pytest.approx(across, abs=0.03)
    assert not any("temperature" in run for run in data["runs"])  # they differ by 1 K at most
    filled = text.replace('mass: "?"', "mass: 1500 kg").replace('rotating_mass: "?"', "rotating_mass: 50 kg")
    path = tmp_path / "coast.yaml"
    path.write_text(filled.replace('"?"', "2.2 m^2"), encoding="utf-8")
    inputs = gather(load_step("coastdown"), path)
    assert prepare(inputs.spec, inputs.data, inputs.known).campaign.runs[0].inputs["wind_speed"][0] == pytest.approx(
        along, abs=0.03
    )


def test_units_at_the_end_of_names_are_read(tmp_path: Path) -> None:
    lines = ["date_time,wind_speed_m/s,wind_dir_deg,temp_C,pressure_hPa"]
    lines += [f"{MORNING + timedelta(seconds=10.0 * k):%Y-%m-%d %H:%M:%S},2.5,90,20.0,1002.1" for k in range(240)]
    (tmp_path / "wx.csv").write_text("\n".join(lines) + "\n")
    _, data = drafted(tmp_path, *coasts(tmp_path), tmp_path / "wx.csv")
    assert data["environment"]["temperature"].startswith("20.0 +-")
    assert data["environment"]["pressure"].startswith("100.21 +-")
    assert data["runs"][0]["wind_speed"] == "1.25 m/s"


@pytest.mark.parametrize("units", ["", "\t\t°C\t%\tkm/h\t\thPa\n"])
def test_a_station_without_units_asks_for_them(tmp_path: Path, units: str) -> None:
    """An export with the date beside minutes, and the wind by points of the compass."""
    lines = [
        f"{MORNING + timedelta(minutes=k):%d.%m.%y\t%H:%M}\t20.0\t46\t{9.0 + k % 2}\tE\t1002.1\n" for k in range(-5, 30)
    ]
    head = "Date\tTime\tTemp Out\tOut Hum\tWind Speed\tWind Dir\tBar\n"
    (tmp_path / "davis.txt").write_text(head + units + "".join(lines), encoding="utf-8")
    text, data = drafted(tmp_path, *coasts(tmp_path), tmp_path / "davis.txt")
    air = data["environment"]
    if units:
        assert (air["temperature"], air["humidity"]) == ("20.0 +- 0.1 degC", "46 +- 1 %")
        assert data["runs"][0]["wind_speed"] == "1.32 m/s"
        return
    assert (air["temperature"], air["pressure"], air["humidity"]) == (
        "20.0 +- 0.1 ?",
        "1002.10 +- 0.01 ?",
        "46.0 +- 0.1 ?",
    )
    assert data["runs"][0]["wind_speed"] == "4.75 ?"
    assert "'Bar' of davis.txt during the runs; check that it is not reduced to sea level" in text
    path = tmp_path / "coast.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"'environment\.temperature' is not decided"):
        gather(load_step("coastdown"), path)


@pytest.mark.parametrize(
    ("dated", "hours", "why"),
    [(False, 0.0, "are not times of day"), (True, 5.0, "does not cover the times of day of all runs")],
)
def test_a_station_of_another_clock_gives_the_air_alone(tmp_path: Path, dated: bool, hours: float, why: str) -> None:
    text, data = drafted(tmp_path, *coasts(tmp_path, dated), station(tmp_path / "wx.csv", hours=hours))
    assert why in text
    assert data["environment"]["temperature"] == "21.0 +- 0.6 degC"
    assert not any("wind_speed" in run for run in data["runs"])


def test_a_wind_without_a_direction_is_not_taken(tmp_path: Path) -> None:
    path = station(tmp_path / "wx.csv", heading="--")
    assert is_station(survey(path))
    _, data = drafted(tmp_path, *coasts(tmp_path), path)
    assert not any("wind_speed" in run for run in data["runs"])


def test_runs_without_a_heading_have_no_wind(tmp_path: Path) -> None:
    paths = coasts(tmp_path)
    for path in paths:
        path.write_text(path.read_text(encoding="utf-8").replace("Heading", "Lean"), encoding="utf-8")
    text, data = drafted(tmp_path, *paths, station(tmp_path / "wx.csv"))
    assert "mean wind 2.5 m/s; its direction along the road is unknown, since 3 of 3 logs have no heading" in text
    assert [run["start"] for run in data["runs"]] == ["0.0 s", "600.0 s", "1200.0 s"]


def test_a_car_s_log_is_no_station(tmp_path: Path) -> None:
    path = tmp_path / "car.csv"
    path.write_text("t [s],speed [m/s],temperature [degC],pressure [kPa]\n0,1,20,100\n1,2,20,100.1\n", encoding="utf-8")
    assert not is_station(survey(path))


@pytest.mark.slow
def test_a_stated_wind_takes_the_place_of_a_hidden_one() -> None:
    runs = coast.campaign(REFERENCE, 2, coast.DAY, {"headwind": 3.0})
    spec = spec_of(runs)
    stated = [
        run.model_copy(update={"wind_speed": Given(3.0 if run.direction == "out" else -3.0)}) for run in spec.runs
    ]
    result = prepare(spec.model_copy(update={"runs": stated}), logs_of(runs), known(REFERENCE)).publish()
    area = result.parameters["drag_area"]
    assert abs(area.value - coast.truth(REFERENCE)["drag_area"]) < 3.5 * area.std


def test_limits_of_wind_are_met_or_not_where_both_winds_are_stated() -> None:
    day = TestDay((293.15,), 1.2, ((1.0, None), (-1.0, None)), 4, (32.0, 4.0), (), (1.5, 2.1))
    rows = {(r.regulation, r.limit): r.outcome for r in regulation_limits(day)}
    assert rows["SAE J1263", "mean crosswind below 2.2 m/s (8 km/h)"] == "met"
    assert rows["UN R83", "wind across the road below 2 m/s"] == "not met"
    assert rows["UN R83", "mean wind below 3 m/s"] == "met"
    assert rows["UN R83", "peaks of the wind below 5 m/s"] == "not checked"


@pytest.mark.parametrize(
    ("first", "second", "step"), [(1.7e9, 1.7e9 + 90000, 90000), (86000.0, 400.0, 800.0), (1.7e9 + 1600, 3200.0, None)]
)
def test_moments_without_a_date_are_the_nearest(first: float, second: float, step: float | None) -> None:
    found = time_between(first, second)
    assert found == pytest.approx(step) if step is not None else abs(found) <= 43200.0
