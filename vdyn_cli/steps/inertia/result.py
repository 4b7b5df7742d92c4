"""The result of a wheel-inertia test: one inertia from road, pendulum, or both."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from vdyn_cli.inference import Unknown
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import FitSummary, Result
from vdyn_cli.steps.contract import UnpublishedError
from vdyn_cli.steps.effect_estimates import effect_amplitudes
from vdyn_cli.steps.inertia import figures, text
from vdyn_cli.steps.inertia.road_inertia import RoadInertia
from vdyn_cli.steps.inertia.wheel_inertia import PendulumInertia, published_inertia, standard_distance
from vdyn_cli.steps.step_policy import STEP_POLICY


def inertia_result(
    road: RoadInertia | None,
    pendulum: PendulumInertia | None,
    findings: Sequence[Finding],
    unknowns: Sequence[Unknown] = (),
) -> Result:
    """The result of one or both methods, of which at least one is given.

    Parameters
    ----------
    findings : of description and logs. unknowns : of effects in the road's balance.

    Raises
    ------
    UnpublishedError : the interval of the inertia contains zero.
    """
    answer = published_inertia(road, pendulum)
    estimates = {"wheel_inertia": Estimate.of("wheel_inertia", answer.value, answer.std, answer.interval95, "inertia")}
    restate = partial(text.sentence, origin=text.origin(answer, road, pendulum))
    swing = pendulum.swing if pendulum else None
    result = Result(
        "inertia",
        restate(estimates, {}),
        Parameters(estimates),
        _summary(road, pendulum),
        text.METHODS,
        figures.comparisons(road, swing),
        figures.figures(road, swing),
        text.tables(road, pendulum),
        tuple(dict.fromkeys(findings)),
        _both_methods(road, pendulum),
        amplitudes=effect_amplitudes(road.solution, unknowns) if road else {},
        restate=restate,
    )
    if answer.interval95[0] <= 0:
        got, remedy = text.not_determined(answer)
        finding = Finding("wheel_inertia", "is not determined: its interval contains zero", got, remedy)
        raise UnpublishedError((finding,), result)
    return result


def _summary(road: RoadInertia | None, pendulum: PendulumInertia | None) -> FitSummary:
    """Summary of the road's fit where there is one, else of the recording's, else of a stated period."""
    swing = pendulum.swing if pendulum else None
    solutions = [fit.solution for fit in (road, swing) if fit is not None]
    warnings = [w for s in solutions for w in s.warnings]
    if road and pendulum and abs(standard_distance(road, pendulum)) > STEP_POLICY.inertia_disagreement:
        apart = abs(standard_distance(road, pendulum))
        warnings.append(f"road and pendulum disagree by {apart:.0f} standard deviations: one of them is wrong")
    if road is not None:
        off = np.concatenate([measured - simulated for measured, simulated in road.torque])
        inertia = road.solution.values["wheel_inertia"]
        floor = np.concatenate([np.sqrt(r.noise.variance(inertia, road.moment)) / r.duration for r in road.runs])
        numbers, unit = (_rms(off), _rms(floor)), "N m"
    elif swing is not None:
        off = swing.recording.values - swing.simulated
        numbers, unit = (_rms(off), swing.noise), figures.SWING_UNITS[swing.recording.channel]
    else:
        return FitSummary(("pendulum",), 0.0, 0.0, "s", ())
    runs = (*(run.log.name for run in (road.runs if road else ())), *((swing.recording.name,) if swing else ()))
    unknowns = tuple(dict.fromkeys(n for s in solutions for n in (*s.names, *s.per_run)))
    first = solutions[0]
    return FitSummary(runs, *numbers, unit, unknowns, first.unit, first.n_units, warnings=tuple(warnings))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _both_methods(road: RoadInertia | None, pendulum: PendulumInertia | None) -> dict[str, Any]:
    """The inertia by each method in numbers, for the JSON."""
    extra: dict[str, Any] = {}
    budgets = {"road": road.budget if road else None, "pendulum": pendulum.budget if pendulum else None}
    for name, budget in budgets.items():
        if budget is not None:
            parts = {c.name: {"slope": c.slope, "std": c.std} for c in budget.contributions}
            interval = list(budget.interval95)
            extra[name] = {"wheel_inertia": budget.value, "std": budget.std, "interval95": interval, "inputs": parts}
    if pendulum is not None:
        extra["pendulum"]["period"] = pendulum.period.value.value
    if road is not None and pendulum is not None:
        extra["road_less_pendulum_in_std"] = standard_distance(road, pendulum)
    return extra
