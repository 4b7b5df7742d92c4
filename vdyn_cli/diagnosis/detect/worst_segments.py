"""The segments of the runs with the largest errors of the baseline's simulation that noise does not explain."""

from __future__ import annotations

import numpy as np

from vdyn_cli.inference import white_level
from vdyn_cli.quantities.diagnosis import WorstSegment
from vdyn_cli.quantities.result import Comparison, Result

# These choose what is shown, no verdict.
SEGMENTS = 12  # number in each run
SHOWN = 6  # segments in the report
LEAST_NOISE = 0.3  # share of the channel's median noise over runs: repeated values make a run look too exact
SIGNIFICANT = 3.0  # standard errors of a segment's mean


def worst_segments(result: Result) -> tuple[WorstSegment, ...]:
    """The segment of every run in which measured and simulated differ most, largest first.

    The error is the mean of a segment; its noise is the white level of the run's error.
    """
    noise: dict[str, list[float]] = {}
    for c in result.comparisons:
        error = c.measured - c.simulated
        error = error[np.isfinite(error)]
        if error.size >= 4 * SEGMENTS:
            noise.setdefault(c.channel, []).append(white_level(error))
    least = {channel: LEAST_NOISE * float(np.median(each)) for channel, each in noise.items()}
    worst = [
        max(found, key=lambda s: abs(s.over_noise))
        for c in result.comparisons
        if (found := _significant(c, least.get(c.channel, 0.0)))
    ]
    return tuple(sorted(worst, key=lambda s: -abs(s.over_noise))[:SHOWN])


def _significant(c: Comparison, least_noise: float) -> list[WorstSegment]:
    error = c.measured - c.simulated
    good = np.isfinite(error) if c.used is None else np.isfinite(error) & c.used
    if good.sum() < 4 * SEGMENTS:
        return []
    x, error = c.x[good], error[good]
    noise = max(white_level(error), least_noise)
    found = []
    for part in np.array_split(np.arange(x.size), SEGMENTS):
        mean = float(np.mean(error[part]))
        ratio = mean / noise if noise > 0 else 0.0
        if abs(ratio) * np.sqrt(part.size) > SIGNIFICANT:
            segment = f"{c.x_label} {x[part[0]]:.3g} to {x[part[-1]]:.3g}"
            found.append(
                WorstSegment(run=c.run, channel=c.channel, segment=segment, size=mean, unit=c.unit, over_noise=ratio)
            )
    return found
