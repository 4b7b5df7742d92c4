"""A position that contradicts the speed equally in all runs: the size of the gain, and cases that are not a gain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.messy_cases import estimated
from tests.plant import messy_day
from tests.plant.messy_day import Case, Day, Logger
from vdyn_cli.io.quality.cross_checks import with_cross_checks
from vdyn_cli.io.quality.distance_gain import CommonGain, common_gain, distance_gain, is_integral
from vdyn_cli.io.reader import Column
from vdyn_cli.project.checks.redundancy import compared_over_runs, tied_pairs
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters

QUICK = Day(rms=0.0005, upper=27.0, lower=8.0)


def scaled(case: Case, scale: float) -> Case:
    return replace(case, runs=tuple(replace(r, speed=scale * r.speed) for r in case.runs))


def gain_of(case: Case) -> CommonGain:
    gains = [distance_gain(r.time, r.speed, r.position) for r in case.runs]
    found = common_gain([g for g in gains if g is not None])
    assert found is not None
    return found


@pytest.mark.parametrize("logger", [Logger(), Logger(rate=50.0, held=5.0), Logger(rate=20.0, smooth=0.6)])
def test_speeds_that_are_right_late_or_held_do_not_contradict_the_position(logger: Logger) -> None:
    found = gain_of(messy_day.drive(41, replace(QUICK, logger=logger)))
    assert not found.contradicts
    assert found.value == pytest.approx(1.0, abs=0.002)


def test_a_position_from_the_wrong_speed_holds_no_evidence() -> None:
    case = scaled(messy_day.drive(42, QUICK), 0.97)
    own = [np.concatenate([[0.0], np.cumsum(np.diff(r.time) * (r.speed[1:] + r.speed[:-1]) / 2)]) for r in case.runs]
    runs = tuple(replace(r, position=p) for r, p in zip(case.runs, own, strict=True))
    assert not gain_of(replace(case, runs=runs)).contradicts
    assert all(is_integral(r.time, r.speed, r.position) for r in runs)
    slower = [(r.time[::10], r.speed[::10], np.round(r.position[::10], 2)) for r in runs]
    assert all(is_integral(*columns) for columns in slower)


def test_a_position_of_its_own_noise_is_not_the_integral_of_the_speed() -> None:
    run, noise = messy_day.drive(46, QUICK).runs[0], np.random.default_rng(46)
    measured = run.position + noise.normal(0.0, 0.3, run.position.size)
    assert not is_integral(run.time, run.speed, measured)


def test_a_position_along_another_line_is_no_gain() -> None:
    run = messy_day.drive(43, QUICK).runs[0]
    chord = 1800.0 * np.sin(run.position / 1800.0)
    assert distance_gain(run.time, run.speed, chord) is None


def test_a_wrong_gain_is_a_data_fault_with_its_size_and_intervals_that_hold_the_truth() -> None:
    case = messy_day.drive(44, replace(QUICK, runs=4))
    result = estimated(scaled(case, 1.04), position=True)
    (fault,) = [f for f in result.findings if f.fault]
    assert "reads 4." in fault.what
    assert "too high in all 4 runs" in fault.what
    assert "scale: 0.96" in fault.remedy
    for name in ("rolling_resistance", "drag_area"):
        low, high = result.parameters[name].interval95
        assert low < case.truth[name] < high
    assert not any(f.fault for f in estimated(case, position=True).findings)


def test_the_table_of_channels_says_what_the_step_says() -> None:
    for scale, good in ((1.0, True), (1.025, False)):
        case = scaled(messy_day.drive(45, replace(QUICK, runs=4)), scale)
        logs = [Log(f"{k}.csv", r.time, {"speed": r.speed, "position": r.position}) for k, r in enumerate(case.runs)]
        pairs, findings = compared_over_runs([p for log in logs for p in tied_pairs(log, Parameters({}))])
        assert {p.good for p in pairs} == {good}
        assert bool(findings) is not good


def test_the_remedy_corrects_the_channel() -> None:
    assert Column("v", "km/h", "m/s", scale=1.02).in_si(np.array([36.0])) == pytest.approx(10.2)


def test_a_pause_of_the_logger_while_moving_is_no_gain() -> None:
    run = messy_day.drive(47, QUICK).runs[0]
    half = run.time.size // 2
    late = np.where(np.arange(run.time.size) < half, run.time, run.time + 130.0)
    assert distance_gain(late, run.speed, run.position) == pytest.approx(1.0, abs=0.005)
    log = Log("a.csv", late, {"speed": run.speed, "position": run.position})
    assert not [f for f in with_cross_checks(log).findings if "contradict" in f.what]
