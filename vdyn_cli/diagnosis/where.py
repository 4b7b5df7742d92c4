"""Where the baseline's simulation departs from the data: the largest errors that noise does not explain."""

from __future__ import annotations

from typing import Any

import numpy as np

from vdyn_cli.inference import white_level
from vdyn_cli.quantities.result import Comparison, Result

PIECES = 12  # of each run
SHOWN = 6
QUIETEST = 0.3  # of the usual noise of its channel that a run may have
LEAST = 3.0  # times its own noise that a piece's mean must be off


def where(result: Result) -> list[dict[str, Any]]:
    """The piece of every run in which measured and simulated differ most, largest first."""
    levels = _levels(result)
    worst = [
        max(pieces, key=lambda e: abs(e["over_noise"]))
        for c in result.comparisons
        if (pieces := _pieces(c, QUIETEST * levels.get(c.channel, 0.0)))
    ]
    worst.sort(key=lambda e: -abs(e["over_noise"]))
    return worst[:SHOWN]


def _levels(result: Result) -> dict[str, float]:
    """Usual noise of each channel: a stretch in which a logger repeats a value is no more exact than the others."""
    found: dict[str, list[float]] = {}
    for c in result.comparisons:
        good = np.isfinite(c.measured) & np.isfinite(c.simulated)
        if good.sum() >= 4 * PIECES:
            found.setdefault(c.channel, []).append(white_level((c.measured - c.simulated)[good]))
    return {channel: float(np.median(each)) for channel, each in found.items()}


def _pieces(c: Comparison, least: float) -> list[dict[str, Any]]:
    good = np.isfinite(c.measured) & np.isfinite(c.simulated)
    if c.used is not None:
        good &= c.used
    if good.sum() < 4 * PIECES:
        return []
    x, error = c.x[good], (c.measured - c.simulated)[good]
    noise = max(white_level(error), least)
    found = []
    for part in np.array_split(np.arange(x.size), PIECES):
        mean = float(np.mean(error[part]))
        ratio = mean / noise if noise > 0 else 0.0
        if abs(ratio) * np.sqrt(part.size) > LEAST:
            found.append(
                {
                    "run": c.run,
                    "channel": c.channel,
                    "segment": f"{c.x_label} {x[part[0]]:.3g} to {x[part[-1]]:.3g}",
                    "size": mean,
                    "unit": c.unit,
                    "over_noise": ratio,
                }
            )
    return found
