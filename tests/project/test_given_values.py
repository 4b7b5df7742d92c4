"""Parameters stated in a description, with the uncertainty that follows from theirs."""

from __future__ import annotations

import pytest

from vdyn_cli.description.description_model import Environment
from vdyn_cli.project.reading.given_values import given_air


def density(**stated: str) -> tuple[float, float]:
    found = given_air(Environment.model_validate(stated)).estimates["air_density"]
    return found.value, found.std


def test_the_density_holds_the_uncertainty_of_the_air() -> None:
    value, std = density(temperature="300 +- 3 K", pressure="100 +- 1 kPa")
    assert value == pytest.approx(1.161, rel=1e-3)
    assert std / value == pytest.approx(2**0.5 * 0.01, rel=0.02)  # 1 % of each


def test_humidity_counts_a_little() -> None:
    value, std = density(temperature="30 degC", pressure="100 kPa", humidity="0.5 +- 0.5")
    assert std / value == pytest.approx(0.5 * 0.378 * 4246.0 / 100_000.0, rel=0.03)  # es(30 degC) = 4246 Pa


def test_exact_air_has_an_exact_density() -> None:
    assert density(temperature="24 degC", pressure="98.9 kPa")[1] == 0.0
