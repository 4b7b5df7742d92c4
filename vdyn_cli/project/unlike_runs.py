"""Runs that differ from their siblings in unit or sign, though one channel map holds for all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.sign_conventions import REMEDY

SPEEDS = ("speed", "vehicle_speed")
# What a run's speed is times too large where its file is in another unit than those of its siblings.
FACTORS = {1 / 3.6: "m/s among km/h", 3.6: "km/h among m/s", 1 / 1.609344: "mph among km/h", 1.609344: "km/h among mph"}
FACTORS |= {1 / 2.236936: "m/s among mph", 2.236936: "mph among m/s"}
ALIKE = 1.15  # largest over smallest speed of the siblings: then they are driven alike, and a factor shows
NEAR = 0.04  # relative distance from a factor: factors are 1.6 and more from each other
FEWEST = 3  # siblings


def other_units(logs: Sequence[Log]) -> Iterator[Finding]:
    """A finding for each run whose speeds are those of its siblings times the factor between two units."""
    for channel in SPEEDS:
        high = {k: float(np.nanquantile(np.abs(log[channel]), 0.98)) for k, log in enumerate(logs) if channel in log}
        for k, value in high.items():
            others = [v for j, v in high.items() if j != k]
            if len(others) < FEWEST or not min(others) > 0.0 or max(others) > ALIKE * min(others):
                continue
            ratio = value / float(np.median(others))
            near = next((w for f, w in FACTORS.items() if abs(ratio / f - 1.0) <= NEAR), None)
            if near is not None:
                what = f"the speed is {ratio:.3g} times that of the other runs, as of a file in {near}"
                remedy = "export this run in the unit of the others, or describe it in a file of its own"
                yield Finding(f"{logs[k].name}, channel '{channel}'", what, "", remedy)


def with_run_signs(findings: Sequence[Finding], logs: Sequence[Log]) -> tuple[Finding, ...]:
    """The findings, where a sign is wrong in some runs only with the remedy that turns it there alone."""
    wrong = [f for f in findings if f.remedy == REMEDY]
    names = {f.where.partition(", ")[0] for f in wrong}
    if not names or len(names) >= len(logs):
        return tuple(findings)
    return tuple(replace(f, remedy=_turned(f)) if f.remedy == REMEDY else f for f in findings)


def _turned(finding: Finding) -> str:
    channel = finding.where.partition(", ")[2].removeprefix("channel ").strip("' ")
    return f"add 'signs: {{{channel}: -1}}' to this run: the other runs have the usual sign"
