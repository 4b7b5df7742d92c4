"""What a plant module hands over for sample_logs/: finished files, and the truth they were made with.

``tests.plant.write`` calls ``samples()`` of every module of this package that has one: a new test joins by being there.
"""

from __future__ import annotations

from dataclasses import dataclass

TEMPERATURE, PRESSURE = 24.0, 98_900.0  # degC and Pa on the test day of the sample logs
AIR_DENSITY = round(PRESSURE / (287.05 * (TEMPERATURE + 273.15)), 4)  # kg/m^3, dry


@dataclass(frozen=True)
class Samples:
    """``files``: name to bytes; ``truth``: parameter names of the results to SI values; ``about``: Markdown lines."""

    title: str
    files: dict[str, bytes]
    truth: dict[str, float]
    about: str = ""
