"""Fixed-point iteration, for fits whose weights or linearization depend on their own result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

S = TypeVar("S")


@dataclass(frozen=True)
class Settled(Generic[S]):
    """End of the iteration: its last state, and whether its last move was below the tolerance."""

    state: S
    converged: bool


def until_settled(step: Callable[[S], tuple[S, float]], start: S, rounds: int, tolerance: float) -> Settled[S]:
    """Apply ``step`` until its move falls below ``tolerance``, at most ``rounds`` times.

    Parameters
    ----------
    step : state -> (next state, its move, usually the largest change of an unknown in standard deviations).
    rounds : largest number of iterations; with zero, the start is returned as not converged.
    """
    state = start
    for _ in range(rounds):
        state, moved = step(state)
        if moved < tolerance:
            return Settled(state, True)
    return Settled(state, False)
