"""How far the answer would move if a given number were wrong: masses, inertia, lengths, and the bump's size."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference import Solution
from vdyn_cli.physics.models.half_car import GIVEN, SOUGHT
from vdyn_cli.quantities.result import Table
from vdyn_cli.steps.bump.regression import BumpFit

Array = NDArray[np.float64]

WORDS = {
    "mass": "mass",
    "sprung_pitch_inertia": "pitch inertia of the body",
    "cg_to_front": "centre of gravity to front axle",
    "wheelbase": "wheelbase",
    "unsprung_mass_front": "unsprung mass, front",
    "unsprung_mass_rear": "unsprung mass, rear",
    "bump_height": "height of the bump",
    "bump_width": "width of the bump",
}


def slopes(fit: BumpFit, solution: Solution) -> dict[str, dict[str, float]]:
    """d sought / d given at the solution, every other unknown following.

    With J the whitened derivatives to all unknowns, P the priors' weights and d those to a given number,
    slope = -(J'J + P)^-1 J'd; where the number is itself an unknown under a prior, (J'J + P)^-1 P.
    """
    s, m, g = len(fit.shared), len(fit.own), len(fit.crossings)
    names = [n for n in GIVEN if n in WORDS]
    outside = [n for n in names if n not in solution.names]
    columns = np.array([names.index(n) for n in outside], dtype=np.intp)
    simulator = fit.simulator_of((*outside, *fit.simulator.unknowns))
    normal, pull = np.zeros((s + g * m, s + g * m)), np.zeros((s + g * m, len(names)))
    for run, crossing in enumerate(fit.crossings):
        theta = fit.local(solution, run)
        jacobian = fit.rows(run, theta).jacobian
        inner = theta[: fit.scales[run].size] * fit.scales[run]
        seen = simulator(fit.drives[run], np.concatenate([[fit.known.values[n] for n in outside], inner]))
        by_given = np.concatenate(
            [
                seen.sensitivities[n][np.isfinite(crossing.channels[n]), : len(outside)] / fit.deviation(run, n)
                for n in fit.channels
            ]
        )
        at = np.concatenate([np.arange(s), s + run * m + np.arange(m)])
        normal[np.ix_(at, at)] += jacobian.T @ jacobian
        pull[at[:, None], columns] -= jacobian.T @ by_given
    weights = np.array([0.0 if u.prior is None else u.prior[1] ** -2.0 for u in (*fit.shared, *fit.own * g)])
    normal += np.diag(weights)
    for name in names:
        if name in solution.names:
            at_shared = solution.names.index(name)
            pull[at_shared, names.index(name)] = weights[at_shared]
    scale = 1.0 / np.sqrt(np.diag(normal))
    moved = scale[:, None] * np.linalg.solve(normal * np.outer(scale, scale), scale[:, None] * pull)
    return {n: {sought: float(moved[i, k]) for i, sought in enumerate(SOUGHT)} for k, n in enumerate(names)}


def budget_table(by_given: Mapping[str, Mapping[str, float]], fit: BumpFit, solution: Solution) -> Table:
    """Per cent of each result for 1 % of each given number, and for its stated standard deviation."""
    rows = []
    for name, row in by_given.items():
        std = fit.known.std.get(name, 0.0)
        value = fit.known.values[name]
        cells = [WORDS[name], f"+- {std / value:.2%}" if std else "exact"]
        for sought in SOUGHT:
            per_cent = row[sought] * value / solution.values[sought]
            adds = 100 * abs(row[sought]) * std / solution.values[sought]
            cells.append(f"{per_cent:+.2f} %" + (f" (+- {adds:.2g} %)" if std else ""))
        rows.append(tuple(cells))
    scatter = (f"+- {solution.std[n] / solution.values[n]:.2%}" for n in SOUGHT)
    rows.append(("standard deviation of the result", "", *scatter))
    columns = ("given number", "known to", *(n.replace("_", " ") for n in SOUGHT))
    caption = (
        "How much each result moves when a given number is 1 % larger; in brackets what its stated standard deviation "
        "adds. A number with a standard deviation is held only that firmly: the logs may know it better. State one "
        "('82 +- 2 kg') wherever a number is not exact: it is carried into the intervals."
    )
    return Table("budget", "What the given numbers do", columns, tuple(rows), caption)
