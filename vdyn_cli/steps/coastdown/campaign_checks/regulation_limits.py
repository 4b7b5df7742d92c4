"""Limits of the regulations on coast-downs, each with its clause, compared with a test day.

Sources: SAE J1263 (test conditions); SAE J2263 (scope); UN Regulation 83, Annex 4a, Appendix 7, paragraphs 2, 3.1, 3.3
and 5.1; UN GTR 15 (WLTP), Annex 4, paragraphs 4.1.1 to 4.1.2 and 4.3.1.4. Limits on quantities that no log contains are
listed as not checked.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from vdyn_cli.quantities.check_schema import Outcome, RegulationLimit, TimeAccuracy
from vdyn_cli.quantities.constants import ZERO_CELSIUS
from vdyn_cli.steps.coastdown.campaign_checks.coast_times import R83_LIMIT, R83_PAIRS, WLTP_LIMIT, WLTP_PAIRS
from vdyn_cli.steps.coastdown.spec import WIND_LIMIT

J1263, J2263, R83, WLTP = "SAE J1263", "SAE J2263", "UN R83", "WLTP (UN GTR 15)"
REFERENCE_DENSITY = 100_000.0 / (287.05 * 293.2)  # kg/m^3, dry air of 100 kPa and 293.2 K: UN R83


@dataclass(frozen=True)
class TestDay:
    """Conditions and runs of a coast-down campaign, as far as they are known.

    Parameters
    ----------
    temperatures : K, of the day or of each run. density : kg/m^3. wind : (mean, peak) of each run along the road,
        m/s; the peak is None where only the mean is stated.
    pairs : number of usable ones. speeds : m/s, highest and lowest that all usable runs pass. accuracy : of the times.
    across : mean crosswind of each run, m/s; empty unless it is known for every run.
    """

    temperatures: tuple[float, ...]
    density: float | None
    wind: tuple[tuple[float, float | None], ...]
    pairs: int
    speeds: tuple[float, float] | None
    accuracy: Sequence[TimeAccuracy]
    across: tuple[float, ...] = ()


def regulation_limits(day: TestDay) -> list[RegulationLimit]:
    """One row for each implemented limit of SAE J1263, SAE J2263, Regulation 83 and WLTP: met, not met, or not checked.

    A limit that is not checked has the missing quantity as reason.
    """
    return [*_temperature(day), *_wind(day), *_runs(day), *_speeds(day), *_accuracy(day), *_road()]


def _row(regulation: str, clause: str, limit: str, found: str, met: bool | None) -> RegulationLimit:
    outcome: Outcome = "not checked" if met is None else "met" if met else "not met"
    return RegulationLimit(regulation=regulation, clause=clause, limit=limit, found=found, outcome=outcome)


def _temperature(day: TestDay) -> Iterator[RegulationLimit]:
    celsius = [t - ZERO_CELSIUS for t in day.temperatures]
    found = "no temperature: give environment.temperature"
    if celsius:
        found = f"{min(celsius):.1f} degC" + (f" to {max(celsius):.1f} degC" if max(celsius) > min(celsius) else "")
    for regulation, clause, low, high in (
        (J1263, "test conditions, temperature", 5.0, 35.0),
        (WLTP, "Annex 4, 4.1.1.2", 5.0, 40.0),
    ):
        met = low <= min(celsius) and max(celsius) <= high if celsius else None
        yield _row(regulation, clause, f"air at {low:g} to {high:g} degC", found, met)
    off = None if day.density is None else day.density / REFERENCE_DENSITY - 1.0
    found = "no temperature and pressure: give both in environment" if off is None else f"{100.0 * off:+.1f} %"
    limit = "air density within 7.5 % of that at 100 kPa and 293.2 K"
    yield _row(R83, "Annex 4a, Appendix 7, 3.3", limit, found, None if off is None else abs(off) <= 0.075)


def _wind(day: TestDay) -> Iterator[RegulationLimit]:
    """Limits of the wind; a wind known only along the road can show that a limit is exceeded, not that it is met."""
    along = [abs(m) for m, _ in day.wind]
    both_parts = 0 < len(day.across) == len(along)
    highest = max(map(math.hypot, along, day.across) if both_parts else along, default=None)
    mean = ("mean wind", highest, "" if both_parts else " along the road")
    peak = ("peaks of the wind", max((p for _, p in day.wind if p is not None), default=None), " along the road")
    missing = "no wind measured: log wind_speed, or give 'wind_speed' of each run"
    missing = "only means are stated" if day.wind else missing
    for regulation, clause, (what, value, part), limit in (
        (J1263, "test conditions, wind", mean, WIND_LIMIT),
        (R83, "Annex 4a, Appendix 7, 3.1", mean, 3.0),
        (R83, "Annex 4a, Appendix 7, 3.1", peak, 5.0),
        (WLTP, "Annex 4, 4.1.1.1 (stationary anemometer)", mean, 5.0),
        (WLTP, "Annex 4, 4.1.1.1 (stationary anemometer)", peak, 8.0),
    ):
        found = missing if value is None else f"{value:.1f} m/s{part}"
        met = None if value is None else value < limit
        if met and part:
            found, met = f"{found}; the crosswind is not measured", None
        yield _row(regulation, clause, f"{what} below {limit:.3g} m/s", found, met)
    across = max(day.across, default=None)
    for regulation, clause, what, limit in (
        (J1263, "test conditions, wind", "mean crosswind below 2.2 m/s (8 km/h)", 8.0 / 3.6),
        (R83, "Annex 4a, Appendix 7, 3.1", "wind across the road below 2 m/s", 2.0),
        (WLTP, "Annex 4, 4.1.1.1", "wind across the road below 2 m/s", 2.0),
    ):
        found = "not stated: give 'crosswind' of each run" if across is None else f"{across:.1f} m/s, mean of a run"
        yield _row(regulation, clause, what, found, None if across is None else across < limit)
    yield _row(J2263, "", "wind, measured on board", "the wind limits of this standard are not implemented", None)


def _runs(day: TestDay) -> Iterator[RegulationLimit]:
    for regulation, clause, least in (
        (R83, "Annex 4a, Appendix 7, 5.1", R83_PAIRS),
        (WLTP, "Annex 4, 4.3.1.4", WLTP_PAIRS),
    ):
        limit = f"at least {least} pairs of opposite runs"
        yield _row(
            regulation, clause, limit, f"{day.pairs} usable pair{'' if day.pairs == 1 else 's'}", day.pairs >= least
        )
    yield _row(J1263, "", "number of runs", "the required number is not implemented", None)
    yield _row(J2263, "", "number of runs", "the required number is not implemented", None)


def _speeds(day: TestDay) -> Iterator[RegulationLimit]:
    found, met = "no speed that all usable runs pass", None
    if day.speeds is not None:
        fast, slow = (3.6 * v for v in day.speeds)
        found, met = f"{fast:.0f} to {slow:.0f} km/h", fast >= 115.0 and slow <= 15.0
    yield _row(J2263, "scope", "speeds from 115 to 15 km/h", found, met)
    why = "it depends on the vehicle's class and cycle"
    yield _row(WLTP, "Annex 4, 4.3.1.4", "speeds of the vehicle's cycle", why, None)


def _accuracy(day: TestDay) -> Iterator[RegulationLimit]:
    for regulation, clause, limit, values, least in (
        (R83, "Annex 4a, Appendix 7, 5.1", R83_LIMIT, [(t.speed, t.r83) for t in day.accuracy], R83_PAIRS),
        (WLTP, "Annex 4, 4.3.1.4", WLTP_LIMIT, [(t.speed, t.wltp) for t in day.accuracy], WLTP_PAIRS),
    ):
        text = f"statistical accuracy p at most {100 * limit:.0f} % at every speed"
        known = [(p, v) for v, p in values if p is not None]
        if not known:
            yield _row(regulation, clause, text, f"fewer than {least} pairs, or no common speeds", None)
            continue
        worst, speed = max(known)
        over = [f"{v:.0f}" for p, v in known if p > limit]
        found = f"p = {100 * worst:.1f} % at {speed:.0f} km/h" + (f"; above at {', '.join(over)} km/h" if over else "")
        yield _row(regulation, clause, text, found, not over)


def _road() -> Iterator[RegulationLimit]:
    why = "the slope of the road is not measured: survey it"
    yield _row(J1263, "test conditions, road", "slope below 0.5 %", why, None)
    yield _row(R83, "Annex 4a, Appendix 7, 2", "slope at most 1.5 %, constant within 0.1 %", why, None)
    yield _row(WLTP, "Annex 4, 4.1.2", "slope at most 1 %", why, None)
