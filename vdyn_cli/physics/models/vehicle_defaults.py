"""Default values of vehicle parameters that no step and no description gives, for every use of the full model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from vdyn_cli.physics.laws.atmosphere import air_density

Known = Mapping[str, float]


@dataclass(frozen=True)
class Assumption:
    """One default of a parameter: a formula of the known parameters, and its justification.

    ``value`` raises KeyError where it needs an unknown parameter; the next assumption is then tried.
    """

    name: str
    value: Callable[[Known], float]
    because: str


@dataclass(frozen=True)
class Completed:
    """A full parameter set.

    Parameters
    ----------
    values : of every requested name, SI, except those that are missing.
    assumed : reasons for the values that no measurement or description gave, by name.
    missing : names without a value and a default; a default that needs a missing parameter is not listed itself.
    """

    values: Mapping[str, float]
    assumed: Mapping[str, str]
    missing: tuple[str, ...]


def complete(names: Iterable[str], known: Known) -> Completed:
    """The values of ``names``: known ones, and defaults for the others.

    Parameters
    ----------
    names : of parameters. known : values by name, SI.
    """
    values, assumed = _with_defaults(known)
    names = tuple(names)
    missing = [name for name in names if name not in values]
    without_default = {name: 1.0 for name in missing if name not in FOLLOWING}
    there, _ = _with_defaults({**values, **without_default})
    return Completed(
        {name: values[name] for name in names if name in values},
        {name: assumed[name] for name in names if name in assumed},
        tuple(name for name in missing if name in without_default or name not in there),
    )


def _with_defaults(known: Known) -> tuple[dict[str, float], dict[str, str]]:
    """The known values with all defaults that follow from them, and the reason for each default."""
    values = dict(known)
    assumed: dict[str, str] = {}
    for default in _ASSUMPTIONS:
        if default.name in values:
            continue
        try:
            values[default.name] = float(default.value(values))
        except KeyError:
            continue
        assumed[default.name] = default.because
    return values, assumed


def _beyond_the_wheels(k: Known) -> float:
    """Inertia of the driveline, kg m^2 at the wheels: that of the rotating mass minus that of the wheels."""
    rest = k["rotating_mass"] * k["wheel_radius"] ** 2 - 4 * k["wheel_inertia"]
    if rest < LEAST_DRIVELINE_INERTIA:
        raise KeyError("rotating_mass")  # it does not include the driveline
    return rest


def _like_the_other_side(side: str, other: str) -> Callable[[Known], float]:
    return lambda k: k[f"shaft_damping_{other}"] / k[f"shaft_stiffness_{other}"] * k[f"shaft_stiffness_{side}"]


LEAST_DRIVELINE_INERTIA = 0.2  # kg m^2: gears and the inner ends of the shafts alone
SIDE_GEAR_INERTIA = 5e-3  # kg m^2: side gear 1 kg at 25 mm, joint 2.5 kg at 40 mm, a third of a bar of 2 kg at 14 mm
# s/m: a braked car that rocks on its tires at 4 Hz has 9 % of critical damping, for a rubber loss factor of 0.2.
# Pacejka's low-speed damping (Tire and Vehicle Dynamics, 3rd ed., 2012, section 8.6: 770 N s/m) is 0.1 to 0.2.
REST_DAMPING = 0.3
SHAFT_TIME = 2e-3  # s, damping over stiffness of a half-shaft: 8 % of critical at a shuffle of 12 Hz

_A = Assumption
_ASSUMPTIONS = (
    _A("cg_to_front", lambda k: k["wheelbase"] - k["cg_to_rear"], "wheelbase minus cg_to_rear"),
    _A("drag_area", lambda k: k["frontal_area"] * k["drag_coefficient"], "frontal_area times drag_coefficient"),
    _A("track_front", lambda k: k["track_rear"], "as track_rear"),
    _A("track_front", lambda k: 1.5, "usual value; no effect on straight driving"),
    _A("track_rear", lambda k: k["track_front"], "as track_front"),
    _A("roll_inertia", lambda k: k["mass"] * (0.4 * k["track_front"]) ** 2, "radius of gyration of 0.4 track"),
    _A("yaw_inertia", lambda k: k["pitch_inertia"], "as pitch_inertia, within 10 % for passenger cars"),
    _A("unsprung_mass_front", lambda k: 0.05 * k["mass"], "5 % of the mass"),
    _A("unsprung_mass_rear", lambda k: 0.045 * k["mass"], "4.5 % of the mass"),
    _A("tire_vertical_damping", lambda k: 0.0, "small compared with the dampers"),
    _A("tire_load_sensitivity", lambda k: 0.0, "friction was measured at about the static load"),
    _A("tire_relaxation_length", lambda k: 0.3, "usual for passenger car tires: 0.1 to 0.4 m"),
    _A("tire_cornering_stiffness", lambda k: 15.0, "usual value; no effect on straight driving"),
    _A("tire_rest_damping", lambda k: REST_DAMPING, "usual value for rubber; only relevant at standstill"),
    _A("rolling_speed", lambda k: 0.0, "rolling resistance assumed independent of speed"),
    _A("drag_height", lambda k: k["cg_height"], "at the center of gravity"),
    _A("air_density", lambda k: air_density(k["temperature"], k["pressure"]), "dry air of this temperature, pressure"),
    _A("air_density", lambda k: air_density(293.15, 1e5), "20 degC, 100 kPa, reference conditions of a road load"),
    _A("wind_variance", lambda k: 0.0, "no gusts"),
    _A(
        "driveline_efficiency",
        lambda k: 1.0,
        "no loss under load; its interval also covers an equal relative error of wheel radius or torque gain",
    ),
    _A(
        "recuperation_loss",
        lambda k: 0.0,
        "between a loss of the gears (1) and a torque corrected by the efficiency (-1)",
    ),
    _A("driveline_inertia", _beyond_the_wheels, "rotating_mass minus four wheels"),
    _A("driveline_inertia", lambda k: LEAST_DRIVELINE_INERTIA, "gears only: the motor is disconnected from the wheels"),
    _A("side_gear_inertia", lambda k: SIDE_GEAR_INERTIA, "usual value of gear and joint; little influence"),
    _A(
        "motor_reaction",
        lambda k: 1.0 / k["gear_ratio"],
        "transverse motor that turns in the direction of the wheels: 1/gear_ratio",
    ),
    _A("motor_reaction", lambda k: 0.0, "the motor's direction of rotation is not known"),
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
    _A("hub_swing", lambda k: 1.0, "hubs move with the pitching body"),
    _A("driveline_pitch", lambda k: 1.0, "the driveline pitches with the body"),
)

# Parameters with a default.
FOLLOWING = frozenset(default.name for default in _ASSUMPTIONS)
