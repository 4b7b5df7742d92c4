"""Hubs of a half car that the slope of the road pushes fore and aft against the bushings of the suspension."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.engine.maths import sqrt
from vdyn_cli.engine.model_builder import ModelBuilder, Number

# 1/s: a hub that is stiffer than this (40 Hz) follows without its own oscillation, so that zero compliance is a limit
STIFFEST = 2 * np.pi * 40.0
DAMPING_RATIO = 0.12  # of rubber bushings with a loss angle of some 11 degrees


@dataclass(frozen=True)
class Hub:
    """The fore-aft motion of an axle's hubs relative to the body, at one instant.

    b = m / k,   e'' + V' + s th'' = -Fz u' / m - (e + d e') / b

    Parameters
    ----------
    offset, rate : e, m, and e', m/s, forward. mass : m of the axle, kg. compliance : b, s^2: the square of the inverse
        natural frequency; 0 for rigid hubs, and near 0 of either sign linear in it. climb : Fz u', backward force of
        the road's slope, N.
    """

    offset: Number
    rate: Number
    mass: Number
    compliance: Number
    climb: Number

    @property
    def _square(self) -> Number:
        """Square of the natural frequency, 1/s^2."""
        return 1.0 / sqrt(self.compliance**2 + STIFFEST**-4)

    @property
    def share(self) -> Number:
        """Share of the mass that does not follow the body: b times the square of the natural frequency."""
        return self.compliance * self._square

    @property
    def acceleration(self) -> Number:
        """e'' on a body that moves steadily, m/s^2."""
        elastic = self.offset + 2 * DAMPING_RATIO / sqrt(self._square) * self.rate
        return -self.share * self.climb / self.mass - self._square * elastic

    @property
    def backward(self) -> Number:
        """Backward force of the hubs on a body that moves steadily, N."""
        return self.climb + self.mass * self.acceleration


def hub_states(e: ModelBuilder, end: str) -> tuple[Number, Number]:
    """Offset e, m, and rate e', m/s, of the hubs of an axle: ``end`` is "front" or "rear"."""
    return e.state(f"hub_{end}"), e.state(f"hub_rate_{end}")


@dataclass(frozen=True)
class LongitudinalMotion:
    """Fore-aft motion of body and hubs, and the pitching that it causes.

    M V' + mu s th'' + sum m e'' = -sum Fz u',   Is th'' = T + s Ms V'

    Parameters
    ----------
    sprung, inertia : Ms, kg, and Is, kg m^2, of the body. lever : s, m, of its center above the hubs' forces.
    hubs : front and rear.
    """

    sprung: Number
    inertia: Number
    lever: Number
    hubs: tuple[Hub, Hub]

    def pitch_acceleration(self, moment: Number) -> Number:
        """th'', rad/s^2, under the moment T of the springs and dampers, N m."""
        front, rear = self.hubs
        following = front.mass * (1.0 - front.share) + rear.mass * (1.0 - rear.share)
        backward = front.backward + rear.backward
        inertia = moving_pitch_inertia(self.sprung, following, self.inertia, self.lever)
        return (moment - self.lever * self.sprung / (self.sprung + following) * backward) / inertia

    def integrate(self, e: ModelBuilder, pitch_acceleration: Number) -> None:
        """Integrate the motion of the hubs."""
        front, rear = self.hubs
        following = front.mass * (1.0 - front.share) + rear.mass * (1.0 - rear.share)
        backward = front.backward + rear.backward
        body = -(backward + following * self.lever * pitch_acceleration) / (self.sprung + following)
        carried = body + self.lever * pitch_acceleration
        for end, hub in (("front", front), ("rear", rear)):
            e.integrate(**{f"hub_{end}": hub.rate, f"hub_rate_{end}": hub.acceleration - hub.share * carried})


def moving_pitch_inertia(sprung: Number, following: Number, own: Number, lever: Number) -> Number:
    """Pitch inertia of the body with the masses that its pitching moves fore and aft, kg m^2: Is + Ms m/(Ms + m) s^2.

    Parameters
    ----------
    sprung, following : Ms and m, kg. own : Is, kg m^2. lever : s, m.
    """
    return own + sprung * following / (sprung + following) * lever**2
