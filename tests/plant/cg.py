"""Accelerate-and-brake runs: the logs behind launch_*.csv, and how much they can tell at best.

``cg_motion`` has the physics (note there what spinning wheels do) and the effects that can be hidden.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tests.plant import sample, sensors
from tests.plant.cg_motion import EFFECTS, STEP, Body, Pedals, Ride, sizes
from tests.plant.information import Information, effect_slopes, from_constraints, prior, total
from tests.plant.sample import Samples
from tests.plant.sensors import Array, Record
from tests.plant.vehicle import AIR_DENSITY, GRAVITY, REFERENCE, Vehicle
from tests.plant.write_csv import PLAIN, WINDOWS, csv_bytes

RATE = 100.0  # Hz
JITTER = 0.02  # share of the sample spacing; one device samples all channels
LOAD = sensors.WHEEL_FORCE
ACCELERATION = sensors.GPS_ACCELERATION
PITCH_RATE = sensors.GYRO
SPEED = sensors.GPS_SPEED.but(latency=0.0)
WHEELS = ("FL", "FR", "RL", "RR")
# Standard deviations of what no tester knows: the height of a car's pitch axis, m, its tires' slip per friction, and
# their relaxation length, m.
AXIS, SLIP, RELAXATION = 0.15, 0.03, 0.15
BRAKE_FRONT = 0.65  # share of the braking force; all of the driving force is at the front

# Sizes at which finite differences are taken.
SMALL = dict.fromkeys(EFFECTS, 1e-3) | {"unsprung_mass": 40.0, "own_axles": 0.5, "aero_lift": 0.1, "road_grade": 1e-4}
ONE_SIDED = ("unsprung_mass", "own_axles", "acceleration_lag")


@dataclass(frozen=True)
class Manoeuvre:
    """One run: its way, its pedals, and its sample times (s)."""

    direction: str
    pedals: Pedals
    times: Array

    def ride(self, vehicle: Vehicle, effects: Mapping[str, float] | None = None, late: float = 0.0) -> Ride:
        """The true signals at the sample times, or ``late`` s before them."""
        body = Body(vehicle, self.pedals, float(self.times[-1]), effects)
        return body.at(np.maximum(self.times - late, 0.0))


@dataclass(frozen=True)
class Run:
    """One run as handed to the tester."""

    record: Record
    direction: str


def truth(vehicle: Vehicle) -> dict[str, float]:
    """The parameters that these runs determine."""
    return {name: float(getattr(vehicle, name)) for name in ("cg_height", "cg_to_rear", "pitch_inertia")}


def known(vehicle: Vehicle, air_density: float = AIR_DENSITY) -> dict[str, float]:
    """What the tester writes into the description, whatever is hidden."""
    names = (
        *("mass", "wheelbase", "antenna_height", "drag_area", "drag_height", "wheel_inertia", "wheel_radius"),
        "rolling_resistance",
    )
    return {name: float(getattr(vehicle, name)) for name in names} | {"air_density": air_density}


def manoeuvres(seed: int, count: int = 4, air_density: float = AIR_DENSITY) -> list[Manoeuvre]:
    """Throttle pulses up to about 20 m/s, brake pulses at the pace of the body's own pitching, throttle, brake."""
    rng = np.random.default_rng([seed, 0xC6])
    result = []
    for k in range(count):
        presses: list[tuple[float, float, float]] = [(1.0, 0.25, 2.6)]  # hold s, ramp s, then level m/s^2
        for _ in range(3):
            presses.append((rng.uniform(0.9, 1.6), 0.2, rng.uniform(0.0, 0.6)))
            presses.append((rng.uniform(0.4, 0.8), 0.2, rng.uniform(2.2, 2.9)))
        presses.append((0.9, 0.3, 0.0))
        for _ in range(4):
            presses.append((rng.uniform(0.3, 0.7), 0.12, -rng.uniform(4.0, 6.0)))
            presses.append((rng.uniform(0.25, 0.45), 0.12, 0.0))
        for _ in range(2):
            presses.append((rng.uniform(0.4, 0.8), 0.2, rng.uniform(2.2, 2.9)))
            presses.append((rng.uniform(0.9, 1.4), 0.2, 0.0))
        presses.append((0.5, 0.12, -rng.uniform(4.0, 5.5)))
        presses.append((rng.uniform(0.4, 0.6), 0.12, 0.0))
        hold, ramp, level = np.array(presses).T
        ends = np.cumsum(np.round((hold + ramp) / STEP)) * STEP  # corners where the steps of the integration end
        knots = np.concatenate([[0.0], np.column_stack([ends - ramp, ends]).ravel()])
        wanted = np.concatenate([[0.0, 0.0], np.repeat(level, 2)[:-1]])
        times = sensors.jitter(sensors.regular(float(np.ceil(ends[-1] + 1.5)), RATE), JITTER, rng)
        uphill = 1.0 if k % 2 == 0 else -1.0
        pedals = Pedals(float(rng.uniform(5.0, 7.0)), knots, wanted, uphill, air_density)
        result.append(Manoeuvre("out" if uphill > 0 else "back", pedals, times))
    return result


def noise_free(
    vehicle: Vehicle, runs: list[Manoeuvre], effects: Mapping[str, float] | None = None
) -> list[dict[str, Array]]:
    """What perfect sensors would log, SI, by column header."""
    return [_readings(vehicle, run, effects) for run in runs]


def _readings(vehicle: Vehicle, run: Manoeuvre, effects: Mapping[str, float] | None) -> dict[str, Array]:
    q = sizes(effects)
    true = run.ride(vehicle, effects)
    loads = run.ride(vehicle, effects, q["clock_offset"]) if q["clock_offset"] else true
    front_share = np.where(loads.force > 0, 1.0, BRAKE_FRONT)
    gain = 1.0 + q["wheel_force_gain"]
    crossed = (q["load_crosstalk"] + q["load_crosstalk_front"]) * front_share * loads.force
    front = (gain + q["wheel_force_gain_front"]) * (loads.front + crossed)
    front = front - q["load_compression"] * np.maximum(front - vehicle.front_load, 0.0)
    rear = gain * (loads.rear + q["load_crosstalk"] * (1.0 - front_share) * loads.force)
    lever = vehicle.antenna_height - vehicle.cg_height
    push = run.ride(vehicle, effects, q["acceleration_delay"]) if q["acceleration_delay"] else true
    felt = push.acceleration - lever * push.pitch_acceleration
    felt = felt + q["accelerometer_gain"] * felt
    felt = _filtered(run.times, felt, q["acceleration_lag"])
    felt = felt + q["accelerometer_offset"] + GRAVITY * np.sin(q["accelerometer_tilt"])
    return {
        "Time [s]": run.times,
        **dict(zip((f"{wheel} Fz [N]" for wheel in WHEELS), (front / 2, front / 2, rear / 2, rear / 2), strict=True)),
        "Antenna Accel [m/s^2]": felt,
        "Pitch Rate [deg/s]": (1.0 + q["pitch_rate_gain"]) * true.pitch_rate,
        "Speed [km/h]": true.speed - lever * true.pitch_rate,
    }


def _filtered(times: Array, signal: Array, tau: float) -> Array:
    """A signal (n,) behind a first-order low-pass filter; a line between samples, and at rest before the first."""
    if tau == 0.0:
        return signal
    read = signal.copy()
    for k, step in enumerate(np.diff(times)):
        ramp, kept = (signal[k + 1] - signal[k]) / step, np.exp(-step / tau)
        read[k + 1] = signal[k + 1] - ramp * tau + kept * (read[k] - signal[k] + ramp * tau)
    return read


def campaign(
    vehicle: Vehicle,
    seed: int,
    effects: Mapping[str, float] | None = None,
    count: int = 4,
    air_density: float = AIR_DENSITY,
) -> tuple[Run, ...]:
    """The runs as logged, from a seed; the load cells are zeroed before each."""
    runs = manoeuvres(seed, count, air_density)
    rng = np.random.default_rng([seed, 0xC7])
    meters = {f"{wheel} Fz [N]": (LOAD, 1.0) for wheel in WHEELS} | {
        "Antenna Accel [m/s^2]": (ACCELERATION, 1.0),
        "Pitch Rate [deg/s]": (PITCH_RATE, 180 / np.pi),
        "Speed [km/h]": (SPEED, 3.6),
    }
    decimals = {"Time [s]": 4, "Speed [km/h]": 2} | {f"{wheel} Fz [N]": 0 for wheel in WHEELS}
    result = []
    for run, true in zip(runs, noise_free(vehicle, runs, effects), strict=True):
        columns = {"Time [s]": run.times}
        for header, (meter, unit) in meters.items():
            columns[header] = unit * sensors.read(meter, true[header], rng)
        result.append(Run(Record(columns, decimals), run.direction))
    return tuple(result)


def information(
    vehicle: Vehicle,
    seed: int,
    effects: Mapping[str, float] | None = None,
    count: int = 4,
    unknowns: Sequence[str] = (),
) -> Information:
    """About cg_height, cg_to_rear, pitch_inertia and the effects in ``unknowns``.

    Under their priors, also about each run's zero of both axles' load cells, the height of the pitch axis and the
    tires' sliding, which no tester knows.

    Motion and loads being unknown themselves, a log says no more than that the moments balance at each sample, L Ff =
    lr (Ff + Fr) - (M h + 4 J/r) a - Fd hd + I th'', a the antenna's acceleration + (H - h) th'', th'' by the slope of
    the pitch rate; the noise of every sensor in it counts.
    """
    lever = vehicle.antenna_height - vehicle.cg_height
    per_acceleration = vehicle.mass * vehicle.cg_height + 4 * vehicle.wheel_inertia / vehicle.wheel_radius
    names = ("cg_height", "cg_to_rear", "pitch_inertia")
    unknowns = tuple(dict.fromkeys([*unknowns, "pitch_axis"]))
    parts = [prior({"pitch_axis": AXIS, "slip_compliance": SLIP, "tire_relaxation_length": RELAXATION})]
    stretched = replace(vehicle, tire_relaxation_length=vehicle.tire_relaxation_length + RELAXATION)
    for k, run in enumerate(manoeuvres(seed, count)):
        true = run.ride(vehicle, effects)
        late = run.ride(stretched, effects).sliding_rate - true.sliding_rate
        spin = 4 * vehicle.wheel_inertia / vehicle.wheel_radius
        inner = slice(1, -1)
        by_height = -vehicle.mass * true.acceleration + per_acceleration * true.pitch_acceleration
        slopes = np.column_stack(
            [
                by_height[inner],
                (true.front + true.rear)[inner],
                true.pitch_acceleration[inner],
                np.full(run.times.size - 2, vehicle.cg_to_front),
                np.full(run.times.size - 2, -vehicle.cg_to_rear),
                spin * vehicle.tire_longitudinal_stiffness * true.sliding_rate[inner],
                spin * late[inner] / RELAXATION,
                effect_slopes(partial(_imbalance, vehicle, run), effects or {}, unknowns, SMALL, ONE_SIDED),
            ]
        )
        zeros = [f"zero_front_{k}", f"zero_rear_{k}"]
        band = _noise_band(vehicle, run, per_acceleration, lever)
        tires = ("slip_compliance", "tire_relaxation_length")
        parts.append(from_constraints((*names, *zeros, *tires, *unknowns), slopes, band))
        parts.append(prior(dict.fromkeys(zeros, 2**0.5 * LOAD.zero)))
    return total(parts)


def _imbalance(vehicle: Vehicle, run: Manoeuvre, effects: Mapping[str, float]) -> Array:
    """By how much the moments of the readings at the inner samples miss their balance when effects are ignored."""
    log = _readings(vehicle, run, effects)
    front, rear = log["FL Fz [N]"] + log["FR Fz [N]"], log["RL Fz [N]"] + log["RR Fz [N]"]
    rate = log["Pitch Rate [deg/s]"]
    pitching = (rate[2:] - rate[:-2]) / (run.times[2:] - run.times[:-2])
    lever = vehicle.antenna_height - vehicle.cg_height
    per_acceleration = vehicle.mass * vehicle.cg_height + 4 * vehicle.wheel_inertia / vehicle.wheel_radius
    drag = 0.5 * run.pedals.air_density * vehicle.drag_area * log["Speed [km/h]"] ** 2
    moment = vehicle.cg_to_rear * rear - vehicle.cg_to_front * front - drag * vehicle.drag_height
    moment = moment - vehicle.rolling_resistance * vehicle.wheel_radius * (front + rear)
    moment = moment - per_acceleration * log["Antenna Accel [m/s^2]"]
    return np.asarray(moment[1:-1] - per_acceleration * lever * pitching + vehicle.pitch_inertia * pitching)


def _noise_band(vehicle: Vehicle, run: Manoeuvre, per_acceleration: float, lever: float) -> Array:
    """Lower band of the covariance of the moment balance at the inner samples."""
    load, push, rate = (s.noise**2 + s.step**2 / 12 for s in (LOAD, ACCELERATION, PITCH_RATE))
    pitching = (vehicle.pitch_inertia - per_acceleration * lever) / (run.times[2:] - run.times[:-2])
    band = np.zeros((3, pitching.size))
    band[0] = 2 * load * (vehicle.cg_to_front**2 + vehicle.cg_to_rear**2) + per_acceleration**2 * push
    band[0] += 2 * pitching**2 * rate
    band[2, :-2] = -pitching[:-2] * pitching[2:] * rate
    return band


def samples() -> Samples:
    """launch_1.csv to launch_4.csv."""
    runs = campaign(REFERENCE, 20171, {"own_axles": 1.0}, air_density=sample.AIR_DENSITY)
    return Samples(
        title="Accelerate-and-brake runs",
        files={
            f"launch_{k}.csv": csv_bytes(run.record, WINDOWS if k == 3 else PLAIN)
            for k, run in enumerate(runs, start=1)
        },
        truth=truth(REFERENCE)
        | {"mass": REFERENCE.mass, "wheelbase": REFERENCE.wheelbase, "antenna_height": REFERENCE.antenna_height}
        | {"drag_area": REFERENCE.drag_area, "drag_height": REFERENCE.drag_height, "air_density": sample.AIR_DENSITY}
        | {"wheel_inertia": REFERENCE.wheel_inertia, "wheel_radius": REFERENCE.wheel_radius}
        | {"rolling_resistance": REFERENCE.rolling_resistance}
        | {f"unsprung_mass_{n}": getattr(REFERENCE, f"unsprung_mass_{n}") for n in ("front", "rear")},
        about=(
            "Throttle and brake pulses on a flat road, out (1, 3) and back (2, 4), in still air. Loads are those "
            "between tire and road; the load cells were zeroed to about 10 N each before every run. The antenna's "
            "acceleration is the rate of its speed, forward positive, free of gravity; it is 1.52 m above the road."
            " Pitch rate is nose-up positive. The angular momentum of the four wheels is in the loads (without it,"
            " cg height has an error of 1.6 %), and so is the moment of rolling resistance (without it, cg_to_rear has"
            " an error of 3 mm). The axles bounce on the tires (without this, the pitch inertia has an error). Every"
            " channel is on one clock. launch_3 has CRLF line ends."
        ),
    )
