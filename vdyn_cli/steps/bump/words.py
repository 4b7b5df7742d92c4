"""Bump crossings in words: the closing sentence, what is doubtful, how it was done."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.steps.bump.given import Known
from vdyn_cli.steps.bump.modes import Mode
from vdyn_cli.steps.bump.regression import MISFIT, BumpFit
from vdyn_cli.steps.bump.views import Replay

VAGUE = 0.1  # of a value: an interval wider than that is worth a word
FOLLOWS = 0.5  # per cent of tire stiffness per per cent of unsprung mass: without wheel hop it is 1
HOP = (
    "the bump is too gentle to make the wheels hop, and without that a heavier axle on a stiffer tire moves alike; "
    "cross it faster, or take a shorter or higher one"
)
SCALE = "with the bump's height uncertain too, the ratio of stiffness to mass is what hopping wheels tell; measure it"


def sentence(estimates: Mapping[str, Estimate], swings: Sequence[Mode]) -> str:
    """What an engineer would say."""

    def told(name: str, unit: str) -> str:
        e = estimates[name]
        half = (e.interval95[1] - e.interval95[0]) / 2e3
        digits = int(np.clip(1 - np.floor(np.log10(max(half, 1e-9))), 0, 4))
        return f"{1e-3 * e.value:.{digits}f} +- {half:.{digits}f} {unit}"

    axles = [
        f"{end} springs {told(f'suspension_stiffness_{end}', 'kN/m')}, dampers "
        f"{told(f'suspension_damping_{end}', 'kN s/m')}"
        for end in ("front", "rear")
    ]
    first = axles[0][0].upper() + axles[0][1:]
    tires = told("tire_vertical_stiffness", "kN/m")
    rest = ", ".join(f"{m.name} {m.frequency:.2f} Hz" for m in swings)
    return f"{first}; {axles[1]}; tires of an axle {tires} (95 %). The car swings at: {rest}."


def vague(estimates: Mapping[str, Estimate], by_given: Mapping[str, Mapping[str, float]], known: Known) -> list[str]:
    """Words for what is hardly determined, and for a tire that stands and falls with the unsprung masses."""
    said = []
    for name, estimate in estimates.items():
        half = (estimate.interval95[1] - estimate.interval95[0]) / 2
        if half > VAGUE * abs(estimate.value):
            what = HOP if name == "tire_vertical_stiffness" else "cross the bump faster, or take a higher one"
            said.append(f"{name} is hardly determined (+- {half / abs(estimate.value):.0%}): {what}")
    name = "tire_vertical_stiffness"
    masses = [f"unsprung_mass_{end}" for end in ("front", "rear")]
    follows = sum(by_given[m][name] * known.values[m] for m in masses if m not in known.std) / estimates[name].value
    if follows > FOLLOWS:
        why = SCALE if "bump_height" in known.std else HOP
        said.append(
            f"{name} rests on the unsprung masses, which are given as exact: 1 % of them is {follows:.1f} % of it; "
            f"{why}, or state how well they are known ('82 +- 4 kg')"
        )
    return said


def not_followed(fit: BumpFit, misfit: Mapping[str, float]) -> list[str]:
    """Words for channels that the simulation does not follow down to their noise."""
    inflated = {n: fit.inflation[n] * misfit[n] for n in fit.channels}
    return [
        f"{name}: the simulation leaves {ratio:.1f} times the sensor's noise; the channel is weighted by that"
        for name, ratio in inflated.items()
        if ratio > MISFIT
    ]


def extra(swings: Sequence[Mode], replays: Sequence[Replay]) -> dict[str, Any]:
    """Modes and crossings in numbers, for scripts."""
    found = {
        m.name.replace(" ", "_"): {
            "frequency": m.frequency,
            "frequency95": list(m.frequency95),
            "damping_ratio": m.damping,
            "damping_ratio95": list(m.damping95),
        }
        for m in swings
    }
    runs = [{"run": r.run, "speed": r.pace, "distance_front": r.distance} for r in replays]
    return {"modes": found, "crossings": runs}


EXCITE = Finding(
    "bump",
    "these crossings do not tell springs, dampers and tires apart",
    "",
    "cross faster or over a higher bump: unless the wheels hop, a heavier axle on a stiffer tire moves alike; and "
    "check the bump's height, width and shape",
)

METHODS = (
    "Output error: the half car with tires that lift off is integrated (Runge-Kutta, steps of 1 ms) with exact "
    "sensitivities and compared with axle loads, vertical acceleration and pitch rate of all runs at once, each "
    "channel weighted by the white noise of its third differences, or by what the simulation leaves of it where that "
    "is larger. The bump is first looked for in each log with the answer of a usual car (matched filter); then its "
    "place, scale and slope of the speed (a polynomial through the speed channel, within its error), the body's "
    "motion before the bump and each sensor's zero are each run's own unknowns under priors. Given numbers with a "
    "standard deviation are unknowns under that prior, so their uncertainty is in the intervals. Intervals from the "
    "spread over blocks of equal information within the runs."
)
