"""The result of a load-transfer test: center of gravity and pitch inertia."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.inference import Solution, Unknown
from vdyn_cli.physics.models.load_transfer import SOUGHT
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.cg import figures, text
from vdyn_cli.steps.cg.known_vehicle import COMPLIANCE, KnownVehicle
from vdyn_cli.steps.cg.load_fit import LoadFit
from vdyn_cli.steps.effect_estimates import effect_amplitudes
from vdyn_cli.steps.fit_outcome import fit_summary
from vdyn_cli.steps.known_sensitivity import slopes_by_known

ONLY_IN_EFFECTS = ("brake_share_front", COMPLIANCE)  # known numbers that the balance without effects does not contain


def cg_result(fit: LoadFit, solution: Solution, vehicle: KnownVehicle, findings: Sequence[Finding]) -> Result:
    """The result, whose intervals include the scatter of the runs and the uncertainty of the known numbers."""
    moved = _moved(fit, solution, vehicle)
    estimates = _estimates(solution, moved, vehicle)
    if fit.pitch_inertia is not None:
        del estimates["pitch_inertia"]
    balances = fit.mean_imbalances(solution)
    compared = figures.comparisons(fit, [imbalance for imbalance, _ in balances])
    held = fit.pitch_inertia
    withheld = {} if held is None else {"pitch_inertia": text.withheld(held, vehicle.pitch_inertia_std)}
    published = [n for n in SOUGHT if n not in withheld]
    return Result(
        "cg",
        text.sentence(estimates, {}),
        Parameters(estimates, {a: {b: solution.correlation[a][b] for b in published} for a in published}),
        fit_summary(solution, (c.run for c in compared), [e for e, _ in balances], [std for _, std in balances], "N"),
        text.METHODS,
        compared,
        figures.figures(fit, compared),
        (text.uncertainty_table(solution, moved),),
        tuple(findings),
        amplitudes=effect_amplitudes(solution, fit.added.unknowns, _inherited(fit, solution, moved)),
        withheld=withheld,
        restate=text.sentence,
    )


def _moved(fit: LoadFit, solution: Solution, vehicle: KnownVehicle) -> dict[str, dict[str, float]]:
    """Change of each result and effect when a known number is one standard deviation larger, by known number.

    To first order; masses and lengths multiply each other in the balance, so that the second order is smaller by the
    ratio of a known number's standard deviation to its value.
    """
    std = {n: s for n, s in vehicle.std.items() if fit.added or n not in ONLY_IN_EFFECTS}
    unknowns = (*fit.added.unknowns, *(Unknown(n, vehicle.values[n]) for n in std))
    extended = replace(fit, added=replace(fit.added, unknowns=unknowns))
    if fit.pitch_inertia is not None:  # an unknown with a prior
        std["pitch_inertia"] = vehicle.pitch_inertia_std
    if not std:
        return {}
    regression = extended.regression(extended.unknowns_at(solution))
    slopes = slopes_by_known(regression, [*std], {**vehicle.values, **solution.values}, solution.per_run)
    results = (*SOUGHT, *fit.added.names)
    return {n: {r: row[r] * std[n] for r in results} for n, row in slopes.items()}


def _inherited(fit: LoadFit, solution: Solution, moved: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    """Standard deviation of each unknown of the effects, with the uncertainty of the known numbers."""
    return {
        n: float(np.hypot(solution.std[n], np.linalg.norm([row[n] for row in moved.values()]))) for n in fit.added.names
    }


def _estimates(
    solution: Solution, moved: Mapping[str, Mapping[str, float]], vehicle: KnownVehicle
) -> dict[str, Estimate]:
    """The estimates, with the root sum of squares of scatter and inherited uncertainty.

    Where the loads contradict the mass, the interval of the pitch inertia includes its values for both, and that of
    the position includes an error of one axle's loads.
    """
    estimates = {}
    for name in SOUGHT:
        value, std = solution.values[name], solution.std[name]
        low, high = solution.interval95[name]
        inherited = float(np.sqrt(sum(row[name] ** 2 for row in moved.values())))
        half = float(np.hypot((high - low) / 2, NORMAL95 * inherited))
        by_mass = value * (1 + vehicle.load_excess) if name == "pitch_inertia" else value
        half += vehicle.one_axle_shift if name == "cg_to_rear" else 0.0
        lowest, highest = PARAMETERS[name].lower, PARAMETERS[name].upper
        interval = max(min(value, by_mass) - half, lowest), min(max(value, by_mass) + half, highest)
        std = float(np.sqrt(std**2 + inherited**2 + (by_mass - value) ** 2))
        estimates[name] = Estimate.of(name, value, std, interval, "cg")
    rear = estimates["cg_to_rear"]
    wheelbase, (low, high) = vehicle.values["wheelbase"], rear.interval95
    front = Estimate.of("cg_to_front", wheelbase - rear.value, rear.std, (wheelbase - high, wheelbase - low), "cg")
    return {**estimates, "cg_to_front": front}
