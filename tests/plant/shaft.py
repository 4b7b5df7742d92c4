"""Half-shafts: drawings of the left and right one, and a tip-in (and tip-out) with the left one's twist logged.

A motor of its own inertia turns the shaft's inner end, the wheel its outer one; the tire's slip builds up over its
relaxation length and pushes half a car. Explicit midpoint steps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import atan, copysign, exp, pi, sin

import numpy as np
from scipy.sparse import csr_matrix, diags, hstack, vstack
from scipy.sparse.linalg import splu

from tests.plant.information import Array, Information, effect_slopes
from tests.plant.sample import Samples
from tests.plant.sensors import SHAFT_TORQUE, WHEEL_SPEED, Record, Sensor, jitter, read, regular
from tests.plant.vehicle import AIR_DENSITY, REFERENCE, Vehicle
from tests.plant.write_csv import csv_bytes

EFFECTS = {
    "series_compliance": "rad/(N m) of the joints, in series with the shaft",
    "damping": "N m s/rad beyond the vehicle's",
    "backlash": "rad of free play to either side",
    "inertia_before_shaft": "kg m^2 between the torque's measurement and the shaft, by the motor's current",
    "shaft_friction": "N m of dry friction, which turns over 1 mrad of twist",
    "torque_zero_drift": "N m/s by which the torque's zero drifts from the start",
    "stiffening": "1/rad^2: torque k phi (1 + q phi^2); in no catalog, for controls",
}
# Sizes at which finite differences are taken.
SMALL = {
    "series_compliance": 1e-7,
    "damping": 0.1,
    "backlash": 1e-3,
    "stiffening": 1.0,
    "inertia_before_shaft": 0.01,
    "shaft_friction": 0.1,
    "torque_zero_drift": 0.1,
}
ONE_SIDED = ("backlash",)
RATE = 1000.0
STEP = 1.25e-4  # s
SENSORS: dict[str, Sensor] = {
    "Shaft Torque [N m]": SHAFT_TORQUE,
    "Motor Speed [rad/s]": WHEEL_SPEED.but(noise=0.015),
    "Wheel Speed [rad/s]": WHEEL_SPEED.but(noise=0.015),
    "Twist [deg]": Sensor(noise=np.radians(0.003), step=np.radians(0.001), zero=np.radians(0.05)),
}
DECIMALS = {"Time [s]": 6, "Shaft Torque [N m]": 1}


@dataclass(frozen=True)
class Section:
    """A piece of shaft between two steps of its diameter, m."""

    outer_diameter: float
    inner_diameter: float
    length: float

    def compliance(self, shear_modulus: float) -> float:
        """rad/(N m): length / (G J), the polar moment J being the area times the mean square radius."""
        area = pi * (self.outer_diameter**2 - self.inner_diameter**2) / 4
        mean_square = (self.outer_diameter**2 + self.inner_diameter**2) / 8
        return self.length / (shear_modulus * area * mean_square)


# Splined ends, collars, and the bar between them: solid and short on the left, a tube on the right. mm.
PATTERN = {
    "left": ((31, 0, 42), (33, 0, 28), (36, 0, 215), (33, 0, 28), (31, 0, 42)),
    "right": ((30, 0, 46), (32, 0, 40), (40, 30, 490), (32, 0, 40), (30, 0, 46)),
}


def drawing(vehicle: Vehicle, side: str) -> list[Section]:
    """Sections to a tenth of a millimeter whose stiffness is the vehicle's within 0.1 %."""
    wanted, shear = float(getattr(vehicle, f"shaft_stiffness_{side}")), vehicle.shear_modulus
    plain = [Section(*(value / 1000 for value in row)) for row in PATTERN[side]]
    thicker = (wanted * sum(s.compliance(shear) for s in plain)) ** 0.25
    sections = [
        Section(round(thicker * s.outer_diameter, 4), round(thicker * s.inner_diameter, 4), s.length) for s in plain
    ]
    bar = sections[2]
    ends = sum(s.compliance(shear) for s in sections if s is not bar)
    length = bar.length * (1.0 / wanted - ends) / bar.compliance(shear)
    return [*sections[:2], Section(bar.outer_diameter, bar.inner_diameter, round(length, 4)), *sections[3:]]


def stiffness(sections: list[Section], shear_modulus: float) -> float:
    """N m/rad."""
    return 1.0 / sum(section.compliance(shear_modulus) for section in sections)


def truth(vehicle: Vehicle) -> dict[str, float]:
    """Stiffness as drawn; damping of the left shaft, whose twist is logged."""
    sides = {f"shaft_stiffness_{s}": stiffness(drawing(vehicle, s), vehicle.shear_modulus) for s in PATTERN}
    return {**sides, "shaft_damping_left": vehicle.shaft_damping_left}


def known(vehicle: Vehicle) -> dict[str, float]:
    return {"shear_modulus": vehicle.shear_modulus}


def noise_free(vehicle: Vehicle, times: Array, effects: Mapping[str, float] | None = None) -> dict[str, Array]:
    """What perfect sensors would log, SI, by column header."""
    effects = effects or {}
    unknown = set(effects) - set(EFFECTS)
    if unknown:
        raise ValueError(f"a shaft has no effect {sorted(unknown)}")
    grid = STEP * np.arange(int(times[-1] / STEP) + 3)
    history = _drive(vehicle, tuple(sorted(effects.items())), len(grid))
    found = {header: np.interp(times, grid, signal) for header, signal in zip(SENSORS, history.T, strict=True)}
    found["Shaft Torque [N m]"] += effects.get("torque_zero_drift", 0.0) * (times - times[0])
    accelerated = np.gradient(history[:, 1], STEP) * effects.get("inertia_before_shaft", 0.0)
    found["Shaft Torque [N m]"] += np.interp(times, grid, accelerated)
    return found


def campaign(
    vehicle: Vehicle, seed: int, effects: Mapping[str, float] | None = None, duration: float = 4.0
) -> list[Record]:
    """One log, noise and all."""
    rng = np.random.default_rng([seed, 0x5A])
    times = jitter(regular(duration, RATE), 0.05, rng)
    columns = {"Time [s]": times}
    for header, true in noise_free(vehicle, times, effects).items():
        columns[header] = read(SENSORS[header], true, rng) * (float(np.degrees(1.0)) if "deg" in header else 1.0)
    return [Record(columns, DECIMALS)]


def information(
    vehicle: Vehicle,
    seed: int,
    effects: Mapping[str, float] | None = None,
    duration: float = 4.0,
    unknowns: Sequence[str] = (),
    sensors: Mapping[str, Sensor] = SENSORS,
) -> Information:
    """About stiffness, damping and the zero of torque (its and the twist's) of the left shaft, and the effects in
    ``unknowns``.

    The motion is unknown: every sample's rate of twist is, and the twist at the start; twist is its running mean.
    """
    times = jitter(regular(duration, RATE), 0.05, np.random.default_rng([seed, 0x5A]))
    _, fast, slow, twist = noise_free(vehicle, times, effects).values()
    n = times.size
    sd_torque, sd_fast, sd_slow, sd_twist = (float(np.hypot(s.noise, s.step / 12**0.5)) for s in sensors.values())
    q = effects or {}
    k = 1.0 / (1.0 / truth(vehicle)["shaft_stiffness_left"] + q.get("series_compliance", 0.0))
    c = vehicle.shaft_damping_left + q.get("damping", 0.0)

    def beyond(hidden: Mapping[str, float]) -> Array:
        torque, fast, slow, twist = noise_free(vehicle, times, hidden).values()
        return np.asarray(torque - k * twist - c * (fast - slow))

    by_effect = effect_slopes(beyond, effects or {}, unknowns, SMALL, ONE_SIDED)
    eye, none = diags([np.ones(n)], [0]), csr_matrix((n, n))
    half = np.diff(times) / 2
    chain = hstack([diags([-np.ones(n - 1), np.ones(n - 1)], [0, 1], shape=(n - 1, n)),
                    -diags([half, half], [0, 1], shape=(n - 1, n))])  # fmt: skip
    motion = vstack(
        [
            hstack([k * eye, c * eye]) / sd_torque,
            hstack([none, eye]) / np.hypot(sd_fast, sd_slow),
            hstack([eye, none]) / sd_twist,
            chain / 1e-8,
        ]
    ).tocsc()
    sought = np.column_stack([twist, fast - slow, np.ones(n), by_effect]) / sd_torque
    taken = motion[:n].T @ sought
    left = sought.T @ sought - taken.T @ splu((motion.T @ motion).tocsc()).solve(taken)
    return Information(("shaft_stiffness_left", "shaft_damping_left", "zero", *unknowns), left)


def samples() -> Samples:
    (log,) = campaign(REFERENCE, seed=2017)
    lines = [f"Shear modulus {REFERENCE.shear_modulus / 1e9} GPa; sections from the inside out, in mm:", ""]
    lines += ["| side | outer diameter | inner diameter | length |", "|---|---|---|---|"]
    for side in PATTERN:
        for s in drawing(REFERENCE, side):
            sizes = " | ".join(f"{1000 * x:.1f}" for x in (s.outer_diameter, s.inner_diameter, s.length))
            lines.append(f"| {side} | {sizes} |")
    lines += ["", "The tip-in log is of the left shaft; both speeds are those of its ends."]
    return Samples("Half-shafts", {"tip_in.csv": csv_bytes(log)}, truth(REFERENCE), "\n".join(lines))


def _pedal(t: float) -> float:
    """Torque of the motor at one half-shaft, N m: coast, tip-in, tip-out, tip-in, each step in some 40 ms."""
    torque = -20.0
    for when, step in ((0.4, 340.0), (1.7, -380.0), (2.7, 460.0)):
        if t > when:
            u = (t - when) / 0.02
            torque += step * (1.0 - (1.0 + u) * exp(-u))
    return torque


@lru_cache(maxsize=16)
def _drive(vehicle: Vehicle, hidden: tuple[tuple[str, float], ...], points: int) -> Array:
    """Shaft torque, speed of its inner and outer end, twist; shape (points, 4). Starts coasting at 8 m/s."""
    v, r, effects = vehicle, vehicle.wheel_radius, dict(hidden)
    spring = 1.0 / (1.0 / truth(v)["shaft_stiffness_left"] + effects.get("series_compliance", 0.0))
    damper, gap = v.shaft_damping_left + effects.get("damping", 0.0), effects.get("backlash", 0.0)
    stiffening, dry = effects.get("stiffening", 0.0), effects.get("shaft_friction", 0.0)
    load = v.front_load / 2
    resistance = v.rolling_resistance * v.rear_load / 2  # of the rear wheel; the front one is in the wheel's balance
    motor = v.driveline_inertia / 2
    half_car = v.mass / 2 + v.wheel_inertia / r**2  # one rear wheel turns along

    def shaft(twist: float, rate: float) -> float:
        engaged = abs(twist) - gap
        if engaged <= 0.0:
            return 0.0 if gap else damper * rate
        torque = copysign(spring * engaged * (1.0 + stiffening * engaged**2), twist) + damper * rate
        return torque if not gap or torque * twist > 0.0 else 0.0  # flanks push, they never pull

    def rates(t: float, y: tuple[float, ...]) -> tuple[float, ...]:
        twist, fast, slow, slip, speed, rubbing = y
        torque = shaft(twist, fast - slow) + dry * rubbing
        x = v.tire_B * slip
        force = load * v.tire_D * sin(v.tire_C * atan(x - v.tire_E * (x - atan(x))))
        return (
            fast - slow,
            (_pedal(t) - torque) / motor,
            (torque - force * r - v.rolling_resistance * load * r) / v.wheel_inertia,
            (r * slow - speed - speed * slip) / v.tire_relaxation_length,
            (force - AIR_DENSITY / 4 * v.drag_area * speed**2 - resistance) / half_car,
            (fast - slow - abs(fast - slow) * rubbing) / 1e-3,
        )

    start = _pedal(0.0)
    speed = 8.0
    slip = (start / r - v.rolling_resistance * load) / (load * v.tire_longitudinal_stiffness)
    turning = speed * (1.0 + slip) / r
    y: tuple[float, ...] = (start / spring + copysign(gap, start), turning, turning, slip, speed, 0.0)
    history = np.empty((points, 4))
    for k in range(points):
        history[k] = shaft(y[0], y[1] - y[2]) + dry * y[5], y[1], y[2], y[0]
        d = rates(k * STEP, y)
        middle = tuple(a + STEP / 2 * b for a, b in zip(y, d, strict=True))
        d = rates((k + 0.5) * STEP, middle)
        y = tuple(a + STEP * b for a, b in zip(y, d, strict=True))
    history.flags.writeable = False
    return history
