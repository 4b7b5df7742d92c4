"""Drives in which a gear is shifted or the torque's gain changes, by the acceleration per drive torque."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant.sensors import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.drives.ratio_changes import Pieces, ratio_changes
from vdyn_cli.steps.validate.drives.segments import RunConditions, Segmentation, drive_segments
from vdyn_cli.steps.validate.drives.stated_motion import StatedMotion

MASS, RADIUS, STEP = 1700.0, 0.32, 0.05  # kg, m, s
STATED = StatedMotion(1.0 / (RADIUS * MASS), -160.0 / MASS, -0.9 / MASS)
GEARS = ((0.0, 1.0), (30.0, 0.62), (55.0, 0.45), (95.0, 0.62), (120.0, 1.0))  # s, ratio from then on
OFTEN = tuple((13.0 * k, (1.0, 0.62, 0.45, 0.62)[k % 4]) for k in range(13))
Driven = tuple[Array, dict[str, Array], Array]


def drive(
    seed: int, ratios: tuple[tuple[float, float], ...] = ((0.0, 1.0),), hills: float = 0.001, shown: bool = False
) -> Driven:
    """Some minutes under a torque that changes every few seconds, over hills (rms grade).

    ``shown``: an elevation shows their slope to 0.3 %; else they are not logged.
    """
    rng = np.random.default_rng([7, seed])
    time = np.arange(0.0, 160.0, STEP)
    at = np.cumsum(rng.uniform(2.0, 8.0, 60))
    wanted = np.interp(time, at, rng.uniform(150.0, 1100.0, 60))  # N m at the wheels
    starts, factors = np.array(ratios).T
    ratio = factors[np.searchsorted(starts, time, side="right") - 1]
    x, v, speed, slope = 0.0, 8.0, np.empty(time.size), np.empty(time.size)
    place, phase = rng.uniform(25.0, 200.0, 10), rng.uniform(0.0, 2 * np.pi, 10)
    for k in range(time.size):
        speed[k] = v
        hill = slope[k] = hills * np.sqrt(0.2) * np.sum(np.sin(x / place + phase))
        v = max(v + STEP * ((wanted[k] / RADIUS - 160.0 - 0.9 * v**2) / MASS - 9.81 * hill), 0.0)
        x += STEP * v
    channels = {"speed": speed + 0.02 * rng.standard_normal(time.size), "brake_torque": np.zeros(time.size)}
    if shown:
        channels["grade"] = slope + 0.003 * np.sin(0.2 * time)
    return time, channels, wanted / ratio + 0.5 * rng.standard_normal(time.size)


@pytest.mark.parametrize("hills", [0.0, 0.003, 0.02])
def test_one_gear_over_hills_is_no_finding(hills: float) -> None:
    assert not any(change.spans for change in ratio_changes([drive(k, hills=hills) for k in range(4)], STATED))


def test_gears_are_found_and_all_but_the_stated_one_are_left_out() -> None:
    (change,) = ratio_changes([drive(1, GEARS)], STATED)
    assert [round(factor, 2) for *_, factor in change.spans] == pytest.approx([0.62, 0.45, 0.62], abs=0.02)
    assert [round(a) for a, _, _ in change.spans] == pytest.approx([30, 55, 95], abs=1)
    time = drive(1, GEARS)[0]
    assert change.other[(time > 31) & (time < 119)].all()
    assert not change.other[(time < 29) | (time > 121)].any()
    (finding,) = change.finding("run.csv")
    assert "0.62 from 30" in finding.what
    assert finding.doubt


def test_gears_in_one_of_several_drives_are_found_by_their_repetition() -> None:
    """Shifts disturb the acceleration at every change, but the gears return."""
    time, channels, torque = drive(5, OFTEN)
    torque = torque * (1.0 + 0.1 * np.exp(-np.mod(time, 13.0)))  # after every shift, the clutch still slips
    changes = ratio_changes([drive(1), drive(2), (time, channels, torque)], STATED)
    assert [bool(change.spans) for change in changes] == [False, False, True]
    factors = np.array([factor for *_, factor in changes[2].spans])
    assert np.min(np.abs(factors[:, None] / (1.0, 0.62, 0.45) - 1.0), axis=1).max() < 0.08


@pytest.mark.parametrize("seed", [20, 21])
def test_gears_that_return_are_found_over_hills_that_are_not_logged(seed: int) -> None:
    (change,) = ratio_changes([drive(seed, OFTEN, hills=0.004)], STATED)
    factors = np.array([factor for *_, factor in change.spans])
    assert factors.size > 6
    assert np.min(np.abs(factors[:, None] / (0.62, 0.45) - 1.0), axis=1).max() < 0.06


def test_a_gain_that_changes_in_one_drive_is_found_there() -> None:
    drives = [drive(k) for k in range(3)]
    time, channels, torque = drive(3)
    drives.append((time, channels, np.where(time > 80.0, 1.1 * torque, torque)))
    changes = ratio_changes(drives, STATED)
    assert [len(change.spans) for change in changes] == [0, 0, 0, 1]
    ((start, _, factor),) = changes[3].spans
    assert start == pytest.approx(80.0, abs=1.5)
    assert factor == pytest.approx(1 / 1.1, abs=0.015)


def test_a_drive_is_simulated_in_the_usual_gear_only() -> None:
    time, channels, torque = drive(1, GEARS)
    log = Log("run.csv", time, {**channels, "drive_torque": torque}, ())
    segments, findings = drive_segments([log], [RunConditions()], Segmentation("road_load", motion=STATED))
    assert [t for s in segments for t in (s.time[0], s.time[-1])] == pytest.approx([0.0, 30.0, 120.0, 160.0], abs=1.0)
    assert ["acceleration per torque changes" in f.what for f in findings] == [True]


def test_a_drive_with_the_gears_of_another_is_left_out_too() -> None:
    """Over hills, one drive alone does not show that its parts are gears."""
    hilly = drive(4, GEARS, hills=0.004)
    assert not ratio_changes([hilly], STATED)[0].spans
    assert [bool(change.spans) for change in ratio_changes([drive(1, GEARS), hilly], STATED)] == [True, True]


@pytest.mark.parametrize("seed", range(3))
def test_gears_are_found_over_hills_that_an_elevation_shows(seed: int) -> None:
    assert not ratio_changes([drive(seed, GEARS, hills=0.02)], STATED)[0].spans
    (change,) = ratio_changes([drive(seed, GEARS, hills=0.02, shown=True)], STATED)
    assert [round(a) for a, _, _ in change.spans] == pytest.approx([30, 55, 95], abs=2)
    assert [factor for *_, factor in change.spans] == pytest.approx([0.62, 0.45, 0.62], abs=0.04)


@pytest.mark.parametrize(("ratio", "geared"), [(0.73, False), (0.62, True)])
def test_a_drive_mostly_in_the_usual_gear_needs_the_ratios_of_another(ratio: float, geared: bool) -> None:
    """A hill in it resembles another ratio, while the rest has the level of all drives."""
    found = Pieces(np.arange(4.0), np.array([1.0, ratio, 1.01]), np.array([50.0, 25.0, 60.0]), np.zeros(3), False)
    levels = np.array([1.0, 0.62])
    assert found.has(levels, beside=1.0) is geared


def test_gears_that_follow_the_speed_are_found_in_every_drive() -> None:
    """High gears at high speeds look like another drag, and the torque steps at a shift."""
    drives = [shifted(seed) for seed in range(3)]
    for change in ratio_changes(drives, STATED):
        assert change.spans
        assert np.median([factor for *_, factor in change.spans]) == pytest.approx(0.62, abs=0.015)


def shifted(seed: int) -> Driven:
    """A drive whose gear depends on the speed: 1 or, above 15 m/s, 0.62."""
    rng = np.random.default_rng([9, seed])
    time = np.arange(0.0, 160.0, STEP)
    goal = np.interp(time, np.r_[0.0, np.cumsum(rng.uniform(6.0, 16.0, 30))], np.r_[5.0, rng.uniform(6.0, 24.0, 30)])
    speed, force, high, v = np.empty(time.size), np.empty(time.size), np.zeros(time.size, dtype=bool), 5.0
    for k in range(time.size):
        high[k] = v > (14.0 if k and high[k - 1] else 15.0)
        force[k] = np.clip(MASS * (goal[k] - v) - 900.0, -900.0, 3800.0) + 160.0 + 0.9 * v**2
        speed[k] = v
        v += STEP * (force[k] - 160.0 - 0.9 * v**2) / MASS
    channels = {"speed": speed + 0.02 * rng.standard_normal(time.size), "brake_torque": np.zeros(time.size)}
    return time, channels, force * RADIUS / np.where(high, 0.62, 1.0)
