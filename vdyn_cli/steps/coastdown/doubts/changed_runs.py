"""A change between two runs: a trailer, a load, other tires, a dragging brake, from which on all runs differ.

A change by ``run_change.changed_from`` is a candidate effect. Where the diagnosis names it, the values after it are
stated; where it does not, and where only a test of the forces shows a change, the intervals include both sides.

The resistance of the runs is tested at all speeds, and at high speeds alone: a hitched trailer adds about as much mass
as rolling resistance, so that the deceleration at low speeds hardly changes, whereas that at high speeds does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log_names import log_of
from vdyn_cli.quantities.number_text import number
from vdyn_cli.steps.coastdown.doubts.odd_decelerations import CHANGED
from vdyn_cli.steps.coastdown.doubts.outlying_runs import OutlyingRun, resistance_step
from vdyn_cli.steps.coastdown.fit.reference_conditions import road_load_of
from vdyn_cli.steps.coastdown.fit.residuals import fast_forces, fitted_to, run_forces
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit
from vdyn_cli.steps.step_policy import STEP_POLICY

UNITS = {"rolling_resistance": "", "drag_area": " m^2"}
AFTER = {"rolling_resistance": "changed_rolling", "drag_area": "changed_drag"}  # their relative change by the effect


@dataclass(frozen=True)
class ChangedRuns:
    """The first run after a change of the resistance, and what the runs before and after it give by themselves.

    Parameters
    ----------
    run : index of that run among the runs of the fit.
    before, after : estimates with standard deviations of the runs on either side; None where they give none.
    step : the change in N and its p value, where the forces show it.
    above : m/s, lowest speed of the tested part of the runs; None where it is all of them.
    """

    run: int
    before: Solution | None
    after: Solution | None
    step: OutlyingRun | None = None
    above: float | None = None

    def finding(self, run: str) -> Finding:
        """The change, the estimates on both sides, and what to do. run : name of the first run after the change."""
        what = "from this run on the car slows down faster or more slowly than before"
        if self.step is not None:
            way, size = "higher" if self.step.force > 0 else "lower", abs(self.step.force)
            where, p_value = "" if self.above is None else f" above {3.6 * self.above:.0f} km/h", self.step.p_value
            what = f"from this run on the resistance{where} is {size:.0f} N {way} than before (p = {p_value:.1g})"
        sides = {"the earlier runs alone": self.before, "the later ones": self.after}
        given = [f"{who} give {_listed(found)}" for who, found in sides.items() if found is not None]
        if given:
            what += (
                f"; {', '.join(given)}, with the stated mass; the fit is to all runs, and its intervals include both"
            )
        return Finding(run, what, remedy=CHANGED, doubt=True)

    def shifts(self, fit: RoadLoadFit) -> list[dict[str, float]]:
        """Shifts from the fit to the estimates from either side of the change."""
        values = fit.solution.values
        return [
            {n: side.values[n] - values[n] for n in UNITS if n in values}
            for side in (self.before, self.after)
            if side is not None
        ]


def changed_runs(fit: RoadLoadFit) -> ChangedRuns | None:
    """The change that the runs show and the fit does not contain; None on an open road.

    Else the one with the smallest p value of the forces, if that is significant and matters.
    """
    if not fit.campaign.coasting or AFTER["rolling_resistance"] in fit.solution.names:
        return None
    heading, fast = fit.campaign.headings, fast_forces(fit)
    tested: list[tuple[Array, float | None]] = [(run_forces(fit)[0], None), *([] if fast is None else [fast])]
    least = STEP_POLICY.material_run_force * float(road_load_of(fit.at).force(float(np.mean(fit.speeds))))
    steps = [(resistance_step(forces, heading, len(tested)), above) for forces, above in tested]
    found = [(step, above) for step, above in steps if step is not None and abs(step.force) > least]
    if (first := _first_changed(fit)) is not None:
        found = [one for one in found if one[0].run == first]
    step, above = min(found, key=lambda one: one[0].p_value) if found else (None, None)
    run = first if step is None else step.run
    return None if run is None else ChangedRuns(run, *_sides(fit, run), step, above)


def values_after(fit: RoadLoadFit) -> tuple[Finding, ...]:
    """The values after a change that the fit contains, at the first run after it."""
    first, solution = _first_changed(fit), fit.solution
    if first is None or AFTER["rolling_resistance"] not in solution.names:
        return ()
    given = []
    for name in (n for n in UNITS if n in solution.names):
        value, change = solution.values[name], solution.values[AFTER[name]]
        std = solution.std_of({name: 1.0 + change, AFTER[name]: value})
        given.append(f"{name} is {number(value * (1.0 + change), std)} (+- {number(NORMAL95 * std, std)}){UNITS[name]}")
    what = f"from this run on {' and '.join(given)}, with the stated mass; the result is that of the earlier runs"
    return (Finding(fit.campaign.runs[first].name, what, remedy=CHANGED, doubt=True),)


def before_change(fit: RoadLoadFit) -> str:
    """Words for the headline: the run before which the car was changed, where the fit contains that; else empty."""
    first = _first_changed(fit)
    if first is None or AFTER["rolling_resistance"] not in fit.solution.names:
        return ""
    return f" (of the car before it was changed for {log_of(fit.campaign.runs[first].name)})"


def _first_changed(fit: RoadLoadFit) -> int | None:
    """Index of the first run after a change of the car (run_change.changed_from); None where none was found."""
    return next((k for k, run in enumerate(fit.campaign.runs) if run.changed), None)


def _sides(fit: RoadLoadFit, first: int) -> tuple[Solution | None, Solution | None]:
    """The estimates of the runs before and after a change, where these have the directions of all."""
    heading = fit.campaign.headings
    sides = range(first), range(first, heading.size)
    before, after = (fitted_to(fit, side) if set(heading[list(side)]) == set(heading) else None for side in sides)
    return before, after


def _listed(found: Solution) -> str:
    names = [n for n in UNITS if n in found.names]
    return " and ".join(f"{n} {number(found.values[n], found.std[n])}{UNITS[n]}" for n in names)
