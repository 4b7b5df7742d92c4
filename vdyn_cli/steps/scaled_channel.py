"""Channels that can be computed from another channel times constants of the vehicle, and per another channel."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ScaledChannel:
    """A channel as the product of another channel and constants, perhaps divided by a third channel.

    target = source * constants[0] * constants[1] ... / per

    Parameters
    ----------
    target, source : channels of the vocabulary.
    constants : parameters of the vehicle, which must be known.
    optional : parameters of the vehicle that are 1 where they are not known.
    assumes : what the product neglects, as a sentence.
    in_model : whether the step's model has the constants in the channel, and with them their uncertainty.
    per : channel by which the product is divided; the target is missing where it is below ``least``, SI.
    """

    target: str
    source: str
    constants: tuple[str, ...]
    assumes: str
    optional: tuple[str, ...] = ()
    in_model: bool = False
    per: str = ""
    least: float = 0.0

    @property
    def equation(self) -> str:
        """The equation as text: ``"speed = wheel_speed * wheel_radius"``."""
        product = " * ".join((self.source, *self.constants, *self.optional))
        return f"{self.target} = {product}{f' / {self.per}' if self.per else ''}"


SPEED_OF_WHEEL = ScaledChannel(
    "speed",
    "wheel_speed",
    ("wheel_radius",),
    "The slip of a free-rolling wheel is neglected: it is below 0.1 %, and nearly constant.",
)

_MOTOR = "Friction and iron losses of the motor, and the inertia of its rotor, are part of the vehicle."
TORQUE_OF_MOTOR = ScaledChannel("drive_torque", "motor_current", ("torque_constant",), _MOTOR)
# m/s: below, an error of 0.05 m/s in the speed, that of a receiver, is more than 2.5 % of the force.
SLOWEST_POWERED = 2.0
FORCE_OF_POWER = ScaledChannel(
    "drive_force",
    "drive_power",
    ("driveline_efficiency",),
    f"Below {SLOWEST_POWERED:g} m/s it is not used.",
    per="speed",
    least=SLOWEST_POWERED,
)


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
