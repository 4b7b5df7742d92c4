"""The result of a drop test: springs, dampers, tires, natural frequencies of each axle, and the simulated drops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.physics.models.dropped_car import sought
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.result import Comparison, Figure, Result, Series, Table
from vdyn_cli.steps.bump.drop_fit import DropFit
from vdyn_cli.steps.effect_estimates import effect_amplitudes
from vdyn_cli.steps.fit_outcome import fit_summary, fitted_parameters
from vdyn_cli.steps.interval_text import with_interval

METHODS = (
    "Output error: the car is simulated from the release on and compared with the heights of body and wheels of all "
    "drops at once, each weighted by its white noise (third differences). Heights and rates at the start and the "
    "sensors' zeros are unknowns of each drop; the weight is the load at rest, and a wheel that leaves the ground "
    "carries no load. Masses are known, because heights alone determine only stiffness and damping over mass. "
    "Intervals follow from the scatter of blocks of equal information (Bell and McCaffrey 2002)."
)


def drop_result(fit: DropFit, wheels: int, findings: Sequence[Finding], solution: Solution) -> Result:
    """The published result of a drop test at a solution of its fit.

    Parameters
    ----------
    wheels : number of an axle's wheels on the rig; with one, an axle's parameters are twice the rig's.
    findings : about the description and the logs.
    """
    on_rig = fitted_parameters(solution, sought(fit.axles), "bump")
    estimates = {n: _times(e, 2 // wheels) for n, e in on_rig.items()}
    comparisons = []
    for k, run in enumerate(fit.runs):
        outputs = fit.simulate(k, solution.local((*fit.shared, *fit.own), k)).outputs
        for name in fit.channels:
            simulated = outputs[name] + solution.per_run[f"{name}_zero"][k]
            measured = run.heights[name]
            time = run.time - run.time[0]
            comparisons.append(Comparison(run.run, name, "m", time, "time since the release in s", measured, simulated))
    residuals = [c.measured - c.simulated for c in comparisons]
    noise = [run.noise[n] for run in fit.runs for n in fit.channels]
    return Result(
        "bump",
        _sentence(on_rig, wheels),
        replace(on_rig, estimates=estimates),
        fit_summary(solution, (run.run for run in fit.runs), residuals, noise, "m"),
        METHODS,
        tuple(comparisons),
        (_residual(comparisons),),
        (_modes(fit, on_rig),),
        tuple(dict.fromkeys((*findings, *_per_wheel(wheels)))),
        amplitudes=effect_amplitudes(solution, fit.added.unknowns),
    )


def _times(one: Estimate, factor: int) -> Estimate:
    if factor == 1:
        return one
    low, high = one.interval95
    value = factor * one.value
    return replace(one, value=value, std=factor * one.std, interval95=(factor * low, factor * high), baseline=value)


def _sentence(estimates: Mapping[str, Estimate], wheels: int) -> str:
    texts = [f"{name.replace('_', ' ')} {with_interval(e, e.unit)}" for name, e in estimates.items()]
    of = "One wheel" if wheels == 1 else "The axle" if len(texts) == 3 else "The half car"
    return f"{of} on the rig: {'; '.join(texts)}."


def _per_wheel(wheels: int) -> list[Finding]:
    if wheels == 2:
        return []
    what = "one wheel is on the rig: the parameters, which are those of an axle, are twice the rig's"
    return [Finding("bump", what, minor=True)]


def _residual(comparisons: Sequence[Comparison]) -> Figure:
    series = tuple(Series(f"{c.run}, {c.channel}", c.x, c.measured - c.simulated, role="residual") for c in comparisons)
    caption = (
        "Measured minus simulated height. Good: noise around zero. Bad: an oscillation that ends earlier than the "
        "simulated one (dry friction), a wave of the body's frequency that grows and falls (a nonlinear spring or "
        "damper), bursts after the release (the release was not sudden)."
    )
    return Figure("drop_residual", "Residual of the heights", caption, "time since the release in s", "m", series)


def _modes(fit: DropFit, on_rig: Mapping[str, Estimate]) -> Table:
    """Table of natural frequency and damping ratio of body and wheel hop, each axle alone."""
    rows = []
    tire = on_rig["tire_vertical_stiffness"].value
    for end in fit.axles:
        k, c = (on_rig[f"suspension_{kind}_{end}"].value for kind in ("stiffness", "damping"))
        mass, wheel = fit.sprung[end], fit.known[f"unsprung_mass_{end}"]
        body = np.sqrt(k * tire / (k + tire) / mass)
        hop = np.sqrt((k + tire) / wheel)
        rows.append((f"body over the {end} axle", f"{body / (2 * np.pi):.2f}", f"{c / (2 * np.sqrt(k * mass)):.3f}"))
        rows.append((f"{end} wheel hop", f"{hop / (2 * np.pi):.2f}", f"{c / (2 * hop * wheel):.3f}"))
    caption = "Each axle alone: spring and tire in series under the body, in parallel at the wheel."
    return Table("modes", "Natural frequencies", ("mode", "frequency [Hz]", "damping ratio"), tuple(rows), caption)
