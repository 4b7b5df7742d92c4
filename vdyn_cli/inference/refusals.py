"""Reasons to refuse a minimum: unknowns that are not identifiable, no convergence, or an estimate at its bound."""

from __future__ import annotations

import numpy as np

from vdyn_cli.inference.identifiability import COLLINEAR, Unidentifiable, find_unidentifiable, phrase
from vdyn_cli.inference.normal_system import Solved
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.number_text import listed

AT_BOUND = 1e-7  # distance from a bound, of the physical range, that counts as at the bound
NARROW_PRIOR = 0.1  # standard deviation of a prior over the physical range, below which it determines the unknown
INVOLVED = 1e-3  # share of the largest possible response from which a run's own unknown is involved in a null direction


def refusals(solved: Solved, unconverged: bool) -> list[Finding]:
    """The reasons to refuse the minimum as a result; only the first kind found, because it explains the others.

    In this order: runs without information, parameters that are not identifiable, no convergence, estimates at bounds.

    Parameters
    ----------
    solved : the minimum. unconverged : accept a fit that did not converge.
    """
    undetermined = _runs_without_information(solved) or _undetermined(solved)
    return undetermined or ([] if unconverged else _unconverged(solved)) or _at_bounds(solved)


def _runs_without_information(solved: Solved) -> list[Finding]:
    """Runs that do not determine their own unknowns, even if the shared ones are known."""
    regression, m = solved.regression, solved.m
    findings = []
    for run, rows in enumerate(solved.reduced.own if m else ()):
        norms = np.linalg.norm(solved.point.system.runs[run, :, :m], axis=0)
        undetermined = [u.name for u, n in zip(regression.own, norms, strict=True) if n == 0]
        if not undetermined:
            _, values, axes = np.linalg.svd(rows[:, :m] / norms)
            open_axes = np.abs(axes[values < COLLINEAR * values.max()])
            undetermined = [
                u.name for i, u in enumerate(regression.own) if open_axes.size and open_axes[:, i].max() > 0.1
            ]
        if undetermined:
            what = f"the data of this run do not determine {listed(undetermined)}"
            findings.append(
                Finding(regression.runs[run], what, "", f"leave the run out, or state {' or '.join(undetermined)}")
            )
    return findings


def _undetermined(solved: Solved) -> list[Finding]:
    """Shared unknowns that are not identifiable, and the combinations that are."""
    regression, s = solved.regression, solved.s
    if not s:
        return []
    # A narrow prior determines an unknown, however large the scatter of the data.
    given = [u.prior is not None and u.prior[1] < NARROW_PRIOR * (u.upper - u.lower) for u in regression.shared]
    ranges = np.where(given, np.inf, [u.upper - u.lower for u in regression.shared])
    noise = max(float(np.sqrt(solved.variance)), 1.0)
    found = find_unidentifiable(
        solved.reduced.factor[:s, :s] / noise, ranges, solved.point.system.column_norms()[:s] / noise
    )
    if found is None:
        return []
    names = [u.name for u in regression.shared]
    members = [names[i] for i in found.members]
    own = _own_in_null_directions(solved, found)
    rows = found.combinations()
    if rows:
        x = solved.point.x[:s]
        held = [f"{phrase(names, row)} = {float(row @ x):.4g}" for row in rows]
        what = f"the data determine only {listed(held)}, not {listed(members)} separately"
    elif own:
        what = f"a change of {listed(members)} is canceled by a change of {listed(own)} in each run"
    else:
        what = f"the data do not determine {listed(members)}"
    free = " and ".join(names[i] for i in found.free)
    return [
        Finding(
            "fit", what, "", f"state {free}{' or ' + ' or '.join(own) if own else ''}, or add runs that separate them"
        )
    ]


def _own_in_null_directions(solved: Solved, found: Unidentifiable) -> list[str]:
    """The runs' own unknowns that are involved in the null directions."""
    m = solved.m
    if not m:
        return []
    rows: Array = solved.reduced.own[:, :, m:-1]
    response = np.max(np.abs(rows @ found.directions), axis=(0, 2))
    largest = np.max(np.abs(rows) @ np.abs(found.directions), axis=(0, 2))
    involved = response > INVOLVED * np.maximum(largest, 1e-300)
    return [u.name for u, a in zip(solved.regression.own, involved, strict=True) if a]


def _unconverged(solved: Solved) -> list[Finding]:
    if solved.minimum.converged:
        return []
    step, x = solved.minimum.step, solved.point.x
    worst = int(np.argmax(np.abs(step) / np.maximum(np.abs(x), 1e-300)))
    got = f"{solved.regression.label(worst)} = {x[worst]:.4g}, next step {step[worst]:.2g}"
    what = f"the fit did not converge in {solved.minimum.iterations} iterations"
    return [Finding("fit", what, got, "check the logs and the given values, or state the value of an unknown")]


def _at_bounds(solved: Solved) -> list[Finding]:
    regression, x = solved.regression, solved.point.x
    every = regression.shared + regression.own * len(regression.runs)
    findings = []
    for i, u in enumerate(every):
        width = u.upper - u.lower
        near = AT_BOUND * (width if np.isfinite(width) else max(abs(float(x[i])), 1e-12))
        for bound, which in ((u.lower, "lower"), (u.upper, "upper")):
            if abs(x[i] - bound) <= near:
                what = f"{regression.label(i)} lies at its {which} bound"
                remedy = (
                    "a unit, a sign or a given value such as the mass is wrong, or these data do not determine the "
                    "parameter: then state its value"
                )
                findings.append(Finding("fit", what, f"{bound:g} {u.unit}".strip(), remedy))
    return findings
