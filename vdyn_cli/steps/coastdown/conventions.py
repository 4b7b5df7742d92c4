"""Signs of channels that contradict physics, found before they are fitted."""

from __future__ import annotations

import numpy as np

from vdyn_cli.inference.bins import cut
from vdyn_cli.physics.models.road_load import Driven
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.selection import FEWEST_SAMPLES

LOOK = 2.0  # s, over which rates are taken
OPPOSED = -0.3  # cosine of a channel and the rate of the speed that only a turned sign explains


def conventions(log: Log, driven: Driven) -> list[Finding]:
    """Signs that contradict physics, with the line that mends them."""
    found, line = [], "add 'sign: -1' to its channel"
    good = np.isfinite(log["speed"])
    if good.sum() < FEWEST_SAMPLES:
        return []
    if np.median(log["speed"][good]) < -0.5:
        return [Finding(f"{log.name}, speed", "the car drives backwards", "negative speed", line)]
    drives = () if driven == "coasting" else ("drive_torque", "drive_force")
    for name in ("acceleration", *drives):
        alike = _alike(log, name) if name in log else 0.0
        if alike < OPPOSED:
            what = f"{name} falls when the car speeds up and rises when it slows down"
            found.append(Finding(f"{log.name}, {name}", what, f"correlation {alike:.2f}", line))
    return found


def _alike(log: Log, name: str) -> float:
    """Cosine of the channel and the rate of the speed; 0 where too little is known."""
    good = np.isfinite(log["speed"]) & np.isfinite(log[name])
    if good.sum() < FEWEST_SAMPLES:
        return 0.0
    bins = cut(log.time[good], LOOK)
    if bins.time.size < 4:
        return 0.0
    speed, value = bins.mean(log["speed"][good]), bins.mean(log[name][good])
    rate, value = np.diff(speed) / np.diff(bins.time), 0.5 * (value[1:] + value[:-1])
    if name != "acceleration":  # a drive holds the speed too: only its changes count
        rate, value = rate - rate.mean(), value - value.mean()
    size = float(np.linalg.norm(rate) * np.linalg.norm(value))
    return float(rate @ value) / size if size > 0 else 0.0
