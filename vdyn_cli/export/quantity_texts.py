"""Unit and meaning of every quantity of the exported vehicle: the vocabulary, and the variables of the model."""

from __future__ import annotations

from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.quantities.vocabulary import CHANNELS, PARAMETERS

PLACES = {
    **{"_fl": "front left", "_fr": "front right", "_rl": "rear left", "_rr": "rear right"},
    **{"_front": "front axle", "_rear": "rear axle"},
}

Q = Quantity
_OWN = (
    Q("rolling_speed", "s/m", "rise of the rolling resistance coefficient with speed"),
    Q("wind_variance", "m^2/s^2", "variance of the gusts along the road"),
    Q("heading", "", "direction on the test track: +1 out, -1 back; 0 if not applicable"),
    Q("elapsed", "s", "time since the start; only effects that change with time use it"),
    Q("start_speed", "m/s", "initial speed"),
    Q("road", "m", "height of the road under the wheel"),
    Q("position", "m", "distance along the road"),
    Q("lateral_position", "m", "distance to the left"),
    Q("lateral_speed", "m/s", "speed to the left"),
    Q("heave", "m", "height of the body's center above rest"),
    Q("heave_rate", "m/s", "its rate"),
    Q("pitch", "rad", "pitch angle, nose-up positive"),
    Q("pitch_rate", "rad/s", "its rate"),
    Q("roll", "rad", "roll angle, left side up positive"),
    Q("roll_rate", "rad/s", "its rate"),
    Q("yaw", "rad", "yaw angle, to the left positive"),
    Q("yaw_rate", "rad/s", "its rate"),
    Q("run_time", "s", "time since the start"),
    Q("wheel_height", "m", "height of the wheel above rest"),
    Q("wheel_rate", "m/s", "its rate"),
    Q("contact", "m", "height of the road, filtered by the tire's damping"),
    Q("slip", "", "longitudinal slip of the tire after relaxation, driving positive"),
    Q("lateral_slip", "", "lateral slip of the tire after relaxation"),
    Q("rolling_bend", "", "-1 to 1, direction of the rolling resistance"),
    Q("brake_bend", "", "-1 to 1, direction of the brake friction"),
    Q("twist", "rad", "twist of the half-shaft"),
    Q("carrier_speed", "rad/s", "angular speed of the differential's carrier minus that of the motor's housing"),
    Q("side_gear_speed", "rad/s", "half the difference of the side gears' speeds, left minus right"),
)
OWN = {quantity.name: quantity for quantity in _OWN}


def parameter_quantity(name: str) -> Quantity:
    """Unit and meaning of a parameter or of a quantity of the run; empty if not known."""
    return PARAMETERS.get(name) or OWN.get(name) or Quantity(name, "", "")


def signal_quantity(name: str) -> Quantity:
    """Unit and meaning of an input or an output, also of a single wheel."""
    return CHANNELS.get(name) or state_quantity(name)


def state_quantity(name: str) -> Quantity:
    """Unit and meaning of a state, also of a wheel or an axle; empty for the state of an effect."""
    ending = next((suffix for suffix in PLACES if name.endswith(suffix)), "")
    place, stem = PLACES.get(ending), name.removesuffix(ending)
    known = OWN.get(stem) or CHANNELS.get(stem)
    if known is None:
        return Quantity(name, "", "")
    return Quantity(name, known.unit, f"{known.meaning}, {place}" if place else known.meaning)


def comment(quantity: Quantity) -> str:
    """Unit and meaning in one line."""
    return ", ".join(part for part in (quantity.unit or "1", quantity.meaning) if part)
