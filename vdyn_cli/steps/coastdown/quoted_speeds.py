"""The speeds at which a road load is quoted and tabulated."""

from __future__ import annotations

QUOTED = tuple(v / 3.6 for v in (60.0, 40.0, 80.0, 100.0, 20.0))  # m/s; the first one in the fitted range is quoted
TABLE_SPEEDS = tuple(v / 3.6 for v in range(20, 141, 20))  # m/s, of the table of forces
TABLE_MARGIN = 1.4  # m/s (5 km/h) by which a table speed may lie outside the fitted speeds


def quoted_speed(fitted: tuple[float, float]) -> float:
    """The speed, m/s, at which the road load is quoted, for the lowest and highest fitted speed, m/s."""
    low, high = fitted
    return next((v for v in QUOTED if low <= v <= high), 0.5 * (low + high))


def table_speeds(fitted: tuple[float, float]) -> list[float]:
    """The speeds of the table of forces, m/s, for the lowest and highest fitted speed, m/s."""
    low, high = fitted
    return [v for v in TABLE_SPEEDS if low - TABLE_MARGIN <= v <= high + TABLE_MARGIN] or [quoted_speed(fitted)]
