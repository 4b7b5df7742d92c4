"""A wheel that swings, with a rate gyro on it: as a compound pendulum, on two cords, or on a torsion rod.

Energies, theta from rest, J about the wheel's own axis:

    compound    (J + m d^2) theta'^2 / 2,                    m g d (1 - cos theta)
    bifilar     (J + m h'(theta)^2) theta'^2 / 2,            m g h,  h = l - sqrt(l^2 - 4 b^2 sin^2(theta / 2))
    torsional   J theta'^2 / 2,                              kt theta^2 / 2

with viscous friction, integrated without approximation for small swings (DOP853 to 1e-11).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import cos, pi, sin, sqrt

import numpy as np
from scipy.integrate import solve_ivp

from tests.plant.information import Array, Information, from_means, prior, total
from tests.plant.sample import Samples
from tests.plant.sensors import GYRO, Record, jitter, read, regular
from tests.plant.vehicle import GRAVITY, REFERENCE, Vehicle
from tests.plant.write_csv import csv_bytes

EFFECTS: Mapping[str, str] = {}
RATE = 500.0


@dataclass(frozen=True)
class Rig:
    """How the wheel hangs. ``distance`` is pivot to axis (compound) or half the cords' spacing (bifilar)."""

    kind: str = "compound"
    mass: float = 20.0
    distance: float = 0.205
    cord: float = 2.0  # m, bifilar
    stiffness: float = 60.0  # N m/rad, torsional
    friction: float = 0.06  # N m s/rad


@dataclass(frozen=True)
class Swing:
    """One recording as it was: the swing's state when it began."""

    times: Array
    angle: float
    rate: float


def rig(vehicle: Vehicle, kind: str = "compound") -> Rig:
    """The vehicle's own wheel in a rig that suits it."""
    distance = {"compound": 0.665 * vehicle.wheel_radius, "bifilar": 0.2}.get(kind, 0.0)
    return Rig(kind, mass=vehicle.wheel_mass, distance=distance)


def truth(vehicle: Vehicle) -> dict[str, float]:
    return {"wheel_inertia": vehicle.wheel_inertia}


def known(vehicle: Vehicle, kind: str = "compound") -> dict[str, float]:
    """What the tester measures on the rig, without error."""
    hung = rig(vehicle, kind)
    return {
        "compound": {"mass": hung.mass, "pivot_distance": hung.distance},
        "bifilar": {"mass": hung.mass, "separation": 2 * hung.distance, "length": hung.cord},
        "torsional": {"torsional_stiffness": hung.stiffness},
    }[kind]


def swing(seed: int, duration: float = 30.0, amplitude: float = 0.2) -> Swing:
    """Let go at about ``amplitude`` rad; the logger is started somewhere in the first swing."""
    rng = np.random.default_rng([seed, 0x9E])
    phase = float(rng.uniform(0.0, 2 * pi))
    times = jitter(regular(duration, RATE), 0.1, rng)
    return Swing(times, amplitude * cos(phase), -4.5 * amplitude * sin(phase))


def noise_free(hung: Rig, inertia: float, swung: Swing) -> Array:
    """The wheel's angular rate at the recording's times, rad/s."""
    solution = solve_ivp(
        _law(hung, inertia),
        (0.0, float(swung.times[-1])),
        [swung.angle, swung.rate],
        method="DOP853",
        t_eval=swung.times,
        rtol=1e-11,
        atol=1e-13,
    )
    return np.asarray(solution.y[1])


def period(hung: Rig, inertia: float, amplitude: float) -> float:
    """Time of one full swing of the frictionless rig, by integration from rest at ``amplitude`` rad."""

    def upright(_: float, y: Array) -> float:
        return float(y[0])

    upright.terminal = True  # type: ignore[attr-defined]
    law = _law(replace(hung, friction=0.0), inertia)
    quarter = solve_ivp(law, (0.0, 1e3), [amplitude, 0.0], method="DOP853", events=upright, rtol=1e-12, atol=1e-14)
    return 4.0 * float(quarter.t_events[0][0])


def campaign(
    vehicle: Vehicle,
    seed: int,
    effects: Mapping[str, float] | None = None,
    kind: str = "compound",
    duration: float = 30.0,
) -> list[Record]:
    """One recording, bias and noise and all."""
    if effects:
        raise ValueError(f"a pendulum has no effect {sorted(effects)}")
    swung = swing(seed, duration)
    clean = noise_free(rig(vehicle, kind), vehicle.wheel_inertia, swung)
    rate = read(GYRO, clean, np.random.default_rng([seed, 0x9F]))
    return [Record({"Time [s]": swung.times, "Angular Rate [rad/s]": rate}, {"Time [s]": 6, "Angular Rate [rad/s]": 6})]


def information(vehicle: Vehicle, seed: int, kind: str = "compound", duration: float = 30.0) -> Information:
    """About the wheel's inertia, beside friction, the state at the start and the gyro's zero; the rig is known."""
    hung, swung = rig(vehicle, kind), swing(seed, duration)
    at = np.array([vehicle.wheel_inertia, hung.friction, swung.angle, swung.rate, 0.0])

    def mean(batch: Array) -> Array:
        rows = []
        for inertia, friction, angle, rate, zero in batch:
            started = replace(swung, angle=angle, rate=rate)
            rows.append(noise_free(replace(hung, friction=friction), inertia, started) + zero)
        return np.array(rows)

    sd = np.full(swung.times.size, np.hypot(GYRO.noise, GYRO.step / 12**0.5))
    names = ("wheel_inertia", "friction", "angle", "rate", "zero")
    return total([from_means(names, mean, at, np.full(5, 1e-5), sd), prior({"zero": GYRO.zero})])


def by_ruler(vehicle: Vehicle, kind: str, sd: Mapping[str, float]) -> float:
    """Standard deviation of an inertia found from an exact period and a rig measured with these errors.

    Each error's part is how far the inertia must move to keep the period when the true rig is off by it.
    """
    hung, inertia = rig(vehicle, kind), vehicle.wheel_inertia
    own = {"mass": "mass", "pivot_distance": "distance", "separation": "distance", "length": "cord",
           "torsional_stiffness": "stiffness"}  # fmt: skip
    wanted = period(hung, inertia, 1e-3)
    per_inertia = (period(hung, 1.001 * inertia, 1e-3) - period(hung, 0.999 * inertia, 1e-3)) / (0.002 * inertia)
    variance = 0.0
    for name, error in sd.items():
        off = error / 2 if name == "separation" else error
        moved = replace(hung, **{own[name]: getattr(hung, own[name]) + off})
        variance += ((period(moved, inertia, 1e-3) - wanted) / per_inertia) ** 2
    return float(variance**0.5)


def samples() -> Samples:
    (log,) = campaign(REFERENCE, seed=2017)
    hung = rig(REFERENCE)
    return Samples(
        title="Wheel pendulum",
        files={"pendulum.csv": csv_bytes(log)},
        truth=truth(REFERENCE),
        about=f"The wheel ({hung.mass} kg) swings about a knife edge {1000 * hung.distance:.1f} mm from its axis.",
    )


def _law(hung: Rig, inertia: float) -> Callable[[float, Array], tuple[float, float]]:
    m, d, weight = hung.mass, hung.distance, hung.mass * GRAVITY

    def compound(_: float, y: Array) -> tuple[float, float]:
        return y[1], -(weight * d * sin(y[0]) + hung.friction * y[1]) / (inertia + m * d**2)

    def bifilar(_: float, y: Array) -> tuple[float, float]:
        # drop = l - h; (l - h)^2 = l^2 - 2 b^2 (1 - cos theta), differentiated twice
        drop = sqrt(hung.cord**2 - 2 * d**2 * (1 - cos(y[0])))
        rise = d**2 * sin(y[0]) / drop
        bend = (d**2 * cos(y[0]) + rise**2) / drop
        push = m * rise * bend * y[1] ** 2 + weight * rise + hung.friction * y[1]
        return y[1], -push / (inertia + m * rise**2)

    def torsional(_: float, y: Array) -> tuple[float, float]:
        return y[1], -(hung.stiffness * y[0] + hung.friction * y[1]) / inertia

    return {"compound": compound, "bifilar": bifilar, "torsional": torsional}[hung.kind]
