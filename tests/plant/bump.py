"""Crossing a bump: a half car drives over it at some 15 km/h, four times, and its wheels leave the road.

Logged at 500 Hz on a jittering clock: axle loads (zero unknown), speed (scale off by about 1e-4), the body's vertical
acceleration and pitch rate. Where the bump lies in a log is known to a few centimeters only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tests.plant.half_car import HalfCars, body_acceleration, ride, tire_load
from tests.plant.information import Array, Information, effect_slopes, prior, slopes, total
from tests.plant.obstacle import Bump
from tests.plant.sample import Samples
from tests.plant.sensors import ACCELEROMETER, GROUND_SPEED, GYRO, WHEEL_FORCE, Record, Sensor, jitter, read, regular
from tests.plant.vehicle import REFERENCE, Vehicle
from tests.plant.write_csv import csv_bytes

EFFECTS = {
    "asymmetric_damping": "1: damper force C (v + q |v|), v > 0 in rebound",
    "suspension_friction": "N of dry friction in an axle's struts",
    "progressive_spring": "1/m: spring force K x (1 + q x), x > 0 in compression",
    "bump_stop": "N: force q ((compression - 20 mm) / 10 mm)^2 beyond that compression",
    "tire_damping": "N s/m per axle",
    "rear_tire_stiffness": "1: the rear tires are (1 + q) times as stiff as the front tires",
    "tire_enveloping": "m of contact patch over which the tire averages the road",
    "speed_error": "1: the speed channel reads (1 + q) times the speed",
    "clock_offset": "s by which acceleration and pitch rate are read late",
    "rear_load_delay": "s by which the rear loads are read late",
    "front_load_gain": "1: the front loads read (1 + q) times too high",
    "rear_load_gain": "1: the rear loads read (1 + q) times too high",
    "logger_filter": "s, time constant of a pole through which the logger reads loads and motion",
    "bump_height_error": "1: the bump is (1 + q) times as high as the tester measured",
    "bump_width_error": "1: the bump is (1 + q) times as wide as the tester measured",
    "bump_trapezoid": "1: share of a trapezoid, flat over 0.4 of its width, in the bump's profile",
    "wheel_circle": "1: share of the path of a circle of 0.31 m that rolls over the bump",
    "degressive_damping": "s/m: damper force C v (1 - q |v|), a shape that no law of the catalog has, for controls",
}
# Sizes at which finite differences are taken.
SMALL = {"asymmetric_damping": 1e-3, "suspension_friction": 100.0, "progressive_spring": 1e-2, "tire_damping": 1.0}
SMALL |= {"tire_enveloping": 0.08, "speed_error": 1e-4, "clock_offset": 1e-4, "rear_load_delay": 1e-4}
SMALL |= {"bump_height_error": 1e-3, "bump_stop": 4.0}
SMALL |= {"front_load_gain": 1e-3, "rear_load_gain": 1e-3, "logger_filter": 0.004}
SMALL |= {"bump_width_error": 1e-3, "bump_trapezoid": 1e-3, "wheel_circle": 1e-3}
SMALL |= {"degressive_damping": 1e-3, "rear_tire_stiffness": 1e-3}
ONE_SIDED = ("suspension_friction", "tire_enveloping", "logger_filter")
PARAMETERS = (
    "suspension_stiffness_front",
    "suspension_stiffness_rear",
    "suspension_damping_front",
    "suspension_damping_rear",
    "tire_vertical_stiffness",
)
STEP = 2.5e-4  # s; a finer one moves a load by less than 1 N, an estimate by less than a tenth of its bound
RATE = 500.0
FILTER_NODES = 24  # of the integral over the past that a logger's filter is
DISTANCE = 3.0  # m from a log's start to the bump, as paced out: see DISTANCE_SD
DISTANCE_SD = 0.03
SPEED_SCALE_SD = 1e-4
AXLE_LOAD = WHEEL_FORCE.but(  # two wheels' sensors
    noise=WHEEL_FORCE.noise * 2**0.5, zero=WHEEL_FORCE.zero * 2**0.5, limit=WHEEL_FORCE.limit * 2
)
SENSORS: dict[str, Sensor] = {
    "Front Load [N]": AXLE_LOAD,
    "Rear Load [N]": AXLE_LOAD,
    "Speed [km/h]": GROUND_SPEED,
    "Vertical Accel [m/s^2]": ACCELEROMETER,
    "Pitch Rate [deg/s]": GYRO,
}
UNIT = {"Speed [km/h]": 3.6, "Pitch Rate [deg/s]": float(np.degrees(1.0))}


@dataclass(frozen=True)
class Crossing:
    """One run as driven; the log tells nothing of it but ``times``."""

    times: Array
    speed: float  # at the start
    speed_up: float  # m/s^2
    distance: float  # true, from the start to the bump's near edge, front axle
    speed_scale: float


def truth(vehicle: Vehicle) -> dict[str, float]:
    return {name: getattr(vehicle, name) for name in PARAMETERS}


def known(vehicle: Vehicle) -> dict[str, float]:
    """What the tester writes into the description."""
    masses = ("sprung_mass", "unsprung_mass_front", "unsprung_mass_rear")
    names = (*masses, "wheelbase", "cg_to_front", "sprung_pitch_inertia")
    return {name: float(getattr(vehicle, name)) for name in names}


def runs(seed: int, count: int = 4, duration: float = 3.5) -> list[Crossing]:
    """Four crossings between 3.5 and 6 m/s, speeds spread out."""
    rng = np.random.default_rng([seed, 0xB0])
    speeds = 3.6 + 2.3 * (np.arange(count) + rng.uniform(0.2, 0.8, count)) / count
    return [
        Crossing(
            times=jitter(regular(duration, RATE), 0.2, rng),
            speed=float(speed),
            speed_up=float(rng.normal(0.0, 0.03)),
            distance=float(rng.normal(DISTANCE, DISTANCE_SD)),
            speed_scale=float(rng.normal(0.0, SPEED_SCALE_SD)),
        )
        for speed in speeds
    ]


def noise_free(
    vehicle: Vehicle, crossings: list[Crossing], effects: Mapping[str, float] | None = None, bump: Bump | None = None
) -> list[dict[str, Array]]:
    """What perfect sensors would log, SI, by column header."""
    unknowns = np.array([[c.speed, c.speed_up, c.distance] for c in crossings])
    return _measure(_cars([vehicle] * len(crossings), effects or {}), unknowns, crossings, effects or {}, bump)


def campaign(
    vehicle: Vehicle, seed: int, effects: Mapping[str, float] | None = None, bump: Bump | None = None, count: int = 4
) -> list[Record]:
    """The logs of ``count`` runs, noise and all."""
    rng = np.random.default_rng([seed, 0xB1])
    crossings = runs(seed, count)
    records = []
    for crossing, clean in zip(crossings, noise_free(vehicle, crossings, effects, bump), strict=True):
        columns = {"Time [s]": crossing.times}
        for header, sensor in SENSORS.items():
            gain = crossing.speed_scale if header.startswith("Speed") else 0.0
            columns[header] = read(sensor.but(gain=gain), clean[header], rng) * UNIT.get(header, 1.0)
        records.append(Record(columns, {"Time [s]": 6, "Front Load [N]": 0, "Rear Load [N]": 0, "Speed [km/h]": 2}))
    return records


def information(
    vehicle: Vehicle,
    seed: int,
    effects: Mapping[str, float] | None = None,
    bump: Bump | None = None,
    count: int = 4,
    unknowns: Sequence[str] = (),
) -> Information:
    """About ``PARAMETERS``, the effects in ``unknowns``, and what run k has of its own.

    That is where the bump lies, speed, its slope and scale, the zero of each sensor.
    All five channels count; priors are the sensors' data sheets and the tape measure.
    """
    effects = effects or {}
    own = ("speed", "speed_up", "distance")
    at_shared = np.array([getattr(vehicle, name) for name in PARAMETERS])
    crossings = runs(seed, count)

    def readings(hidden: Mapping[str, float]) -> Array:
        logs = noise_free(vehicle, crossings, hidden, bump)
        return np.concatenate([channel for log in logs for channel in log.values()])

    by_effect = np.split(effect_slopes(readings, effects, unknowns, SMALL, ONE_SIDED), count)
    parts = []
    for k, crossing in enumerate(crossings):
        at = np.concatenate([at_shared, [crossing.speed, crossing.speed_up, crossing.distance], np.zeros(6)])
        steps = np.concatenate([1e-3 * at_shared, [1e-3, 1e-3, 1e-3], np.ones(6)])

        def mean(batch: Array, crossing: Crossing = crossing) -> Array:
            alike, shape = np.unique(batch[:, : len(PARAMETERS) + 3], axis=0, return_inverse=True)
            shared = [vehicle.but(**dict(zip(PARAMETERS, row, strict=False))) for row in alike]
            driven = alike[:, len(PARAMETERS) :]
            logs = _measure(_cars(shared, effects), driven, [crossing] * len(shared), effects, bump)
            stacked = np.array([np.concatenate(list(log.values())) for log in logs])[np.ravel(shape)]
            offsets = np.repeat(batch[:, -6:-1], crossing.times.size, axis=1)
            offsets[:, 2 * crossing.times.size : 3 * crossing.times.size] += batch[:, -1:] * crossing.speed
            return np.asarray(stacked + offsets)

        names = [*PARAMETERS, *(f"{n}_{k}" for n in own), *(f"zero_{h}_{k}" for h in SENSORS), f"speed_scale_{k}"]
        sd = np.repeat([np.hypot(s.noise, s.step / 12**0.5) for s in SENSORS.values()], crossing.times.size)
        whitened = np.hstack([slopes(mean, at, steps), by_effect[k]]) / sd[:, None]
        parts.append(Information((*names, *unknowns), whitened.T @ whitened))
        zeros = {f"zero_{header}_{k}": max(sensor.zero, 1e-9) for header, sensor in SENSORS.items()}
        parts.append(prior({**zeros, f"speed_scale_{k}": SPEED_SCALE_SD, f"distance_{k}": DISTANCE_SD}))
    return total(parts)


def samples() -> Samples:
    logs = campaign(REFERENCE, seed=2017)
    return Samples(
        title="Bump crossings",
        files={f"bump_{k}.csv": csv_bytes(log) for k, log in enumerate(logs, start=1)},
        truth=truth(REFERENCE),
        about=(
            f"Haversine bump {Bump().height} m high, {Bump().width} m wide, {DISTANCE} m (+- {DISTANCE_SD} m) after "
            "the start of each log; the wheels lift off behind it. Vertical acceleration is zero at rest; pitch is "
            "nose-up positive; loads are those between tires and road."
        ),
    )


def _cars(vehicles: list[Vehicle], effects: Mapping[str, float]) -> HalfCars:
    def column(name: str) -> Array:
        return np.array([getattr(v, name) for v in vehicles])

    def pair(front: str, rear: str) -> Array:
        return np.column_stack([column(front), column(rear)])

    flat = np.ones(len(vehicles))
    return HalfCars(
        sprung_mass=column("sprung_mass"),
        pitch_inertia=column("sprung_pitch_inertia"),
        unsprung_mass=pair("unsprung_mass_front", "unsprung_mass_rear"),
        levers=pair("cg_to_front", "cg_to_rear"),
        stiffness=pair("suspension_stiffness_front", "suspension_stiffness_rear"),
        damping=pair("suspension_damping_front", "suspension_damping_rear"),
        tire_stiffness=column("tire_vertical_stiffness")[:, None]
        * (1.0 + np.array([0.0, effects.get("rear_tire_stiffness", 0.0)])),
        tire_damping=column("tire_damping") + effects.get("tire_damping", 0.0),
        static_load=pair("front_load", "rear_load"),
        asymmetry=flat * effects.get("asymmetric_damping", 0.0),
        friction=flat * effects.get("suspension_friction", 0.0),
        progression=flat * effects.get("progressive_spring", 0.0),
        degression=flat * effects.get("degressive_damping", 0.0),
        stop=flat * effects.get("bump_stop", 0.0),
    )


def _measure(
    cars: HalfCars, driven: Array, crossings: list[Crossing], effects: Mapping[str, float], bump: Bump | None
) -> list[dict[str, Array]]:
    """Perfect readings of car k on crossing k; ``driven`` holds each one's speed, its slope, and distance."""
    unknown = set(effects) - set(EFFECTS)
    if unknown:
        raise ValueError(f"a bump crossing has no effect {sorted(unknown)}")
    known = bump or Bump()
    bump = replace(
        known,
        patch=effects.get("tire_enveloping", 0.0),
        height=known.height * (1.0 + effects.get("bump_height_error", 0.0)),
        width=known.width * (1.0 + effects.get("bump_width_error", 0.0)),
        trapezoid=effects.get("bump_trapezoid", 0.0),
        circle=effects.get("wheel_circle", 0.0),
    )
    speed, up, distance = driven.T[:, :, None]
    behind = np.array([0.0, 1.0]) * np.sum(cars.levers, axis=1)[:, None]

    def road(t: Array) -> tuple[Array, Array, Array]:
        v = speed + up * t
        s = (speed * t + up / 2 * t**2 - distance)[:, :, None] - behind[:, None, :]
        return v, bump.level(s), bump.slope(s) * v[:, :, None]

    end = max(float(c.times[-1]) for c in crossings)
    halves = STEP / 2 * np.arange(2 * int(end / STEP) + 5)
    _, level, slope = road(np.tile(halves, (len(crossings), 1)))
    trip = ride(cars, level, slope, STEP)
    each = np.arange(len(crossings))[:, None]
    wide = cars.take(each)
    times = np.array([c.times for c in crossings])

    def loads(t: Array) -> Array:
        _, level, slope = road(t)
        return tire_load(wide, trip.at(t, each)[0], level, slope)

    v, _, _ = road(times)

    def sensed(moments: Array) -> Array:
        rear_times = np.maximum(moments - effects.get("rear_load_delay", 0.0), 0.0)
        late = np.maximum(moments - effects.get("clock_offset", 0.0), 0.0)
        body, extra = trip.at(late, each)
        front = loads(moments)[:, :, 0] * (1.0 + effects.get("front_load_gain", 0.0))
        rear = loads(rear_times)[:, :, 1] * (1.0 + effects.get("rear_load_gain", 0.0))
        return np.array([front, rear, body_acceleration(wide, body, extra), body[:, :, 5]])

    # A pole is a mean over the past with weight exp(-age / tau).
    pole = effects.get("logger_filter", 0.0)
    ages, weights = np.polynomial.laguerre.laggauss(FILTER_NODES) if pole else (np.zeros(1), np.ones(1))
    past = (w * sensed(np.maximum(times - pole * a, 0.0)) for a, w in zip(ages, weights, strict=True))
    front, rear, acceleration, pitch_rate = sum(past)
    channels = (front, rear, v * (1.0 + effects.get("speed_error", 0.0)), acceleration, pitch_rate)
    return [dict(zip(SENSORS, [channel[k] for channel in channels], strict=True)) for k in range(len(crossings))]
