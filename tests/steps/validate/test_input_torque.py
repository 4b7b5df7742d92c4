"""Denoised torque: ramps and corners are preserved."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.engine.lead import LEAD, read_ahead
from vdyn_cli.engine.simulate import Drive
from vdyn_cli.io.clocks.align import on_one_clock
from vdyn_cli.physics.models.road_load import road_load
from vdyn_cli.physics.models.vehicle import vehicle
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.drives.input_torque import DriveInputs, denoised
from vdyn_cli.steps.validate.drives.segments import RunConditions, Segmentation, drive_segments

TIME = np.arange(0.0, 20.0, 0.01)
TRUE = np.interp(TIME, [0, 3, 3.15, 8, 8.2, 11, 11.1, 20], [0, 0, 300, 300, 20, 20, 250, 180])


def test_most_of_the_noise_goes_and_corners_stay() -> None:
    rng = np.random.default_rng(4)
    found, _ = denoised(TIME, TRUE + rng.standard_normal(TIME.size), 1.0)
    error = found - TRUE
    assert np.sqrt(np.mean(error**2)) < 0.4
    assert np.abs(error).max() < 4.0
    steady = (TIME > 4.5) & (TIME < 7.0)
    assert np.std(error[steady]) < 0.2


def test_without_noise_nothing_is_changed() -> None:
    assert denoised(TIME, TRUE, 1e-3)[0] == pytest.approx(TRUE, abs=0.02)


def restless() -> np.ndarray:
    """A pedal in constant motion: fifteen straight lines, some shorter than the longest fits."""
    rng = np.random.default_rng(6)
    knots = np.r_[0.0, np.cumsum(rng.uniform(0.66, 2.0, 30))]
    return np.interp(TIME, knots, np.cumsum(rng.choice([-1, 1], 31) * rng.uniform(50, 200, 31)))


@pytest.mark.parametrize("true", [TRUE, restless()], ids=["three pedals", "restless"])
def test_it_works_the_same_backwards_in_time(true: np.ndarray) -> None:
    noisy = true + np.random.default_rng(5).standard_normal(TIME.size)
    backwards, corners = denoised(-TIME[::-1], noisy[::-1], 1.0)
    forwards, found = denoised(TIME, noisy, 1.0)
    assert forwards == pytest.approx(backwards[::-1], abs=1e-9)
    assert -corners[0][::-1] == pytest.approx(found[0], abs=1e-9)


KNOTS = [0.0, 3.0037, 3.1521, 8.0049, 8.2064, 11.0011, 11.104, 20.0]
BETWEEN = np.interp(TIME, KNOTS, [0, 0, 300, 300, 20, 20, 250, 180])


def test_corners_are_found_between_samples() -> None:
    times, values = denoised(TIME, BETWEEN, 0.01)[1]
    assert times == pytest.approx(KNOTS[1:-1], abs=1e-4)
    assert values == pytest.approx([0, 300, 300, 20, 20, 250], abs=0.1)


def test_noise_makes_no_corners_and_moves_true_ones_little() -> None:
    rng = np.random.default_rng(7)
    assert denoised(TIME, 100 + rng.standard_normal(TIME.size), 1.0)[1][0].size == 0
    times, _ = denoised(TIME, BETWEEN + rng.standard_normal(TIME.size), 1.0)[1]
    assert len(times) >= 3
    assert max(min(abs(t - k) for k in KNOTS) for t in times) < 2e-3


def test_a_pedal_that_never_rests_is_followed_closely() -> None:
    """Denoised sample by sample, the worst error is 2.2 noise levels in the mean of such drives."""
    worst = []
    for seed in range(40):
        noisy = restless() + np.random.default_rng([12, seed]).standard_normal(TIME.size)
        worst.append(np.abs(denoised(TIME, noisy, 1.0)[0] - restless()).max())
    assert np.mean(worst) < 1.2
    assert max(worst) < 3.0


@pytest.mark.parametrize("frequency", [0.5, 2.0, 8.0])
@pytest.mark.parametrize("level", [0.5, 2.0, 10.0])
def test_what_swings_is_not_distorted(frequency: float, level: float) -> None:
    swing = 200 * np.sin(2 * np.pi * frequency * TIME)
    noise = level * np.random.default_rng(8).standard_normal(TIME.size)
    values, (times, heights) = denoised(TIME, swing + noise, level)
    assert np.sqrt(np.mean((values - swing) ** 2)) < 2.0 * level
    assert np.abs(heights - 200 * np.sin(2 * np.pi * frequency * times)).max(initial=0.0) < 6.0 * level


@pytest.mark.parametrize("offset", [0.0, 0.37, 1234.5])
def test_corners_at_samples_stay_samples(offset: float) -> None:
    """A recorded demand has its corners at samples."""
    time = offset + TIME
    values, corners = denoised(time, np.round(TRUE, 1), 1e-3)
    assert not np.isin(corners[0], time).any()
    drive = Drive(time, {"torque": values}, between={"torque": corners})
    ahead = read_ahead(drive, {("torque", LEAD): 0.0}).inputs["torque"]
    assert ahead == pytest.approx(values, abs=1e-6)


def coasting(second: float, zero: float = 0.3, noise: float = 1.0) -> np.ndarray:
    """A pedal released three times, the second time to the torque ``second``, N m."""
    times = [0, 2, 2.2, 6, 6.2, 7.4, 7.6, 10, 10.2, 20]
    true = np.interp(TIME, times, [0, 0, 300, 300, second, second, 250, 250, 0, 0])
    return np.asarray(zero + true + noise * np.random.default_rng(9).standard_normal(TIME.size))


@pytest.mark.parametrize("noise", [0.02, 1.0])
@pytest.mark.parametrize("zero", [0.0, 0.3, 1.2])
def test_a_pedal_let_go_gives_the_same_torque_every_time(noise: float, zero: float) -> None:
    """Also for a sensor whose zero is many times its noise."""
    found, _ = denoised(TIME, coasting(0.0, zero, noise), noise, zero=0.5)
    let_go = [found[(a < TIME) & (b > TIME)] for a, b in ((0.2, 1.9), (6.3, 7.3), (10.3, 19.8))]
    assert all(np.ptp(level) == 0.0 for level in let_go)
    assert {level[0] for level in let_go} == {let_go[0][0]}
    assert let_go[0][0] == pytest.approx(zero, abs=0.1 * noise)


def test_a_torque_that_is_another_stays_another() -> None:
    found, _ = denoised(TIME, coasting(1.0), 1.0)
    apart = found[(TIME > 6.3) & (TIME < 7.3)].mean() - found[(TIME > 10.3) & (TIME < 19.8)].mean()
    assert apart == pytest.approx(1.0, abs=0.3)


def test_the_level_is_where_most_of_the_coasting_is_however_long_a_pedal_creeps_beside_it() -> None:
    time = np.arange(0.0, 46.0, 0.01)
    knots = [0, 8, 8.2, 11, 11.2, 19, 19.2, 20, 20.2, 44, 44.1, 46]
    true = np.interp(time, knots, [0, 0, 200, 200, 0, 0, 200, 200, 1.5, 9, 200, 200])
    found, _ = denoised(time, true + np.random.default_rng(2).standard_normal(time.size), 1.0, zero=3.0)
    for begin, end in ((0.1, 7.9), (11.3, 18.9)):
        level = found[(begin < time) & (time < end)]
        assert np.ptp(level) == 0.0
        assert level[0] == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize("width", [1.0, 2.0])
def test_a_pedal_that_is_pressed_smoothly_has_no_corners(width: float) -> None:
    true = 150.0 * (1.0 - np.cos(np.pi * np.clip((TIME - 5.0) / width, 0.0, 1.0)))
    found, (corners, _) = denoised(TIME, true + np.random.default_rng(1).standard_normal(TIME.size), 1.0)
    assert corners.size == 0
    assert np.sqrt(np.mean((found - true) ** 2)) < 0.5


@pytest.mark.parametrize("slope", [50.0, 100.0, 200.0, 1000.0])
def test_the_foot_of_a_ramp_is_not_cut_off(slope: float) -> None:
    """A slowly pressed pedal leaves the released-pedal level before the noise shows it."""
    true = np.interp(TIME, [0, 5.003, 5.003 + 200 / slope, 10, 10.2, 20], [0, 0, 200, 200, 0, 0])
    worst = []
    for seed in range(10):
        found, _ = denoised(TIME, true + np.random.default_rng(seed).standard_normal(TIME.size), 1.0)
        worst.append(np.abs(found - true)[(TIME > 4.9) & (TIME < 5.15)].max())
    assert np.median(worst) < 0.6
    assert max(worst) < 1.5


@pytest.mark.parametrize(
    ("rate", "slope"), [(50, 500), (100, 2000), (100, 200), (500, 100), (500, 500), (1000, 500), (1000, 2000)]
)
def test_corners_are_not_rounded_off(rate: int, slope: int) -> None:
    """A rounded corner is a systematic error that excites simulated shafts less than the driver did."""
    time = np.arange(0.0, 6.0, 1.0 / rate)
    fine = np.arange(0.5, 5.5, 5e-4)
    knots, torques = [0.0, 2.0037, 2.0037 + 300 / slope, 6.0], [0, 0, 300, 300]
    near = np.min(np.abs(fine[:, None] - knots[1:-1]), axis=1) < 0.03
    errors = []
    for seed in range(12):
        noisy = np.interp(time, knots, torques) + np.random.default_rng([11, seed]).standard_normal(time.size)
        values, (times, heights) = denoised(time, noisy, 1.0)
        where = np.searchsorted(time, times)
        found = np.interp(fine, np.insert(time, where, times), np.insert(values, where, heights))
        errors.append((found - np.interp(fine, knots, torques))[near])
    assert np.sqrt(np.mean(np.mean(errors, axis=0) ** 2)) < 0.12  # some 0.4 where every sample is seen by itself
    assert np.std(errors) < 0.45


def logged(kind: str) -> Log:
    """A torque at 50 Hz with a speed at 100 Hz: in one file with empty rows, or in that of a logger 5 ms late."""
    rng = np.random.default_rng(21)
    own = TIME[::2] + (0.005 if kind == "two files" else 0.0)
    torque = np.interp(own, KNOTS, [0, 0, 300, 300, 20, 20, 250, 180]) + rng.standard_normal(own.size)
    speed = 10.0 + np.sin(TIME) + 0.01 * rng.standard_normal(TIME.size)
    log = Log("a.csv", TIME, {"speed": speed})
    if kind == "one file":
        return log.with_channels(drive_torque=np.insert(torque, np.arange(1, own.size + 1), np.nan))
    return on_one_clock(log, [Log("a.csv", own, {"drive_torque": torque})])


@pytest.mark.parametrize("kind", ["one file", "two files"])
def test_a_torque_of_a_slower_logger_keeps_its_corners(kind: str) -> None:
    """Linear interpolation between its samples would round corners off, and hide the noise level."""
    (segment,), _ = drive_segments([logged(kind)], [RunConditions()], Segmentation("vehicle"))
    assert segment.noise_levels["drive_torque"] == pytest.approx(1.0, rel=0.15)
    (drive,) = DriveInputs((segment,), vehicle()).drives
    times, values = drive.line("drive_torque")
    near = np.abs(times[:, None] - KNOTS[1:-1]).min(axis=1) < 0.1
    error = values[near] - np.interp(times[near], KNOTS, [0, 0, 300, 300, 20, 20, 250, 180])
    assert np.sqrt(np.mean(error**2)) < 1.5


def test_the_run_time_of_a_window_counts_from_the_start_of_its_log() -> None:
    log = Log("a.csv", TIME, {"speed": np.full(TIME.size, 10.0), "drive_torque": np.full(TIME.size, 30.0)})
    segments, _ = drive_segments([log], [RunConditions()], Segmentation("road_load", length=5.0))
    starts = [drive.start["run_time"] for drive in DriveInputs(tuple(segments), road_load("torque")).drives]
    assert starts == pytest.approx([s.time[0] for s in segments])
    assert len(starts) >= 3
    assert starts[-1] > 5.0


def paused(rate: int, ramp: float, seed: int, smooth: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Errors, every half millisecond, about a ramp of this duration, s, and the number of corners."""
    rng = np.random.default_rng([13, seed])
    time, fine, start = np.arange(0.0, 4.0, 1.0 / rate), np.arange(1.9, 2.2, 5e-4), 2.0 + rng.uniform(0.0, 1.0 / rate)

    def true(at: np.ndarray) -> np.ndarray:
        share = np.clip((at - start) / ramp, 0.0, 1.0)
        return 300.0 * (0.5 + 0.5 * np.cos(np.pi * share) if smooth else 1.0 - share)

    values, (times, heights) = denoised(time, true(time) + rng.standard_normal(time.size), 1.0)
    where = np.searchsorted(time, times)
    return np.interp(fine, np.insert(time, where, times), np.insert(values, where, heights)) - true(fine), times


@pytest.mark.parametrize(("rate", "ramp"), [(50, 0.06), (50, 0.12), (100, 0.04), (100, 0.06), (200, 0.03)])
def test_a_shift_pause_of_few_samples_keeps_its_corners(rate: int, ramp: float) -> None:
    """Linear interpolation between samples misses it by about 4 noise levels."""
    found = [paused(rate, ramp, seed) for seed in range(40)]
    assert np.mean([times.size == 2 for _, times in found]) > 0.8
    assert np.median([np.sqrt(np.mean(misses**2)) for misses, _ in found]) < 0.7


@pytest.mark.parametrize("ramp", [0.1, 0.15])
def test_a_torque_that_turns_smoothly_within_few_samples_gets_no_corners(ramp: float) -> None:
    assert np.mean([paused(50, ramp, seed, smooth=True)[1].size > 0 for seed in range(40)]) < 0.1
