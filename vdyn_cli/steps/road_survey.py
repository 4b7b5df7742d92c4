"""The survey of a road: points with elevation or grade, their error, and the grade between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vdyn_cli.quantities.arrays import Array, rms

MODES = 5  # of the error along the road: a constant and four cosines; shorter waves average out within a coast's bin


@dataclass(frozen=True, eq=False)
class RoadSurvey:
    """A surveyed road.

    Parameters
    ----------
    name : of its file. position : (n,) m, ascending. values : (n,) elevation, m, or grade.
    std : (n,) standard deviation of the values, 0 where the survey states none.
    elevation : whether the values are elevations, with independent errors; else grades, whose errors are common to
        long parts of the road.
    """

    name: str
    position: Array
    values: Array
    std: Array
    elevation: bool

    @property
    def span(self) -> tuple[float, float]:
        """First and last position, m."""
        return float(self.position[0]), float(self.position[-1])

    @property
    def uncertain(self) -> bool:
        """Whether the survey states an error."""
        return bool(np.any(self.std > 0))

    @property
    def _usual_std(self) -> float:
        """Root mean square of the standard deviations."""
        return rms(self.std)

    @cached_property
    def _slopes(self) -> Array:
        return np.asarray(np.diff(self.values) / np.diff(self.position))

    def grade(self, place: Array) -> Array:
        """Grade (m,) at positions (m,) m, positive where the road climbs with increasing position."""
        if not self.elevation:
            return np.asarray(np.interp(place, self.position, self.values))
        k = np.clip(np.searchsorted(self.position, place, "right") - 1, 0, self._slopes.size - 1)
        return self._slopes[k]

    def error(self, place: Array, mode: int) -> Array:
        """Standard deviation of mode k of the grade's error at positions (m,) m, with its shape cos(k pi s), s 0 to 1.

        Independent errors of the elevations at n points, of standard deviation sd, are a sum of sines whose
        coefficients each have the standard deviation sd sqrt(2 / n), so those of the grade have k pi / length times
        that. The error of the mean grade comes from the two ends, sd sqrt(2) / length. A grade's error is distributed
        over all modes.

        Parameters
        ----------
        mode : k, below ``MODES``.
        """
        begin, end = self.span
        length, share = end - begin, np.clip((place - begin) / (end - begin), 0.0, 1.0)
        sd = self._usual_std
        if not self.elevation:
            size = sd / np.sqrt(MODES) * (1.0 if mode == 0 else np.sqrt(2.0))
        elif mode == 0:
            size = sd * np.sqrt(2.0) / length
        else:
            size = sd * np.sqrt(2.0 / self.position.size) * mode * np.pi / length
        return np.asarray(size * np.cos(mode * np.pi * share))

    def summary(self) -> dict[str, str | float | int]:
        """The survey in the JSON of a result."""
        (begin, end), kind = self.span, "elevation" if self.elevation else "grade"
        points, sd = self.position.size, self._usual_std
        return {"profile": self.name, "from": begin, "to": end, "points": points, "kind": kind, "std": sd}

    @property
    def size(self) -> str:
        """The stated error as text."""
        sd = self._usual_std
        return f"{1e3 * sd:.2g} mm of elevation" if self.elevation else f"{100 * sd:.2g} % of grade"
