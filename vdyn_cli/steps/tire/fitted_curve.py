"""The curve of a tire test: whole where the sweeps determine it, else only its slope at zero slip."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import fdtrc

from vdyn_cli.inference import Solution
from vdyn_cli.physics.models.tire_curve import SHAPE, SHIFTS, peak_slip
from vdyn_cli.quantities.arrays import Array, rms
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.contract import NO_VALUES
from vdyn_cli.steps.tire.tire_regression import CAR_TIRES, TireCurveProblem

SHAPES = ("tire_C", "tire_E")  # determine the curve beyond its steep part
EXACT = 1e-3  # share of a prior's standard deviation that practically fixes the unknown
GRID = 300  # slips, on which the peak of a curve is searched


@dataclass(frozen=True)
class FittedCurve:
    """The fitted curve of friction over slip.

    Parameters
    ----------
    peak : slip of the largest friction; None where the sweeps do not determine it.
    others : fits in other minima that the sweeps do not reject.
    """

    fit: TireCurveProblem
    solution: Solution
    peak: float | None
    others: tuple[Solution, ...] = ()

    @property
    def largest_friction(self) -> float:
        """The largest friction in driving without effects, up to the largest slip of the sweeps, at their mean load."""
        return float(np.max(self._friction(np.linspace(0.0, self.fit.reach, GRID))))

    @property
    def steepest_chord(self) -> float:
        """The largest ratio of friction to slip, without effects and shifts, of the mean of driving and braking.

        Friction rises ever less with slip, so that no chord from zero is steeper than the curve at zero. A free form
        that is fitted to bins beyond zero can be too flat there; the data then show it in a chord.
        """
        slip = np.linspace(0.0, self.fit.reach, GRID)[1:]
        still = dict.fromkeys(("radius_error", *SHIFTS), 0.0)
        return float(np.max((self._friction(slip, still) - self._friction(-slip[::-1], still)[::-1]) / (2 * slip)))

    def _friction(self, slip: Array, changed: Mapping[str, float] = NO_VALUES) -> Array:
        """The friction at increasing slips (n,) without effects, at the mean load of the sweeps."""
        shapes = {name: value for effect in self.fit.added.effects for name, value in effect.nominal.items()}
        values = {**self.solution.values, **dict.fromkeys(self.fit.added.names, 0.0), **shapes, **changed}
        load = float(np.mean(np.concatenate([sweep.load for sweep in self.fit.sweeps])))
        return self.fit.force(slip, load, values) / load


def fitted_curve(fit: TireCurveProblem) -> FittedCurve:
    """The whole curve where the sweeps extend beyond its peak, else one with the shape of passenger car tires.

    Fx = Fz D sin(C atan(B s - E (B s - atan(B s)))), least squares in Fx and in the slip s

    Otherwise C = 1.6 +- 0.15 and E = 0 +- 0.6 are priors, and only the slope at zero slip, B C D, is determined. With
    stated C and E the shape is known, so that a peak beyond the sweeps is published. Source: Pacejka, Tire and Vehicle
    Dynamics, 3rd ed., 2012, section 4.3.1.

    Parameters
    ----------
    fit : with the stated priors.

    Raises
    ------
    ResultError : the sweeps do not determine the slope at zero slip.
    """
    with suppress(ResultError):  # the shape beyond the slope is not determined
        solution, *others = fit.minima()
        peak = peak_slip(*(solution.values[n] for n in ("tire_B", "tire_C", "tire_E")))
        if peak < fit.reach or set(SHAPES) <= set(fit.prior):
            return FittedCurve(fit, solution, peak, tuple(others))
    fit = replace(fit, prior={**CAR_TIRES, **fit.prior})
    try:
        return FittedCurve(fit, fit.minima()[0], None)
    except ResultError:
        fit = replace(fit, scale=shape_held(fit).fit.scale)
        return FittedCurve(fit, fit.minima()[0], None)


def explains_more(free: FittedCurve, formula: FittedCurve, level: float) -> bool:
    """Whether a curve with more unknowns explains the sweeps significantly better than one of the magic formula.

    F = (S0 - S) / k / (S / (n - p)), S0 and S the sums of the squared residuals over the noise of n bins, p and k all
    and the additional unknowns; the mean square of the residuals stands for the noise, so that a wrong noise of the
    sensors does not count. A free form that does not follow the sweeps either (``scale`` above 1) explains nothing.

    Parameters
    ----------
    level : probability with which a curve of the magic formula is found to depart from it.
    """
    left, before = (c.fit.scale**2 * sum(float(r @ r) for r in c.solution.residuals) for c in (free, formula))
    bins = sum(r.size for r in free.solution.residuals)
    more = len(free.fit.free) - len(formula.fit.free)
    spare = bins - len(SHAPE) - len(free.fit.free) - len(free.fit.added.unknowns)
    if free.fit.scale > 1.0 or left <= 0.0 or more <= 0 or spare <= 0:
        return False
    return float(fdtrc(more, spare, (before - left) / more / (left / spare))) < level


def shape_held(fit: TireCurveProblem) -> FittedCurve:
    """The slope at zero slip of a curve with shape factors fixed at the means of their priors, or of car tires.

    For sweeps that no fit of the shape follows: ``scale`` is their ratio of residual to noise, at least 1.

    Raises
    ------
    ResultError : the sweeps do not determine slope and height of that curve either.
    """
    priors = {**CAR_TIRES, **fit.prior}
    exact = {n: (mean, EXACT * std) for n, (mean, std) in priors.items() if n in CAR_TIRES}
    held = replace(fit, prior={**priors, **exact})
    held = replace(held, scale=max(rms(*held.minima()[0].residuals), 1.0))
    return FittedCurve(held, held.minima()[0], None)
