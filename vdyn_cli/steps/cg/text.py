"""Sentence, uncertainty table and methods text of a load-transfer test."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vdyn_cli.inference import Solution
from vdyn_cli.physics.models.load_transfer import SOUGHT
from vdyn_cli.quantities.number_text import number, two_digits
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.result import Table
from vdyn_cli.steps.interval_text import ends

METHODS = (
    "Moment balance about the rear contact, integrated over windows of some 20 ms by Simpson's rule; the pitch "
    "acceleration enters as the change of the pitch rate. Loads, acceleration and pitch rate all have white noise, "
    "estimated from third differences, and their true values are eliminated (total least squares). Every run has its "
    "own zero of the load cells within its standard deviation. Intervals follow from the scatter of blocks of "
    "equal information (Bell and McCaffrey 2002); the uncertainty of known numbers is added."
)


def withheld(mean: float, std: float) -> str:
    """Why the pitch inertia is not published; ``mean`` and ``std``, kg m^2, are assumed for the other results."""
    assumed = f"{two_digits(mean)} +- {two_digits(std)} kg m^2 is assumed for the other results"
    return f"the runs do not determine it ({assumed}); use a pitch rate with less noise, or pulses of 0.5 s"


def sentence(estimates: Mapping[str, Estimate], _extra: Mapping[str, Any]) -> str:
    """The headline: height, position and pitch inertia with their 95 % intervals."""

    def shown(name: str, unit: str) -> tuple[str, str]:
        e = estimates[name]
        return f"{number(e.value, e.half_width)} {unit}", f"(95 %: {ends(e.interval95)})"

    (height, of_height), (rear, of_rear) = shown("cg_height", "m"), shown("cg_to_rear", "m")
    where = f"The center of gravity is {height} high {of_height} and {rear} ahead of the rear axle {of_rear}"
    if "pitch_inertia" not in estimates:
        return f"{where}; the runs do not determine the pitch inertia."
    inertia, of_inertia = shown("pitch_inertia", "kg m^2")
    return f"{where}; the pitch inertia is {inertia} {of_inertia}."


def uncertainty_table(solution: Solution, moved: Mapping[str, Mapping[str, float]]) -> Table:
    """Table of the sources of each result's standard deviation.

    Parameters
    ----------
    moved : shift of each result, SI, for one standard deviation of a known number, by known number.
    """
    units = {"cg_height": ("mm", 1e3), "cg_to_rear": ("mm", 1e3), "pitch_inertia": ("kg m²", 1.0)}

    def cells(std: Mapping[str, float]) -> list[str]:
        return [f"{two_digits(abs(std[n]) * units[n][1])} {units[n][0]}" for n in SOUGHT]

    rows = [("scatter of the runs", *cells(solution.std)), *((name, *cells(row)) for name, row in moved.items())]
    caption = "Standard deviations by their source; each known number is moved by one standard deviation."
    return Table("budget", "Where the uncertainty comes from", ("source", *SOUGHT), tuple(rows), caption)
