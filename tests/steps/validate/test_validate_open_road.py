"""Drives on hilly roads: hills, losses and the accelerometer's zero are found, and nothing else."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.open_road import CDA, DENSITY, F0, F1, Made, Truth, description, drive, written
from vdyn_cli.project.execute import RefusedResultError, execute
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import load_step
from vdyn_cli.steps.validate.preparation import prepare
from vdyn_cli.steps.validate.road.slope_evidence import shown_lag
from vdyn_cli.steps.validate.tables import window_table
from vdyn_cli.steps.validate.text import windows_sentence
from vdyn_cli.steps.validate.window_ends import WindowEnds

pytestmark = pytest.mark.slow  # whole diagnoses or recoveries

DRIVES, SHORT = 8, 200.0  # s
# A speed that reads too low makes the accelerations too small for the torque, as a loss does; the accelerometer's own
# gain is free beside it, since how much of the hills it felt is not known.
LOSSES = {"payload", "driveline_loss", "torque_gain", "mass_error", "rotating_mass", "wheel_radius", "speed_scale"}


def made(truth: Truth, seed: int, seconds: float = SHORT) -> list[Made]:
    return [drive(truth, 1000 * seed + k, seconds) for k in range(DRIVES)]


def found(folder: Path, drives: list[Made], **diagnose: Any) -> Result:
    described = {**description(folder, drives), **({"diagnose": diagnose} if diagnose else {})}
    return execute("validate", written(folder, described)).result


@pytest.fixture(scope="module")
def lossy(tmp_path_factory: pytest.TempPathFactory) -> tuple[Result, list[Made], Truth]:
    truth = Truth()
    drives = made(truth, 3)
    folder = tmp_path_factory.mktemp("lossy")
    return found(folder, drives, extend=["accelerometer_slope", "driveline_loss"]), drives, truth


@pytest.mark.thorough  # a diagnosis of half a minute; tests/real has the like
def test_hills_and_a_loss_are_found_and_a_seeming_loss_is_reported(
    lossy: tuple[Result, list[Made], Truth],
) -> None:
    told = lossy[0].diagnosis
    assert told is not None
    assert told.verdict == "ambiguous"
    sets = [set(one) for one in told.ambiguous]
    (losses,) = [s for s in sets if "driveline_loss" in s]
    assert losses <= LOSSES
    assert len(losses) > 1
    assert "hills that the accelerometer measured" in told.sentence.lower()
    assert told.gain is not None
    assert told.gain.after < 0.4 * told.gain.before
    assert told.gain.interval95[0] > 0


@pytest.mark.thorough  # a diagnosis of half a minute; tests/real has the like
def test_sizes_are_within_their_intervals(lossy: tuple[Result, list[Made], Truth]) -> None:
    result, _, truth = lossy
    sizes = result.amplitudes
    low, high = sizes["driveline_loss"].interval95
    assert low < truth.loss < high
    assert high - low < 0.06
    assert sizes["accelerometer_slope"].value == pytest.approx(1.0, abs=0.04)
    zero = result.extra["validation"]["road"]["accelerometer_zero"]
    assert zero["interval95"][0] < truth.zero < zero["interval95"][1]
    assert zero["interval95"][1] - zero["interval95"][0] < 0.04


@pytest.mark.thorough  # a diagnosis of half a minute; tests/real has the like
def test_the_road_found_is_the_road_that_was_there(lossy: tuple[Result, list[Made], Truth]) -> None:
    result, drives, _ = lossy
    for entry, one in zip(result.extra["validation"]["road"]["drives"].values(), drives, strict=True):
        along = np.r_[0.0, np.cumsum(np.diff(one.time) * one.speed[1:])]
        edges = entry["distance_m"]
        there = [one.slope[(along >= a) & (along < b)].mean() for a, b in pairwise(edges)]
        assert np.corrcoef(entry["slope"], there)[0, 1] > 0.98


@pytest.mark.thorough  # a diagnosis of half a minute; tests/real has the like
def test_the_force_that_holds_a_speed_is_that_of_the_true_car(lossy: tuple[Result, list[Made], Truth]) -> None:
    result, _, truth = lossy
    for entry in result.extra["validation"]["road"]["holding_force"]:
        v = entry["speed_kmh"] / 3.6
        true = (F0 + F1 * v + 0.5 * DENSITY * CDA * v**2) / (1.0 - truth.loss)
        assert entry["value"] == pytest.approx(true, rel=0.06)


@pytest.mark.thorough  # a diagnosis of half a minute; tests/real has the like
def test_drives_left_out_are_predicted_better(lossy: tuple[Result, list[Made], Truth]) -> None:
    held = lossy[0].extra["validation"]["road"]["held_out"]
    assert held["rms_after"] < 0.5 * held["rms_before"]
    assert held["gain"]["interval95"][0] > 0
    low, high = held["mean_after"]["interval95"]
    assert low < 0.15
    assert high > -0.15
    tables = {t.key: t for t in lossy[0].tables}
    assert len(tables["held_out_ends"].rows) == DRIVES + 2
    assert {"roads", "holding_force"} <= tables.keys()


@pytest.mark.thorough  # the trips of an electric car name hills, too
def test_hills_alone_are_named(tmp_path: Path) -> None:
    told = found(tmp_path, made(Truth(loss=0.0), 6)).diagnosis
    assert told is not None
    assert told.verdict == "named"
    assert told.extended == ("accelerometer_slope",)
    low, high = told.causes[0].unknowns["accelerometer_slope"].interval95
    assert low < 1.0 < high


def described_over_hills(
    folder: Path, truth: Truth, seed: int, drop: str, sign: float = 1.0, late: float = 0.0
) -> Path:
    """Three drives without windows, described as on a level road; an elevation in steps of a meter is logged.

    ``drop``: the channel that is not mapped. ``sign``: of the logged elevation. ``late``: s, by which it is.
    """
    drives = [drive(truth, 1000 * seed + k, SHORT) for k in range(3)]
    described = dict(description(folder, drives))
    described["settings"] = {"model": "road_load"}
    channels = {**described["channels"], "elevation": {"column": "z", "unit": "m"}}
    described["channels"] = {name: one for name, one in channels.items() if name != drop}
    for k, one in enumerate(drives):
        rise = np.diff(one.time) * one.speed[1:] * np.sin(np.arctan(one.slope[1:]))
        height = np.interp(one.time - late, one.time, np.r_[0.0, np.cumsum(rise)])
        height = np.round(500.0 + sign * height)
        rows = zip(one.time, one.speed, one.torque, one.felt, height, strict=True)
        lines = ["t;v;T;a;z", *(f"{t:.2f};{v:.4f};{q:.3f};{f:.4f};{z:.0f}" for t, v, q, f, z in rows)]
        (folder / f"drive_{k}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return written(folder, described)


def over_hills(folder: Path, truth: Truth, seed: int, drop: str) -> Result:
    try:
        return execute("validate", described_over_hills(folder, truth, seed, drop)).result
    except RefusedResultError as error:
        return error.record.result


@pytest.mark.thorough  # 13 s
def test_hills_explain_whole_drives_that_the_simulation_misses(tmp_path: Path) -> None:
    told = over_hills(tmp_path, Truth(), 1, "elevation").diagnosis
    assert told is not None
    assert told.verdict == "ambiguous"  # which loss it is, the drives cannot tell
    assert ("accelerometer_slope",) in told.ambiguous
    (losses,) = [set(one) for one in told.ambiguous if "driveline_loss" in one]
    assert losses <= LOSSES


@pytest.mark.thorough
def test_hills_alone_are_named_without_windows(tmp_path: Path) -> None:
    told = over_hills(tmp_path, Truth(loss=0.0), 11, "elevation").diagnosis
    assert told is not None
    assert told.extended == ("accelerometer_slope",)
    assert told.causes[0].unknowns["accelerometer_slope"].value == pytest.approx(1.0, abs=0.1)


@pytest.mark.thorough
@pytest.mark.parametrize("loss", [0.0, Truth().loss])
def test_hills_of_a_logged_elevation_are_simulated(tmp_path: Path, loss: float) -> None:
    """Only the loss is left to name."""
    told = over_hills(tmp_path, Truth(loss=loss), 11 if loss == 0.0 else 1, "acceleration").diagnosis
    assert told is not None
    if loss == 0.0:
        assert told.verdict == "adequate"
    else:
        assert {n for one in told.ambiguous for n in one} | set(told.extended) <= LOSSES
        assert "driveline_loss" in {n for one in told.ambiguous for n in one} | set(told.extended)


@pytest.mark.parametrize(("sign", "doubted"), [(1.0, False), (-1.0, True)])
def test_an_elevation_gives_the_grade_also_with_the_wrong_sign(tmp_path: Path, sign: float, doubted: bool) -> None:
    read = gather(load_step("validate"), described_over_hills(tmp_path, Truth(loss=0.0), 11, "acceleration", sign), ())
    problem = prepare(read.spec, read.data, read.known)
    for log, one in zip(problem.logs, [drive(Truth(loss=0.0), 11_000 + k, SHORT) for k in range(3)], strict=True):
        slope = np.interp(log.time, one.time, one.slope)
        assert np.corrcoef(log["grade"], slope)[0, 1] > 0.8
    (found,) = [f for f in problem.findings if f.where == "channels.elevation" and "likeliest lag" not in f.what]
    assert found.doubt is doubted


def test_a_late_elevation_gives_the_grade_where_the_hills_are(tmp_path: Path) -> None:
    described = described_over_hills(tmp_path, Truth(loss=0.0), 11, "acceleration", late=2.0)
    read = gather(load_step("validate"), described, ())
    problem = prepare(read.spec, read.data, read.known)
    for log, one in zip(problem.logs, [drive(Truth(loss=0.0), 11_000 + k, SHORT) for k in range(3)], strict=True):
        slope = np.interp(log.time, one.time, one.slope)
        there, before = (np.corrcoef(log["grade"], np.interp(log.time - t, log.time, slope))[0, 1] for t in (0.0, 2.0))
        assert there > before
    (late,) = [f.what for f in problem.findings if "likeliest lag" in f.what]
    assert float(late.split()[7]) == pytest.approx(2.0, abs=0.25)


@pytest.mark.slow
def test_an_elevation_without_a_lag_keeps_its_place(tmp_path: Path) -> None:
    """Speed errors that accumulate over a minute had moved the hills of this day by 0.35 s."""
    read = gather(load_step("validate"), described_over_hills(tmp_path, Truth(loss=0.0), 42, "acceleration"), ())
    problem = prepare(read.spec, read.data, read.known)
    assert problem.grades
    assert not any("likeliest lag" in f.what for f in problem.findings)


def test_one_block_of_forces_shows_no_standard_error_of_a_lag(tmp_path: Path) -> None:
    described = dict(description(tmp_path, [drive(Truth(loss=0.0), 1, SHORT)]))
    described |= {"settings": {"model": "road_load"}}
    described["runs"] = [{**run, "from_time": "20 s", "to_time": "40 s"} for run in described["runs"]]
    read = gather(load_step("validate"), written(tmp_path, described), ())
    problem = prepare(read.spec, read.data, read.known)
    hills = 0.02 * np.sin(problem.logs[0].time / 4.0)
    assert shown_lag(problem.baseline, problem.logs, [hills])[1] == np.inf


def test_nothing_is_found_on_a_level_road_without_losses(tmp_path: Path) -> None:
    told = found(tmp_path, made(Truth(hills=0.0, loss=0.0), 4)).diagnosis
    assert told is not None
    assert told.verdict == "adequate"


def test_one_trip_has_no_interval_over_trips() -> None:
    one = WindowEnds(("a",), np.zeros(4, np.int64), np.array([1.0, 2.0, 3.0, 1.0]), 20.0, 1.75, (-np.inf, np.inf), 0.5)
    assert windows_sentence(one) == (
        "After 20 s the simulated car is 1.75 m/s too fast (mean of 4 windows of one trip; log further trips for an "
        "interval)."
    )
    assert "inf" not in str(window_table(one).rows)
