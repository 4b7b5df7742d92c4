"""Channels that can be computed from another channel times constants of the vehicle."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ScaledChannel:
    """A channel as the product of another channel and constants.

    target = source * constants[0] * constants[1] ...

    Parameters
    ----------
    target, source : channels of the vocabulary.
    constants : parameters of the vehicle, which must be known.
    optional : parameters of the vehicle that are 1 where they are not known.
    assumes : what the product neglects, as a sentence.
    in_model : whether the step's model has the constants in the channel, and with them their uncertainty.
    """

    target: str
    source: str
    constants: tuple[str, ...]
    assumes: str
    optional: tuple[str, ...] = ()
    in_model: bool = False

    @property
    def equation(self) -> str:
        """The equation as text: ``"speed = wheel_speed * wheel_radius"``."""
        return f"{self.target} = {' * '.join((self.source, *self.constants, *self.optional))}"


SPEED_OF_WHEEL = ScaledChannel(
    "speed",
    "wheel_speed",
    ("wheel_radius",),
    "The slip of a free-rolling wheel is neglected: it is below 0.1 %, and nearly constant.",
)

_MOTOR = "Friction and iron losses of the motor, and the inertia of its rotor, are part of the vehicle."
TORQUE_OF_MOTOR = ScaledChannel("drive_torque", "motor_current", ("torque_constant",), _MOTOR)


def torque_at_wheel(target: str) -> ScaledChannel:
    """A torque at the wheel from the motor's current, its torque constant and the gear ratio.

    Parameters
    ----------
    target : name of the torque's channel, N m.
    """
    return ScaledChannel(
        target,
        "motor_current",
        ("torque_constant",),
        "Losses of motor and gear, and the inertia of the rotor, are neglected.",
        ("gear_ratio",),
    )
