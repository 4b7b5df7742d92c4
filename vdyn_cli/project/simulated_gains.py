"""Gains that change in mid-run, seen in a channel against the simulation of the fitted model.

The model of a step ties channels that no law ties alone: a shaft's torque to its twist, a tire's force to slip and
load. The two parts of such a run disagree by a factor, and the fit lies between them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np

from vdyn_cli.io.quality.gain_changes import GainChange, drifting, likely_change, stepped_share
from vdyn_cli.io.quality.quality_policy import QUALITY, QualityPolicy
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.result import Comparison

Course = Literal["", "abrupt", "gradual"]


def simulated_gain_findings(comparisons: Sequence[Comparison], policy: QualityPolicy = QUALITY) -> Iterator[Finding]:
    """A fault for each run in which the gain of a channel against its simulation changes, as in no other run.

    A model that lacks an effect misses its logs, too; but it misses all runs alike, and seldom by a factor that changes
    at one instant. What a single run shows must not be a gain that differs with the sign of the channel or its size;
    where it is no step either, it is a doubt: a sensor's gain drifts, or the part itself does.

    Parameters
    ----------
    comparisons : measured and simulated, of every run; those over time are tested.
    """
    by_channel: dict[str, list[Comparison]] = {}
    for one in comparisons:
        if one.x_label.startswith("time"):
            by_channel.setdefault(one.channel, []).append(one)
    for channel, runs in by_channel.items():
        alone = len(runs) < policy.fewest_like_runs
        changes = [_likely(one, alone, policy) for one in runs]
        usual = 0.0 if alone else float(np.median([abs(np.log(c.factor)) if c else 0.0 for c, _ in changes]))
        for run, (change, course) in zip((one.run for one in runs), changes, strict=True):
            if change is None or not course or abs(np.log(change.factor)) < policy.unlike_runs * usual:
                continue  # of the model, or the test, and of no sensor
            share = f"{channel} against its simulation: the ratio changes by {100 * (change.factor - 1.0):+.1f} %"
            if course == "abrupt":
                remedy = f"cut the run with from_time or to_time: {change.at:.1f} s, or remove it"
                what = f"{share} at {change.at:.1f} s: the gain of a sensor changed"
                yield Finding(run, what, "", remedy, fault=True, doubt=True)
            else:
                what = f"{share} in the course of the run, about {change.at:.1f} s: the gain of a sensor, or the part"
                yield Finding(run, what, "", "repeat the run; a second one shows whether it is the sensor", doubt=True)


def _likely(one: Comparison, alone: bool, policy: QualityPolicy) -> tuple[GainChange | None, Course]:
    """The most likely change of a run's gain, and its course where it is certain and large."""
    good = np.isfinite(one.measured) & np.isfinite(one.simulated)
    if one.used is not None:
        good &= one.used
    time, y, x = one.x[good], one.measured[good], one.simulated[good]
    found = likely_change(y, x, policy)
    if found is None or found[1] * found[2] <= 0.0:
        return None, ""
    k, g, h, t, share = found
    change = GainChange(one.channel, float(time[k - 1]), h / g, t)
    large = abs(h / g - 1.0) >= policy.least_gain_change and t >= policy.gain_change_t
    if not large or share > policy.simulated_share:
        return change, ""
    drift = stepped_share(y, x, k, drifting(x))
    if not alone:
        return change, "abrupt" if drift <= policy.abrupt_share else ""
    law = np.column_stack([x, x * (x > 0.0), x * np.abs(x)])
    if stepped_share(y, x, k, law) > policy.lone_abrupt_share:
        return change, ""
    return change, "abrupt" if drift <= policy.lone_abrupt_share else "gradual"
