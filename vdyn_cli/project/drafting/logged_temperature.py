"""The air's temperature as the car's own sensor logs it, for ``vdyn init``."""

from __future__ import annotations

import re
from collections.abc import Sequence

from vdyn_cli.io.channel_survey import ChannelFacts
from vdyn_cli.quantities.quantity import UnitError, from_si, to_si

# An intake, a battery or a cabin is not the air: only names that say so count.
_NAME = re.compile(
    r"\b(amb(ient)?|outside|outdoor|exterior|external)\b.*\btemp(erature)?\b"
    r"|\btemp(erature)?\b.*\b(amb(ient)?|outside|outdoor)\b|\bau(ss|ß)entemperatur\b|\b(t|temp) (au(ss|ß)en|amb|out)\b",
    re.IGNORECASE,
)
_INSIDE = re.compile(r"cabin|battery|intake|coolant|heat|interior|set ?point", re.IGNORECASE)
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
    name = facts.info.name.replace("_", " ")
    if facts.state not in ("varies", "constant") or not _NAME.search(name) or _INSIDE.search(name):
        return False
    try:
        low, high = (to_si(value, _unit(facts), "K") for value in (facts.lowest, facts.highest))
    except UnitError:
        return False
    return _AIR[0] < low and high < _AIR[1]


def _unit(facts: ChannelFacts) -> str:
    unit = facts.info.unit
    return f"deg{unit}" if unit in ("C", "F") else unit
