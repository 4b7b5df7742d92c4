"""Balance of a coast-down campaign before any fit: directions, order, wind and accuracy of its runs.

The mean deceleration of each run over the speeds that all runs pass is regressed on direction and order::

    a_i = m + d h_i + b t_i

with the heading h = +1 out, -1 back and t the start (or the order) from -1/2 to 1/2: b is the trend due to warming
tires or changing wind, 2 d the difference between the directions, due to a slope 2 d / (2 g) or a wind.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.check_schema import CoastBalance, RunDeceleration, TimeAccuracy
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.steps.coastdown.campaign_checks.coast_times import coast_times, listed_by_start, paired_runs
from vdyn_cli.steps.coastdown.campaign_checks.regulation_limits import TestDay, regulation_limits
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment
from vdyn_cli.steps.coastdown.doubts.odd_decelerations import RunDecelerations
from vdyn_cli.steps.coastdown.problem import CoastdownProblem

NO_EFFECTS = dict.fromkeys(("trend", "trend_half", "difference", "difference_half", "scatter"))


@dataclass(frozen=True)
class CampaignCoasts:
    """The longest usable segment of each usable run; directions and starts of all runs of the description."""

    problem: CoastdownProblem
    segments: tuple[CoastSegment, ...]
    directions: tuple[str | None, ...]
    starts: tuple[float, ...] | None

    @property
    def order(self) -> Array:
        """Order (n,) of the runs from -1/2 (first) to 1/2 (last), by start or by order in the description."""
        at = np.array([self.starts[s.run] if self.starts else float(s.run) for s in self.segments])
        return np.asarray((at - at.min()) / max(float(np.ptp(at)), 1e-12) - 0.5)

    @property
    def rates(self) -> RunDecelerations:
        """The mean decelerations of the runs."""
        known = self.problem.known
        return RunDecelerations(self.segments, known["mass"].value + known["rotating_mass"].value)

    def balance(self, names: Sequence[str]) -> CoastBalance:
        """Directions, order, trend, wind, accuracy and limits of the campaign; ``names`` of all its runs."""
        rates, directions = self.rates, self.directions
        found = rates.means()
        effects = {} if found is None else _effects(found, rates.heading, self.order)
        listed = listed_by_start(self.segments, directions, self.starts)
        pairs = paired_runs(*listed)
        partners = {self.segments[k].run for pair in pairs for k in pair}
        ways = [s.direction for s in self.segments]
        known = len(ways) > 1 and all(w in ("out", "back") for w in ways)
        driven = [ways[i] for i in np.argsort(self.order, kind="stable")] if known else []
        alternating = all(a != b for a, b in pairwise(driven)) if known else None
        accuracy = [
            TimeAccuracy(speed=3.6 * t.speed, time=t.mean, r83=t.r83, wltp=t.wltp) for t in coast_times(*listed)
        ]
        speeds, runs = rates.common, self._runs(names, found)
        balance = CoastBalance(
            out=ways.count("out"),
            back=ways.count("back"),
            pairs=len(pairs),
            unpaired=[names[s.run] for s in self.segments if s.run not in partners and s.direction],
            alternating=alternating,
            speeds=None if speeds is None else (3.6 * speeds[0], 3.6 * speeds[1]),
            **{**NO_EFFECTS, **effects},
            runs=runs,
            accuracy=accuracy,
            limits=regulation_limits(self._day(len(pairs), accuracy, runs)),
            sentences=[],
        )
        mixed = alternating is False and _collinear(rates.heading, self.order)
        return balance.model_copy(update={"sentences": [*_sentences(balance, rates.step() is not None, mixed)]})

    def _runs(self, names: Sequence[str], found: Array | None) -> list[RunDeceleration]:
        place = {s.run: i for i, s in enumerate(self.segments)}
        shifts = None if found is None else _influence(found, self.rates.heading)
        rows = []
        for k, name in enumerate(names):
            i = place.get(k)
            wind = self.segments[i].log.channels.get("wind_speed") if i is not None else None
            shift = shifts[i] if shifts is not None and i is not None else None
            rows.append(
                RunDeceleration(
                    run=name,
                    direction=self.directions[k] or "",
                    start=self.starts[k] if self.starts else None,
                    mean=float(found[i]) if found is not None and i is not None else None,
                    influence=None if shift is None else shift[0],
                    material=shift is not None and abs(shift[0]) > shift[1],
                    wind_mean=None if wind is None else float(np.nanmean(wind)),
                    wind_peak=None if wind is None or np.ptp(wind) == 0.0 else float(np.nanmax(np.abs(wind))),
                )
            )
        return rows

    def _day(self, pairs: int, accuracy: Sequence[TimeAccuracy], runs: Sequence[RunDeceleration]) -> TestDay:
        spec, known = self.problem.spec, self.problem.known
        warm = {r.temperature.value for r in spec.runs if r.temperature is not None}
        if not warm and "temperature" in known.estimates:
            warm = {known["temperature"].value}
        density = known["air_density"].value if "air_density" in known.estimates else None
        across = [r.crosswind.value for r in spec.runs if r.crosswind is not None]
        wind = tuple((r.wind_mean, r.wind_peak) for r in runs if r.wind_mean is not None)
        crosswinds = tuple(across) if len(across) == len(spec.runs) else ()
        return TestDay(tuple(sorted(warm)), density, wind, pairs, self.rates.common, accuracy, crosswinds)


def _effects(found: Array, heading: Array, order: Array) -> dict[str, Any]:
    """Trend, difference and scatter of mean decelerations, as in CoastBalance; empty for too few runs."""
    both = bool(np.ptp(heading) > 0)
    rows = np.column_stack([np.ones(found.size), order, *([heading] if both else [])])
    degrees = found.size - np.linalg.matrix_rank(rows)
    if degrees < 1 or np.linalg.matrix_rank(rows) < rows.shape[1]:
        return {}
    inverse = np.linalg.inv(rows.T @ rows)
    values = inverse @ rows.T @ found
    spread = float(np.sqrt(np.sum((found - rows @ values) ** 2) / degrees))
    half = t_quantile(float(degrees)) * spread * np.sqrt(np.diag(inverse))
    mean = float(values[0])
    effects = {"trend": float(values[1]) / mean, "trend_half": float(half[1]) / mean, "scatter": spread / mean}
    way = {"difference": 2.0 * float(values[2]), "difference_half": 2.0 * float(half[2])} if both else {}
    return effects | way


def _influence(found: Array, heading: Array) -> list[tuple[float, float] | None]:
    """For each run, change of the mean without it and half the 95 % interval of that mean, relative to the full mean.

    The mean weights both directions equally, so that an additional run in one of them does not shift it.
    """
    shifts: list[tuple[float, float] | None] = []
    ways = [heading == way for way in np.unique(heading)]
    mean = float(np.mean([found[way].mean() for way in ways]))
    for i in range(found.size):
        groups = [found[way & (np.arange(found.size) != i)] for way in ways]
        degrees = sum(g.size - 1 for g in groups)
        if any(g.size == 0 for g in groups) or degrees < 1:
            shifts.append(None)
            continue
        squares = sum(float(np.sum((g - g.mean()) ** 2)) for g in groups)
        error = np.sqrt(squares / degrees * sum(1.0 / g.size for g in groups)) / len(groups)
        shift = float(np.mean([g.mean() for g in groups])) - mean
        shifts.append((shift / mean, t_quantile(float(degrees)) * float(error) / mean))
    return shifts


def _collinear(heading: Array, order: Array) -> bool:
    """Whether a trend over the runs has more than half of its variance in common with their directions."""
    return bool(np.ptp(heading) > 0 and np.ptp(order) > 0 and np.corrcoef(heading, order)[0, 1] ** 2 > 0.5)


def _sentences(b: CoastBalance, stepped: bool, mixed: bool) -> Iterator[str]:
    """Sentences on balance, order, warm-up and wind.

    ``stepped``: the trend is a step from one run to the next. ``mixed``: it is collinear with the directions.
    """
    yield from _on_directions(b, mixed)
    if b.trend is not None and b.trend_half is not None:
        text = (
            f"from the first to the last run the deceleration changes by {100 * b.trend:+.1f} % +- "
            f"{100 * b.trend_half:.1f} %"
        )
        warm = " (tires still warming up: drive longer before the first run)" if b.trend < 0 else " (wind or load)"
        cause = " (a step: see the notes on the runs)" if stepped else warm
        yield text + (cause if abs(b.trend) > b.trend_half else ", not significant")
    if b.difference is not None and b.difference_half is not None:
        slope = 100.0 * b.difference / (2.0 * GRAVITY)
        sure = abs(b.difference) > b.difference_half
        text = f"mean deceleration out minus back: {b.difference:+.4f} +- {b.difference_half:.4f} m/s^2"
        yield text + (f": a wind, or a slope of {slope:+.2f} %" if sure else ": no significant wind or slope")
    if b.scatter is not None:
        yield f"runs of one direction scatter by {100 * b.scatter:.1f} % of the mean deceleration"
    winds = [(r.wind_mean, r.run) for r in b.runs if r.wind_mean is not None]
    if winds:
        strongest, run = max(winds, key=lambda wind: abs(wind[0]))
        yield f"strongest mean wind {strongest:+.1f} m/s along the road ({run})"
    else:
        yield "wind is not measured: only the scatter and the directions of the runs show it"


def _on_directions(b: CoastBalance, mixed: bool) -> Iterator[str]:
    """Sentences on the numbers of runs in both directions, their pairs, and their order."""
    if not b.out and not b.back:
        what = "no run states its direction: a wind or a slope is collinear with resistance"
        yield f"{what}; add 'direction: out' or 'back' to each run"
    else:
        fewer = "out" if b.out < b.back else "back"
        more = f"; drive {abs(b.out - b.back)} more {fewer}" if b.out != b.back else ""
        yield f"usable runs: {b.out} out, {b.back} back; pairs: {b.pairs}{more}"
    if b.unpaired:
        yield f"without a run in the opposite direction: {', '.join(b.unpaired)}"
    if mixed:
        what = "directions do not alternate: a change of wind or tires is collinear with a slope"
        yield f"{what}; drive out and back in turn"
