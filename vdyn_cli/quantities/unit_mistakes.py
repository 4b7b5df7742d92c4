"""Units that are commonly taken for each other, by the factor by which a reading is then wrong."""

from __future__ import annotations

from math import log

# Reading over true value, and its usual cause.
SPEED_MISTAKES: tuple[tuple[float, str], ...] = (
    (3.6, "km/h read as m/s"),
    (1 / 3.6, "m/s read as km/h"),
    (2.23694, "mph read as m/s"),
    (1 / 2.23694, "m/s read as mph"),
    (1.60934, "km/h read as mph"),
    (1 / 1.60934, "mph read as km/h"),
    (1.94384, "kn read as m/s"),
    (1 / 1.94384, "m/s read as kn"),
)

# Accelerations compared with the change of the speed, which may be the channel with the wrong unit; factors above 2.
ACCELERATION_MISTAKES: tuple[tuple[float, str], ...] = (
    (1 / 9.80665, "acceleration in g read as m/s^2"),
    (9.80665, "acceleration in m/s^2 read as g"),
    (1 / 3.6, "speed in km/h read as m/s"),
    (3.6, "speed in m/s read as km/h"),
    (1 / 2.23694, "speed in mph read as m/s"),
    (2.23694, "speed in m/s read as mph"),
)


def usual_mistake(factor: float, mistakes: tuple[tuple[float, str], ...], apart: float) -> str:
    """The cause of a reading that is ``factor`` times the true value; empty where none is that close.

    Parameters
    ----------
    factor : positive. mistakes : factors with their causes; empty: none is known.
    apart : largest relative difference from a known factor.
    """
    if not mistakes:
        return ""
    off, cause = min((abs(log(factor / known)), cause) for known, cause in mistakes)
    return cause if off < apart else ""
