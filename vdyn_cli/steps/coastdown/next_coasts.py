"""Coasts that could be driven next: wider, both ways, warm, cold, on another day; simulated from the baseline's fit.

Every manoeuvre is a pair of coasts, out and back on the same level road in still air, after the runs already driven.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.inference import Regression
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.coastdown.campaign_checks.expected_accuracy import LONGEST_COAST, SIMULATION_STEP, coasting_clock
from vdyn_cli.steps.coastdown.fit.campaign import Campaign
from vdyn_cli.steps.coastdown.fit.road_load_regression import effects_of, rows_of, transferred
from vdyn_cli.steps.coastdown.fit.road_run import RoadRun
from vdyn_cli.steps.manoeuvre import Manoeuvre

FASTER, FASTEST = 1.3, 130 / 3.6  # times the highest speed driven, up to what is legal somewhere, m/s
SLOWEST = 2.0  # m/s
WIDER = 1.1  # times the span of speeds driven: a smaller increase is the same manoeuvre
FEWEST_STEPS = 20  # of a simulated coast
REST = 60.0  # s between coasts
WARM = 3600.0  # s of driving, after which tires and brakes are warm
OTHER = 10.0  # K by which another day is colder or warmer
MILD = 288.0  # K, above which the other day is the colder one
COUNTS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


@dataclass(frozen=True)
class _PlannedCoast:
    """A coast from ``upper`` to ``lower`` (m/s), begun ``start`` s after the day's first run, at ``temperature`` K."""

    upper: float
    lower: float
    start: float
    temperature: float
    air_density: float | None = None


def next_coasts(regression: Regression, values: Mapping[str, float]) -> tuple[Manoeuvre, ...]:
    """The coasts that could be driven next, those with the least effort first.

    Empty on an open road (``windows: powered``), where no runs are driven for the test.

    Parameters
    ----------
    regression : of the coast-downs, with every candidate effect. values : of its shared unknowns at the baseline's fit.
    """
    campaign = rows_of(regression).campaign
    if campaign.accelerometer == "alone":
        return ()
    upper = float(np.median([r.speed[:5].mean() for r in campaign.runs]))
    lower = float(np.median([r.speed[-5:].mean() for r in campaign.runs]))
    top = max(upper, min(FASTER * max(float(r.speed.max()) for r in campaign.runs), FASTEST))
    now = max(r.start + r.since + float(np.ptp(r.time)) for r in campaign.runs) + REST
    usual = float(np.mean([r.temperature for r in campaign.runs]))
    powered = not campaign.coasting
    coast = _PlannedCoast(top, SLOWEST, now, usual) if powered else _PlannedCoast(upper, lower, now, usual)

    def planned(how: str, one: _PlannedCoast, most: int = 10, anew: frozenset[str] = frozenset()) -> Manoeuvre:
        def words(runs: int) -> str:
            each = COUNTS[runs // 2] if runs // 2 < len(COUNTS) else str(runs // 2)
            return f"{runs} coast-downs from {3.6 * one.upper:.0f} to {3.6 * one.lower:.0f} km/h, {each} each way{how}"

        return Manoeuvre(words, lambda: transferred(regression, _pair(campaign, one, values), values), 2, most, anew)

    found = []
    wider = not powered and top - SLOWEST > WIDER * (upper - lower)
    if not wider or set(campaign.headings) != {1.0, -1.0}:
        found.append(planned(", with the drive logged" if powered else "", coast))
    if wider:
        found.append(planned("", replace(coast, upper=top, lower=SLOWEST)))
    if now < WARM:
        found.append(planned(", after one hour of driving", replace(coast, start=WARM)))
    cold = ", with tires and brakes as cold as at the first run (start: 0 s)"
    found.append(planned(cold, replace(coast, start=0.0), 1))
    change = OTHER if usual < MILD else -OTHER
    density = None
    if "air_density" not in {u.name for u in campaign.unknowns}:
        density = campaign.values["air_density"] * usual / (usual + change)
    other = replace(coast, temperature=usual + change, air_density=density)
    day = f", on a day that is {OTHER:.0f} K {'warmer' if change > 0 else 'colder'} (state both temperatures)"
    found.append(planned(day, other, anew=_winds(regression)))
    return tuple(found)


def coast_trace(at: Mapping[str, float], upper: float, lower: float) -> tuple[Array, Array]:
    """Time and speed (n,), s and m/s, of a coast on a level road in still air; at most a quarter of an hour.

    Parameters
    ----------
    at : parameters of the road load in SI. upper, lower : m/s.
    """
    speed, clock = coasting_clock(at, upper, lower)
    time = np.arange(0.0, max(min(float(clock[-1]), LONGEST_COAST), FEWEST_STEPS * SIMULATION_STEP), SIMULATION_STEP)
    return time, np.asarray(np.interp(time, clock, speed))


def _winds(regression: Regression) -> frozenset[str]:
    """Unknowns of the air effects that last only for the day: another day has another wind."""
    return frozenset(n for e in effects_of(regression) if "air" in e.on and not e.lasts for n in e.unknowns)


def _pair(campaign: Campaign, one: _PlannedCoast, values: Mapping[str, float]) -> Campaign:
    """Two coasts, out and back, with the road, the model and the sensor noise of the runs that were driven."""
    at = {n: values.get(n, v) for n, v in campaign.values.items()}
    # With fewer samples in a bin, the mean over the bin keeps its noise.
    spacing = float(np.median([np.median(np.diff(r.time)) for r in campaign.runs]))
    share = float(np.sqrt(min(spacing / SIMULATION_STEP, 1.0)))
    driven = campaign.levels[:1] if campaign.white else campaign.levels
    levels = {n: share * float(np.mean([level[n] for level in driven])) for n in driven[0]}
    return replace(
        campaign,
        runs=tuple(replace(_run(campaign, one, at, (1.0, -1.0)[k]), origin=k) for k in range(2)),
        levels=(levels, levels),
        shifts=(),
    )


def _run(campaign: Campaign, one: _PlannedCoast, at: Mapping[str, float], heading: float) -> RoadRun:
    time, speed = coast_trace(at, one.upper, one.lower)
    inputs: dict[str, Array | float] = {"grade": 0.0, "wind_speed": 0.0}
    if not campaign.coasting:
        inputs[f"drive_{campaign.drive}"] = np.zeros_like(time)
    return RoadRun(
        f"a coast {'out' if heading > 0 else 'back'}",
        time,
        speed,
        inputs,
        np.zeros(time.size, dtype=np.int64),
        acceleration=None if campaign.accelerometer == "none" else np.gradient(speed, time),
        heading=heading,
        start=one.start,
        temperature=one.temperature,
        air_density=one.air_density,
        place=None if campaign.road is None else campaign.road[0 if heading > 0 else 1],
        changed=campaign.runs[-1].changed,  # as the car was last
    )
