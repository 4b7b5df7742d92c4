"""The law of a part learned from the data: a short formula if one is sufficient, else a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, cast

import numpy as np
from scipy.special import chdtri

from vdyn_cli.diagnosis.part.part_curve import Curve, share_of_curve
from vdyn_cli.diagnosis.part.part_finding import PartFinding
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.effects import Effect
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.law_definition import CurveDefinition, Form, LawDefinition
from vdyn_cli.steps.free_part import Part
from vdyn_cli.steps.learned_effect import LAW_FORMS, learned_effect

RIDGE = 1e-9  # share of the mean variance of a curve's points, added so that their covariance can be inverted
ROOM = 3.0  # bounds of a formula's shape parameter in the fit: its value times and divided by this
AMPLITUDE_BOUND = 20.0  # bounds of an amplitude in the fit: +- this times its value or its plausible size


@dataclass(frozen=True)
class FittedForm:
    """A formula fitted to the curves of all places of the part.

    Parameters
    ----------
    values : (coefficients,) of each curve. distance : chi-square distance from the curves.
    share : share of the curves' rms deviation from the baseline's law that it explains, per length or in standard
        errors, whichever is larger: the ends of a curve that few readings determine would else decide alone.
    own : least share of its course, in standard errors, that the part's own law cannot follow.
    """

    form: str
    values: tuple[tuple[float, ...], ...]
    distance: float
    share: float
    own: float

    @property
    def sufficient(self) -> bool:
        """Whether the data cannot discriminate it from the free curve, or the remaining deviation is negligible."""
        return self.share >= POLICY.formula_share

    @property
    def size(self) -> int:
        """Number of coefficients of one curve."""
        return len(LAW_FORMS[self.form].coefficients)


@dataclass(frozen=True)
class Learned:
    """A learned law ready to be fitted.

    Parameters
    ----------
    indistinguishable : other forms that fit equally well.
    free : for a formula, the same law as a table; None for a table.
    """

    name: str
    form: str
    definition: LawDefinition
    effect: Effect
    indistinguishable: tuple[str, ...]
    free: Effect | None = None


def fitted_forms(finding: PartFinding) -> tuple[FittedForm, ...]:
    """Every form fitted to the part's curves, first the sufficient ones, by number of coefficients.

    Of these with equally many, odd ones are first for a part that is alike in both directions, then the one that the
    part's own law can follow least: with a wide saturation, which is nearly a line, the data would not determine a
    stiffness.
    """

    def order(one: FittedForm) -> tuple[bool, float, bool, float]:
        if not one.sufficient:
            return True, one.distance, False, 0.0
        return False, one.size, finding.parts[0].odd and not LAW_FORMS[one.form].odd, -one.own

    found, whole = [], sum(_deviation(curve, finding) for curve in finding.curves)
    enough = float(chdtri(max(finding.fitted.freedom, 1.0), 1.0 - POLICY.formula_level))
    for form in LAW_FORMS:
        fits = [fit for curve in finding.curves if (fit := _fit(curve, form, finding)) is not None]
        if len(fits) < len(finding.curves):
            continue
        values, distance, laws, own = zip(*fits, strict=True)
        share = share_of_curve(list(zip(finding.curves, laws, strict=True)), finding.fitted.solution.values)
        share = max(share, 1.0 - float(np.sqrt(sum(distance) / whole))) if whole > 0.0 else share
        share = max(share, POLICY.formula_share) if sum(distance) <= enough else share
        found.append(FittedForm(form, values, sum(distance), share, min(own)))
    return tuple(sorted(found, key=order))


def _fit(curve: Curve, form: str, finding: PartFinding) -> tuple[tuple[float, ...], float, Array, float] | None:
    """Coefficients, chi-square distance, the law's values (n,) at the curve's points, ``own``; None without a fit."""
    from scipy.optimize import minimize

    law, definition = LAW_FORMS[form], _definition(curve.part, form, (), curve)
    free, root = curve.gauge(finding.fitted.solution.values), _root(curve)
    target = np.linalg.solve(root, curve.value)

    def solved(shapes: Sequence[float]) -> tuple[float, float, Array]:
        with np.errstate(all="ignore"):
            column = np.array([float(law.law(float(x), shapes, definition)) for x in curve.at])
        if not np.all(np.isfinite(column)) or not np.any(column):
            return 0.0, np.inf, curve.value
        design = np.column_stack([column, free])
        whitened = np.linalg.solve(root, design)
        step = np.linalg.lstsq(whitened, target, rcond=None)[0]
        with np.errstate(all="ignore"):  # a law of huge values overflows
            distance = float(np.sum((target - whitened @ step) ** 2))
        return float(step[0]), distance if np.isfinite(distance) else np.inf, column

    starts = list(product(*_grids(curve, law.units[1:])))
    best = min(starts, key=lambda s: solved(s)[1])
    if best:
        start = np.array(best, dtype=np.float64)
        cost = cast(Any, lambda s: solved(tuple(s))[1])
        search: Any = minimize(cost, start, method="Nelder-Mead", options={"maxiter": 200})
        best = tuple(float(v) for v in search.x) if search.fun <= solved(best)[1] else best
    size, distance, column = solved(best)
    if not np.isfinite(distance):
        return None
    whole, followed = np.linalg.solve(root, column), np.linalg.solve(root, free)
    left = whole - followed @ np.linalg.lstsq(followed, whole, rcond=None)[0]
    return (size, *best), distance, size * column, float(np.linalg.norm(left) / np.linalg.norm(whole))


def _root(curve: Curve) -> Array:
    """The Cholesky factor (n, n) of the covariance of a curve's points, regularized by ``RIDGE``."""
    level = RIDGE * np.mean(np.diag(curve.covariance))
    return np.asarray(np.linalg.cholesky(curve.covariance + level * np.eye(len(curve.at))))


def _deviation(curve: Curve, finding: PartFinding) -> float:
    """Chi-square distance of a curve from what the part's own law can follow."""
    root = _root(curve)
    target, followed = (np.linalg.solve(root, x) for x in (curve.value, curve.gauge(finding.fitted.solution.values)))
    return float(np.sum((target - followed @ np.linalg.lstsq(followed, target, rcond=None)[0]) ** 2))


def _grids(curve: Curve, units: Sequence[str]) -> list[list[float]]:
    """Starting values of each shape parameter: exponents, or places and widths within the covered range."""
    low, high = float(curve.at[0]), float(curve.at[-1])
    reach = max(abs(low), abs(high))
    grids = []
    for k, unit in enumerate(units):
        if unit == "":
            grids.append([0.3, 0.6, 1.5, 2.0, 3.0, 5.0])
        elif len(units) == 2 and k == 0 and curve.part.anchored is False:
            grids.append(list(np.linspace(low, high, 12)))
        else:
            smallest = curve.part.scale or reach / 50
            grids.append([s * w for w in np.geomspace(smallest, 2 * reach, 10) for s in ((1, -1) if low < 0 else (1,))])
    return grids


def _definition(
    part: Part, form: str, names: tuple[str, ...], curve: Curve, basis: Array | None = None
) -> CurveDefinition:
    return CurveDefinition(
        place=part.place,
        coordinate=part.coordinate,
        coordinate_unit=part.coordinate_unit,
        unit=part.unit,
        factor=part.factor,
        span=part.span,
        scale=part.scale,
        anchored=part.anchored,
        form=cast(Form, form),
        unknowns=names,
        basis=() if basis is None else tuple(tuple(row) for row in basis.tolist()),
        reference=float(np.max(np.abs(curve.at))),
    )


def learned(finding: PartFinding, form: FittedForm | None, others: Sequence[str], label: str) -> Learned:
    """The learned law of a part.

    Parameters
    ----------
    form : None for a table. others : forms that fit equally well. label : the part in words.
    """
    name = f"learned_{finding.name}"
    curves: list[CurveDefinition] = []
    starts: dict[str, tuple[float, float, float]] = {}
    for k, curve in enumerate(finding.curves):
        part = curve.part
        prefix = f"{name}_{part.place}" if len(finding.curves) > 1 else name
        if form is None:
            basis, sizes = _directions(finding, part, curve)
            names = tuple(f"{prefix}_{j + 1}" for j in range(len(sizes)))
            curves.append(_definition(part, "table", names, curve, basis))
            most = AMPLITUDE_BOUND * max(part.size, float(np.max(np.abs(sizes), initial=0.0)))
            starts |= {n: (v, -most, most) for n, v in zip(names, sizes.tolist(), strict=True)}
            continue
        coefficients = LAW_FORMS[form.form].coefficients
        names = tuple(f"{prefix}_{c}" for c in coefficients)
        curves.append(_definition(part, form.form, names, curve))
        for j, (n, v) in enumerate(zip(names, form.values[k], strict=True)):
            low, high = (-AMPLITUDE_BOUND * abs(v), AMPLITUDE_BOUND * abs(v)) if not j else sorted((v / ROOM, v * ROOM))
            starts[n] = (v, low, high)
    tags = _tags(finding.parts[0])
    law = LawDefinition(
        element=finding.parts[0].element, label=f"the learned law of {label}", tags=tags, curves=tuple(curves)
    )
    shown = "table" if form is None else form.form
    return Learned(name, shown, law, learned_effect(name, law, starts), tuple(o for o in others if o != shown))


def _tags(part: Part) -> tuple[str, ...]:
    """Tags of the law: of a sensor, of this test only, or none for the vehicle."""
    if part.sensor:
        return ("sensor",)
    if part.factor or part.coordinate in ("elapsed", "run_time", "position"):
        return ("test_only",)
    return ()


def _directions(finding: PartFinding, part: Part, curve: Curve) -> tuple[Array, Array]:
    """The shapes (cosines, directions) that the data determine, each with a largest value of one, and their amplitudes.

    With C the posterior and S the prior covariance of the coefficients, the information of the data is C^-1 - S^-1.
    Directions of S^1/2 in which it exceeds ``learned_information`` times the prior's are kept. Shapes that the
    baseline's law can follow carry no information and are thereby excluded.
    """
    solution = finding.fitted.solution
    at = [solution.names.index(n) for n in part.unknowns]
    root = np.sqrt(finding.fitted.variance_of(part))
    covariance = solution.classical_covariance[np.ix_(at, at)] / finding.search.noise(finding.fitted)
    shrunk, axes = np.linalg.eigh(covariance / np.outer(root, root))
    kept = axes[:, shrunk < 1.0 / (1.0 + POLICY.learned_information)]
    basis = root[:, None] * kept
    found = kept.T @ (np.array([solution.values[n] for n in part.unknowns]) / root)
    largest = np.max(np.abs(part.basis(curve.at) @ basis), axis=0)
    return basis / largest, found * largest
