"""Simulated logs of a test day not driven yet, from settings with stated defaults."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.quantities.vocabulary import PARAMETERS

FEWEST_SAMPLES = 20  # samples of a run: no step evaluates fewer

if TYPE_CHECKING:
    from vdyn_cli.description.description_model import Description
    from vdyn_cli.quantities.parameters import Parameters


@dataclass(frozen=True)
class PlanSetting:
    """A number that a planned day needs: its quantity, and (spec, known) -> its default in SI."""

    quantity: Quantity
    default: Callable[[Any, Parameters], float]


def setting(name: str, default: float, unit: str, meaning: str, most: float, least: float = 0.0) -> PlanSetting:
    """A setting with a fixed default, and range from ``least`` to ``most``, all in ``unit`` (SI)."""
    return PlanSetting(Quantity(name, unit, meaning, "", least, most), lambda spec, known: default)


def guess(name: str, default: float | Callable[[Any, Parameters], float]) -> PlanSetting:
    """A parameter that the day is to determine, with its planned value (SI) where the vehicle states none."""
    quantity = PARAMETERS[name]
    usual = default if callable(default) else lambda spec, known: default
    return PlanSetting(quantity, lambda spec, known: known[name].value if name in known else usual(spec, known))


@dataclass(frozen=True)
class DayRequest:
    """One day to simulate.

    Parameters
    ----------
    spec : the description, with one entry under ``runs`` for each run. known : parameters, SI.
    at : value of each setting, SI. rng : the source of the day's noise.
    """

    spec: Description
    known: Parameters
    at: Mapping[str, float]
    rng: np.random.Generator

    def clock(self, duration: float) -> Array:
        """Sample times (n,) from 0 to ``duration`` s at the planned rate.

        Raises
        ------
        InputError : fewer than ``FEWEST_SAMPLES`` samples.
        """
        rate = self.at["rate"]
        count = round(duration * rate) + 1
        if count < FEWEST_SAMPLES:
            what = f"a run of {duration:.3g} s at {rate:.3g} Hz has {count} samples, fewer than {FEWEST_SAMPLES}"
            raise InputError(Finding("plan", what, remedy="plan with a higher rate, or with longer runs"))
        return np.arange(count) / rate

    def read(self, true: Array, noise: str, zero: float = 0.0) -> Array:
        """The readings (n,) of a true signal (n,), with white noise and a random zero of the run.

        Parameters
        ----------
        noise : name of the setting with the noise's standard deviation. zero : standard deviation of the zero, SI.
        """
        return true + zero * self.rng.standard_normal() + self.at[noise] * self.rng.standard_normal(true.size)


@dataclass(frozen=True)
class PlannedDay:
    """How a step simulates a day before it is driven.

    Parameters
    ----------
    runs : default number of runs.
    settings : of the day, each a key of ``plan`` in the description.
    logs : (request) -> one log for each run, with every channel that the step can read.
    run : index -> keys of a run that the description does not list.
    """

    runs: int
    settings: tuple[PlanSetting, ...]
    logs: Callable[[DayRequest], tuple[Log, ...]]
    run: Callable[[int], Mapping[str, Any]] = lambda index: {}
