"""Numbers, units and names on a page."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.report import typography
from vdyn_cli.report.typography import RoundedEstimate


@pytest.mark.parametrize(
    ("value", "low", "high", "expected"),
    [
        (0.010123, 0.00989, 0.01035, RoundedEstimate("0.01012", "0.00023", "0.00023", "0.00989", "0.01035")),
        (41_234.5, 40_900, 41_569, RoundedEstimate("41230", "330", "330", "40900", "41570")),
        (1588.0, 1588.0, 1588.0, RoundedEstimate("1588")),
        (2.7, math.nan, math.nan, RoundedEstimate("2.7")),
        (0.61, 0.55, 0.72, RoundedEstimate("0.610", "0.110", "0.060", "0.550", "0.720")),
        (-3e-6, -4e-6, -2e-6, RoundedEstimate("−3.0", "1.0", "1.0", "−4.0", "−2.0", -6)),
        (7.93e10, 7.9e10, 7.96e10, RoundedEstimate("7.930", "0.030", "0.030", "7.900", "7.960", 10)),
        (0.0, -1.0, 1.0, RoundedEstimate("0.0", "1.0", "1.0", "−1.0", "1.0")),
        (-0.001, -1.0, 1.0, RoundedEstimate("0.0", "1.0", "1.0", "−1.0", "1.0")),
        (0.0, -6e-6, 0.592, RoundedEstimate("0.000", "0.592", "0.000", "0.000", "0.592")),
        (5.0, -math.inf, 7.0, RoundedEstimate("5.0", "2.0", "–", "–", "7.0")),
        (9.97, 9.97 - 0.996, 9.97 + 0.996, RoundedEstimate("10.0", "1.0", "1.0", "9.0", "11.0")),
        (math.nan, 0.0, 1.0, RoundedEstimate("–")),
    ],
)
def test_digits_follow_the_interval(value: float, low: float, high: float, expected: RoundedEstimate) -> None:
    assert typography.rounded(value, low, high) == expected


@given(st.floats(allow_nan=True), st.floats(allow_nan=True), st.floats(allow_nan=True))
def test_any_three_numbers_can_be_written(value: float, low: float, high: float) -> None:
    rounded = typography.rounded(value, low, high)
    assert rounded.value
    assert len(rounded.value) < 30
    assert "nan" not in f"{rounded}"
    assert typography.relative(value, low, high)


@given(st.floats(min_value=1e-4, max_value=1e6), st.floats(min_value=1e-3, max_value=0.5))
def test_written_interval_is_the_given_one(value: float, share: float) -> None:
    half = share * value
    rounded = typography.rounded(value, value - half, value + half)
    assert float(rounded.plus) == pytest.approx(half, rel=0.06)
    assert abs(float(rounded.value) - value) <= 0.06 * half


@pytest.mark.parametrize(
    ("written", "shown"),
    [
        ("kg m^2", "kg·m²"),
        ("N s^2/m^2", "N·s²/m²"),
        ("N m s/rad", "N·m·s/rad"),
        ("m/s**2", "m/s²"),
        ("m s^-2", "m·s⁻²"),
        ("degC", "°C"),
        ("1/s", "1/s"),
        ("%", "%"),
        ("", ""),
    ],
)
def test_units(written: str, shown: str) -> None:
    assert typography.unit(written) == shown


@pytest.mark.parametrize(
    ("symbol", "parts"),
    [
        ("Cd A", (("C", "d"), ("A", ""))),
        ("frr", (("f", "rr"),)),
        ("F0", (("F", "0"),)),
        ("BCD", (("BCD", ""),)),
        ("sigma", (("σ", ""),)),
        ("", ()),
    ],
)
def test_symbols(symbol: str, parts: tuple[tuple[str, str], ...]) -> None:
    assert typography.symbol(symbol) == parts


def test_prose_sets_signs_but_leaves_names_and_ranges_alone() -> None:
    text = typography.prose(
        "A headwind of 2.9 +- 0.1 m/s, -3 N, 0.5 m^2, doi 10.4271/2017-01-1574, runs 2-3, coast_2-a"
    )
    assert text.replace("\N{NO-BREAK SPACE}", " ") == (
        "A headwind of 2.9 ± 0.1 m/s, −3 N, 0.5 m², doi 10.4271/2017-01-1574, runs 2-3, coast_2-a"
    )
    assert "2.9\N{NO-BREAK SPACE}± 0.1\N{NO-BREAK SPACE}m/s" in text


@given(st.text())
def test_any_text_becomes_writable(text: str) -> None:
    typography.prose(text + "\ud800\x00").encode("utf-8")


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (-3.0, "−3"), (7.4, "7.4"), (0.5, "0.5"), (100.0, "100"), (0.0, "0"), (math.inf, "–"),
        (1.5e-9, "1.5 × 10⁻⁹"),
    ],
)  # fmt: skip
def test_numbers_without_zeros_at_their_end(value: float, shown: str) -> None:
    assert typography.shortest(value).replace(typography.NARROW, " ") == shown


@pytest.mark.parametrize(
    ("path", "name"),
    [
        ("../sample_logs/coast_1.csv", "coast_1"),
        ("C:\\logs\\coast 1.CSV.gz", "coast 1"),
        ("coast_1 out", "coast_1 out"),
        ("out/back", "out/back"),
        ("logs/report.csv (12)", "report (12)"),
        ("../a/run 3.vbo", "run 3"),
        ("../a/ride_1.json", "ride_1"),
        ("app/recording 2/Location.csv", "recording 2/Location"),
        ("/logs/TripA12.csv.gz, 339 to 468 s", "TripA12, 339 to 468 s"),
    ],
)
def test_runs_are_called_by_their_file(path: str, name: str) -> None:
    assert typography.run_name(path) == name


def test_shortened_keeps_both_ends() -> None:
    assert typography.shortened("run_coast_out_3_cold", 10) == "run_…_cold"
    assert typography.shortened("short", 10) == "short"


def test_terminal_line_of_an_estimate() -> None:
    estimate = Estimate.of("drag_area", 0.5602, 0.006, (0.547, 0.5734), "coastdown")
    assert typography.estimate_text(estimate) == "0.560 ± 0.013 m²  (2.4 %)"
    given = Estimate.of("mass", 1588.0, 0.0, (1588.0, 1588.0), "given")
    assert typography.estimate_text(given) == "1588 kg"
