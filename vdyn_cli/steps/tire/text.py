"""Sentences and the table of a tire test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.result import Table
from vdyn_cli.steps.interval_text import with_interval
from vdyn_cli.steps.tire.binned_sweep import BinnedSweep
from vdyn_cli.steps.tire.policy import TIRE_POLICY

METHODS = (
    "Slip follows from wheel speed, radius and vehicle speed; samples are averaged into bins in which slip changes by "
    "at most 1.5 %. The fit of the magic formula minimizes the distance in slip and force together, with the noise of "
    "each channel from its third differences and without the second-order effect of slip noise. The wheel radius is a "
    "nuisance parameter with its standard deviation as prior. Where the sweeps end before the peak or contradict the "
    "formula, or the formula hides another error, the curve may depart smoothly from it. Intervals follow from the "
    "scatter of blocks of equal information (Bell and McCaffrey 2002)."
)


WITHHELD = "the sweeps determine only the product B C D, the slope at zero slip"


def sentence(estimates: Mapping[str, Estimate], _extra: Mapping[str, Any], peak: float | None) -> str:
    """The headline: peak friction and slope at zero slip, or the slope alone; ``peak`` is the slip of the peak."""
    slope = estimates["tire_longitudinal_stiffness"]
    at_zero = with_interval(slope, "per unit of slip")
    if peak is None:
        return f"The tire's slope at zero slip is {at_zero}; the sweeps do not determine its peak."
    friction, brake = with_interval(estimates["tire_D"]), estimates.get("tire_D_brake")
    if brake is not None:
        friction = f"{with_interval(brake)} in braking and, in driving, {friction}"
    return f"The tire's peak friction is {friction} at {100 * peak:.1f} % of slip; its slope at zero slip is {at_zero}."


def peak_not_reached(sweeps: Sequence[BinnedSweep]) -> str:
    """The warning that the sweeps determine only the slope at zero slip, with their largest slip and friction."""
    slip = max(float(np.abs(sweep.slip).max()) for sweep in sweeps)
    friction = max(float(np.max(np.abs(sweep.force / sweep.load))) for sweep in sweeps)
    return (
        f"the sweeps do not determine the peak (largest slip {100 * slip:.1f} %, largest friction "
        f"{friction:.2f}): only the product B C D is determined, not B, C, D and E; sweep to two or three times the "
        "slip of the peak"
    )


def departure(slope: Estimate, formula: Estimate, peak: float | None) -> tuple[str, ...]:
    """The warning that the curve departs from the magic formula, with both slopes at zero slip.

    Parameters
    ----------
    slope, formula : at zero slip, of the curve and of the magic formula. peak : its slip; None: B, C, D are withheld.
    """
    if peak is None:
        return ()
    return (
        f"the tire departs from the magic formula, whose slope at zero slip, B C D, is {formula.value:.4g}: the "
        f"published slope, {with_interval(slope)}, is that of a curve with a free form",
    )


def no_free_form(reason: str) -> str:
    """The warning that only the magic formula can be fitted; ``reason``: why a curve with a free form cannot."""
    return (
        f"a curve with a free form cannot be fitted ({reason}): the slope at zero slip is that of the magic formula, "
        "and its interval does not include other forms"
    )


def peak_by_priors(reach: float, peak: float) -> str:
    """The warning that the peak was not reached; ``reach`` is the largest slip measured, ``peak`` that of the peak."""
    return (
        f"the peak at {100 * peak:.1f} % of slip lies beyond the sweeps (largest slip {100 * reach:.1f} %): B and D "
        "depend on the stated C and E"
    )


def other_curves(shapes: Sequence[float]) -> str:
    """The warning that the sweeps do not reject curves in other minima; ``shapes`` are their C."""
    values = " and ".join(f"{c:.2f}" for c in shapes)
    return (
        f"curves with C of {values} fit the sweeps about equally well: the intervals of B, C, D and E include all of "
        "them; sweep further beyond the peak"
    )


def two_peaks_note(sweeps: Sequence[BinnedSweep]) -> tuple[Finding, ...]:
    """A finding where one curve is fitted to driving and braking although their largest frictions differ.

    They differ if the 98 % and the negative 2 % quantile of force over load are ``two_peaks`` of the larger one apart,
    and the slips extend to ``peak_slip`` either way.
    """
    slip, friction = (np.concatenate(x) for x in ([s.slip for s in sweeps], [s.force / s.load for s in sweeps]))
    driving, braking = float(np.quantile(friction, 0.98)), -float(np.quantile(friction, 0.02))
    both_reached = slip.min() <= -TIRE_POLICY.peak_slip and slip.max() >= TIRE_POLICY.peak_slip
    if not both_reached or abs(driving - braking) < TIRE_POLICY.two_peaks * max(driving, braking):
        return ()
    what = "the largest friction differs between driving and braking, and one curve is fitted to both"
    remedy = (
        "set the zero of the force sensor and repeat; if the tire really differs, write 'peaks: two' under settings"
    )
    return (Finding("settings.peaks", what, f"{driving:.3f} and {braking:.3f}", remedy),)


def prior_notes(priors: Mapping[str, tuple[float, float]], solution: Solution) -> list[Finding]:
    """A finding for each stated shape factor: that it is a prior, and how much the fit deviates from it."""
    found = []
    for name, (mean, std) in priors.items():
        away = (solution.values[name] - mean) / std
        what = f"{mean:g} +- {std:.2g} is a prior; the fitted value deviates by {away:+.1f} of its standard deviations"
        doubtful = abs(away) > TIRE_POLICY.prior_contradicted
        remedy = "state another value, or a wider standard deviation" if doubtful else ""
        found.append(Finding(name, what, "", remedy, minor=not doubtful, doubt=doubtful))
    return found


def sweeps_table(sweeps: Sequence[BinnedSweep]) -> Table:
    """Table of range, load, bins and noise of each sweep."""
    rows = tuple(
        (s.run, f"{100 * s.slip.min():.1f} %", f"{100 * s.slip.max():.1f} %", f"{np.mean(s.load):.0f} N",
         str(s.slip.size),
         f"{100 * np.sqrt(np.mean(s.slip_variance)):.2f} %", f"{np.sqrt(np.mean(s.force_variance)):.1f} N")
        for s in sweeps
    )  # fmt: skip
    columns = ("sweep", "slip from", "slip to", "mean load", "bins", "noise of slip", "noise of force")
    caption = "Noise is that of a bin's mean, from third differences of the channel."
    return Table("sweeps", "The sweeps", columns, rows, caption)
