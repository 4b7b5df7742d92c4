"""Detection of gains that change in mid-run, from channels and their simulation by the fitted model.

The model of a step relates channels that no single law relates: a shaft's torque to its twist, a tire's force to slip
and load. Before and after the change they differ by a factor, and the fit is in between.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np

from vdyn_cli.io.quality.gain_changes import GainChange, drift_design, likely_change, stepped_share
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.result import Comparison

AT_ONCE = 1.0  # s: a sensor's gain changes from one sample to the next, a brake or a swerve acts for one second or more

SLOPED = ("acceleration",)  # channels to which a slope of the road adds

ChangeKind = Literal["", "abrupt", "gradual"]


def simulated_gain_findings(comparisons: Sequence[Comparison]) -> Iterator[Finding]:
    """A fault for each run in which the gain of a channel over its simulation changes, unlike in the other runs.

    A model that lacks an effect also misses its logs, but in all runs alike, and seldom by a factor that changes at one
    instant. For a single run, a gain that depends on the sign or size of the channel is excluded, and a gradual change
    is only a warning: the gain of a sensor drifts, or the part itself changes.

    Parameters
    ----------
    comparisons : measured and simulated channels of every run; those over time are tested.
    """
    by_channel: dict[str, list[Comparison]] = {}
    for one in comparisons:
        if one.x_label.startswith("time"):
            by_channel.setdefault(one.channel, []).append(one)
    for channel, runs in by_channel.items():
        alone = len(runs) < QUALITY.fewest_compared_runs
        changes = [_likely(one, alone) for one in runs]
        usual = 0.0 if alone else float(np.median([abs(np.log(c.factor)) if c else 0.0 for c, _ in changes]))
        for run, (change, kind) in zip((one.run for one in runs), changes, strict=True):
            if change is None or not kind or abs(np.log(change.factor)) < QUALITY.outlying_run_ratio * usual:
                continue  # not a sensor's gain, but the model or the test
            share = f"{channel} against its simulation: the ratio changes by {100 * (change.factor - 1.0):+.1f} %"
            if kind == "abrupt":
                remedy = f"cut the run with from_time or to_time: {change.at:.1f} s, or remove it"
                what = f"{share} at {change.at:.1f} s: the gain of a sensor changed"
                yield Finding(run, what, "", remedy, fault=True, doubt=True)
            else:
                what = f"{share} gradually, about {change.at:.1f} s: the gain of a sensor, or the part itself, changed"
                yield Finding(run, what, "", "another run shows whether it is the sensor", doubt=True)


def _likely(one: Comparison, alone: bool) -> tuple[GainChange | None, ChangeKind]:
    """The most likely change of a run's gain, and whether it is abrupt or gradual; empty if not significant."""
    good = np.isfinite(one.measured) & np.isfinite(one.simulated)
    if one.used is not None:
        good &= one.used
    time, y, x = one.x[good], one.measured[good], one.simulated[good]
    found = likely_change(y, x)
    if found is None or found[1] * found[2] <= 0.0:
        return None, ""
    k, g, h, t, share = found
    change = GainChange(one.channel, float(time[k - 1]), h / g)
    large = abs(h / g - 1.0) >= QUALITY.least_gain_change and t >= QUALITY.gain_change_t
    if not large or share > QUALITY.simulated_share:
        return change, ""
    if one.channel in SLOPED and _may_be_added(y, x, k):
        return change, ""
    drift = stepped_share(y, x, k, drift_design(x)) if _steps_at_once(time, y, x, k, (g, h)) else np.inf
    if not alone:
        return change, "abrupt" if drift <= QUALITY.abrupt_share else ""
    law = np.column_stack([x, x * (x > 0.0), x * np.abs(x)])
    if stepped_share(y, x, k, law) > QUALITY.single_run_abrupt_share:
        return change, ""
    return change, "abrupt" if drift <= QUALITY.single_run_abrupt_share else "gradual"


def _may_be_added(y: Array, x: Array, k: int) -> bool:
    """Whether a step added to y at index k, such as a hill to a specific force, leaves as little as one of the gain."""
    law = np.column_stack([x, np.arange(x.size) >= k])
    return stepped_share(y, x, k, law) > QUALITY.abrupt_share


def _steps_at_once(time: Array, y: Array, x: Array, k: int, gains: tuple[float, float]) -> bool:
    """Whether the gain changes within ``AT_ONCE`` or a fiftieth of the run, whichever is shorter.

    By regressions of y on x just before and after index k, over five samples or more. A simulated speed integrates its
    errors: over a drive its ratio to the measured one changes within seconds, and so it does where a coasting car is
    braked or steered for some seconds; two means may fit that well. False where less than ``near_change`` of the change
    is near, beyond three standard errors of both local gains.
    """
    width = max(min(x.size // 50, int(AT_ONCE / float(np.median(np.diff(time))))), 5)
    near = slice(max(k - width, 0), k), slice(k, k + width)
    squares = [float(x[s] @ x[s]) for s in near]
    if min(squares) <= 0.0:
        return True
    local = [float(x[s] @ y[s]) / square for s, square in zip(near, squares, strict=True)]
    residual = np.concatenate([y[s] - gain * x[s] for s, gain in zip(near, local, strict=True)])
    error = 3.0 * float(np.sqrt(np.mean(residual**2) * sum(1.0 / s for s in squares)))
    whole = gains[1] - gains[0]
    return bool((local[1] - local[0]) * np.sign(whole) + error > QUALITY.near_change * abs(whole))
