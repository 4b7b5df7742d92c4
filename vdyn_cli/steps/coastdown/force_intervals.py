"""Intervals of the road load's forces that hold several answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from vdyn_cli.quantities.result import Result

SAME = 1e-6  # km/h between the speeds of two rows that are one


def holding_forces(result: Result, answers: Sequence[Result]) -> Result:
    """The result whose forces over speed have 95 % intervals that hold those of all answers.

    low(V) = min over answers of low_a(V), high(V) likewise; the force itself stays.

    Parameters
    ----------
    answers : results of the same campaign with other effects in the model; rows are matched by their speed in km/h.
    """
    load = result.extra["road_load"]
    others = [row for one in answers for row in one.extra["road_load"]["force"]]
    forces = []
    for row in load["force"]:
        same = [o["interval95"] for o in others if abs(o["speed_kmh"] - row["speed_kmh"]) < SAME]
        low, high = zip(row["interval95"], *same, strict=True)
        forces.append({**row, "interval95": [min(low), max(high)]})
    return replace(result, extra={**result.extra, "road_load": {**load, "force": forces}})
