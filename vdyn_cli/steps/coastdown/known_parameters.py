"""The car's known parameters with their uncertainties, completed by defaults, and the unknowns of the fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.inference import Unknown
from vdyn_cli.physics.models.road_load import DRIVELINE, DriveSignal
from vdyn_cli.quantities.constants import ROTATING_SHARE, ROTATING_SHARE_STD, USUAL_WHEELS
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.coastdown.fit.campaign import AccelerometerUse
from vdyn_cli.steps.coastdown.spec import CoastdownSpec

SCALE_ERROR = 0.02  # standard deviation of the accelerometer's gain: the body pitches when the car accelerates
RECUPERATION_STD = 1.0  # 1: the gears' loss; -1: a torque that holds the efficiency of driving
PRIOR_REACH = 8.0  # prior standard deviations by which a value may move: beyond, the given value is wrong
ROAD_LOAD = {  # start, lower and upper bound, unit
    "rolling_resistance": (0.012, 5e-4, 0.1, ""),
    "rolling_speed": (0.0, -5e-3, 5e-3, "s/m"),
    "drag_area": (0.65, 0.05, 15.0, "m^2"),
}


def known_parameters(spec: CoastdownSpec, logs: Sequence[Log], known: Parameters) -> dict[str, Given]:
    """The known parameters in SI, completed with fixed ones and the rotating mass.

    Raises
    ------
    InputError : a parameter is missing, or no parameter is left to estimate.
    """
    fix = spec.settings.fix
    if len(fix.names) == 2:
        what = "rolling resistance and drag are both fixed: no parameter is left to estimate"
        raise InputError(Finding("settings.fix", what, remedy="remove one of them"))
    torque = spec.settings.windows != "coast" and all("drive_torque" in log for log in logs)
    area = ("frontal_area",) if fix.drag_coefficient else ()
    known.require("mass", "air_density", *(("gear_ratio", "wheel_radius") if torque else ()), *area, where="coastdown")
    given = {n: Given(e.value, e.std) for n, e in known.items() if n not in ("rolling_resistance", "drag_area")}
    efficiency = given.setdefault("driveline_efficiency", Given(1.0))
    given.setdefault("recuperation_loss", Given(0.0, RECUPERATION_STD if torque and efficiency.value < 1.0 else 0.0))
    given.setdefault("rotating_mass", _rotating_mass(given))
    if fix.rolling_resistance:
        given["rolling_resistance"] = fix.rolling_resistance
    if fix.drag_area:
        given["drag_area"] = fix.drag_area
    elif fix.drag_coefficient:
        coefficient, area_ = fix.drag_coefficient, given["frontal_area"]
        value = coefficient.value * area_.value
        share = float(np.hypot(coefficient.std / coefficient.value, area_.std / area_.value))
        given["drag_area"] = Given(value, value * share)
    return given


def assumptions(known: Parameters) -> tuple[Finding, ...]:
    """A finding where the rotating mass is assumed."""
    if "rotating_mass" in known or _by_wheels(known):
        return ()
    what = (
        f"rotating_mass is not given: assumed {100 * ROTATING_SHARE:.1f} % (+- "
        f"{100 * ROTATING_SHARE_STD:.0f} %) of the mass, "
        "typical for wheels; motors add to it"
    )
    remedy = (
        "add 'rotating_mass: <number> kg' under vehicle: sum of J/r^2 of the wheels and all parts that turn with them"
    )
    return (Finding("vehicle", what, remedy=remedy),)


def model_values(known: Mapping[str, Given], use: AccelerometerUse, drive: DriveSignal) -> dict[str, float]:
    """A value for every parameter of the road load model, SI; start values of those that are estimated.

    Parameters
    ----------
    known : parameters with their standard deviations, SI. use : of the accelerometer. drive : the measured drive.
    """
    names = ["mass", "rotating_mass", "air_density"]
    names += DRIVELINE if drive == "torque" else ()
    values = {n: known[n].value for n in names}
    values |= {n: known[n].value if n in known else ROAD_LOAD[n][0] for n in ROAD_LOAD}
    sensor = ("accelerometer_zero", "accelerometer_scale", "road_slope") if use != "none" else ()
    return values | dict.fromkeys(("wind_variance", *sensor), 0.0)


def campaign_unknowns(
    known: Mapping[str, Given], values: Mapping[str, float], use: AccelerometerUse, terms: int, both_ways: bool
) -> tuple[Unknown, ...]:
    """The unknowns of the road load, then the uncertain known parameters, then the accelerometer's zero and scale.

    Parameters
    ----------
    values : of the model's parameters. terms : of the road load, 2 or 3.
    both_ways : whether runs in both directions separate the road's slope from the accelerometer's zero.
    """
    found = []
    for name, (start, low, high, unit) in ROAD_LOAD.items():
        if name not in known and not (name == "rolling_speed" and terms == 2):
            found.append(Unknown(name, start, low, high, unit))
    for name in values:
        if name in known and known[name].std > 0:
            mean, std = known[name].value, known[name].std
            low, high = mean - PRIOR_REACH * std, mean + PRIOR_REACH * std
            low = max(low, 0.1 * mean) if mean > 0 else low
            found.append(Unknown(name, mean, low, high, "", (mean, std), nuisance=True))
    if use == "with_speed":
        found.append(Unknown("accelerometer_zero", 0.0, -3.0, 3.0, "m/s^2", nuisance=True))
        if both_ways:
            found.append(Unknown("road_slope", 0.0, -0.2, 0.2, nuisance=True))
    if use != "none":
        found.append(Unknown("accelerometer_scale", 0.0, -0.3, 0.3, "", (0.0, SCALE_ERROR), nuisance=True))
    return tuple(found)


def _by_wheels(known: Mapping[str, object] | Parameters) -> bool:
    return "wheel_inertia" in known and "wheel_radius" in known


def _rotating_mass(known: Mapping[str, Given]) -> Given:
    """n J/r^2 of n wheels where their inertia is known, else the usual share of the mass, kg."""
    if _by_wheels(known):
        inertia, radius = known["wheel_inertia"], known["wheel_radius"].value
        wheels = known["wheels"].value if "wheels" in known else USUAL_WHEELS
        return Given(wheels * inertia.value / radius**2, wheels * inertia.std / radius**2)
    mass = known["mass"].value
    return Given(ROTATING_SHARE * mass, ROTATING_SHARE_STD * mass)
