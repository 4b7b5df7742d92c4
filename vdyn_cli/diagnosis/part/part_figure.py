"""The curve of the part at fault as a figure."""

from __future__ import annotations

from itertools import groupby

import numpy as np

from vdyn_cli.quantities.diagnosis import FaultyPart
from vdyn_cli.quantities.result import Figure, Series


def part_figure(part: FaultyPart) -> Figure:
    """The part's law with its band over the range that the data cover, the baseline's law, and the named law."""
    series = []
    first = 0
    laws = part.law.values if part.law is not None and len(part.law.values) == len(part.curve) else ()
    for place, group in groupby(part.curve, key=lambda p: p.place):
        points = tuple(group)
        rows = slice(first, first + len(points))
        first += len(points)
        x = np.array([p.at for p in points])
        low, high = np.array([p.interval95 for p in points]).T
        of = f", {place}" if place else ""
        value = np.array([p.value for p in points])
        series.append(Series(f"95 % band{of}", x, low, "band", role="simulated", y2=high))
        series.append(Series(f"free curve{of}", x, value, "line", role="simulated"))
        series.append(Series(f"model's law{of}", x, np.array(part.baseline[rows]), "line", role="baseline"))
        if laws and part.law is not None:
            series.append(Series(f"{part.law.label}{of}", x, np.array(laws[rows]), "line", role="reference"))
    unit = f" in {part.unit}" if part.unit else ""
    over = part.coordinate.replace("_", " ")
    caption = (
        f"Where the error lies: {part.label}, estimated as a free curve over the range that the runs cover. Good: the "
        "named law runs inside the band. Bad: it leaves the band (another law), or the band is as wide as the curve is "
        f"high (too few data). Curve defined up to: {part.gauge}."
    )
    x_label = f"{over} in {part.coordinate_unit}" if part.coordinate_unit else over
    return Figure("part", "The part at fault", caption, x_label, f"{part.label}{unit}", tuple(series))
