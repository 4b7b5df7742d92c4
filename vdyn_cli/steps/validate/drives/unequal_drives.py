"""Detects drives in which the car accelerates by another share of its drive torque than in the others.

While the car is driven, its acceleration is a T + b + c V^2 + d T', with a = i/(r (M + mr)). A fault that all drives
share changes all a alike; a load, a gear, tires or a torque unit of single drives does not, and a noise model that
is estimated from all drives would take their misfit for hills.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.step_policy import STEP_POLICY
from vdyn_cli.steps.validate.drives.driven_samples import driven_samples
from vdyn_cli.steps.validate.drives.span_averages import SPAN

BLOCKS = 12  # of a drive, of which each is left out once (jackknife)
LEAST_DRIVEN = 60  # s of driven samples: five for each block, as many as the regression has unknowns and one more
FEWEST_OTHERS = 2  # fewest other drives, so that a median is not the value of a single one
MEDIAN = np.pi / 2.0  # variance of a median over that of a mean, of a normal distribution


def unequal_drives(
    names: Sequence[str], drives: Sequence[tuple[Array, Mapping[str, Array], Array]]
) -> Iterator[Finding]:
    """A finding for each drive whose acceleration per drive torque differs from the median of the other drives.

    Parameters
    ----------
    names : of the logs. drives : of one car: time (n,) s; channels speed (m/s, may contain NaN), brake_torque (N m)
        and, if logged, grade; drive torque (n,) N m.
    """
    found = [_acceleration_per_torque(*drive) for drive in drives]
    for k, (name, own) in enumerate(zip(names, found, strict=True)):
        others = np.array([other for j, other in enumerate(found) if j != k and other is not None])
        if own is None or len(others) < FEWEST_OTHERS:
            continue
        usual = float(np.median(others[:, 0]))
        ratio, common = usual / own[0], MEDIAN * np.mean(others[:, 1] ** 2) / len(others)
        share, error = ratio - 1.0, float(np.sqrt((ratio * own[1]) ** 2 + common)) / own[0]
        if abs(share) > max(STEP_POLICY.unequal_t * error, STEP_POLICY.unequal_share):
            what = (
                f"the drive torque per acceleration is {100 * abs(share):.0f} +- {200 * error:.0f} % "
                f"{'larger' if share > 0 else 'smaller'} than in the other drives: another load, gear, tire or unit"
            )
            remedy = "validate this drive in a description of its own, with its mass and gear_ratio"
            yield Finding(name, what, "", remedy, doubt=True)


def _acceleration_per_torque(time: Array, channels: Mapping[str, Array], torque: Array) -> tuple[float, float] | None:
    """The slope a of the acceleration over the drive torque, 1/(kg m), and its standard error; None if not positive."""
    seen = driven_samples(time, channels, torque, SPAN)
    if seen.time.size * SPAN < LEAST_DRIVEN:
        return None
    columns, rate = seen.columns, seen.rate
    slope = float(np.linalg.lstsq(columns, rate, rcond=None)[0][0])
    blocks = np.array_split(np.arange(rate.size), BLOCKS)
    without = [np.linalg.lstsq(np.delete(columns, b, 0), np.delete(rate, b), rcond=None)[0][0] for b in blocks]
    std = float(np.std(without) * np.sqrt(BLOCKS - 1))
    return (slope, std) if slope > 0.0 else None
