"""The air's temperature as the car's own sensor logs it, for ``vdyn init``."""

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
        *("luft", "oat", "ute", "lucht", "buiten"),
    ]
)
_COMPOUND = re.compile(
    r"\b((aussen|umgebungs|luft|aussenluft|ute|utendors|buiten|lucht)(?=temp)|t(?=amb)|amb(?=t\b))",
    re.IGNORECASE,
)
_INSIDE = re.compile(
    r"cabin|battery|intake|inlet|coolant|heat|interior|set ?point|ansaug|ladeluft|kühl|innen|reifen|öl|oil|tire|tyre",
    re.IGNORECASE,
)
_DEGREES = {"c": "degC", "degc": "degC", "celsius": "degC", "f": "degF", "degf": "degF", "k": "K"}  # ends of names
_AIR = (233.0, 328.0)  # K, beyond the weather of any test day: a sensor that is not connected
_SENSOR = 2.0  # K, a car's sensor behind the bumper, which the engine and the road warm


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
    unit = facts.info.unit or re.split(r"[\W_]+", facts.info.name.lower())[-1]
    return _DEGREES.get(unit.lower(), unit)
