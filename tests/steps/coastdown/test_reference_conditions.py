"""Road load in the units of dynamometers, there and back, and corrected to reference conditions."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vdyn_cli.physics.laws.atmosphere import air_density
from vdyn_cli.steps.coastdown.fit.reference_conditions import (
    Conditions,
    RoadLoad,
    corrected_load,
    road_load_of,
)

COEFFICIENT = st.floats(-500, 500).filter(lambda x: x == 0 or abs(x) > 1e-6)
TARGETS = ("Target Coef A (lbf)", "Target Coef B (lbf/mph)", "Target Coef C (lbf/mph**2)")
LBF, MPH = 4.4482216152605, 0.44704  # N, m/s


def from_epa(a: float, b: float, c: float) -> RoadLoad:
    """The load of A lbf, B lbf/mph, C lbf/mph^2."""
    return RoadLoad(a * LBF, b * LBF / MPH, c * LBF / MPH**2)


def from_dyno(f0: float, f1: float, f2: float) -> RoadLoad:
    """The load of F0 N, F1 N/(km/h), F2 N/(km/h)^2."""
    return RoadLoad(f0, f1 * 3.6, f2 * 3.6**2)


def in_epa(load: RoadLoad) -> tuple[float, ...]:
    """A lbf, B lbf/mph, C lbf/mph^2."""
    return tuple(value for value, _ in load.published().values())[3:]


def in_dyno(load: RoadLoad) -> tuple[float, ...]:
    """F0 N, F1 N/(km/h), F2 N/(km/h)^2."""
    return tuple(value for value, _ in load.published().values())[:3]


@given(COEFFICIENT, COEFFICIENT, COEFFICIENT)
def test_units_convert_there_and_back(a: float, b: float, c: float) -> None:
    assert in_epa(from_epa(a, b, c)) == pytest.approx((a, b, c), rel=4e-16)
    assert in_epa(from_dyno(*in_dyno(from_epa(a, b, c)))) == pytest.approx((a, b, c), rel=1e-15)


def test_the_papers_car_in_every_unit() -> None:
    load = from_epa(22.883, -0.15919, 0.020143)
    assert load.coefficients == pytest.approx([101.79, -1.584, 0.44835], rel=1e-4)
    f0, f1, f2 = in_dyno(load)
    v = 60.0
    assert f0 + f1 * v + f2 * v**2 == pytest.approx(float(load.force(v / 3.6)))
    mph = v / 1.609344
    assert 22.883 - 0.15919 * mph + 0.020143 * mph**2 == pytest.approx(float(load.force(v / 3.6)) / 4.4482216, rel=1e-7)


def test_every_car_of_the_epa_list_converts_exactly(shared_data: Path) -> None:
    """As many digits as the list prints, there and back through SI and through N and km/h."""
    with (shared_data / "epa_testcar" / "testcar_2012_2016_subset.csv").open(encoding="utf-8") as file:
        rows = [tuple(row[t] for t in TARGETS) for row in csv.DictReader(file)]
    assert len(rows) > 100
    checked = 0
    for texts in rows:
        if not all(texts):
            continue
        printed = tuple(float(t) for t in texts)
        load = from_epa(*printed)
        for back in (in_epa(load), in_epa(from_dyno(*in_dyno(load)))):
            assert [round(x, 12) for x in back] == [round(x, 12) for x in printed]
        checked += 1
    assert checked > 100


TEST_DAY = Conditions(297.15, 1.1595, 1588.0)


def test_the_correction_takes_each_part_with_its_own_law() -> None:
    load = RoadLoad(148.0, 1.0, 0.317, np.diag([4.0, 0.01, 1e-4]), 10.0)
    reference = Conditions(293.15, air_density(293.15, 100_000.0), 1500.0)
    found = corrected_load(load, TEST_DAY, reference)
    warm = 1 + 8.6e-3 * 4
    assert found.f0 == pytest.approx(148.0 * 1500 / 1588 * warm)
    assert found.f1 == pytest.approx(warm)
    assert found.f2 == pytest.approx(0.317 * reference.air_density / 1.1595)
    assert found.covariance[0, 0] == pytest.approx(4.0 * (1500 / 1588 * warm) ** 2)


def test_nothing_to_correct_changes_nothing() -> None:
    load = RoadLoad(148.0, 1.0, 0.317)
    assert np.array_equal(corrected_load(load, TEST_DAY, TEST_DAY).coefficients, load.coefficients)


def test_the_standards_factor_is_the_ratio_of_densities() -> None:
    """K2 = (T/293)(100 kPa/p) of the standards."""
    by_standard = (297.15 / 293.15) * (100.0 / 98.9)
    assert air_density(293.15, 100_000.0) / air_density(297.15, 98_900.0) == pytest.approx(by_standard, rel=1e-12)


def test_the_interval_of_a_force_knows_that_its_parts_oppose() -> None:
    at = {"rolling_resistance": 0.01, "rolling_speed": 0.0, "drag_area": 0.6, "mass": 1500.0, "air_density": 1.2}
    names = ("rolling_resistance", "drag_area")
    std = np.array([2e-4, 0.02])
    apart, together = (
        road_load_of(at, names, np.outer(std, std) * np.array([[1, r], [r, 1]]), 7.0) for r in (0.0, -0.9)
    )
    assert together.half_width(15.0)[0] < 0.5 * apart.half_width(15.0)[0]
    assert np.diff(together.intervals(), axis=0) == pytest.approx(np.diff(apart.intervals(), axis=0))
    slope = 1500 * 9.80665
    assert np.diff(apart.intervals(), axis=0)[0, 0] == pytest.approx(2 * 2.3646 * slope * 2e-4, rel=1e-4)
    document = apart.document()
    assert document["F0_N"] == pytest.approx(0.01 * slope)
    assert document["A_lbf_interval95"][0] < document["A_lbf"] < document["A_lbf_interval95"][1]  # type: ignore[index, operator]
