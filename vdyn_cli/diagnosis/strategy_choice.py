"""Which strategy a step's model asks for."""

from __future__ import annotations

from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.linearized import open_linearized
from vdyn_cli.diagnosis.refit import open_refit
from vdyn_cli.diagnosis.strategy import Strategy


def open_strategy(setup: DiagnosisSetup) -> Strategy:
    """The linearized strategy where the step declares its model expensive, else the refit strategy.

    Raises
    ------
    ResultError : the baseline cannot be fitted, where that comes first.
    """
    return open_linearized(setup) if setup.linearized else open_refit(setup)
