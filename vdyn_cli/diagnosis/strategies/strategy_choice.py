"""Chooses the strategy for a step's model."""

from __future__ import annotations

from dataclasses import replace

from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.strategies.full_model import full_model
from vdyn_cli.diagnosis.strategies.linearized import open_linearized
from vdyn_cli.diagnosis.strategies.refit import RefitStrategy
from vdyn_cli.diagnosis.strategies.relaxed_regression import with_wide_priors
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.inference import RefusedFitError


def open_strategy(setup: DiagnosisSetup) -> Strategy:
    """The linearized strategy where the step declares its model expensive, else the refit strategy.

    If the data do not determine the baseline's unknowns, these get priors as wide as their ranges, so that the
    candidates are still tested in the directions that the data determine.

    Raises
    ------
    ResultError : the baseline cannot be fitted.
    """
    try:
        return _opened(setup)
    except RefusedFitError:
        return _opened(replace(setup, regression=with_wide_priors(setup.regression)))


def _opened(setup: DiagnosisSetup) -> Strategy:
    strategy: Strategy = (
        open_linearized(setup) if setup.linearized else RefitStrategy(full_model(setup, setup.regression))
    )
    strategy.fitted(())  # raises where the baseline cannot be fitted
    return strategy
