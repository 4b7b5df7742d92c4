"""Pairs of physically related channels of two loggers, from which the loggers' clocks can be aligned.

A quantity logged by both; a wheel speed and a vehicle speed (r om = V plus slip); a speed and an acceleration
(a = dV/dt plus the effect of slope and tilt); a position and a speed (V = dx/dt); a pitch angle and a pitch rate.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from vdyn_cli.quantities.vocabulary import WHEEL_SPEEDS

WHEELS = ("wheel_speed", *WHEEL_SPEEDS, "motor_speed")
# Order of each channel as a derivative of the position along the road, and of the pitch angle.
_ALONG = {"position": 0, "speed": 1, "vehicle_speed": 1, **dict.fromkeys(WHEELS, 1), "acceleration": 2}
_PITCH = {"pitch": 0, "pitch_rate": 1}
ALIGNING = (*_ALONG, *_PITCH)  # channels that can align two clocks, with or without use in the step


@dataclass(frozen=True)
class ChannelTie:
    """Two physically related channels: the same quantity, a multiple of it, or its derivative.

    Parameters
    ----------
    first, second : channels of the reference and of the other logger.
    order : order of the second as a derivative of the first: -1, 0, 1.
    """

    first: str
    second: str
    order: int = 0

    @property
    def same(self) -> bool:
        """Whether both logged the same quantity."""
        return self.first == self.second

    @property
    def slopes(self) -> bool:
        """Whether one of the two is an accelerometer, which also measures the road's slope."""
        return self.order != 0 and "acceleration" in (self.first, self.second)

    @property
    def wheel(self) -> int | None:
        """Index (0, 1) of a wheel's speed if the other is of the vehicle, so that slip separates them; else None."""
        wheels = [self.first in WHEELS, self.second in WHEELS]
        return wheels.index(True) if sum(wheels) == 1 else None

    def __str__(self) -> str:
        return f"channel '{self.first}'" if self.same else f"channels '{self.first}' and '{self.second}'"


def ties(reference: Collection[str], other: Collection[str]) -> list[ChannelTie]:
    """The physically related pairs of two loggers' channels: shared channels first, and of these the speed first."""
    shared = sorted((n for n in reference if n in other and n != "time"), key=lambda n: n != "speed")
    found = [ChannelTie(n, n) for n in shared]
    for motion in (_ALONG, _PITCH):
        for first in motion:
            for second in motion:
                order = motion[second] - motion[first]
                if first != second and first in reference and second in other and abs(order) <= 1:
                    found.append(ChannelTie(first, second, order))
    return found


def tie_of(first: str, second: str) -> ChannelTie | None:
    """The relation of two channels, by name; None if they are not physically related."""
    return next((t for t in ties((first,), (second,))), None)


def related_channels(channels: Collection[str]) -> list[str]:
    """The channels with which another logger's clock could be aligned to that of a logger with these channels."""
    return [n for n in ALIGNING if ties(channels, (n,))]
