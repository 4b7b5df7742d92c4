"""What is assumed of a vehicle where no step and no description says it: one table for every use of the full model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from vdyn_cli.physics.laws.atmosphere import air_density

Known = Mapping[str, float]


@dataclass(frozen=True)
class Assumption:
    """One way to a parameter that is not given: a formula over what is known, and why it holds.

    ``value`` raises KeyError where it needs what is not known; the next way is then tried.
    """

    name: str
    value: Callable[[Known], float]
    because: str


@dataclass(frozen=True)
class Completed:
    """A full parameter set.

    Parameters
    ----------
    values : of every name asked for, SI, except those that are missing.
    assumed : those that no measurement or description gave, with the reason for their value.
    missing : those that are not given and have no default; of a default that follows from a missing one, only that.
    """

    values: Mapping[str, float]
    assumed: Mapping[str, str]
    missing: tuple[str, ...]


def complete(names: Iterable[str], known: Known) -> Completed:
    """The values of ``names``: what is known, and for the rest what follows from it or is usual."""
    values, assumed = _followed(known)
    names = tuple(names)
    missing = [name for name in names if name not in values]
    asked = {name: 1.0 for name in missing if name not in FOLLOWING}
    there, _ = _followed({**values, **asked})
    return Completed(
        {name: values[name] for name in names if name in values},
        {name: assumed[name] for name in names if name in assumed},
        tuple(name for name in missing if name in asked or name not in there),
    )


def _followed(known: Known) -> tuple[dict[str, float], dict[str, str]]:
    """What is known and what follows from it or is usual, and the reason for each of the latter."""
    values = dict(known)
    assumed: dict[str, str] = {}
    for way in _WAYS:
        if way.name in values:
            continue
        try:
            values[way.name] = float(way.value(values))
        except KeyError:
            continue
        assumed[way.name] = way.because
    return values, assumed


def _beyond_the_wheels(k: Known) -> float:
    """Inertia of the driveline, kg m^2 at the wheels: what the rotating mass leaves when the wheels are taken off."""
    rest = k["rotating_mass"] * k["wheel_radius"] ** 2 - 4 * k["wheel_inertia"]
    if rest < LEAST_DRIVELINE_INERTIA:
        raise KeyError("rotating_mass")  # says nothing of the driveline
    return rest


def _like_the_other_side(side: str, other: str) -> Callable[[Known], float]:
    return lambda k: k[f"shaft_damping_{other}"] / k[f"shaft_stiffness_{other}"] * k[f"shaft_stiffness_{side}"]


LEAST_DRIVELINE_INERTIA = 0.2  # kg m^2: gears and the inner ends of the shafts alone
SIDE_GEAR_INERTIA = 5e-3  # kg m^2: side gear 1 kg at 25 mm, joint 2.5 kg at 40 mm, a third of a bar of 2 kg at 14 mm
# s/m: a braked car that rocks on its tires at 4 Hz is damped by 9 % of critical, as rubber of a loss factor of 0.2 is.
# Pacejka's low-speed damping (Tire and Vehicle Dynamics, 3rd ed., 2012, section 8.6: 770 N s/m) is 0.1 to 0.2.
REST_DAMPING = 0.3
SHAFT_TIME = 2e-3  # s, damping over stiffness of a half-shaft: 8 % of critical at a shuffle of 12 Hz

_A = Assumption
_WAYS = (
    _A("cg_to_front", lambda k: k["wheelbase"] - k["cg_to_rear"], "wheelbase minus cg_to_rear"),
    _A("drag_area", lambda k: k["frontal_area"] * k["drag_coefficient"], "frontal_area times drag_coefficient"),
    _A("track_front", lambda k: k["track_rear"], "as track_rear"),
    _A("track_front", lambda k: 1.5, "usual value; no effect on straight driving"),
    _A("track_rear", lambda k: k["track_front"], "as track_front"),
    _A("roll_inertia", lambda k: k["mass"] * (0.4 * k["track_front"]) ** 2, "radius of gyration of 0.4 track"),
    _A("yaw_inertia", lambda k: k["pitch_inertia"], "as pitch_inertia: passenger cars lie within a tenth of it"),
    _A("unsprung_mass_front", lambda k: 0.05 * k["mass"], "5 % of the mass"),
    _A("unsprung_mass_rear", lambda k: 0.045 * k["mass"], "4.5 % of the mass"),
    _A("tire_vertical_damping", lambda k: 0.0, "small beside the dampers"),
    _A("tire_load_sensitivity", lambda k: 0.0, "friction was measured at about the static load"),
    _A("tire_relaxation_length", lambda k: 0.3, "usual for passenger car tires: 0.1 to 0.4 m"),
    _A("tire_cornering_stiffness", lambda k: 15.0, "usual value; no effect on straight driving"),
    _A("tire_rest_damping", lambda k: REST_DAMPING, "usual value for rubber; only felt where the car stands"),
    _A("rolling_speed", lambda k: 0.0, "rolling resistance assumed independent of speed"),
    _A("drag_height", lambda k: k["cg_height"], "at the center of gravity"),
    _A("air_density", lambda k: air_density(k["temperature"], k["pressure"]), "dry air of this temperature, pressure"),
    _A("air_density", lambda k: air_density(293.15, 1e5), "20 degC, 100 kPa, to which a road load is referred"),
    _A("wind_variance", lambda k: 0.0, "no gusts"),
    _A("driveline_efficiency", lambda k: 1.0, "no loss under load"),
    _A("driveline_inertia", _beyond_the_wheels, "rotating_mass minus four wheels"),
    _A("driveline_inertia", lambda k: LEAST_DRIVELINE_INERTIA, "gears only: the motor is disconnected from the wheels"),
    _A("side_gear_inertia", lambda k: SIDE_GEAR_INERTIA, "usual value of gear and joint; little influence"),
    _A(
        "motor_reaction",
        lambda k: 1.0 / k["gear_ratio"],
        "motor across the car, turning as the wheels do: 1/gear_ratio",
    ),
    _A("motor_reaction", lambda k: 0.0, "the way in which the motor turns is not known"),
    _A(
        "shaft_damping_left",
        _like_the_other_side("left", "right"),
        "that of the right side, in proportion to stiffness",
    ),
    _A(
        "shaft_damping_right",
        _like_the_other_side("right", "left"),
        "that of the left side, in proportion to stiffness",
    ),
    _A("shaft_damping_left", lambda k: SHAFT_TIME * k["shaft_stiffness_left"], "2 ms times the stiffness"),
    _A("shaft_damping_right", lambda k: SHAFT_TIME * k["shaft_stiffness_right"], "2 ms times the stiffness"),
    _A("brake_share_front", lambda k: 0.65, "usual for passenger cars"),
    _A("hub_swing", lambda k: 1.0, "hubs swing with the pitching body"),
    _A("driveline_pitch", lambda k: 1.0, "the driveline pitches with the body"),
)

# Parameters that others, or custom, can stand for.
FOLLOWING = frozenset(way.name for way in _WAYS)
