"""Intervals of the road load's forces that combine several results."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from vdyn_cli.inference.mixture import mixture_interval
from vdyn_cli.quantities.result import Result

SAME = 1e-6  # km/h, largest difference of two speeds that count as equal


def spanning_forces(result: Result, answers: Sequence[Result]) -> Result:
    """The result with force intervals that span those of all answers.

    low(V) = min over answers of low_a(V), high(V) likewise; the force itself is unchanged.

    Parameters
    ----------
    answers : results of the same campaign with other effects in the model; rows are matched by their speed in km/h.
    """

    def held(row: Mapping[str, Any]) -> tuple[float, float]:
        low, high = zip(row["interval95"], *_same_speed(row, answers), strict=True)
        return min(low), max(high)

    return _with_intervals(result, held)


def averaged_forces(result: Result, answers: Sequence[tuple[float, Result]]) -> Result:
    """The result with the 95 % force intervals of its mixture with other answers, never narrower than its own.

    Parameters
    ----------
    answers : probability and result of each; see ``spanning_forces``.
    """

    def averaged(row: Mapping[str, Any]) -> tuple[float, float]:
        others = [(p, interval) for p, one in answers for interval in _same_speed(row, [one])]
        low, high = mixture_interval(row["interval95"], others)
        return min(low, row["interval95"][0]), max(high, row["interval95"][1])

    return _with_intervals(result, averaged)


def _with_intervals(result: Result, interval: Callable[[Mapping[str, Any]], tuple[float, float]]) -> Result:
    load = result.extra["road_load"]
    forces = [{**row, "interval95": list(interval(row))} for row in load["force"]]
    return replace(result, extra={**result.extra, "road_load": {**load, "force": forces}})


def _same_speed(row: Mapping[str, Any], answers: Sequence[Result]) -> list[tuple[float, float]]:
    """The intervals of other answers at the row's speed."""
    rows = [other for one in answers for other in one.extra["road_load"]["force"]]
    return [other["interval95"] for other in rows if abs(other["speed_kmh"] - row["speed_kmh"]) < SAME]
