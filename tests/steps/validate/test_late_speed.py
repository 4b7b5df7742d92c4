"""A speed whose clock is a second from that of the torque is shifted; hills, gusts and short latencies are not."""

import numpy as np
import pytest

from vdyn_cli.quantities.arrays import filled
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.drives.late_speed import with_speed_on_time

STEP, LENGTH = 0.02, 150.0  # s


def _drive(seed: int, delay: float, hills: float = 0.0) -> Log:
    """A car of 1100 kg whose driver steps the torque every few seconds, by Euler's method."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, LENGTH, STEP)
    steps = rng.uniform(0.0, 90.0, 60)
    pedal = steps[np.minimum((time / rng.uniform(4.0, 8.0)).astype(int), 59)]
    torque, speed, position = np.zeros(time.size), np.full(time.size, 15.0), 0.0
    for k in range(1, time.size):
        torque[k] = torque[k - 1] + (pedal[k - 1] - torque[k - 1]) * STEP / 0.15
        v = speed[k - 1]
        slope = hills * np.sin(position / 60.0)
        force = 18.0 * torque[k - 1] - 110.0 - 0.4 * v * v - 1100.0 * 9.81 * slope
        speed[k] = max(v + force / 1160.0 * STEP, 3.0)
        position += v * STEP
    shown = time[250:-250:5]
    read = np.interp(shown - delay, time, speed) + rng.normal(0.0, 0.02, shown.size)
    read[::2] = np.nan
    return Log("drive.csv", shown, {"speed": read, "drive_torque": np.interp(shown, time, torque)})


@pytest.mark.parametrize("delay", [1.0, -0.7])
def test_a_speed_on_another_clock_is_shifted(delay: float) -> None:
    late, right = _drive(1, delay), _drive(1, 0.0)
    (found,), (finding,) = with_speed_on_time([late])
    assert f"{abs(delay):.1f} s" in finding.what
    assert finding.doubt
    error = filled(found.time, found["speed"]) - filled(right.time, right["speed"])
    assert np.max(np.abs(error[20:-20])) < 0.25


@pytest.mark.parametrize(("delay", "hills"), [(0.0, 0.03), (0.25, 0.0), (0.25, 0.02)])
def test_hills_and_latencies_are_left_to_the_fit(delay: float, hills: float) -> None:
    late = _drive(2, delay, hills)
    assert with_speed_on_time([late]) == ((late,), ())
