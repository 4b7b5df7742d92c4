"""Alignment of several loggers' clocks: correct delay and standard error, and every resampling reported."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.bench.align_accuracy import KINDS, QUANTILE, Kind, recordings
from tests.io.text_logs import read_csv
from vdyn_cli.io.clocks.align import merge
from vdyn_cli.io.clocks.clock_estimate import clock_difference
from vdyn_cli.io.clocks.tied_channels import ChannelTie
from vdyn_cli.io.reader import Column
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given


def align(reference: Log, other: Log, channel: str) -> tuple[float, float]:
    """Delay of the other's clock by a channel that both recorded, and its standard error, s."""
    found = clock_difference(reference, other, ChannelTie(channel, channel))
    return found.delay, found.delay_std


def said(log: Log) -> str:
    return "\n".join(str(f) for f in log.findings)


def pair(seed: int = 0, kind: Kind = KINDS["test drive, 100 and 10 Hz"]) -> tuple[Log, Log, float]:
    return recordings(kind, np.random.default_rng([seed, 41]))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["test drive, 100 and 10 Hz", "10 and 100 Hz, far apart", "one acceleration and stop"])
def test_the_delay_is_as_accurate_as_the_data_allow_and_its_error_honest(name: str) -> None:
    kind, errors, scaled = KINDS[name], [], []
    for seed in range(16):
        ours, theirs, bound = pair(seed, kind)
        delay, std = align(ours, theirs, "speed")
        errors.append((delay - kind.delay) / bound)
        scaled.append((delay - kind.delay) / std)
    assert np.sqrt(np.mean(np.square(errors))) < 1.6  # of 16 cases; the bench shows 1.0
    assert np.mean(np.abs(scaled) < QUANTILE) > 0.8


def test_swapping_the_loggers_turns_the_sign() -> None:
    ours, theirs, _ = pair()
    there, std = align(ours, theirs, "speed")
    back, _ = align(theirs, ours, "speed")
    assert there == pytest.approx(-back, abs=std)


@pytest.mark.slow
def test_a_clock_against_itself_has_no_delay() -> None:
    ours, _, _ = pair()
    delay, std = align(ours, ours, "speed")
    assert abs(delay) < 1e-6
    assert std < 1e-6


def test_origins_may_be_hours_apart() -> None:
    ours, theirs, _ = pair()
    later = replace(theirs, time=theirs.time + 40_000.0)
    assert align(ours, later, "speed")[0] == pytest.approx(40_000.1234, abs=0.01)


def test_a_short_log_is_found_in_a_long_one() -> None:
    ours, theirs, _ = pair()
    delay, std = align(ours, theirs.between(30.0, 75.0), "speed")
    assert abs(delay - 0.1234) < 5.0 * std


def test_gaps_and_missing_values_do_not_bias() -> None:
    ours, theirs, _ = pair(kind=KINDS["jitter, 100 and 85 Hz"])
    speed = ours["speed"].copy()
    speed[2000:3500] = np.nan
    speed[::7] = np.nan
    keep = (theirs.time < 60.0) | (theirs.time > 80.0)
    cut = Log("theirs", theirs.time[keep], {"speed": theirs["speed"][keep]})
    delay, std = align(ours.with_channels(speed=speed), cut, "speed")
    assert abs(delay - 0.1234) < 4.0 * std < 0.02


def test_a_pure_coast_down_says_how_little_it_knows() -> None:
    ours, theirs, bound = pair(kind=KINDS["coast-down"])
    delay, std = align(ours, theirs, "speed")
    assert std > 0.3 * bound > 0.01
    assert abs(delay - 0.1234) < 4.0 * std


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda v: -v, "one logger has the opposite sign: add 'sign: -1' to its channel"),
        (lambda v: 3.6 * v, "check the unit"),
        (lambda v: np.full(v.size, 20.0), "is constant"),
        (lambda v: np.full(v.size, np.nan), "has 0 readings: 20 are needed"),
        (lambda v: np.random.default_rng(1).normal(size=v.size), "no match with the first logger at any delay"),
    ],
)
def test_recordings_that_do_not_match_are_refused(change, message: str) -> None:  # type: ignore[no-untyped-def]
    ours, theirs, _ = pair()
    with pytest.raises(InputError, match=message):
        align(ours, theirs.with_channels(speed=change(theirs["speed"])), "speed")


def test_loggers_of_two_drives_are_refused_with_their_times() -> None:
    ours, theirs, _ = pair()
    later = replace(theirs, time=theirs.time + 5000.0)
    other = later.with_channels(speed=np.random.default_rng(1).normal(size=later.time.size))
    with pytest.raises(InputError, match=r"times do not overlap: 50.* against [^>]*> check that both logs are of one"):
        align(ours, other, "speed")


def test_a_channel_that_one_logger_lacks_is_named() -> None:
    ours, theirs, _ = pair()
    with pytest.raises(InputError, match="theirs: has no channel 'torque' to align the loggers on"):
        align(ours.with_channels(torque=ours["speed"]), theirs, "torque")


def test_a_motion_that_repeats_itself_is_refused() -> None:
    t = np.arange(0.0, 100.0, 0.01)
    rng = np.random.default_rng(2)
    logs = [Log(n, t, {"speed": 15.0 + np.sin(2.0 * t) + rng.normal(0.0, 0.01, t.size)}) for n in "ab"]
    with pytest.raises(InputError, match="first logger at several delays"):
        align(*logs, "speed")


def test_an_even_motion_is_refused() -> None:
    t = np.arange(0.0, 100.0, 0.01)
    rng = np.random.default_rng(2)
    logs = [Log(n, t, {"speed": 0.3 * t + rng.normal(0.0, 0.05, t.size)}) for n in "ab"]
    with pytest.raises(InputError, match="too uniformly"):
        align(*logs, "speed")


def test_merging_says_delay_error_and_resampling() -> None:
    ours, theirs, _ = pair()
    theirs = theirs.with_channels(altitude=3.0 * theirs.time)
    merged, _ = merge(ours, [theirs], "speed")
    assert merged.name == "ours"
    assert np.array_equal(merged.time, ours.time)
    assert np.array_equal(merged["speed"], ours["speed"])
    text = said(merged)
    delay, std = align(ours, theirs, "speed")
    assert f"theirs: clock is {delay:+.4f} s +- {std:.4f} s (standard error) from that of ours" in text
    assert "'altitude' resampled to its clock (linear interpolation)" in text
    there = np.isfinite(merged["altitude"])
    assert there.mean() > 0.98
    np.testing.assert_allclose(merged["altitude"][there], 3.0 * (ours.time[there] + delay), atol=1e-6)


def test_a_slower_loggers_own_samples_are_handed_on() -> None:
    ours, theirs, _ = pair()
    theirs = replace(theirs.with_channels(altitude=np.sin(theirs.time)), time=theirs.time * (1.0 + 8e-4))
    merged, (clock,) = merge(ours, [theirs], "speed")
    time, values = merged.samples["altitude"]
    np.testing.assert_allclose(clock.stamp(time), theirs.time, atol=1e-9)
    assert np.array_equal(values, theirs["altitude"])
    inside = np.isfinite(merged["altitude"])
    np.testing.assert_allclose(merged["altitude"][inside], np.interp(ours.time[inside], time, values), atol=1e-9)
    assert not merged.with_channels(altitude=2.0 * merged["altitude"]).samples


def test_a_faster_logger_is_averaged_and_gaps_stay_empty() -> None:
    fast, slow, _ = pair()
    noisy = fast.with_channels(load=np.random.default_rng(3).normal(size=fast.time.size))
    keep = (noisy.time < 40.0) | (noisy.time > 50.0)
    noisy = Log("fast", noisy.time[keep], {k: v[keep] for k, v in noisy.channels.items()})
    merged, _ = merge(slow, [noisy], "speed")
    assert "'load' resampled to its clock (means over 0.1 s)" in said(merged)
    there = np.isfinite(merged["load"])
    assert merged["load"][there].std() == pytest.approx(np.sqrt(0.1), rel=0.15)
    empty = merged.time[~there] - 0.1234
    assert ((empty > 39.8) & (empty < 50.2)).sum() > 95
    assert ((empty > 41.0) & (empty < 49.0)).sum() == ((merged.time > 41.1234) & (merged.time < 49.1234)).sum()


def test_several_loggers_and_their_findings_are_kept() -> None:
    ours, theirs, _ = pair()
    third = Log("third", theirs.time + 5.0, {"speed": theirs["speed"], "empty": np.full(theirs.time.size, np.nan)})
    merged, _ = merge(ours, [theirs, third], "speed")
    assert "third: clock is +5.1" in said(merged)
    assert "'empty' resampled to its clock (fewer than two values)" in said(merged)
    assert sorted(merged.channels) == ["empty", "speed"]


def test_a_drifting_clock_is_said_and_corrected() -> None:
    ours, theirs, _ = pair()
    steady, (clock,) = merge(ours, [theirs], "speed")
    assert "which is not significant and not corrected" in said(steady)
    assert not clock.corrected
    drifting = replace(theirs, time=theirs.time * (1.0 + 8e-4))
    merged, (clock,) = merge(ours, [drifting], "speed")
    assert "which is corrected" in said(merged)
    assert clock.drift == pytest.approx(8e-4, abs=3.0 * clock.drift_std)
    assert "more than any quartz clock" in said(merged)
    with pytest.raises(InputError, match="the logs are of different runs or a channel is faulty"):
        merge(ours, [replace(theirs, time=theirs.time * 1.005)], "speed")


def test_real_wheel_speed_and_satellite_speed(shared_data: Path) -> None:
    folder = shared_data / "comma2k19_segment"
    time = Column("t", "s", "s")
    wheel = read_csv(folder / "wheel_speed_mps.csv", {"time": time, "speed": Column("rl", "m/s", "m/s")})
    bus = read_csv(folder / "can_speed.csv", {"time": time, "speed": Column("v_mps", "m/s", "m/s")})
    gnss = read_csv(folder / "gnss.csv", {"time": time, "speed": Column("speed_mps", "m/s", "m/s")})
    delay, std = align(bus, gnss, "speed")
    assert 0.05 < delay < 0.3
    assert std < 0.02
    # The delays around three loggers must add up to zero.
    around = align(bus, wheel, "speed")[0] + align(wheel, gnss, "speed")[0] - delay
    assert abs(around) < 0.03


def clocked(folder: Path, name: str, begin: float, length: float, date: str = "") -> Log:
    """A log with its clock as times of day, of a speed that depends on the time of day alone."""
    time = begin + np.arange(0.0, length, 0.1)
    speed = 20.0 + 3.0 * np.sin(0.2 * time) + np.sin(0.71 * time)
    rows = [
        f"{date}{int(t // 3600):02d}:{int(t % 3600 // 60):02d}:{t % 60:06.3f},{v:.5f}"
        for t, v in zip(time, speed, strict=True)
    ]
    (folder / name).write_text("\n".join(["UTC,v", *rows]) + "\n")
    return read_csv(folder / name, {"time": Column("UTC", "s", "s"), "speed": Column("v", "m/s", "m/s")})


@pytest.mark.parametrize("date", ["", "2026-05-01 "])
@pytest.mark.parametrize("stated", [True, False])
def test_times_of_day_of_two_loggers_are_one_clock(date: str, stated: bool, tmp_path: Path) -> None:
    """The second logger began 5 s later: its first sample is not at the first one's."""
    first = clocked(tmp_path, "gps.csv", 33125.0, 60.0, date)
    second = clocked(tmp_path, "can.csv", 33130.0, 50.0)
    second = replace(second, channels={"vehicle_speed": second["speed"]})
    merged, (clock,) = merge(first, [second], None, [Given(0.0, 0.0) if stated else None])
    both = np.isfinite(merged["vehicle_speed"])
    assert both.sum() == pytest.approx(500, abs=2)
    assert np.max(np.abs(merged["vehicle_speed"] - merged["speed"])[both]) < 0.01
    assert clock.delay == pytest.approx(0.0, abs=0.01)


def test_clocks_of_different_zones_are_aligned_by_their_channels(tmp_path: Path) -> None:
    first = clocked(tmp_path, "gps.csv", 33125.0, 60.0)
    second = replace(first, name="can.csv", begin=first.begin + 3600.0)
    _, (clock,) = merge(first, [second])
    assert clock.delay == pytest.approx(0.0, abs=1e-6)
    with pytest.raises(InputError, match=r"does not overlap gps\.csv enough with the stated delay"):
        merge(first, [second], None, [Given(0.0, 0.0)])
