"""The key numbers of a fit, as a strip of small boxes below the headline."""

from __future__ import annotations

import math
from dataclasses import dataclass

from vdyn_cli.quantities.result import FitSummary
from vdyn_cli.report import typography


@dataclass(frozen=True)
class Chip:
    """One key number; ``mood`` is good, fair or bad, or empty for a number that has no target."""

    label: str
    value: str
    unit: str = ""
    note: str = ""
    mood: str = ""
    link: str = ""


def chips(fit: FitSummary, findings: int, slug: str, gained: bool, doubted: bool) -> tuple[Chip, ...]:
    """Residual and noise floor, held-out error, runs, independent units of the intervals, warnings.

    Parameters
    ----------
    findings : number of notes on the data.
    slug : prefix of the page's ids.
    gained : the page shows the gain on held-out runs, so that the held-out error is omitted here.
    doubted : the model lacks an effect, so that a residual near the noise floor does not count as good.
    """
    out = []
    shown = typography.unit(fit.unit)
    if math.isfinite(fit.rms):
        out.append(
            Chip(
                "residual rms",
                typography.significant(fit.rms, 2),
                shown,
                _noise_note(fit),
                "fair" if doubted else _rating(fit),
            )
        )
    if fit.held_out_rms is not None and math.isfinite(fit.held_out_rms) and not gained:
        out.append(Chip("held-out rms", typography.significant(fit.held_out_rms, 2), shown, "runs not used in the fit"))
    if fit.runs:
        note = typography.count(len(fit.unknowns), "unknown") + " estimated" if fit.unknowns else ""
        out.append(Chip("runs", str(fit.run_count), "", note))
    if fit.interval_unit == "model":
        out.append(Chip("intervals from", "noise model", "", "not from the scatter between runs"))
    elif fit.interval_units:
        kind = typography.count(fit.interval_units, fit.interval_unit or "unit").partition(" ")[2]
        out.append(Chip("intervals from", str(fit.interval_units), kind, "independent units"))
    if fit.warnings:
        note = f"and {typography.count(findings, 'note')} on the data" if findings else ""
        out.append(Chip("warnings", str(len(fit.warnings)), "", note, "fair", f"#{slug}-warnings"))
    elif findings:
        out.append(Chip("notes", str(findings), "", "on the data", "", f"#{slug}-data"))
    return tuple(out)


def _ratio(fit: FitSummary) -> float:
    known = math.isfinite(fit.noise_floor) and fit.noise_floor > 0
    return fit.rms / fit.noise_floor if known else math.nan


def _noise_note(fit: FitSummary) -> str:
    ratio = _ratio(fit)
    everyday = typography.everyday(fit.unit)
    also = f"{typography.quantity(fit.rms * everyday[1], everyday[0], 2)}, " if everyday else ""
    if not math.isfinite(ratio):
        return also.removesuffix(", ") or "noise floor not known"
    return f"{also}{typography.significant(ratio, 2)} × the noise floor"


def _rating(fit: FitSummary) -> str:
    ratio = _ratio(fit)
    return "" if not math.isfinite(ratio) else "good" if ratio < 1.3 else "fair" if ratio < 2.5 else "bad"
