"""The result of a half-shaft test: stiffness and damping of each side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from vdyn_cli.quantities.arrays import rms
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate, Parameters, normal_interval
from vdyn_cli.quantities.result import FitSummary, Result
from vdyn_cli.steps.fit_outcome import fit_summary
from vdyn_cli.steps.shaft import figures, text
from vdyn_cli.steps.shaft.policy import SHAFT_POLICY
from vdyn_cli.steps.shaft.sections import shared_modulus_correlation
from vdyn_cli.steps.shaft.shaft_fit import noise_excess
from vdyn_cli.steps.shaft.shaft_side import LoggedShaft
from vdyn_cli.steps.shaft.stiffness_comparison import ComparedStiffness


def shaft_result(
    sides: Sequence[ComparedStiffness], findings: Sequence[Finding], changed: Sequence[Finding] = ()
) -> Result:
    """The published result of the sides.

    Parameters
    ----------
    sides : one or two, each with the stiffness by every method.
    findings : about the description and the logs. changed : on runs with another stiffness.
    """
    estimates, notes = _estimates(sides)
    by_method = {s.side.name: {name: {"value": b.value, "std": b.std} for name, b in s.methods.items()} for s in sides}
    restate = partial(text.sentence, sides=sides)
    return Result(
        "shaft",
        restate(estimates, {}),
        Parameters(estimates, _correlation(sides, estimates)),
        _summary(sides, "; ".join(f"{f.where}: {f.what}" for f in changed)),
        text.METHODS,
        figures.comparisons(sides),
        figures.figures(sides),
        text.tables(sides),
        tuple(dict.fromkeys([*changed, *findings, *notes])),
        {"stiffness_by": by_method},
        amplitudes=_amplitudes(sides),
        restate=restate,
    )


def _logged(sides: Sequence[ComparedStiffness]) -> list[LoggedShaft]:
    return [side.logged for side in sides if side.logged is not None]


def _amplitudes(sides: Sequence[ComparedStiffness]) -> dict[str, Estimate]:
    """Estimates of the effects' unknowns, the mean of both sides weighted by inverse variance."""
    logged = [shaft.amplitudes for shaft in _logged(sides)]
    found = {}
    for name in logged[0] if logged else ():
        weight = np.array([a[name].std ** -2.0 for a in logged])
        value = float(weight @ np.array([a[name].value for a in logged]) / weight.sum())
        std = float(weight.sum() ** -0.5)
        found[name] = Estimate(value, std, normal_interval(value, std), "", "", "")
    return found


def _estimates(sides: Sequence[ComparedStiffness]) -> tuple[dict[str, Estimate], list[Finding]]:
    """Stiffnesses, the dampings that the logs determine, and findings about these."""
    estimates, notes = {}, []
    for side in sides:
        budgets = {f"shaft_stiffness_{side.side.name}": side.published}
        if side.logged is not None:
            damping, name = side.logged.damping, f"shaft_damping_{side.side.name}"
            if damping.interval95[0] > 0:
                budgets[name] = damping
                if side.side.delay_assumed:
                    notes.append(text.assumed_delay(name, side.side.torque_delay, side.logged.stiffness))
            else:
                notes.append(text.no_damping(name, damping, side.logged.stiffness))
        for name, budget in budgets.items():
            estimates[name] = Estimate.of(name, budget.value, budget.std, budget.interval95, "shaft")
    return estimates, notes


def _correlation(sides: Sequence[ComparedStiffness], published: Mapping[str, Estimate]) -> dict[str, dict[str, float]]:
    """Correlation of drawings through the shear modulus, and of stiffness and a published damping of one log."""
    drawn = {f"shaft_stiffness_{s.side.name}": s.published for s in sides if list(s.methods) == ["drawing"]}
    found: dict[str, dict[str, float]] = dict(shared_modulus_correlation(drawn)) if len(drawn) > 1 else {}
    for side in sides:
        if side.logged is not None and list(side.methods) == ["log"]:
            k, c = f"shaft_stiffness_{side.side.name}", f"shaft_damping_{side.side.name}"
            if c not in published:
                continue
            found |= {k: {k: 1.0, c: side.logged.correlation}, c: {k: side.logged.correlation, c: 1.0}}
    return found


def _summary(sides: Sequence[ComparedStiffness], cause: str) -> FitSummary:
    logged = _logged(sides)
    if not logged:
        return FitSummary(tuple(f"drawing, {s.side.name}" for s in sides), 0.0, 0.0, "N m", ())
    off = [run.torque - torque for s in logged for run, torque in zip(s.runs, s.torque, strict=True)]
    excess = noise_excess((s.solution for s in logged), (run for s in logged for run in s.runs))
    warnings = [w for s in logged[1:] for w in s.solution.warnings]
    if excess > SHAFT_POLICY.shaft_excess and not cause:
        what = f"the residuals are {excess:.1f} times the sensors' noise"
        warnings.append(f"{what}: backlash, a progressive joint, or a clock offset")
    solution, names = logged[0].solution, [run.name for s in logged for run in s.runs]
    summary = fit_summary(solution, names, off, [rms(*off) / excess], "N m", warnings)
    return replace(summary, unknowns=(*solution.names, *solution.per_run), cause=cause)
