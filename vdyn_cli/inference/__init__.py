"""Nonlinear least squares over runs: shared and per-run unknowns, intervals from independent units, identifiability."""

from vdyn_cli.inference.intervals import equal_information_blocks
from vdyn_cli.inference.least_squares import RefusedFitError, approach, even_if_refused, solve
from vdyn_cli.inference.regression import Regression, Rows, Unknown
from vdyn_cli.inference.solution import Solution, Unit
from vdyn_cli.inference.white_noise import FEWEST_READINGS, exceeds_noise, white_level, whiten

__all__ = [
    "FEWEST_READINGS",
    "RefusedFitError",
    "Regression",
    "Rows",
    "Solution",
    "Unit",
    "Unknown",
    "approach",
    "equal_information_blocks",
    "even_if_refused",
    "exceeds_noise",
    "solve",
    "white_level",
    "whiten",
]
