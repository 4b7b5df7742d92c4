"""Coast-down campaigns, and drives with known torque: the truth and the logs.

``coast_motion`` lists the effects that can be hidden; ``coast_information`` tells how much the logs hold.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from tests.plant import sample, sensors
from tests.plant.coast_motion import BLOCK, STEP, Car, Motion, Plan, Scatter, calm
from tests.plant.sample import Samples
from tests.plant.sensors import Array, Record, Sensor
from tests.plant.vehicle import AIR_DENSITY, GRAVITY, REFERENCE, Vehicle
from tests.plant.wind import STILL, Wind, gusts
from tests.plant.write_csv import CONTINENTAL, PLAIN, WINDOWS, WITH_BOM, csv_bytes

GUSTY = Wind()
TORQUE = sensors.WHEEL_TORQUE.but(zero=0.2)  # zeroed at rest before each run


@dataclass(frozen=True)
class Day:
    """How a campaign is driven and measured."""

    runs: int = 8
    start_speed: float = 75 / 3.6
    end_speed: float = 20 / 3.6
    rate: float = 10.0
    jitter: float = 0.2  # share of the sample spacing
    wind: Wind = GUSTY
    rolling_scatter: float = 0.01  # share, between runs
    air_density: float = AIR_DENSITY
    temperatures: tuple[float, ...] = ()  # degC of each run; 20 where empty, 12 to 28 under temperature_rolling
    one_way: bool = False
    powered: float = 0.0  # s of driving with known torque in each run, instead of coasting
    speed: Sensor = sensors.GPS_SPEED
    position: Sensor = sensors.GPS_POSITION
    acceleration: Sensor | None = None
    torque: Sensor = TORQUE

    def but(self, **changed: object) -> Day:
        return replace(self, **changed)  # type: ignore[arg-type]


DAY = Day()
WIDE = Day(start_speed=36.0, end_speed=2.0)
POWERED = Day(powered=120.0, speed=sensors.GPS_SPEED.but(latency=0.0))
QUIET = Day(jitter=0.0, wind=STILL, rolling_scatter=0.0, speed=Sensor(), position=Sensor(), torque=Sensor())


@dataclass(frozen=True)
class Run:
    """One run as handed to the tester."""

    record: Record
    direction: str
    start: float  # s since the first run
    temperature: float  # degC


def truth(vehicle: Vehicle) -> dict[str, float]:
    """The parameters that a coast-down determines."""
    return {"rolling_resistance": vehicle.rolling_resistance, "drag_area": vehicle.drag_area}


def known(vehicle: Vehicle, day: Day = DAY) -> dict[str, float]:
    """What the tester writes into the description, whatever is hidden."""
    names = ("mass", "rotating_mass", "frontal_area", "drag_coefficient", "gear_ratio", "wheel_radius")
    return {name: float(getattr(vehicle, name)) for name in names} | {"air_density": day.air_density}


def plan(vehicle: Vehicle, seed: int, day: Day = DAY, effects: Mapping[str, float] | None = None) -> Plan:
    """Headings, start speeds, durations (of the calm motion down to the end speed), clocks and torque levels."""
    rng = np.random.default_rng([seed, 0xC0])
    n = day.runs
    heading = np.ones(n) if day.one_way else np.where(np.arange(n) % 2 == 0, 1.0, -1.0)
    speed = day.start_speed + rng.uniform(-0.5, 0.5, n)
    warm = np.linspace(12.0, 28.0, n) if (effects or {}).get("temperature_rolling") else np.full(n, 20.0)
    temperature = np.asarray(day.temperatures, dtype=float) if day.temperatures else warm
    first = Plan(heading, np.arange(n) * 200.0, speed, np.zeros(n), temperature, (), np.zeros((0, n)))
    if day.powered:
        first = replace(first, speed=rng.uniform(6.0, 10.0, n), torque=_torque_levels(vehicle, day, rng))
        duration = np.full(n, day.powered)
    else:
        duration = _durations(Car(vehicle, day.air_density, first, {**(effects or {}), "grade_profile": 0.0}), day)
    samples = tuple(sensors.regular(float(d), day.rate) for d in duration)
    if day.jitter:
        samples = tuple(sensors.jitter(times, day.jitter, rng) for times in samples)
    length = np.ceil(0.5 * (day.start_speed + day.end_speed) * float(duration.mean()))
    begin = np.where(heading > 0, 0.0, length) + rng.uniform(-20.0, 20.0, n)
    return replace(first, start=np.arange(n) * np.ceil(duration.max() + 60.0), position=begin, samples=samples)


def _durations(car: Car, day: Day) -> Array:
    """Seconds until each calm run falls to the end speed, to 0.1 s (at most a quarter of an hour)."""
    for steps in (225, 450, 900):
        motion = car.move(calm(day.runs, steps), steps, step=1.0)
        if (motion.speed[-1] <= day.end_speed).all():
            break
    below = motion.speed <= day.end_speed
    last = np.where(below.any(axis=0), below.argmax(axis=0), steps)
    return np.array(
        [
            round(float(np.interp(-day.end_speed, -v[: k + 1], motion.clock[: k + 1])), 1)
            for v, k in zip(motion.speed.T, last, strict=True)
        ]
    )


def _torque_levels(vehicle: Vehicle, day: Day, rng: np.random.Generator) -> Array:
    """Torque that leads the car through random speeds of 6 to 28 m/s; never below zero, so the brake is not needed."""
    inertia = vehicle.mass + vehicle.rotating_mass
    speed, levels = np.full(day.runs, 8.0), []
    for _ in range(int(np.ceil(day.powered / BLOCK))):
        wanted = rng.uniform(6.0, 28.0, day.runs)
        load = vehicle.rolling_resistance * vehicle.mass * GRAVITY
        load = load + 0.5 * day.air_density * vehicle.drag_area * speed**2
        force = np.clip(load + inertia * (wanted - speed) / BLOCK, 0.0, 2500.0)
        speed = np.clip(speed + (force - load) / inertia * BLOCK, 4.0, None)
        levels.append(np.round(force * vehicle.wheel_radius / vehicle.gear_ratio, 1))
    return np.array(levels)


def noise_free(
    vehicle: Vehicle,
    plan: Plan,
    day: Day = DAY,
    effects: Mapping[str, float] | None = None,
    scatter: Scatter | None = None,
) -> tuple[Array, ...]:
    """Each run's speed (m/s) at its sample times as a perfect sensor logs it, effects included; calm if no scatter."""
    q = effects or {}
    motion = Car(vehicle, day.air_density, plan, q).move(scatter or calm(day.runs, plan.steps), plan.steps)
    late, gain = q.get("speed_delay", 0.0), 1.0 + q.get("speed_scale", 0.0)
    return tuple(gain * _speed_at(motion, run, times - late) for run, times in enumerate(plan.samples))


def _speed_at(motion: Motion, run: int, times: Array) -> Array:
    """Speed at any times; before the start the car moves on as it began (a late sensor still shows that)."""
    early = np.minimum(times, 0.0) * motion.acceleration[0, run]
    return np.interp(times, motion.clock, motion.speed[:, run]) + early


def scatter(day: Day, steps: int, seed: int) -> Scatter:
    """The day's gusts, mean winds and rolling scatter."""
    rng = np.random.default_rng([seed, 0xC1])
    return Scatter(
        gusts(day.wind, day.runs, steps, STEP, rng),
        day.wind.between_runs * rng.standard_normal(day.runs),
        day.rolling_scatter * rng.standard_normal(day.runs),
    )


def campaign(
    vehicle: Vehicle, seed: int, day: Day = DAY, effects: Mapping[str, float] | None = None
) -> tuple[Run, ...]:
    """A whole campaign as logged."""
    q = effects or {}
    decided = plan(vehicle, seed, day, q)
    car = Car(vehicle, day.air_density, decided, q)
    motion = car.move(scatter(day, decided.steps, seed), decided.steps)
    rng = np.random.default_rng([seed, 0xC2])
    zero = day.acceleration.zero * rng.standard_normal() if day.acceleration else 0.0  # one zero for the day
    return tuple(
        Run(
            _record(car, motion, run, day, zero, rng),
            "out" if decided.heading[run] > 0 else "back",
            float(decided.start[run]),
            float(decided.temperature[run]),
        )
        for run in range(day.runs)
    )


def _record(car: Car, motion: Motion, run: int, day: Day, zero: float, rng: np.random.Generator) -> Record:
    q, times = car.q, car.plan.samples[run]
    seen = times - day.speed.latency - q["speed_delay"]
    speed = sensors.read(day.speed.but(gain=q["speed_scale"]), _speed_at(motion, run, seen), rng)
    position = sensors.read(day.position, np.interp(seen, motion.clock, motion.position[:, run]), rng)
    columns = {"Time [s]": times, "GPS Speed [km/h]": 3.6 * speed, "Position [m]": position}
    if day.acceleration is not None:
        rate, clock = motion.acceleration[:, run], motion.clock[:-1] + 0.5 * STEP
        slope = np.arctan(np.interp(clock, motion.clock, motion.grade[:, run]))
        leaning = q["accelerometer_tilt"] + q["body_pitch"] * rate
        felt = rate * np.cos(leaning) + GRAVITY * np.sin(slope + leaning)
        meter = day.acceleration.but(zero=0.0, offset=zero + q["accelerometer_offset"])
        columns["Long Accel [m/s^2]"] = sensors.read(meter, np.interp(times, clock, felt), rng)
    if day.powered:
        meter = day.torque.but(gain=q["torque_gain"], offset=q["torque_offset"])
        columns["Drive Torque [N m]"] = sensors.read(meter, car.torque(times)[:, run], rng)
    decimals = {"Time [s]": 3, "GPS Speed [km/h]": 2, "Position [m]": 2, "Long Accel [m/s^2]": 3}
    return Record(columns, decimals | {"Drive Torque [N m]": 1})


SAMPLE_DAY = DAY.but(
    acceleration=sensors.ACCELEROMETER,
    air_density=sample.AIR_DENSITY,
    temperatures=(sample.TEMPERATURE,) * 8,
)


def samples() -> Samples:
    """coast_1.csv to coast_8.csv, the last three in the dress of other benches."""
    runs = campaign(REFERENCE, 20170, SAMPLE_DAY)
    dress = {6: WITH_BOM, 7: CONTINENTAL, 8: WINDOWS}
    table = "\n".join(f"| coast_{k}.csv | {run.direction} | {run.start:.0f} s |" for k, run in enumerate(runs, start=1))
    return Samples(
        title="Coast-downs",
        files={f"coast_{k}.csv": csv_bytes(run.record, dress.get(k, PLAIN)) for k, run in enumerate(runs, start=1)},
        truth=truth(REFERENCE)
        | {"mass": REFERENCE.mass, "rotating_mass": REFERENCE.rotating_mass}
        | {"frontal_area": REFERENCE.frontal_area, "drag_coefficient": REFERENCE.drag_coefficient}
        | {"air_density": sample.AIR_DENSITY},
        about=(
            "In neutral from about 75 km/h to 20 km/h on a flat road, out and back in turn, at 24 degC and 98.9 kPa "
            "(the rolling resistance is that of these tires on this day, not corrected to 20 degC). Position is the "
            "road's coordinate: it rises on the way out and falls on the way back. The accelerometer measures specific "
            "force: rate of speed + g sin(grade), forward positive. Gusts of 0.6 m/s, 8 s; mean wind of each run "
            "0.3 m/s; rolling scatter of each run 1 %; GPS latency 50 ms; clock jitter +-20 ms, as logged. "
            "coast_6 has a byte-order mark, coast_7 semicolons and decimal commas, coast_8 CRLF.\n\n"
            f"| log | direction | start |\n|---|---|---|\n{table}"
        ),
    )
