"""The result of a wheel-inertia test: one inertia from road, pendulum, or both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from vdyn_cli.inference import Unknown
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Comparison, Figure, FitSummary, Result
from vdyn_cli.steps.effect_estimates import effect_amplitudes
from vdyn_cli.steps.fit_outcome import fit_summary
from vdyn_cli.steps.inertia import figures, text
from vdyn_cli.steps.inertia.policy import INERTIA_POLICY
from vdyn_cli.steps.inertia.road_inertia import RoadInertia
from vdyn_cli.steps.inertia.spin_torque import spin_torques
from vdyn_cli.steps.inertia.wheel_inertia import PendulumInertia, published_inertia, refuse_zero, standard_distance


def inertia_result(
    road: RoadInertia | None,
    pendulum: PendulumInertia | None,
    findings: Sequence[Finding],
    unknowns: Sequence[Unknown],
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
    summary, comparisons, drawn = _summary(road, pendulum)
    result = Result(
        "inertia",
        restate(estimates, {}),
        Parameters(estimates),
        summary,
        text.METHODS,
        comparisons,
        drawn,
        text.tables(road, pendulum),
        tuple(dict.fromkeys(findings)),
        _both_methods(road, pendulum),
        amplitudes=effect_amplitudes(road.solution, unknowns) if road else {},
        restate=restate,
    )
    refuse_zero(result, *text.not_determined(answer))
    return result


def _summary(
    road: RoadInertia | None, pendulum: PendulumInertia | None
) -> tuple[FitSummary, tuple[Comparison, ...], tuple[Figure, ...]]:
    """Summary, comparisons and figures: of the road's fit where there is one, and of the recording's."""
    swing = pendulum.swing if pendulum else None
    summaries, compared, drawn = list[FitSummary](), list[Comparison](), list[Figure]()
    if road is not None:
        torques, summary = spin_torques(road.balance, road.solution)
        compared += torques
        inertia = road.solution.values["wheel_inertia"]
        drawn += [figures.balance(inertia, torques), figures.balance_residual(torques)]
        summaries.append(summary)
    if swing is not None:
        c = figures.swing_comparison(swing)
        compared.append(c)
        drawn.append(figures.swing_residual(swing))
        one = fit_summary(swing.solution, (c.run,), [c.measured - c.simulated], [swing.noise], c.unit)
        summaries.append(replace(one, unknowns=(*swing.solution.names, *swing.solution.per_run)))
    if not summaries:
        return FitSummary(("pendulum",), 0.0, 0.0, "s", ()), (), ()
    warnings = [w for s in summaries for w in s.warnings]
    if road and pendulum and abs(standard_distance(road, pendulum)) > INERTIA_POLICY.inertia_disagreement:
        apart = abs(standard_distance(road, pendulum))
        warnings.append(f"road and pendulum disagree by {apart:.0f} standard deviations: one of them is wrong")
    unknowns = tuple(dict.fromkeys(n for s in summaries for n in s.unknowns))
    runs = tuple(c.run for c in compared)
    whole = replace(summaries[0], runs=runs, unknowns=unknowns, warnings=tuple(warnings))
    return whole, tuple(compared), tuple(drawn)


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
