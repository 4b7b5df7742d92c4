"""A manoeuvre that could be driven next, as a regression of runs not yet driven."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from vdyn_cli.inference import Regression


@dataclass(frozen=True)
class Manoeuvre:
    """Some runs of one kind, which can be driven several times over.

    Parameters
    ----------
    words : the manoeuvre with that many runs in all, as a noun phrase: "4 coasts from 130 to 7 km/h, two each way".
    regression : of ``each`` simulated runs: the step's own, with the same unknowns, effects and noise levels. It may
        raise ArithmeticError or ResultError where the car cannot be driven so. Made only when requested.
    each : runs that belong together and are repeated together.
    most : how often they may be repeated.
    anew : unknowns with another value when these runs are driven, such as the wind of another day.
    """

    words: Callable[[int], str]
    regression: Callable[[], Regression]
    each: int = 2
    most: int = 10
    anew: frozenset[str] = frozenset()
