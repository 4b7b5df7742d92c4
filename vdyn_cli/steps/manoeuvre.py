"""A manoeuvre that could be driven next, as a regression over simulated runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from vdyn_cli.inference import Regression


@dataclass(frozen=True)
class Manoeuvre:
    """Runs of one kind, which can be repeated.

    Parameters
    ----------
    words : number of runs -> noun phrase of the manoeuvre: "4 coast-downs from 130 to 7 km/h, two each way".
    regression : computes the step's regression over ``each`` simulated runs, with the same unknowns, effects and noise
        levels. It may raise ArithmeticError or ResultError where the car cannot drive the manoeuvre.
    each : number of runs that are repeated together.
    most : largest number of repetitions.
    anew : unknowns with a different value in these runs, such as the wind of another day.
    """

    words: Callable[[int], str]
    regression: Callable[[], Regression]
    each: int = 2
    most: int = 10
    anew: frozenset[str] = frozenset()
