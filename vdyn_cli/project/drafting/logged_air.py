"""The air's temperature and pressure as the car's own sensors log them, for ``vdyn init``."""

from __future__ import annotations

import re
from collections.abc import Sequence

from vdyn_cli.io.channel_survey import ChannelFacts
from vdyn_cli.io.file_units import words_and_unit
from vdyn_cli.project.drafting.channel_names import in_english
from vdyn_cli.quantities.quantity import UnitError, from_si, to_si

# An intake, a battery or a cabin is not the air: only names that say so count, in the languages of channel_names.py.
_TEMPERATURE = frozenset(["t", "temp", "temperature", "temperatur", "temperatura", "temper", "oat"])
_OUTSIDE = frozenset(
    [
        *("amb", "ambient", "ambiant", "ambiante", "ambiental", "ambiente", "outside", "outdoor", "exterior"),
        *("external", "exterieur", "exterieure", "esterna", "umgebung", "umgebungs", "aussen", "aussenluft"),
        *("luft", "oat", "ute", "lucht", "buiten", "env"),
    ]
)
_COMPOUND = re.compile(
    r"\b((aussen|umgebungs|luft|aussenluft|ute|utendors|buiten|lucht)(?=temp)|t(?=amb|env)|amb(?=t\b))",
    re.IGNORECASE,
)
_INSIDE = re.compile(
    r"cabin|battery|intake|inlet|coolant|heat|interior|set ?point|ansaug|ladeluft|kühl|innen|reifen|öl|oil|tire|tyre",
    re.IGNORECASE,
)
_DEGREES = {"c": "degC", "degc": "degC", "celsius": "degC", "f": "degF", "degf": "degF", "k": "K"}  # ends of names
_AIR = (233.0, 328.0)  # K, beyond the weather of any test day: a sensor that is not connected
_SENSOR = 2.0  # K, a car's sensor behind the bumper, which the engine and the road warm
_BAROMETER = re.compile(
    r"baro|atmospher|atmosphär|luftdruck|luchtdruk|lufttryck|^p_?(env|amb)|(amb|ambient|outside|umgebungs?)[ ._-]*"
    r"(air[ ._-]*)?(p$|press|druck)",
    re.IGNORECASE,
)
_NOT_AIR = re.compile(r"intake|inlet|manifold|boost|sea|qnh|delta|diff|temp|alt|height|target", re.IGNORECASE)
# Units of a barometer that a name ends in, or that its values show where no unit is stated: the ranges are apart.
_PASCALS = {"kpa": 1e3, "hpa": 1e2, "mbar": 1e2, "mb": 1e2, "bar": 1e5, "pa": 1.0, "inhg": 3386.389, "mmhg": 133.3224}
_PRESSURES = (60_000.0, 108_000.0)  # Pa, from a road at 4000 m to the highest of any weather
_GAUGE = 500.0  # Pa: a car's own diagnosis states the pressure in steps of 1 kPa


def logged_air(logs: Sequence[Sequence[ChannelFacts]]) -> tuple[tuple[str, str], ...]:
    """The lines of the description's ``environment`` for which every log has a column.

    Parameters
    ----------
    logs : the facts on each run's log.
    """
    return (*logged_temperature(logs), *logged_pressure(logs))


def logged_pressure(logs: Sequence[Sequence[ChannelFacts]]) -> tuple[tuple[str, str], ...]:
    """The line ``pressure`` of the description's ``environment``; empty where not every log has a barometer.

    The middle of all values, +- half their range and the error of a car's sensor.

    Parameters
    ----------
    logs : the facts on each run's log.
    """
    found = [next(((f, gain) for f in facts if (gain := _pascals(f))), None) for facts in logs]
    known = [one for one in found if one is not None]
    if not known or len(known) < len(found):
        return ()
    ends = [gain * value for f, gain in known for value in (f.lowest, f.highest)]
    low, high = min(ends), max(ends)
    error = max(_GAUGE, 0.5 * (high - low))
    text = f"{0.5e-3 * (low + high):.1f} +- {1e-3 * error:.1f} kPa  # middle of '{known[0][0].column}'"
    return (("pressure", text),)


def _pascals(facts: ChannelFacts) -> float:
    """Pa per unit of a barometer's column; 0 for any other column."""
    name = facts.info.name
    if facts.state not in ("varies", "constant") or not _BAROMETER.search(name) or _NOT_AIR.search(name):
        return 0.0
    ends = [word for word in re.split(r"[\W_]+", name.lower()) if word]
    stated = facts.info.unit.lower().replace(" ", "") or (ends[-1] if ends[-1] in _PASCALS else "")
    gains = [_PASCALS[stated]] if stated in _PASCALS else [] if stated else list(_PASCALS.values())
    fitting = {g for g in gains if _PRESSURES[0] < g * facts.lowest <= g * facts.highest < _PRESSURES[1]}
    return fitting.pop() if len(fitting) == 1 else 0.0


def logged_temperature(logs: Sequence[Sequence[ChannelFacts]]) -> tuple[tuple[str, str], ...]:
    """The line ``temperature`` of the description's ``environment``; empty where not every log has such a column.

    The middle of all values, +- half their range and the error of a car's sensor.

    Parameters
    ----------
    logs : the facts on each run's log.
    """
    found = [next((f for f in facts if _is_air(f)), None) for facts in logs]
    known = [f for f in found if f is not None]
    if not known or len(known) < len(found):
        return ()
    ends = [to_si(value, _unit(f), "K") for f in known for value in (f.lowest, f.highest)]
    low, high = min(ends), max(ends)
    middle = from_si(0.5 * (low + high), "degC", "K")
    error = max(_SENSOR, 0.5 * (high - low))
    comment = f"middle of '{known[0].column}'; a car's sensor reads too warm at low speed"
    return (("temperature", f"{middle:.0f} +- {error:.0f} degC  # {comment}"),)


def _is_air(facts: ChannelFacts) -> bool:
    if facts.state not in ("varies", "constant") or _INSIDE.search(facts.info.name):
        return False
    words = set(_words(facts))
    if not (words & _TEMPERATURE and words & _OUTSIDE):
        return False
    try:
        low, high = (to_si(value, _unit(facts), "K") for value in (facts.lowest, facts.highest))
    except UnitError:
        return False
    return _AIR[0] < low and high < _AIR[1]


def _words(facts: ChannelFacts) -> tuple[str, ...]:
    name = in_english(facts.info.name.replace("_", " ").replace("ß", "ss"))
    return words_and_unit(_COMPOUND.sub(r"\1 ", name))[0]


def _unit(facts: ChannelFacts) -> str:
    """The unit that the file states, or the end of the name: ``AmbT_degC``."""
    unit = facts.info.unit or [word for word in re.split(r"[\W_]+", facts.info.name.lower()) if word][-1]
    return _DEGREES.get(unit.lower(), unit)
