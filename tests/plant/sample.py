"""What a plant module hands over for sample_logs/: finished files, and the truth they were made with.

``tests.plant.write`` calls ``samples()`` of every module of this package that has one: a new test joins by being there.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Samples:
    """``files``: name to bytes; ``truth``: parameter names of the results to SI values; ``about``: Markdown lines."""

    title: str
    files: dict[str, bytes]
    truth: dict[str, float]
    about: str = ""
