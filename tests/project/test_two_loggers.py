"""A test whose channels come from two loggers: what is reported, and the clocks' errors in the intervals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.reader import Column
from vdyn_cli.project.checks.check import check
from vdyn_cli.project.execute import execute
from vdyn_cli.project.inputs import gather
from vdyn_cli.project.result_document import read_record, to_json
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.report.step_page import step_page
from vdyn_cli.steps import load_step

LOADS = ("FL Fz [N]", "FR Fz [N]", "RL Fz [N]", "RR Fz [N]")
MOTION = ("Antenna Accel [m/s^2]", "Pitch Rate [deg/s]")
DELAY = 0.08  # s
TEXT = """
test: cg
vehicle: {mass: 1588 kg, wheelbase: 2.7 m, antenna_height: 1.6 m, drag_area: 0.55 m^2, drag_height: 0.6 m,
  wheel_inertia: 1.2 kg m^2, wheel_radius: 0.31 m}
environment: {temperature: 24 degC, pressure: 98.9 kPa}
loggers:
  - channels:
      time: {column: "t", unit: s}
      front_left_load: {column: "FL Fz [N]", unit: N}
      front_right_load: {column: "FR Fz [N]", unit: N}
      rear_left_load: {column: "RL Fz [N]", unit: N}
      rear_right_load: {column: "RR Fz [N]", unit: N}
      speed: {column: "Speed [km/h]", unit: km/h}
  - channels:
      time: {column: "t", unit: s}
      acceleration: {column: "Antenna Accel [m/s^2]", unit: m/s^2}
      pitch_rate: {column: "Pitch Rate [deg/s]", unit: deg/s}
runs:
  - {logs: [car_1.csv, box_1.csv], direction: out}
  - {logs: [car_2.csv, box_2.csv], direction: back}
settings: {accelerometer: gps, load_zero: 10 N}
"""


@pytest.fixture(scope="module")
def described(tmp_path_factory: pytest.TempPathFactory, root: Path) -> Path:
    """Launches whose loads and speed are in one file, and acceleration and pitch rate in another, 80 ms later."""
    folder = tmp_path_factory.mktemp("two_loggers")
    for k in (1, 2):
        names = (*LOADS, *MOTION, "Speed [km/h]")
        mapping = {"time": Column("Time [s]", "s", "s")} | {n: Column(n, "1", "1") for n in names}
        log = read_log(root / "sample_logs" / f"launch_{k}.csv", mapping)
        _write(folder / f"car_{k}.csv", log.time, {n: log[n] for n in (*LOADS, "Speed [km/h]")})
        _write(folder / f"box_{k}.csv", log.time + DELAY, {n: log[n] for n in MOTION})
    (folder / "cg.yaml").write_text(TEXT)
    return folder / "cg.yaml"


def _write(path: Path, time: np.ndarray, columns: dict[str, np.ndarray]) -> None:
    rows = np.column_stack([time, *columns.values()])
    np.savetxt(path, rows, fmt="%.6g", delimiter=",", header=",".join(["t", *columns]), comments="")


@pytest.mark.slow
def test_delay_is_found_from_speed_and_acceleration_and_published(described: Path, tmp_path: Path) -> None:
    record = execute("cg", described, level=None)
    clocks = record.result.quality.clocks
    assert [c.pair for c in clocks] == [("speed", "acceleration")] * 2
    assert all(abs(c.delay - DELAY) < 3.0 * c.delay_std < 0.06 for c in clocks)
    document = record.document
    assert document["quality"]["clocks"][0]["delay"] == clocks[0].delay
    (tmp_path / "cg.json").write_text(to_json(document))
    assert read_record(tmp_path / "cg.json")[0].result.quality.clocks == clocks
    page = step_page(record)
    assert page.clocks is not None
    assert len(page.clocks.rows) == 2
    exact = described.with_name("exact.yaml")
    exact.write_text(TEXT.replace("runs:\n", "    delay: 80 ms\nruns:\n"))
    known = execute("cg", exact, level=None).result.parameters["cg_height"]
    assert record.result.parameters["cg_height"].half_width > 1.5 * known.half_width


def test_check_lists_the_clocks(described: Path) -> None:
    document, _ = check(described)
    assert [c.logger for c in document.clocks] == ["box_1.csv", "box_2.csv"]
    pair = next(p for p in document.redundancy if p.first == "acceleration")
    assert pair.delay is not None
    assert pair.delay_std is not None
    assert abs(pair.delay) < 4.0 * pair.delay_std


def test_a_wheel_speed_that_the_step_does_not_read_aligns_the_clocks_only(described: Path) -> None:
    """Wheel loads beside a wheel speed in 1/min: the launches' slip separates it from the speed of the other logger."""
    for k in (1, 2):
        box = np.loadtxt(described.parent / f"box_{k}.csv", delimiter=",", skiprows=1)
        car = np.loadtxt(described.parent / f"car_{k}.csv", delimiter=",", skiprows=1)
        motion = dict(zip(MOTION, box[:, 1:].T, strict=True))
        motion["v"] = np.interp(box[:, 0] - DELAY, car[:, 0], car[:, 5])
        _write(described.parent / f"gps_{k}.csv", box[:, 0], motion)
        columns = dict(zip((*LOADS, "n_VL [1/min]"), car[:, 1:].T, strict=True))
        _write(described.parent / f"wheels_{k}.csv", car[:, 0], columns)
    text = TEXT.replace(
        'speed: {column: "Speed [km/h]", unit: km/h}', 'wheel_speed: {column: "n_VL [1/min]", unit: 1/min}'
    )
    text = (
        text.replace("box_", "gps_")
        .replace("car_", "wheels_")
        .replace("runs:\n", '      speed: {column: "v", unit: km/h}\nruns:\n')
    )
    path = described.with_name("wheel.yaml")
    path.write_text(text)
    inputs = gather(load_step("cg"), path)
    assert all("wheel_speed" in clock.pair for clock in inputs.clocks)
    assert all(abs(clock.delay - DELAY) < 3.0 * clock.delay_std < 0.06 for clock in inputs.clocks)
    assert all("wheel_speed" not in log for log in inputs.logs)


@pytest.mark.slow
def test_two_channels_are_named_by_a_list(described: Path) -> None:
    named = described.with_name("named.yaml")
    named.write_text(TEXT + "align_on: [speed, acceleration]\n")
    assert execute("cg", named, level=None).result.quality.clocks[0].pair == ("speed", "acceleration")
    named.write_text(TEXT + "align_on: speed\n")
    with pytest.raises(InputError, match="has no channel 'speed' to align the loggers on") as refused:
        execute("cg", named, level=None)
    assert "write 'align_on: [speed, acceleration]'" in str(refused.value)


@pytest.mark.slow  # a delay fitted beside a road load
def test_a_stated_delay_is_taken_with_its_uncertainty(described: Path) -> None:
    stated = described.with_name("stated.yaml")
    stated.write_text(TEXT.replace("runs:\n", "    delay: 80 +- 20 ms\nruns:\n"))
    result = execute("cg", stated, level=None).result
    clock = result.quality.clocks[0]
    assert (clock.delay, clock.delay_std, clock.stated) == (0.08, 0.02, True)
    found = execute("cg", described, level=None).result.parameters["cg_height"]
    assert result.parameters["cg_height"].half_width > 1.5 * found.half_width
    page = step_page(execute("cg", stated, level=None))
    assert page.clocks is not None
    assert page.clocks.rows[0][2] == "stated"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("delay", "problem"),
    [
        ("0 s", "from the stated one: a sensor lags"),
        ("300 s", "does not overlap car_1.csv enough with the stated delay"),
    ],
)
def test_a_wrong_stated_delay_is_reported(described: Path, delay: str, problem: str) -> None:
    wrong = described.with_name("wrong.yaml")
    wrong.write_text(TEXT.replace("runs:\n", f"    delay: {delay}\nruns:\n"))
    try:
        found = [str(f) for f in check(wrong)[0].findings]
    except InputError as error:
        found = [str(f) for f in error.findings]
    assert problem in " ".join(found)


def test_the_first_logger_has_no_delay(described: Path) -> None:
    first = described.with_name("first.yaml")
    first.write_text(TEXT.replace("loggers:\n  - channels:", "loggers:\n  - delay: 0 s\n    channels:"))
    with pytest.raises(InputError, match="first logger defines the clock"):
        execute("cg", first, level=None)


@pytest.mark.parametrize(("ratios", "mixed"), [((1.0, 1.0, 1.05), True), ((1.019, 1.022, 1.024), False)])
def test_a_run_whose_logs_contradict_has_a_note(ratios: tuple[float, ...], mixed: bool, tmp_path: Path) -> None:
    """The wheel log of the third run is from another drive, 5 % faster; a wrong radius is no such case."""
    rng, t = np.random.default_rng(4), np.arange(0.0, 90.0, 0.05)
    for k in (1, 2, 3):
        speed = np.interp(t, [0.0, 12.0, 14.0, 90.0], [8.0, 30.0, 30.0 + 0.1 * k, 10.0])
        wheel = speed * ratios[k - 1] / 0.31
        _write(tmp_path / f"gps_{k}.csv", t, {"v": speed + rng.normal(0.0, 0.02, t.size)})
        _write(tmp_path / f"can_{k}.csv", t + 0.3, {"w": wheel + rng.normal(0.0, 0.05, t.size)})
    runs = "".join(
        f"  - {{logs: [gps_{k}.csv, can_{k}.csv], direction: {'back' if k == 2 else 'out'}}}\n" for k in (1, 2, 3)
    )
    (tmp_path / "coast.yaml").write_text(
        "test: coastdown\nvehicle: {mass: 1500 kg, rotating_mass: 60 kg, wheel_radius: 310 +- 1 mm}\n"
        "environment: {temperature: 24 degC, pressure: 98.9 kPa}\n"
        "loggers:\n  - channels: {time: {column: t, unit: s}, speed: {column: v, unit: m/s}}\n"
        "  - channels: {time: {column: t, unit: s}, wheel_speed: {column: w, unit: rad/s}}\n"
        f"runs:\n{runs}"
    )
    document, _ = check(tmp_path / "coast.yaml")
    said = "gps_3.csv and can_3.csv are probably not from one run"
    assert any(said in f.what and f.doubt for f in document.findings) == mixed
    notes = ["probably not from one run" in " ".join(run.why) for run in document.runs]
    assert notes == [False, False, mixed]
    assert "are good" not in document.sentence
