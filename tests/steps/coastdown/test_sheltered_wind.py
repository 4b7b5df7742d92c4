"""A wind that is weaker at one end of the track is in the intervals, as large as it acts on coasts both ways."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.messy_cases import prepared
from tests.plant import messy_day
from vdyn_cli.steps.coastdown.doubts.sheltered_wind import DIFFERENCE, sheltered_wind_finding, sheltered_wind_shift
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit, fit_road_load

DAY = messy_day.Day(rms=0.0, upper=25.0, lower=5.0, runs=4)


@pytest.fixture(scope="module")
def calm() -> RoadLoadFit:
    return fit_road_load(prepared(messy_day.drive(16, DAY), False).problem.campaign_on_road)  # type: ignore[attr-defined]


def in_wind(fit: RoadLoadFit, wind: float) -> RoadLoadFit:
    """The fit with this mean wind, m/s, in its noise."""
    noise = replace(fit.rows.noise, sizes={**fit.sizes, "run_wind": wind})
    return replace(fit, regression=replace(fit.regression, rows=replace(fit.rows, noise=noise)))


def deceleration_fit(fit: RoadLoadFit, wind: tuple[float, float]) -> np.ndarray:
    """Rolling resistance and drag area by the decelerations of a coast out and one back, in small steps.

    ``wind``: against the way out, m/s, in its first and in its second half.
    """
    at, length, found = fit.at, float(np.mean([r.distance[-1] for r in fit.campaign.runs])), []
    for heading in (1.0, -1.0):
        speed, place = DAY.upper, 0.0 if heading > 0 else length
        while speed > DAY.lower:
            flow = speed + heading * wind[0 if place < length / 2 else 1]
            force = at["mass"] * 9.80665 * at["rolling_resistance"]
            force += 0.5 * at["air_density"] * at["drag_area"] * flow * abs(flow)
            found.append((speed, force))
            speed, place = speed - 0.1 * force / fit.inertia, place + 0.1 * heading * speed
    seen = np.array(found)
    columns = np.column_stack([np.full(len(seen), at["mass"] * 9.80665), 0.5 * at["air_density"] * seen[:, 0] ** 2])
    return np.asarray(np.linalg.lstsq(columns, seen[:, 1], rcond=None)[0])


def test_the_shift_is_that_of_coasts_in_such_a_wind(calm: RoadLoadFit) -> None:
    wind = 3.0
    shift = sheltered_wind_shift(in_wind(calm, wind))
    even, uneven = (deceleration_fit(calm, (wind * (1 + e), wind * (1 - e))) for e in (0.0, DIFFERENCE))
    rolling, drag = uneven - even
    assert shift["drag_area"] == pytest.approx(drag, rel=0.25)
    assert shift["rolling_resistance"] == pytest.approx(rolling, rel=0.25)
    (found,) = sheltered_wind_finding(in_wind(calm, wind), shift)
    assert "a wind of 3.0 m/s along the track that is stronger at one end" in found.what


def test_a_calm_day_has_none(calm: RoadLoadFit) -> None:
    still = in_wind(calm, 0.0)
    assert not sheltered_wind_finding(still, sheltered_wind_shift(still))
    assert sheltered_wind_shift(still)["drag_area"] == pytest.approx(0.0, abs=1e-9)
