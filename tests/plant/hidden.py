"""Test days with something hidden in them, and how strongly their logs could show it at best.

The equations of the hidden effects are in the simulations of each step: coast_motion, drive_motion, half_car and so on.

A ``Scenario`` is a random vehicle's campaign of one step with effects hidden in it. ``strength`` is its Cramer-Rao t:
the size of each hidden effect over the least standard deviation that any estimator could give it, the step's
parameters and nuisances being unknown as well, noise and priors known; ``rivals`` is the same with one rival's size
unknown too. A t of 6 can't be missed; a t of 6 with a t of 1 against a rival can't be named.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from tests.plant import bump, cg, coast, coast_information, drive_information, shaft, tire, wheel
from tests.plant.information import Information, prior, total
from tests.plant.vehicle import Vehicle, random_vehicle

FRESH = 500_000  # added to the seed of a further campaign with the same vehicle
DRAWN = 0.0055  # share: 50 micrometers of diameter, 0.3 GPa of modulus
PLAUSIBLE = 10.0  # typical sizes: a rival within these, as a standard deviation, is believed

About = Callable[[Vehicle, int, Mapping[str, float], Sequence[str]], Information]


@dataclass(frozen=True)
class Variant:
    """A way to run a step's test: what is known of the vehicle, what is driven, what is measured.

    ``information(vehicle, seed, hidden, unknowns)`` is about the step's own unknowns and those effects;
    ``rivals`` are the effects of the catalog with a typical size, that of a cell in which each is hidden.
    """

    about: str
    information: About
    rivals: Mapping[str, float]
    day: coast.Day | None = None
    fixed: bool = False


@dataclass(frozen=True)
class Scenario:
    """What is hidden in the logs of one random vehicle; ``campaign``: seed of the logs where not the vehicle's."""

    step: str
    effects: Mapping[str, float]
    seed: int
    variant: str = ""
    campaign: int | None = None
    fault: str = ""

    @property
    def vehicle(self) -> Vehicle:
        return random_vehicle(self.seed)

    @property
    def drawn(self) -> int:
        return self.seed if self.campaign is None else self.campaign

    @property
    def way(self) -> Variant:
        return VARIANTS[self.step, self.variant]

    def fresh(self) -> Scenario:
        """The same vehicle with the same thing hidden, driven and measured anew."""
        return replace(self, campaign=self.drawn + FRESH)

    def evidence(self) -> Evidence:
        """What these logs could tell of the hidden effects and their rivals."""
        sizes = {**self.way.rivals, **self.effects}
        at_truth = self.way.information(self.vehicle, self.drawn, self.effects, tuple(self.effects))
        at_nothing = _at_nothing(self.step, self.variant, self.seed, self.drawn, tuple(sizes))
        loose = prior({name: PLAUSIBLE * abs(size) for name, size in sizes.items()})
        return Evidence(sizes, tuple(self.effects), at_truth, total([at_nothing, loose]))


@lru_cache(16)
def _at_nothing(step: str, variant: str, seed: int, drawn: int, unknowns: tuple[str, ...]) -> Information:
    """Kept from row to row of the matrix: most hide another effect of the same catalog in the same vehicle's logs."""
    return VARIANTS[step, variant].information(random_vehicle(seed), drawn, {}, unknowns)


@dataclass(frozen=True)
class Evidence:
    """Information about a step's own unknowns and some effects.

    ``at_truth`` is about the hidden ones, and tells how well their sizes can be known. ``at_nothing`` is about all of
    ``sizes`` where none is there, and tells whether another could stand in for the hidden one: about the truth a mere
    scale error, which changes what it is taken for, would count as a rival.
    """

    sizes: Mapping[str, float]
    hidden: tuple[str, ...]
    at_truth: Information
    at_nothing: Information

    def t(self) -> dict[str, float]:
        """Of each hidden effect, the other hidden ones being unknown too."""
        loose = prior({name: PLAUSIBLE * abs(self.sizes[name]) for name in self.hidden})
        bound = total([self.at_truth, loose]).bound()  # finite also where the step's own unknowns take all of it
        return {name: abs(self.sizes[name]) / bound[name] for name in self.hidden}

    def alone(self, effect: str, beside: Sequence[str] = ()) -> float:
        """t of any effect of its typical size while the effects ``beside`` it are unknown, and no other is there."""
        absent = set(self.sizes) - {effect, *beside}
        left = self.at_nothing.known(absent).reduced([effect]).matrix[0, 0]
        return float(max(self.sizes[effect] ** 2 * left - PLAUSIBLE**-2, 0.0) ** 0.5)  # without its own prior

    def rivals(self) -> dict[str, dict[str, float]]:
        """Of each hidden effect against each other effect of the catalog, the other hidden ones being unknown."""
        others = [name for name in self.sizes if name not in self.hidden]
        return {
            name: {rival: self.alone(name, [rival, *(n for n in self.hidden if n != name)]) for rival in others}
            for name in self.hidden
        }

    def least(self) -> dict[str, float]:
        """The least of t and of the t against every rival, of each hidden effect."""
        return {name: min([t, *self.rivals()[name].values()]) for name, t in self.t().items()}


def _coast(day: coast.Day, fixed: bool) -> About:
    def about(vehicle: Vehicle, seed: int, hidden: Mapping[str, float], unknowns: Sequence[str]) -> Information:
        info = coast_information.information(vehicle, seed, day, hidden, unknowns)
        return info.known(["drag_area"]) if fixed else info

    return about


COASTING: Mapping[str, float] = {
    "extra_drag_area": 0.10,
    "headwind": 2.0,
    "road_grade": 0.002,
    "grade_profile": 0.003,
    "speed_dependent_rolling": 1e-4,
    "tire_warmup": 0.15,
    "brake_drag": 40.0,
    "brake_drag_fading": 40.0,
    "driveline_drag": 40.0,
    "rotating_mass": 80.0,
    "mass_error": 0.05,
    "speed_scale": 0.03,
    "speed_delay": 0.15,
}
DRIVEN = {**COASTING, "torque_gain": 0.03, "torque_offset": 3.0, "wheel_radius": 0.02}
MANY = coast.WIDE.but(runs=16)
# Morning, noon and evening: were it to warm up all day, the tires' own warming would look alike.
WARM = MANY.but(
    temperatures=(12.0, 15.0, 18.0, 20.5, 23.0, 25.0, 27.0, 28.0, 28.0, 27.0, 25.0, 23.0, 20.0, 17.0, 14.0, 12.0)
)


LOADED: Mapping[str, float] = {
    "accelerometer_tilt": 0.01,
    "accelerometer_offset": 0.1,
    "accelerometer_gain": 0.03,
    "wheel_force_gain": 0.01,
    "clock_offset": 0.005,
    "acceleration_delay": 0.005,
    "acceleration_lag": 0.02,
    "road_grade": 0.01,
    "aero_lift": 0.3,
    "unsprung_mass": 80.0,
    "pitch_axis": 0.1,
}
BUMPED: Mapping[str, float] = {
    "asymmetric_damping": 0.02,
    "suspension_friction": 20.0,
    "progressive_spring": 0.1,
    "bump_stop": 80.0,
    "tire_damping": 20.0,
    "tire_enveloping": 0.03,
    "speed_error": 0.003,
    "clock_offset": 0.001,
    "rear_load_delay": 0.001,
    "front_load_gain": 0.005,
    "rear_load_gain": 0.005,
    "logger_filter": 0.002,
}
SPUN: Mapping[str, float] = {
    "brake_drag": 3.0,
    "bearing_drag": 0.1,
    "bearing_warmup": 3.0,
    "wheel_windage": 1e-3,
    "hub_torque_gain": 0.01,
    "hub_torque_offset": 3.0,
    "hub_torque_crosstalk": 2e-3,
    "torque_zero_drift": 0.2,
    "clock_offset": 0.002,
    "hub_torque_delay": 0.005,
    "hub_torque_lag": 0.005,
    "wheel_radius": 0.01,
    "wheel_mass": 2.0,
}
SLIPPED: Mapping[str, float] = {
    "load_sensitivity": 1e-5,
    "slip_offset": 0.001,
    "force_offset": 20.0,
    "load_offset": 40.0,
    "rolling_force": 0.005,
    "tire_relaxation": 0.2,
    "friction_fade": 0.005,
    "braking_friction": 0.01,
    "vertical_crosstalk": 0.005,
}
TWISTED: Mapping[str, float] = {
    "series_compliance": 5e-6,
    "damping": 20.0,
    "backlash": 2e-3,
    "torque_zero_drift": 0.1,
    "inertia_before_shaft": 0.1,
}


DRIVES: Mapping[str, float] = {
    "extra_drag_area": 0.10,
    "headwind": 1.0,
    "road_grade": 0.001,
    "grade_profile": 0.002,
    "speed_dependent_rolling": 1e-4,
    "tire_warmup": 0.3,
    "brake_drag": 30.0,
    "brake_drag_fading": 30.0,
    "driveline_drag": 30.0,
    "rotating_mass": 60.0,
    "mass_error": 0.02,
    "wheel_radius": 0.005,
    "wheel_inertia": 0.3,
    "shaft_stiffness": 0.1,
    "shaft_damping": 0.5,
    "tire_relaxation": 0.5,
    "motor_inertia": 0.6,
    "backlash": 2e-3,
    "torque_gain": 0.01,
    "torque_offset": 2.0,
    "torque_delay": 0.01,
    "speed_scale": 0.005,
    "speed_delay": 0.03,
}


def _drives(vehicle: Vehicle, seed: int, hidden: Mapping[str, float], unknowns: Sequence[str]) -> Information:
    """Slopes are about a car with nothing hidden: what is told of some effects is a part of what is told of all."""
    every = tuple(dict.fromkeys([*DRIVES, *unknowns]))
    return _drives_at_nothing(vehicle, seed, every).known(set(every) - set(unknowns))


@lru_cache(16)
def _drives_at_nothing(vehicle: Vehicle, seed: int, unknowns: tuple[str, ...]) -> Information:
    return drive_information.information(vehicle, seed, unknowns)


def _coasting(about: str, day: coast.Day, fixed: bool, rivals: Mapping[str, float] = COASTING) -> Variant:
    return Variant(about, _coast(day, fixed), rivals, day, fixed)


def _plain(information: Callable[..., Information]) -> About:
    return lambda vehicle, seed, hidden, unknowns: information(vehicle, seed, hidden, unknowns=unknowns)


def _drawn(vehicle: Vehicle, seed: int, hidden: Mapping[str, float], unknowns: Sequence[str]) -> Information:
    """The drawing's stiffness is within ``DRAWN`` of its value, as ``read_drawing`` of the benches reads it."""
    info = shaft.information(vehicle, seed, hidden, unknowns=unknowns)
    return total([info, prior({"shaft_stiffness_left": DRAWN * vehicle.shaft_stiffness_left})])


VARIANTS: dict[tuple[str, str], Variant] = {
    ("coastdown", "wide"): _coasting("16 coasts from 36 to 2 m/s, drag and rolling both unknown", MANY, False),
    ("coastdown", "warm"): _coasting(
        "16 coasts on a day from 12 to 28 degC", WARM, False, {**COASTING, "temperature_rolling": 0.008}
    ),
    ("coastdown", "fixed"): _coasting("16 coasts from 36 to 2 m/s, drag coefficient fixed", MANY, True),
    ("coastdown", "eight"): _coasting("8 coasts from 36 to 2 m/s, drag and rolling both unknown", coast.WIDE, False),
    ("coastdown", "short"): _coasting("8 coasts from 75 to 20 km/h, drag coefficient fixed", coast.DAY, True),
    ("coastdown", "one_way"): _coasting("8 coasts all one way", coast.WIDE.but(one_way=True), False),
    ("coastdown", "powered"): _coasting("8 drives of 120 s with known torque", coast.POWERED, False, DRIVEN),
    ("cg", ""): Variant("4 accelerate-and-brake runs", _plain(cg.information), LOADED),
    ("bump", ""): Variant("4 crossings, wheels lifting off", _plain(bump.information), BUMPED),
    ("inertia", ""): Variant("3 drives with throttle and brake steps", _plain(wheel.information), SPUN),
    ("tire", ""): Variant("5 slip sweeps beyond the peak", _plain(tire.information), SLIPPED),
    ("validate", ""): Variant("3 drives from rest to 90 km/h and back", _drives, DRIVES),
    ("shaft", ""): Variant("one tip-in of the left half-shaft", _plain(shaft.information), TWISTED),
    ("shaft", "drawn"): Variant("the same, and the shaft's drawing", _drawn, TWISTED),
}
