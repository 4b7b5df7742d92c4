"""Conversion of units: spellings of test benches, offsets, dimensions, refusals."""

from __future__ import annotations

import contextlib
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vdyn_cli.quantities.common_units import _FACTORS, _SAME, common_factor
from vdyn_cli.quantities.quantity import UnitError, _read_scale, from_si, parse, to_si
from vdyn_cli.quantities.unit_grammar import why_no_unit


@pytest.mark.parametrize(
    ("text", "si_unit", "value", "std"),
    [
        ("70 km/h", "m/s", 70 / 3.6, 0),
        ("24 degC", "K", 297.15, 0),
        ("98.9 kPa", "Pa", 98_900, 0),
        ("1.2 Nm", "N m", 1.2, 0),
        ("3 kNm", "N m", 3_000, 0),
        ("1.25 kgm2", "kg m^2", 1.25, 0),
        ("1588 +- 5 kg", "kg", 1588, 5),
        ("308 ± 0.5 mm", "m", 0.308, 0.0005),
        ("20 +- 1 degC", "K", 293.15, 1),
        ("2650 kg +- 1 %", "kg", 2650, 26.5),
        ("308 mm +- 1 mm", "m", 0.308, 0.001),
        ("0.31 m +- 1 mm", "m", 0.31, 0.001),
        ("20 degC +- 1", "K", 293.15, 1),
        ("84.2 %", "", 0.842, 0),
        ("0.5 g", "m/s^2", 4.903325, 0),
        ("0.05 m²", "m^2", 0.05, 0),
        ("1 deg", "rad", np.pi / 180, 0),
        ("1e-3", "s", 1e-3, 0),
        (3, "s", 3, 0),
    ],
)
def test_quantities_become_si(text: str | float, si_unit: str, value: float, std: float) -> None:
    given_ = parse(text, si_unit)
    assert given_.value == pytest.approx(value, rel=1e-12)
    assert given_.std == pytest.approx(std, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "si_unit", "says"),
    [
        ("3 kg", "m", "not a unit of length"),
        ("3 bananas", "m", "'bananas' is not a unit"),
        ("3420 N", "kg", "'N' is not a unit of mass"),
        ("99 kPa", "m/s", "'kPa' is not a unit of speed"),
        ("1,5 m", "m", "has a decimal comma: write 1.5 m"),
        ("2,650 kg", "kg", "has a comma: write 2650 kg, or 2.650 kg if it is a decimal comma"),
        ("308 mm +- 1 kg", "m", "not a unit of length"),
        ("fast", "m/s", "not a number with a unit"),
        ("1 m**9**9**9**9", "m", "not a unit"),
        ("1 m^99999999", "m", "not a unit"),
        ("1 " + "m" * 60, "m", "not a unit"),
        ("", "m", "not a number"),
        ("9**(9**9) m", "m", "not a unit"),
        ("1 9**(9**9)", "m", "not a unit"),
        ("1 ((m**9)**9)**9", "m", "not a unit"),
        ("1 9⁹⁹⁹⁹⁹⁹⁹", "m", "not a unit"),
        ("1 m* *99", "m", "not a unit"),
        ("1 m+m", "m", "not a unit"),
        ("1.5 ton", "kg", "ambiguous: write t or kg"),
        ("1588 +- -2 kg", "kg", "has a negative standard deviation: write 1588 \\+- 2 kg"),
        ("1588 kg +- -0.3 %", "kg", "has a negative standard deviation: write 1588 kg \\+- 0.3 %"),
        ("1 +- 1e999 m", "m", "not a finite number"),
        ("1e999 m", "m", "not a finite number"),
        (float("inf"), "m", "not a finite number"),
        (float("nan"), "m", "not a finite number"),
        (10**400, "m", "not a finite number"),
        pytest.param("9" * 1_000_000, "m", "not a number with a unit", id="a million digits"),
        pytest.param("1" + " " * 1_000_000 + "m", "m", "not a number with a unit", id="a million blanks"),
    ],
)
def test_refusals_say_why(text: str, si_unit: str, says: str) -> None:
    with pytest.raises(UnitError, match=says):
        parse(text, si_unit)


@pytest.mark.parametrize(
    "unit",
    [
        "kg m^2",
        "N s^2/m^2",
        "m²",
        "m s⁻²",
        "(m/s)**2",
        "m**(-2)",
        "N·m",
        "°C",
        "%",
        "1/min",
        "kWh/km",
        "s^0.5",
        "short_ton",
        "",
    ],
)
def test_units_as_people_write_them_stay_units(unit: str) -> None:
    assert why_no_unit(unit) == ""


def test_gram_stays_a_gram_where_mass_is_meant() -> None:
    assert parse("500 g", "kg").value == pytest.approx(0.5)


def test_same_unit_is_exact() -> None:
    values = np.array([0.1, 0.2, 0.3])
    assert to_si(values, "m/s", "m/s") is values


@given(st.floats(-1e6, 1e6), st.sampled_from([("km/h", "m/s"), ("degC", "K"), ("lbf", "N"), ("rpm", "rad/s")]))
def test_there_and_back(value: float, units: tuple[str, str]) -> None:
    assert from_si(to_si(value, *units), *units) == pytest.approx(value, rel=1e-9, abs=1e-9)


@settings(max_examples=40)  # each unknown word costs a search of the unit library
@given(st.text(max_size=30))
def test_any_text_is_read_or_refused(text: str) -> None:
    with contextlib.suppress(UnitError):
        parse(text, "m/s")


@pytest.mark.parametrize("pair", [*((u, u) for u in sorted(_SAME)), *_FACTORS])
def test_listed_factors_are_those_of_the_unit_library(pair):
    # The library's foot is one rounding off.
    assert common_factor(*pair) == pytest.approx(_read_scale(*pair), rel=1e-15, abs=0.0)


def test_listed_units_need_no_unit_library():
    uses = "from vdyn_cli.quantities.quantity import parse; parse('70 km/h', 'm/s')"
    script = f"import sys; {uses}; print('pint' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.parametrize(
    ("written", "si", "factor"), [("m/s2", "m/s^2", 1.0), ("mm2", "m^2", 1e-6), ("N/(m/s)2", "kg/m", 1.0)]
)
def test_a_digit_behind_a_name_is_its_power(written: str, si: str, factor: float) -> None:
    assert to_si(1.0, written, si) == pytest.approx(factor)


@pytest.mark.parametrize(
    ("written", "si", "factor"),
    [
        ("N-m", "N m", 1.0), ("N.m", "N m", 1.0), ("NM", "N m", 1.0), ("kg-m^2", "kg m^2", 1.0),
        ("ft-lb", "N m", 1.3558179483314004), ("lb-ft", "N m", 1.3558179483314004), ("lb", "N", 4.4482216152605),
        ("lb", "kg", 0.45359237), ("KN", "N", 1e3), ("RPM", "rad/s", np.pi / 30), ("r/min", "rad/s", np.pi / 30),
        ("KM/H", "m/s", 1 / 3.6), ("kmh", "m/s", 1 / 3.6), ("MPH", "m/s", 0.44704), ("SEC", "s", 1.0),
    ],
)  # fmt: skip
def test_units_as_loggers_write_them(written: str, si: str, factor: float) -> None:
    assert to_si(1.0, written, si) == pytest.approx(factor, rel=1e-12)


def test_capitals_are_no_nanometers() -> None:
    with pytest.raises(UnitError, match="nautical mile"):
        to_si(1.0, "NM", "m")


def test_a_raw_value_s_unit_has_a_factor() -> None:
    assert to_si(9000.0, "0.01 km/h", "m/s") == pytest.approx(25.0)
    assert to_si(200.0, "0.1degC", "K") == pytest.approx(293.15)
    assert to_si(2.0, "48 N m", "N m") == pytest.approx(96.0)
    with pytest.raises(UnitError):
        to_si(1.0, "0.01 0.01 km/h", "m/s")


@pytest.mark.parametrize("text", ["1588 2 kg", "1588 0.5 kg"])
def test_a_standard_deviation_without_its_sign_is_not_a_factor(text: str) -> None:
    with pytest.raises(UnitError, match=r"two numbers: if the second is a standard deviation, write '\+-' before it"):
        parse(text, "kg")
