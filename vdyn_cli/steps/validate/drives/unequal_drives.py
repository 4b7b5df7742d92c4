"""Detects drives in which the car accelerates by another share of its drive torque than in the others.

While the car is driven, its acceleration is a T + b + c V^2 + d T', with a = i/(r (M + mr)). A fault that all drives
share changes all a alike; a load, a gear, tires or a torque unit of single drives does not, and a noise model that
is estimated from all drives would take their misfit for hills.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.inference.change_points import LevelChange, level_change
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.validate.drives.driven_samples import Driven, driven_samples
from vdyn_cli.steps.validate.drives.span_averages import SPAN
from vdyn_cli.steps.validate.policy import VALIDATE_POLICY

BLOCKS = 12  # of a drive, of which each is left out once (jackknife)
LEAST_DRIVEN = 60  # s of driven samples: five for each block, as many as the regression has unknowns and one more
LEAST_COMPARED = 20  # s, where the scatter between drives gives the standard error: five for each coefficient
FEWEST_OTHERS = 2  # fewest drives that show the usual value; one is enough if it agrees with the stated value
MEDIAN = np.pi / 2.0  # variance of a median over that of a mean, of a normal distribution


def unequal_drives(names: Sequence[str], drives: Sequence[Driven], stated: float | None = None) -> dict[int, Finding]:
    """By index, a finding for each drive whose acceleration per drive torque differs from that of the usual drives.

    Parameters
    ----------
    names : of the logs. drives : of one car. stated : acceleration per drive torque of the car, 1/(kg m).
    """
    known = {k: a for k, drive in enumerate(drives) if (a := _acceleration_per_torque(*drive)) is not None}
    usual, found = _usual(known, stated), dict[int, Finding]()
    for k, own in known.items():
        others = np.array([known[j] for j in usual if j != k])
        if not len(others):
            continue
        ratio, common = float(np.median(others[:, 0])) / own[0], MEDIAN * np.mean(others[:, 1] ** 2) / len(others)
        share, error = ratio - 1.0, float(np.sqrt((ratio * own[1]) ** 2 + common)) / own[0]
        if abs(share) > max(VALIDATE_POLICY.unequal_t * error, VALIDATE_POLICY.unequal_share):
            what = (
                f"the drive torque per acceleration is {100 * abs(share):.0f} +- {200 * error:.0f} % "
                f"{'larger' if share > 0 else 'smaller'} than in the other drives: another load, gear, tire or unit"
            )
            remedy = "validate this drive in a description of its own, with its mass and gear_ratio"
            found[k] = Finding(names[k], what, "", remedy, doubt=True)
    return found


def load_change(drives: Sequence[Driven]) -> LevelChange | None:
    """The change of the torque per acceleration by another load from one of these drives on, in their order.

    None also where a drift, as of the torque's gain, explains more.
    """
    found = [_acceleration_per_torque(*drive, LEAST_COMPARED) for drive in drives]
    change = level_change([1.0 / one[0] if one else np.nan for one in found], FEWEST_OTHERS)
    shown = change and change.chance < VALIDATE_POLICY.load_change_chance and change.over_line < 1.0
    return change if shown else None


def _usual(known: Mapping[int, tuple[float, float]], stated: float | None) -> list[int]:
    """The drives that agree on an acceleration per torque: on the stated one if several do, else most of them.

    Of two drives, the one that agrees with the stated value if the other does not; else none.
    """

    def alike(a: float) -> list[int]:
        return [k for k, one in known.items() if abs(one[0] / a - 1.0) <= VALIDATE_POLICY.unequal_share]

    as_stated = alike(stated) if stated else []
    if len(known) <= FEWEST_OTHERS:
        return as_stated if len(as_stated) == 1 else []
    return as_stated if len(as_stated) >= FEWEST_OTHERS else max((alike(a) for a, _ in known.values()), key=len)


def _acceleration_per_torque(
    time: Array, channels: Mapping[str, Array], torque: Array, least: float = LEAST_DRIVEN
) -> tuple[float, float] | None:
    """The slope a of the acceleration over the drive torque, 1/(kg m), and its standard error; None if not positive."""
    seen = driven_samples(time, channels, torque, SPAN)
    if seen.time.size * SPAN < least:
        return None
    columns, rate = seen.columns, seen.rate
    slope = float(np.linalg.lstsq(columns, rate, rcond=None)[0][0])
    blocks = np.array_split(np.arange(rate.size), BLOCKS)
    without = [np.linalg.lstsq(np.delete(columns, b, 0), np.delete(rate, b), rcond=None)[0][0] for b in blocks]
    std = float(np.std(without) * np.sqrt(BLOCKS - 1))
    return (slope, std) if slope > 0.0 else None
