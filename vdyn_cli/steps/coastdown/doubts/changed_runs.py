"""A change between two runs: a trailer, a load, other tires, a dragging brake, from which on all runs differ.

The resistance of the runs is tested at all speeds, and at high speeds alone: a hitched trailer adds about as much mass
as rolling resistance, so that the deceleration at low speeds hardly changes, whereas that at high speeds does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.number_text import number
from vdyn_cli.steps.coastdown.doubts.agreement import widened_to_include
from vdyn_cli.steps.coastdown.doubts.outlying_runs import OutlyingRun, resistance_step
from vdyn_cli.steps.coastdown.fit.residuals import fast_forces, fitted_to, run_forces
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit
from vdyn_cli.steps.step_policy import STEP_POLICY

CHANGED = (  # the remedy
    "check what changed before this run (load, trailer, tire pressure, roof box, windows, wet road); if something did, "
    "describe the runs before and after the change in two files, each with at least 4 runs, 2 in either direction"
)
UNITS = {"rolling_resistance": "", "drag_area": " m^2"}


@dataclass(frozen=True)
class ChangedRuns:
    """The first run after a change of the resistance, and what the runs before and after it give by themselves.

    Parameters
    ----------
    step : index of that run among the runs of the fit, the change in N, and its p value.
    above : m/s, lowest speed of the tested part of the runs; None where it is all of them.
    before, after : estimates with standard deviations of the runs on either side; None where they give none.
    """

    step: OutlyingRun
    above: float | None
    before: Solution | None
    after: Solution | None

    def finding(self, run: str) -> Finding:
        """The change, the estimates on both sides, and what to do. run : name of the first run after the change."""
        way, size = "higher" if self.step.force > 0 else "lower", abs(self.step.force)
        where = "" if self.above is None else f" above {3.6 * self.above:.0f} km/h"
        what = f"from this run on the resistance{where} is {size:.0f} N {way} than before (p = {self.step.p_value:.1g})"
        sides = {"the earlier runs alone": self.before, "the later ones": self.after}
        given = [f"{who} give {_listed(found)}" for who, found in sides.items() if found is not None]
        if given:
            what += (
                f"; {', '.join(given)}, with the stated mass; the fit is to all runs, and its intervals include both"
            )
        return Finding(run, what, remedy=CHANGED, doubt=True)

    def widened(self, solution: Solution) -> Solution:
        """The solution with 95 % intervals that include the estimates from either side of the change."""
        for found in (self.before, self.after):
            if found is not None:
                solution = widened_to_include(solution, {n: found.values[n] for n in UNITS if n in solution.names})
        return solution


def changed_runs(fit: RoadLoadFit) -> ChangedRuns | None:
    """The change with the smallest p value, if one is significant and matters; None on an open road."""
    runs = fit.campaign.runs
    if fit.campaign.drive != "coasting":
        return None
    heading, fast = np.array([r.heading for r in runs]), fast_forces(fit)
    tested: list[tuple[Array, float | None]] = [(run_forces(fit)[0], None), *([] if fast is None else [fast])]
    least = STEP_POLICY.material_run_force * _middle_load(fit)
    steps = [(resistance_step(forces, heading, len(tested)), above) for forces, above in tested]
    found = [(step, above) for step, above in steps if step is not None and abs(step.force) > least]
    if not found:
        return None
    step, above = min(found, key=lambda one: one[0].p_value)
    sides = range(step.run), range(step.run, len(runs))
    before, after = (_solution(fit, side) if set(heading[list(side)]) == set(heading) else None for side in sides)
    return ChangedRuns(step, above, before, after)


def _middle_load(fit: RoadLoadFit) -> float:
    """The fitted road load in the middle of the speeds, N."""
    at, speed = fit.at, float(np.mean(fit.speeds))
    return at["mass"] * GRAVITY * at["rolling_resistance"] + 0.5 * at["air_density"] * at["drag_area"] * speed**2


def _solution(fit: RoadLoadFit, runs: Sequence[int]) -> Solution | None:
    """The unknowns fitted to these runs; None where they do not determine them."""
    try:
        return fitted_to(fit, runs)
    except ResultError:
        return None


def _listed(found: Solution) -> str:
    names = [n for n in UNITS if n in found.names]
    return " and ".join(f"{n} {number(found.values[n], found.std[n])}{UNITS[n]}" for n in names)
