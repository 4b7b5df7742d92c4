"""Known numbers of the half car: masses, lengths, the body's pitch inertia, the bump, the sensors' zeros."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.physics.models.half_car import BODY_OF, sprung_body
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding, InputError, raise_all
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.bump.crossing import LOADS
from vdyn_cli.steps.bump.policy import BUMP_POLICY
from vdyn_cli.steps.bump.spec import BumpSpec

ENDS = ("front", "rear")
HUBS = tuple(f"hub_compliance_{end}" for end in ENDS)
LEAST_SPRUNG = 0.3  # share of the mass; cars have 0.8 to 0.95, and less than a third means a wrong unit
USUAL_LEVER = Given(0.30, 0.08)  # m, height of the center of gravity above the wheel centers: 0.45 to 0.7 minus 0.3
# m, standard deviation of the lever of longitudinal forces: support angles (anti-dive, anti-squat) of up to 10 degrees
# at half a wheelbase of 1.3 m take off up to 0.23 m, and a truck's center is higher than a car's.
LEVER_STD = 0.3
LEVER_RANGE = (-0.5, 2.0)  # m
# s^2, mass over fore-aft stiffness of an axle's hubs: natural frequencies of 12 to 20 Hz, and stiff ones (0)
USUAL_COMPLIANCE = Given(1.1e-4, 0.8e-4)
COMPLIANCE_RANGE = (-1e-4, 3.1e-4)  # s^2: below 9 Hz a hub would move by more than 10 mm when braking
# slope of the path of an axle's hubs: support angles of up to 10 degrees are two deviations
USUAL_SUPPORT = Given(0.0, 0.1)
SUPPORT_RANGE = (-0.5, 0.5)  # 27 degrees
USUAL_INDEX = (0.4, 1.6)  # Is / (Ms lf lr): half and twice that of cars, which is between 0.7 and 1


@dataclass(frozen=True)
class KnownCar:
    """Known numbers of the half car.

    Parameters
    ----------
    values : by name, SI. std : of the uncertain ones, which become unknowns with that prior.
    zeros : standard deviations of the sensors' zeros, by channel. speed_scale : relative, of the speed's scale.
    """

    values: Mapping[str, float]
    std: Mapping[str, float]
    zeros: Mapping[str, float]
    speed_scale: float

    def with_soft_hubs(self) -> KnownCar:
        """The car whose hubs move fore and aft as those of usual cars do, to be estimated."""
        usual = self.with_values(dict.fromkeys(HUBS, USUAL_COMPLIANCE.value))
        return replace(usual, std={**self.std, **dict.fromkeys(HUBS, USUAL_COMPLIANCE.std)})

    def with_values(self, changed: Mapping[str, float]) -> KnownCar:
        """The car with other values of some numbers, SI."""
        return replace(self, values={**self.values, **changed})

    def ranges(self) -> dict[str, tuple[float, float]]:
        """Physical ranges of the uncertain numbers, SI."""
        found = {n: (PARAMETERS[n].lower, PARAMETERS[n].upper) for n in self.std if n in PARAMETERS}
        found |= {"longitudinal_lever": LEVER_RANGE}
        found |= dict.fromkeys(HUBS, COMPLIANCE_RANGE)
        found |= {f"support_slope_{end}": SUPPORT_RANGE for end in ENDS}
        return found | {n: (0.2 * self.values[n], 5 * self.values[n]) for n in self.std if n not in found}


def known_car(spec: BumpSpec, known: Parameters) -> tuple[KnownCar, tuple[Finding, ...]]:
    """The known numbers of the half car, from the description and earlier steps, and findings about them.

    Raises
    ------
    InputError : numbers are missing or contradict each other.
    """
    settings, bump = spec.settings, spec.obstacle
    numbers, findings = car_numbers(known)
    # These two scale a measured profile.
    numbers["bump_height"], numbers["bump_width"] = bump.height or Given(1.0), bump.width or Given(1.0)
    numbers["outboard_mass"] = Given(0.0)
    place = numbers["antenna_offset"]
    if "vertical_acceleration" in spec.mapped:
        numbers["antenna_offset"] = Given(place.value, place.std or BUMP_POLICY.bump_accelerometer)
    sprung, _ = sprung_body(*(numbers[n].value for n in BODY_OF))
    above = _height_above_wheels({n: Given(e.value, e.std) for n, e in known.items()}).value
    numbers["longitudinal_lever"] = Given(numbers["mass"].value / sprung * above, LEVER_STD)  # of the sprung body
    if settings.load_sensor == "hub":
        known.require("wheel_mass", where="bump")
        wheel = known["wheel_mass"]
        numbers["outboard_mass"] = Given(2 * wheel.value, 2 * wheel.std)
    zeros = dict.fromkeys(LOADS, settings.load_zero.value * 2**0.5)  # two wheels an axle
    zeros |= {"vertical_acceleration": settings.acceleration_zero.value, "pitch_rate": settings.pitch_rate_zero.value}
    numbers |= dict.fromkeys(HUBS, Given(0.0))
    numbers |= {f"support_slope_{end}": USUAL_SUPPORT for end in ENDS}
    values = {n: g.value for n, g in numbers.items()}
    std = {n: g.std for n, g in numbers.items() if g.std > 0}
    return KnownCar(values, std, zeros, settings.speed_scale.value), findings


def car_numbers(known: Parameters) -> tuple[dict[str, Given], tuple[Finding, ...]]:
    """Masses, lengths and the sprung body's pitch inertia, SI, with standard deviations; and findings about them.

    Raises
    ------
    InputError : numbers are missing or contradict each other.
    """
    stated = {n: Given(e.value, e.std) for n, e in known.items()}
    alternatives = {"sprung_mass": "mass", "cg_to_rear": "cg_to_front", "sprung_pitch_inertia": "pitch_inertia"}
    plain = ("wheelbase", "unsprung_mass_front", "unsprung_mass_rear")
    known.require(*plain, *(n for other, n in alternatives.items() if other not in stated), where="bump")
    found = {n: stated[n] for n in plain}
    found["mass"] = _mass(stated)
    wheelbase = stated["wheelbase"].value
    rear = stated.get("cg_to_rear", Given(0.0))
    found["cg_to_front"] = stated.get("cg_to_front", Given(wheelbase - rear.value, rear.std))
    _refuse_impossible(found)
    found["sprung_pitch_inertia"], findings = _pitch_inertia(stated, found)
    sprung, to_front = sprung_body(*(found[n].value for n in BODY_OF))
    index = found["sprung_pitch_inertia"].value / (sprung * to_front * (wheelbase - to_front))
    if not USUAL_INDEX[0] < index < USUAL_INDEX[1]:
        what, got = "is unusual for this mass and wheelbase", f"Is/(Ms lf lr) = {index:.2f}, usually 0.7 to 1"
        findings += (Finding("pitch_inertia", what, got, "check its unit and axis"),)
    found["antenna_offset"] = stated.get("antenna_offset", Given(0.0))
    return found, findings


def _mass(stated: Mapping[str, Given]) -> Given:
    """The mass of the whole car: as stated, or the sum of its parts with their uncertainties."""
    if "sprung_mass" not in stated:
        return stated["mass"]
    parts = [stated[n] for n in ("sprung_mass", "unsprung_mass_front", "unsprung_mass_rear")]
    total = Given(sum(p.value for p in parts), float(np.hypot.reduce([p.std for p in parts])))
    whole = stated.get("mass")
    if whole is not None and abs(whole.value - total.value) > BUMP_POLICY.mass_agreement * whole.value + 3 * whole.std:
        got = f"mass {whole.value:.0f} kg, sprung and unsprung together {total.value:.0f} kg"
        raise InputError(Finding("vehicle", "the masses contradict each other", got, "leave out mass or sprung_mass"))
    return total


def _refuse_impossible(found: Mapping[str, Given]) -> None:
    """Raise InputError where the sprung mass is too small or the center of gravity is not between the axles."""
    findings = []
    sprung, to_front = sprung_body(*(found[n].value for n in BODY_OF))
    if sprung <= LEAST_SPRUNG * found["mass"].value:
        what = (
            f"the sprung mass is {sprung:.0f} kg of {found['mass'].value:.0f} kg: less than {100 * LEAST_SPRUNG:.0f} %"
        )
        findings.append(Finding("vehicle", what, "", "check the mass and the unsprung masses"))
    elif not 0.05 < to_front / found["wheelbase"].value < 0.95:
        got = f"{found['cg_to_front'].value:.2f} m behind the front axle, wheelbase {found['wheelbase'].value:.2f} m"
        what = "the center of gravity does not lie between the axles"
        findings.append(Finding("vehicle", what, got, "check cg_to_front and wheelbase"))
    raise_all(findings)


def _pitch_inertia(stated: Mapping[str, Given], found: Mapping[str, Given]) -> tuple[Given, tuple[Finding, ...]]:
    """Pitch inertia of the sprung body about its center of gravity, kg m^2, and findings.

    When the body pitches by th about the height of the wheels, its center, s above that, moves fore and aft by s th
    relative to the axles. With the whole car's center at rest this motion has the energy of the reduced mass Ms mu/M.
    The whole car's moment balance therefore gives I = Is + (Ms mu/M) s^2 with s = M (h - r)/Ms, the axles at r::

        Is = I - mu M/Ms (h - r)^2

    Assumes that the whole car's pitch inertia I was estimated with wheels on the ground (as `vdyn cg` does).
    """
    if "sprung_pitch_inertia" in stated:
        return stated["sprung_pitch_inertia"], ()
    whole = stated["pitch_inertia"]
    findings: tuple[Finding, ...] = ()
    lever = _height_above_wheels(stated)
    if lever is USUAL_LEVER:
        what = "pitch_inertia is taken as that of the whole car, and the axles' part of it as in a typical car"
        findings = (Finding("bump", what, "", "give cg_height and wheel_radius, or sprung_pitch_inertia"),)
    mass = found["mass"].value
    unsprung = found["unsprung_mass_front"].value + found["unsprung_mass_rear"].value
    factor = unsprung * mass / (mass - unsprung)
    std = float(np.hypot(whole.std, 2 * factor * lever.value * lever.std))
    return Given(whole.value - factor * lever.value**2, std), findings


def _height_above_wheels(stated: Mapping[str, Given]) -> Given:
    """Height of the car's center of gravity above the wheels' centers, m; that of a typical car if not stated."""
    if "cg_height" not in stated or "wheel_radius" not in stated:
        return USUAL_LEVER
    height, radius = stated["cg_height"], stated["wheel_radius"]
    return Given(height.value - radius.value, float(np.hypot(height.std, radius.std)))


def static_loads(values: Mapping[str, float]) -> dict[str, float]:
    """Axle loads at rest, N, by channel: M g (L - lf) / L in front, M g lf / L at the rear.

    Parameters
    ----------
    values : mass M (kg), cg_to_front lf and wheelbase L (m).
    """
    share = values["cg_to_front"] / values["wheelbase"]
    weight = values["mass"] * GRAVITY
    return {"front_load": weight * (1 - share), "rear_load": weight * share}


def carried_masses(values: Mapping[str, float]) -> dict[str, float]:
    """The part of the sprung mass that the springs of each axle carry, kg; ``values`` of the car, SI."""
    sprung, to_front = sprung_body(*(values[n] for n in BODY_OF))
    share = to_front / values["wheelbase"]
    return {"front": sprung * (1 - share), "rear": sprung * share}


def usual_car(values: Mapping[str, float]) -> dict[str, float]:
    """Springs, dampers and tires of a typical car of this weight, SI by name.

    K = m (2 pi 1.3 Hz)^2 and C = 2 0.3 sqrt(K m), m the sprung mass of an axle; tires 250 1/s^2 times the mass

    Parameters
    ----------
    values : masses (kg), cg_to_front and wheelbase (m).
    """
    start = {"tire_vertical_stiffness": 250.0 * values["mass"]}
    for end, mass in carried_masses(values).items():
        stiffness = mass * (2 * np.pi * 1.3) ** 2
        start[f"suspension_stiffness_{end}"] = stiffness
        start[f"suspension_damping_{end}"] = 2 * 0.3 * float(np.sqrt(stiffness * mass))
    return start
