"""A change between two runs: a trailer, a load, other tires, a dragging brake, from which on all runs differ, or two.

A change by ``run_change.changed_in`` is a candidate effect. Where the diagnosis names it, the values after it are
stated; where it does not, and where only a test of the forces shows a change, the intervals include both sides; of two
runs with an undone change, they include the values of the others.

The resistance of the runs is tested at all speeds, and at high speeds alone: a hitched trailer adds about as much mass
as rolling resistance, so that the deceleration at low speeds hardly changes, whereas that at high speeds does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log_names import log_of
from vdyn_cli.quantities.number_text import number
from vdyn_cli.steps.coastdown.doubts.odd_decelerations import CHANGED, CHANGED_PAIR
from vdyn_cli.steps.coastdown.doubts.outlying_runs import OutlyingRun, resistance_step
from vdyn_cli.steps.coastdown.fit.reference_conditions import road_load_of
from vdyn_cli.steps.coastdown.fit.residuals import fast_forces, fitted_to, run_forces
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

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
    undone : name of the last of two runs with a change that the runs after them do not show, ``before`` being the
        estimates of all others; empty where the change lasts.
    """

    run: int
    before: Solution | None
    after: Solution | None
    step: OutlyingRun | None = None
    above: float | None = None
    undone: str = ""

    def finding(self, run: str) -> Finding:
        """The change, the estimates on both sides, and what to do. run : name of the first run after the change."""
        what = f"{_since(self.undone)} the car slows down faster or more slowly than before"
        if self.step is not None:
            way, size = "higher" if self.step.force > 0 else "lower", abs(self.step.force)
            where, p_value = "" if self.above is None else f" above {3.6 * self.above:.0f} km/h", self.step.p_value
            what = f"from this run on the resistance{where} is {size:.0f} N {way} than before (p = {p_value:.1g})"
        sides = {f"the {'other' if self.undone else 'earlier'} runs alone": self.before, "the later ones": self.after}
        given = [f"{who} give {_listed(found)}" for who, found in sides.items() if found is not None]
        if given:
            both = " both" if len(given) > 1 else " them"
            what += (
                f"; {', '.join(given)}, with the stated mass; the fit is to all runs, and its intervals include{both}"
            )
        return Finding(run, what, remedy=CHANGED_PAIR if self.undone else CHANGED, doubt=True)

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
    changed, names = _changed(fit), [run.name for run in fit.campaign.runs]
    if changed and changed[-1] < len(names) - 1:
        others = [k for k in range(len(names)) if k not in changed]
        return ChangedRuns(changed[0], _given_by(fit, others), None, undone=log_of(names[changed[-1]]))
    heading, fast = fit.campaign.headings, fast_forces(fit)
    tested: list[tuple[Array, float | None]] = [(run_forces(fit)[0], None), *([] if fast is None else [fast])]
    least = COASTDOWN_POLICY.material_run_force * float(road_load_of(fit.at).force(float(np.mean(fit.speeds))))
    steps = [(resistance_step(forces, heading, len(tested)), above) for forces, above in tested]
    found = [(step, above) for step, above in steps if step is not None and abs(step.force) > least]
    if changed:
        found = [one for one in found if one[0].run == changed[0]]
    step, above = min(found, key=lambda one: one[0].p_value) if found else (None, None)
    if step is None and not changed:
        return None
    run = changed[0] if step is None else step.run
    return ChangedRuns(run, _given_by(fit, range(run)), _given_by(fit, range(run, heading.size)), step, above)


def findings_after_change(fit: RoadLoadFit) -> tuple[Finding, ...]:
    """A finding at the first changed run, with the values from it on; empty where the fit contains no change."""
    changed, solution, runs = _changed(fit), fit.solution, fit.campaign.runs
    if not changed or AFTER["rolling_resistance"] not in solution.names:
        return ()
    given = []
    for name in (n for n in UNITS if n in solution.names):
        value, change = solution.values[name], solution.values[AFTER[name]]
        std = solution.std_of({name: 1.0 + change, AFTER[name]: value})
        given.append(f"{name} is {number(value * (1.0 + change), std)} (+- {number(NORMAL95 * std, std)}){UNITS[name]}")
    undone = log_of(runs[changed[-1]].name) if changed[-1] < len(runs) - 1 else ""
    which, remedy = ("other", CHANGED_PAIR) if undone else ("earlier", CHANGED)
    what = f"{_since(undone)} {' and '.join(given)}, with the stated mass; the result is that of the {which} runs"
    return (Finding(runs[changed[0]].name, what, remedy=remedy, doubt=True),)


def before_change(fit: RoadLoadFit) -> str:
    """Words for the headline: the run before which the car was changed, where the fit contains that; else empty."""
    changed, runs = _changed(fit), fit.campaign.runs
    if not changed or AFTER["rolling_resistance"] not in fit.solution.names:
        return ""
    if changed[-1] < len(runs) - 1:
        return f" (of the car as in all but {log_of(runs[changed[0]].name)} and {log_of(runs[changed[-1]].name)})"
    return f" (of the car before it was changed for {log_of(runs[changed[0]].name)})"


def _since(undone: str) -> str:
    return f"in this run and {undone}" if undone else "from this run on"


def _changed(fit: RoadLoadFit) -> list[int]:
    """Indices of the runs with a changed car (run_change.changed_in); empty where no change was found."""
    return [k for k, run in enumerate(fit.campaign.runs) if run.changed]


def _given_by(fit: RoadLoadFit, runs: Sequence[int]) -> Solution | None:
    """The estimates of some of the runs, where these have the directions of all."""
    heading = fit.campaign.headings
    return fitted_to(fit, runs) if set(heading[list(runs)]) == set(heading) else None


def _listed(found: Solution) -> str:
    names = [n for n in UNITS if n in found.names]
    return " and ".join(f"{n} {number(found.values[n], found.std[n])}{UNITS[n]}" for n in names)
