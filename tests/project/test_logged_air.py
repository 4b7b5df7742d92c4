"""A car's outside temperature and its barometer fill the description's environment; other sensors do not."""

from __future__ import annotations

import pytest

from vdyn_cli.io.channel_survey import ChannelFacts
from vdyn_cli.io.reader import ChannelInfo
from vdyn_cli.project.drafting.logged_air import logged_pressure, logged_temperature


def channel(name: str, unit: str, lowest: float, highest: float) -> ChannelFacts:
    return ChannelFacts(ChannelInfo(name, unit, 10.0, (0.0, 60.0)), name, "varies", 600, lowest, highest)


def test_the_middle_of_all_logs_with_half_their_range() -> None:
    logs = [
        [channel("Ambient Temperature [°C]", "°C", 22.0, 28.0)],
        [channel("Ambient Temperature [°C]", "°C", 25.0, 30.0)],
    ]
    ((name, text),) = logged_temperature(logs)
    assert (name, text.split("  #")[0]) == ("temperature", "26 +- 4 degC")


def test_fahrenheit_is_converted() -> None:
    ((_, text),) = logged_temperature([[channel("outside_temp", "F", 68.0, 68.0)]])
    assert text.startswith("20 +- 2 degC")


@pytest.mark.parametrize(
    "name",
    ["Lufttemp [°C]", "T_Luft", "Temp außen", "Température ambiante", "AmbT_degC", "TAmb_C", "AMB_AmbientAirTemp"],
)
def test_names_of_other_loggers_and_languages_are_known(name: str) -> None:
    unit = "" if name.endswith(("_C", "_degC")) else "°C"
    ((_, text),) = logged_temperature([[channel(name, unit, 18.0, 19.0)]])
    assert text.startswith("18 +- 2 degC")


@pytest.mark.parametrize(
    "facts",
    [
        channel("Battery Temperature", "°C", 20.0, 22.0),
        channel("Ansauglufttemperatur", "°C", 20.0, 22.0),
        channel("Ambient Temperature Cabin", "°C", 20.0, 22.0),
        channel("Ambient Temperature", "", 20.0, 22.0),
        channel("Ambient Temperature", "°C", -60.0, 20.0),
    ],
    ids=["battery", "intake", "cabin", "no unit", "not connected"],
)
def test_what_is_not_the_air_is_left_to_the_user(facts: ChannelFacts) -> None:
    assert logged_temperature([[facts]]) == ()


def test_a_log_without_it_leaves_the_key_to_the_user() -> None:
    assert logged_temperature([[channel("ambient temp", "degC", 20.0, 21.0)], []]) == ()


@pytest.mark.parametrize(
    ("name", "unit", "value"),
    [
        ("Barometric pressure (from vehicle)(kpa)", "", 97.0),
        ("Luftdruck", "hPa", 970.0),
        ("pEnv", "mbar", 970.0),
        ("Baro [inHg]", "inHg", 28.6442),
        ("AMB.BarometricPressure", "", 97.0),
    ],
)
def test_a_barometer_gives_the_pressure_in_any_unit(name: str, unit: str, value: float) -> None:
    ((key, text),) = logged_pressure([[channel(name, unit, value, value)]])
    assert (key, text.split("  #")[0]) == ("pressure", "97.0 +- 0.5 kPa")


@pytest.mark.parametrize(
    "facts",
    [
        channel("Intake Manifold Pressure", "kPa", 97.0, 97.0),
        channel("Baro altitude", "", 700.0, 800.0),
        channel("Barometer sea level", "hPa", 1013.0, 1014.0),
        channel("Barometric pressure", "kPa", 0.0, 97.0),
    ],
    ids=["manifold", "altitude", "reduced to sea level", "not connected"],
)
def test_other_pressures_are_left_to_the_user(facts: ChannelFacts) -> None:
    assert logged_pressure([[facts]]) == ()
