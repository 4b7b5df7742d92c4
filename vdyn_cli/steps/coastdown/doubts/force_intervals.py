"""Intervals of the road load's forces that combine several results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from vdyn_cli.inference.mixture import mixture_interval
from vdyn_cli.quantities.result import Result

SAME = 1e-6  # km/h, largest difference of two speeds that count as equal


def with_answers(result: Result, answers: Sequence[tuple[float | None, Result]]) -> Result:
    """The result with 95 % force intervals that include other answers; the forces themselves are unchanged.

    low(V) = min of low_a(V) over the result, answers without a probability, and the mixture with the others; high(V)
    likewise

    Parameters
    ----------
    answers : probability and result of each, of the same campaign with other effects in the model; rows are matched by
        their speed in km/h.
    """
    load = result.extra["road_load"]
    forces = [{**row, "interval95": list(_interval(row, answers))} for row in load["force"]]
    return replace(result, extra={**result.extra, "road_load": {**load, "force": forces}})


def _interval(row: Mapping[str, Any], answers: Sequence[tuple[float | None, Result]]) -> tuple[float, float]:
    """The interval of the force in a row that includes the answers' forces at its speed."""
    rows = [(p, other) for p, one in answers for other in one.extra["road_load"]["force"]]
    there = [(p, other["interval95"]) for p, other in rows if abs(other["speed_kmh"] - row["speed_kmh"]) < SAME]
    probable = [(p, interval) for p, interval in there if p is not None]
    ends = [row["interval95"], *(interval for p, interval in there if p is None)]
    low, high = zip(*ends, *([mixture_interval(row["interval95"], probable)] if probable else []), strict=True)
    return min(low), max(high)
