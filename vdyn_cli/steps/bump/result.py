"""The result of a bump test: springs, dampers, tires, and the vibration modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import hypot
from typing import Any

from vdyn_cli.inference import Solution, Unknown
from vdyn_cli.physics.models.half_car import GIVEN, LONGITUDINAL, SOUGHT
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.bump import figures, text
from vdyn_cli.steps.bump.crossing import LOADS, Crossing
from vdyn_cli.steps.bump.half_car_fit import BumpFit
from vdyn_cli.steps.bump.half_car_modes import HalfCarMode, half_car_modes
from vdyn_cli.steps.bump.input_checks import uneven_zeros
from vdyn_cli.steps.bump.replay import Replay, replay
from vdyn_cli.steps.effect_estimates import effect_amplitudes
from vdyn_cli.steps.fit_outcome import fit_summary, fitted_parameters
from vdyn_cli.steps.known_sensitivity import slopes_by_known

# Zero in most tests, or zero on average, so that a relative change has no meaning.
NOT_LISTED = ("antenna_offset", "outboard_mass", *LONGITUDINAL)


def bump_result(fit: BumpFit, solution: Solution, findings: Sequence[Finding]) -> Result:
    """The published result of a bump test at a solution of its fit.

    Parameters
    ----------
    fit : with the channel weights of the solution.
    findings : about the description and the logs.
    """
    parameters = fitted_parameters(solution, SOUGHT, "bump")
    replays = [replay(fit, solution, run) for run in range(len(fit.crossings))]
    modes = half_car_modes(solution, fit.known.values)
    sensitivity = _sensitivity_to_known(fit, solution)
    inflated = {n: m * fit.weights.inflation[n] for n, m in fit.misfit(solution).items()}
    warnings = (*text.warnings(parameters, sensitivity, fit.known), *text.misfit_warnings(inflated))
    residuals = [r.residual(n) for r in replays for n in LOADS]
    noise = [_noise(fit, c, n) for c in fit.crossings for n in LOADS]
    zeros = {n: [r.zeros[n] for r in replays] for n in fit.channels}
    restate = partial(text.sentence, modes=modes)
    return Result(
        "bump",
        restate(parameters, {}),
        parameters,
        fit_summary(solution, (c.run for c in fit.crossings), residuals, noise, "N", warnings),
        text.METHODS,
        figures.comparisons(replays),
        figures.figures(replays),
        (
            text.mode_table(modes),
            text.crossing_table(replays, fit, solution),
            text.misfit_table(fit, inflated),
            text.sensitivity_table(sensitivity, fit, solution),
        ),
        tuple(dict.fromkeys([*findings, *uneven_zeros(zeros, fit.known.zeros)])),
        _extra(modes, replays),
        amplitudes=effect_amplitudes(solution, fit.added.unknowns),
        restate=restate,
    )


def _noise(fit: BumpFit, crossing: Crossing, channel: str) -> float:
    """Standard deviation of a channel by its sensor and by the road, in its unit."""
    return hypot(crossing.noise[channel], fit.road.level(crossing, channel) if fit.road else 0.0)


def _sensitivity_to_known(fit: BumpFit, solution: Solution) -> dict[str, dict[str, float]]:
    """Total derivatives d sought / d known at the solution, by known number."""
    names = [n for n in GIVEN if n not in NOT_LISTED]
    held = tuple(Unknown(n, fit.known.values[n]) for n in names if n not in solution.names)
    extended = replace(fit, added=replace(fit.added, unknowns=(*fit.added.unknowns, *held))).regression()
    return slopes_by_known(extended, names, {**fit.known.values, **solution.values}, solution.per_run)


def _extra(modes: Sequence[HalfCarMode], replays: Sequence[Replay]) -> dict[str, Any]:
    found = {
        m.name.replace(" ", "_"): {
            "frequency": m.frequency,
            "frequency95": list(m.frequency95),
            "damping_ratio": m.damping,
            "damping_ratio95": list(m.damping95),
        }
        for m in modes
    }
    runs = [{"run": r.run, "speed": r.pace, "distance_front": r.distance} for r in replays]
    return {"modes": found, "crossings": runs}
