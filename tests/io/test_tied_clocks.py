"""Clocks of two loggers from physically related channels: delay, drift, choice of the pair, refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.bench.clocks import errors, logs, tie
from tests.io.text_logs import read_csv
from tests.plant.two_loggers import two_loggers
from vdyn_cli.io.clocks.align import merge
from vdyn_cli.io.clocks.clock_estimate import clock_difference
from vdyn_cli.io.clocks.tied_channels import related_channels, ties
from vdyn_cli.io.reader import Column
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log


def said(log: Log) -> str:
    return "\n".join(str(f) for f in log.findings)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("speed", "acceleration"),
        *(pytest.param(n, "speed", marks=pytest.mark.slow) for n in ("speed", "wheel_speed", "position")),
    ],
)
def test_delay_and_drift_lie_within_their_errors(first: str, second: str) -> None:
    for seed in (11, 12):  # the bench has 30
        drive = two_loggers(np.random.default_rng(seed), 300.0)
        found = clock_difference(*logs(drive, first, second), tie(first, second))
        assert max(np.abs(errors(drive, found))) < 3.5
        assert found.delay_std < 0.02
        assert found.drift_std < 2e-4


def test_a_drift_that_a_short_log_does_not_tell_is_that_of_a_quartz_clock() -> None:
    """A coast-down after a launch: its single bend determines the delay but no drift."""
    for seed in range(6):
        rng = np.random.default_rng([seed, 3])
        t = np.arange(0.0, 100.0, 0.02)
        felt = np.where(t < 12.0, 2.2, -0.3 - 0.2 * np.exp(-(t - 12.0) / 40.0)) * np.clip(t, 0.0, 1.0)
        speed = 5.0 + np.cumsum(felt) * 0.02
        slow = t[::5]
        box = Log("box", slow, {"speed": speed[::5] + rng.normal(0.0, 0.02, slow.size)})
        bus = Log("bus", t + 0.35, {"acceleration": felt + rng.normal(0.0, 0.05, t.size)})
        found = clock_difference(box, bus, tie("speed", "acceleration"))
        assert abs(found.delay - 0.35) < 0.05
        assert not found.corrected
        assert abs(found.drift) < 1e-4
        assert found.drift_std <= 1e-4


def test_the_pair_with_the_smallest_error_is_chosen_and_the_others_agree() -> None:
    drive = two_loggers(np.random.default_rng(5), 200.0)
    time = drive.first["speed"][0]
    bus = Log("bus", time, {n: drive.first[n][1] for n in ("speed", "wheel_speed")})
    box = Log("box", *[drive.second["speed"][0], {"speed": drive.second["speed"][1]}])
    merged, (clock,) = merge(bus, [box])
    assert clock.pair == ("speed", "speed")
    assert "a sensor lags" not in said(merged)
    named, (clock,) = merge(bus, [box], ("wheel_speed", "speed"))
    assert "; estimated from 'wheel_speed' and 'speed'" in said(named)


def test_a_sensor_that_lags_behind_its_own_logger_is_said() -> None:
    drive = two_loggers(np.random.default_rng(5), 300.0)
    t, felt = drive.second["acceleration"]
    late = np.interp(t + 0.3, *drive.second["speed"])
    bus = Log("bus", drive.first["speed"][0], {"speed": drive.first["speed"][1]})
    merged, _ = merge(bus, [Log("box", t, {"speed": late, "acceleration": felt})])
    assert "a sensor lags behind its own logger" in said(merged)


@pytest.mark.parametrize("driven", [False, True])
def test_the_slip_of_a_wheel_is_no_delay(driven: bool) -> None:
    """Drives that coast at up to 1 m/s^2 by drag; an axle without drive slips only under brakes."""
    pulls = []
    for seed in range(6):
        rng, t = np.random.default_rng([seed, 8]), np.arange(0.0, 40.0, 0.01)
        force = np.repeat(rng.permutation([3.0, 0.0, -4.0, 2.5, 0.0, -3.0, 2.0, 0.0]), t.size // 8)
        force = np.convolve(force, np.hanning(20) / np.hanning(20).sum(), "same")
        speed = 15.0 + np.cumsum(force - force.mean()) * 0.01
        speed += 2.0 - min(float(speed.min()), 2.0)
        drag = 0.0018 * speed**2
        speed = speed - np.cumsum(drag - drag.mean()) * 0.01
        tire = force if driven else np.minimum(force, 0.0)
        turned = speed * (1.0 + 0.004 * tire) / 0.23
        box = Log("box", t, {"acceleration": np.gradient(speed, 0.01) + rng.normal(0.0, 0.08, t.size)})
        bus = Log("bus", t + 0.06, {"wheel_speed": turned + rng.normal(0.0, 0.06, t.size)})
        found = clock_difference(box, bus, tie("acceleration", "wheel_speed"))
        pulls.append((found.delay - 0.06) / found.delay_std)
        assert found.delay_std < 0.1
    assert float(np.sqrt(np.mean(np.square(pulls)))) < 1.8  # 99 % of means of 6 with Student's t


def test_a_frozen_segment_takes_no_part() -> None:
    drive = two_loggers(np.random.default_rng(5), 200.0)
    (t, speed), (s, felt) = drive.first["speed"], drive.second["acceleration"]
    frozen = speed.copy()
    hold = (t >= 60.0) & (t < 72.0)
    frozen[hold] = speed[hold][0]
    _, (clock,) = merge(Log("bus", t, {"speed": frozen}), [Log("box", s, {"acceleration": felt})])
    assert abs(clock.delay - drive.delay - drive.drift * clock.at) < 3.0 * clock.delay_std < 0.1


def test_loggers_without_a_tied_pair_are_refused_with_the_channels_that_would_serve() -> None:
    t = np.arange(0.0, 60.0, 0.1)
    bus, box = Log("bus", t, {"speed": 10.0 + np.sin(t)}), Log("box", t, {"front_load": 4000.0 + t})
    with pytest.raises(InputError, match="they have no channel in common and no physically related pair") as refused:
        merge(bus, [box])
    assert "map one of these from box: position, speed" in str(refused.value)
    with pytest.raises(InputError, match="are not physically related"):
        merge(bus, [box], ("speed", "front_load"))


def test_motion_ties_and_pitch_ties() -> None:
    assert [str(t) for t in ties(("pitch",), ("pitch_rate", "speed"))] == ["channels 'pitch' and 'pitch_rate'"]
    assert not ties(("position",), ("acceleration",))
    assert related_channels(("pitch",)) == ["pitch", "pitch_rate"]


def test_real_speed_and_satellite_and_accelerometer(shared_data: Path) -> None:
    folder, time = shared_data / "comma2k19_segment", Column("t", "s", "s")
    bus = read_csv(folder / "can_speed.csv", {"time": time, "speed": Column("v_mps", "m/s", "m/s")})
    gnss = read_csv(folder / "gnss.csv", {"time": time, "speed": Column("speed_mps", "m/s", "m/s")})
    phone = read_csv(folder / "imu_acc_mps2.csv", {"time": time, "acceleration": Column("forward", "m/s^2", "m/s^2")})
    _, (sky, felt) = merge(bus, [gnss, phone])
    assert 0.1 < sky.delay < 0.25  # a receiver's latency; the clock is one
    assert sky.delay_std < 0.02
    assert abs(felt.delay) < 3.0 * felt.delay_std
    assert felt.delay_std < 0.2
