"""Numbers rounded according to their uncertainty, and lists of names."""

from __future__ import annotations

import math

import pytest

from vdyn_cli.quantities.number_text import decimals, listed, magnitude, number, two_digits


@pytest.mark.parametrize(
    ("value", "digits", "power"), [(9.94, 2, 0), (9.97, 2, 1), (-0.0312, 2, -2), (0.0996, 2, -1), (0.0, 2, 0)]
)
def test_magnitude_is_that_of_the_rounded_number(value: float, digits: int, power: int) -> None:
    assert magnitude(value, digits) == power


@pytest.mark.parametrize(("uncertainty", "places"), [(0.0123, 3), (0.0996, 2), (9.97, 0), (41.0, 0), (1e-12, 8)])
def test_decimals_show_two_digits_of_the_uncertainty(uncertainty: float, places: int) -> None:
    assert decimals(uncertainty) == places


@pytest.mark.parametrize("uncertainty", [0.0, -1.0, math.nan, math.inf])
def test_without_an_uncertainty_all_decimals_are_shown(uncertainty: float) -> None:
    assert decimals(uncertainty, 5) == 5


def test_a_value_has_the_decimals_of_its_half_width() -> None:
    assert number(0.012345, 0.0021) == "0.0123"
    assert number(9.96, 0.0996) == "9.96"
    assert number(12.3456789, math.nan) == "12.346"
    assert two_digits(0.0996) == "0.10"
    assert two_digits(0.0) == "0"


def test_lists() -> None:
    assert [listed(list(n)) for n in ("a", "ab", "abc")] == ["a", "a and b", "a, b and c"]
    assert listed(["a", "b", "c"], "or") == "a, b or c"
