"""The profile of a bump in the road, closed form where there is one, and what a contact patch feels of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tests.plant.information import Array


@dataclass(frozen=True)
class Bump:
    """Height of the road over the distance s past the bump's near edge.

    ``shape`` is "haversine" (a full cosine period), "half_sine", or "profile" with ``table`` (2, k) of distance and
    height, straight between its points. ``patch`` is the length over which the tire averages. ``trapezoid`` is the
    share of a trapezoid, flat over its middle 0.4, in a shape without table, and ``circle`` that of the path of a
    circle of ``radius`` that rolls over it.
    """

    height: float = 0.07
    width: float = 0.48
    shape: str = "haversine"
    table: Array | None = None
    patch: float = 0.0
    trapezoid: float = 0.0
    circle: float = 0.0
    radius: float = 0.31

    def level(self, s: Array) -> Array:
        """Road height under the contact point, m."""
        if self.patch > 0:
            return (self._area(s + self.patch / 2) - self._area(s - self.patch / 2)) / self.patch
        return self._level(s)

    def slope(self, s: Array) -> Array:
        """Rise of that height per meter."""
        if self.patch > 0:
            return (self._level(s + self.patch / 2) - self._level(s - self.patch / 2)) / self.patch
        if self.circle:
            where, _, steep = self._rolled
            rolled = np.interp(s, where, steep, left=0.0, right=0.0)
            return (1.0 - self.circle) * replace(self, circle=0.0).slope(s) + self.circle * rolled
        inside = (s > 0) & (s < self.width)
        if self.trapezoid:
            ramp = 0.3 * self.width
            rise = np.where(s < ramp, 1.0, np.where(s > self.width - ramp, -1.0, 0.0)) * self.height / ramp
            plain = replace(self, trapezoid=0.0).slope(s)
            return (1.0 - self.trapezoid) * plain + self.trapezoid * np.where(inside, rise, 0.0)
        turn = np.pi * s / self.width
        if self.shape == "haversine":
            return np.where(inside, np.pi * self.height / self.width * np.sin(2 * turn), 0.0)
        if self.shape == "half_sine":
            return np.where(inside, np.pi * self.height / self.width * np.cos(turn), 0.0)
        where, what = self._points()
        steep = np.concatenate([[0.0], np.diff(what) / np.diff(where), [0.0]])
        return steep[np.searchsorted(where, s)]

    def _points(self) -> Array:
        if self.shape != "profile" or self.table is None:
            raise ValueError(f"no such bump: {self.shape}")
        return self.table

    @cached_property
    def _rolled(self) -> tuple[Array, Array, Array]:
        """Where the circle's lowest point is, its height and its rise, for the ground that the circle touches."""
        plain = replace(self, circle=0.0)
        touched = np.linspace(0.0, self.width, 20001)[1:-1]
        turned = np.arctan(plain.slope(touched))
        height = plain.level(touched) - self.radius * (1.0 - np.cos(turned))
        above = height > 0.0
        return (touched - self.radius * np.sin(turned))[above], height[above], np.tan(turned)[above]

    def _level(self, s: Array) -> Array:
        if self.circle:
            where, height, _ = self._rolled
            rolled = np.interp(s, where, height, left=0.0, right=0.0)
            return (1.0 - self.circle) * replace(self, circle=0.0)._level(s) + self.circle * rolled
        if self.trapezoid:
            corners = np.array([0.0, 0.3, 0.7, 1.0]) * self.width
            straight = np.interp(s, corners, [0.0, self.height, self.height, 0.0])
            return (1.0 - self.trapezoid) * replace(self, trapezoid=0.0)._level(s) + self.trapezoid * straight
        turn = np.pi * np.clip(s, 0.0, self.width) / self.width
        if self.shape == "haversine":
            return self.height * np.sin(turn) ** 2
        if self.shape == "half_sine":
            return self.height * np.sin(turn)
        where, what = self._points()
        return np.interp(s, where, what)

    def _area(self, s: Array) -> Array:
        """Integral of the height from before the bump to s."""
        turn = np.pi * np.clip(s, 0.0, self.width) / self.width
        if self.shape == "haversine":
            return self.height * self.width / (2 * np.pi) * (turn - np.sin(turn) * np.cos(turn))
        if self.shape == "half_sine":
            return self.height * self.width / np.pi * (1.0 - np.cos(turn))
        where, what = self._points()
        fine = np.linspace(where[0], where[-1], 4001)
        level = np.interp(fine, where, what)
        area = np.concatenate([[0.0], np.cumsum((level[1:] + level[:-1]) / 2 * np.diff(fine))])
        return np.interp(s, fine, area)
