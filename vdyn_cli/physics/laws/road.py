"""Height of the road under a tire, and shapes of a bump."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from vdyn_cli.engine.maths import fmax, fmin, sin
from vdyn_cli.engine.model_builder import Number, Signals

Shape = Callable[[Number], Number]


def road(s: Signals) -> Number:
    """Height of the road under a contact point, m, relative to the road before the bump.

    u = A shape(x / lambda)

    Parameters
    ----------
    s : position m (x, past the bump's near edge), height m (A), width m (lambda), shape (a function of x / lambda),
        length m (from edge to edge, which effects read).

    Notes
    -----
    Assumes a road that is flat except for the bump, and a tire with point contact.
    Source: doi:10.4271/2017-01-1574, equations (12) and (13).
    """
    return s.height * s.shape(s.position / s.width)


def haversine(share: Number) -> Number:
    """One period of a cosine, sin^2(pi x / lambda), smooth at its edges; ``share`` x / lambda, zero outside 0 to 1."""
    return sin(math.pi * fmin(fmax(share, 0.0), 1.0)) ** 2


def half_sine(share: Number) -> Number:
    """Half a period of a sine, sin(pi x / lambda), corners at both edges; ``share`` x / lambda, zero outside 0 to 1."""
    return sin(math.pi * fmin(fmax(share, 0.0), 1.0))


@dataclass(frozen=True)
class Hump:
    """A smooth hump between two kinks, symmetric about the bump's middle, such as the path of a circle over a bump.

    u / A = sum_k c_k e^k,   e = max(0, 1 - ((x / lambda - 1/2) / r)^2),   k from 1

    Parameters
    ----------
    reach : r, from the middle to a kink, in bump widths. coefficients : c_k, in bump heights.
    """

    reach: float
    coefficients: tuple[float, ...]

    def __call__(self, share: Number) -> Number:
        """The height u / A at ``share`` = x / lambda, which may lie outside 0 to 1."""
        inside = fmax(1.0 - ((share - 0.5) / self.reach) ** 2, 0.0)
        total: Number = 0.0
        for coefficient in reversed(self.coefficients):
            total = (total + coefficient) * inside
        return total


def straight_lines(points: Sequence[tuple[float, float]]) -> Shape:
    """A measured profile: straight lines between its points, level before and after.

    u(x) = sum_i c_i max(0, x - x_i), c_i the change of slope at point i

    Parameters
    ----------
    points : (position, height) in m, positions increasing. The road before has the first height, that after the last:
        a curb is a profile that ends higher.
    """
    slopes = [(h2 - h1) / (x2 - x1) for (x1, h1), (x2, h2) in pairwise(points)]
    bends = [after - before for before, after in zip([0.0, *slopes], [*slopes, 0.0], strict=True)]
    corners = [(x, bend) for (x, _), bend in zip(points, bends, strict=True) if bend != 0.0]

    def profile(position: Number) -> Number:
        height: Number = 0.0
        for corner, bend in corners:
            height = height + bend * fmax(position - corner, 0.0)
        return height

    return profile
