"""Coast-downs on days as they are: a road that undulates, wind that drifts, sensors that hold, filter and round.

The car is a mass with rolling wheels, integrated by the classical Runge-Kutta rule in 0.05 s steps::

    (M + mr) V' = -(frr + frr1 V) M g cos(i) - 1/2 rho Cd A (V + w) |V + w| - M g sin(i) - brake

Every case draws its own vehicle, road, wind and sensors. Position is the road's coordinate: it rises on the way out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import exp

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

Array = NDArray[np.float64]

GRAVITY = 9.80665
STEP = 0.05  # s
LONGEST = 900.0  # s of a coast
FINE = 5.0  # m between the points of a road
ROAD = 8_000.0  # m, of road that is drawn


@dataclass(frozen=True)
class Vehicle:
    """The truth of one case: kg, kg, -, m^2, kg/m^3."""

    mass: float
    rotating_mass: float
    rolling_resistance: float
    drag_area: float
    air_density: float

    def load(self, speed: float) -> float:
        """Road load on a level road in still air, N, at m/s."""
        return self.rolling_resistance * self.mass * GRAVITY + 0.5 * self.air_density * self.drag_area * speed**2


@dataclass(frozen=True)
class Weather:
    """Wind along the road, m/s: gusts with their time (s), a drift over the day with its period (s)."""

    gust: float = 0.5
    gust_time: float = 8.0
    drift: float = 0.3
    drift_time: float = 900.0


@dataclass(frozen=True)
class Logger:
    """How the speed is read.

    Parameters
    ----------
    rate : Hz of the log. noise : m/s of a reading. step : m/s, of its quantization.
    held : Hz of the receiver's own readings, each held until the next; 0 where it reads at the log's rate.
    smooth : s, time constant of a first-order filter in the receiver; 0 for none.
    """

    rate: float = 10.0
    noise: float = 0.03
    step: float = 0.01 / 3.6
    held: float = 0.0
    smooth: float = 0.0


@dataclass(frozen=True)
class Day:
    """How a case is driven.

    Parameters
    ----------
    rms : slope of the road, root mean square; ``waves`` : "sines", "random" or "bowls".
    late_clutch : s at a run's start in which the engine still drags. brake : N at the start of a run, fading in
        ``brake_time`` s.
    """

    rms: float = 0.001
    waves: str = "sines"
    runs: int = 8
    upper: float = 33.0
    lower: float = 3.0
    scatter: float = 0.01
    weather: Weather = field(default_factory=Weather)
    logger: Logger = field(default_factory=Logger)
    late_clutch: float = 0.0
    brake: float = 0.0
    brake_time: float = 20.0


@dataclass(frozen=True)
class Run:
    """One logged coast: (n,) s, m/s, m; ``start`` s since the first run began."""

    time: Array
    speed: Array
    position: Array
    direction: str
    start: float


@dataclass(frozen=True)
class Case:
    """A vehicle, its day and the logs."""

    vehicle: Vehicle
    day: Day
    runs: tuple[Run, ...]
    slope: Callable[[Array], Array] = field(default=np.zeros_like, compare=False)

    @property
    def truth(self) -> dict[str, float]:
        """What a coast-down should find, the road load at 60 km/h in N among it."""
        v = self.vehicle
        return {
            "rolling_resistance": v.rolling_resistance,
            "drag_area": v.drag_area,
            "road_load_60": v.load(60 / 3.6),
        }


def road_of(case: Case) -> Callable[[Array], Array]:
    """Slope of a case's road over its coordinate, for whoever surveys it."""
    return case.slope


def vehicle(rng: np.random.Generator) -> Vehicle:
    """A car between a light two-seater and a large van."""
    mass = rng.uniform(900.0, 2400.0)
    return Vehicle(
        mass=round(mass),
        rotating_mass=round(mass * rng.uniform(0.025, 0.045)),
        rolling_resistance=rng.uniform(0.007, 0.014),
        drag_area=rng.uniform(0.50, 1.0),
        air_density=round(rng.uniform(1.12, 1.26), 4),
    )


@dataclass(frozen=True)
class Road:
    """Slopes every ``FINE`` m from ``begin``, linear between."""

    begin: float
    slopes: Array

    def __call__(self, x: Array) -> Array:
        return np.interp(x, self.begin + FINE * np.arange(self.slopes.size), self.slopes)

    def at(self) -> Callable[[float], float]:
        """The same for one place at a time, without numpy."""
        begin, slopes = self.begin, self.slopes.tolist()
        last = len(slopes) - 1

        def slope(x: float) -> float:
            share = (x - begin) / FINE
            k = int(share)
            if not 0.0 <= share < last:
                return slopes[0] if share < 0.0 else slopes[last]
            return slopes[k] + (share - k) * (slopes[k + 1] - slopes[k])

        return slope


def road(rms: float, waves: str, length: float, rng: np.random.Generator) -> Road:
    """Slope over the road coordinate, flat on average over the stretch that is driven, of this rms there."""
    at = np.arange(-0.5 * ROAD, ROAD, FINE)
    if waves == "sines":
        slope = np.zeros_like(at)
        for wavelength in np.exp(rng.uniform(np.log(120.0), np.log(1500.0), 6)):
            slope += rng.uniform(0.3, 1.0) * np.sin(2 * np.pi * (at / wavelength + rng.uniform()))
    elif waves == "random":
        slope = gaussian_filter1d(rng.standard_normal(at.size), rng.uniform(30.0, 150.0) / FINE)
    else:  # bowls: a few dips and crests of their own lengths
        slope = np.zeros_like(at)
        for _ in range(8):
            u = (at - rng.uniform(-0.2, 1.2) * length) / rng.uniform(60.0, 300.0)
            slope += rng.uniform(-1.0, 1.0) * u * np.exp(0.5 - 0.5 * u**2)
    there = (at >= 0) & (at <= length)
    slope = slope - slope[there].mean()
    slope *= rms / max(float(np.sqrt(np.mean(slope[there] ** 2))), 1e-12)
    return Road(float(at[0]), slope)


def wind(weather: Weather, clock: Array, begin: float, phase: float, rng: np.random.Generator) -> Array:
    """Wind along the out direction at the times of a run, m/s."""
    stay = np.exp(-STEP / weather.gust_time)
    fresh = rng.standard_normal(clock.size) * weather.gust * np.sqrt(1 - stay**2)
    gust = np.empty(clock.size)
    gust[0] = weather.gust * rng.standard_normal()
    for k in range(1, clock.size):
        gust[k] = stay * gust[k - 1] + fresh[k]
    drift = weather.drift * np.sqrt(2.0) * np.sin(2 * np.pi * ((begin + clock) / weather.drift_time + phase))
    return np.asarray(gust + drift)


def coast(
    car: Vehicle, day: Day, slope: Callable[[float], float] | None, begin: tuple[float, float, float], air: Array
) -> tuple[Array, Array]:
    """Speed and position of one run on the fine clock; ``begin`` is heading, position m and speed m/s."""
    heading, place, speed = begin
    weight, inertia = car.mass * GRAVITY, car.mass + car.rotating_mass
    drag, rolling = 0.5 * car.air_density * car.drag_area, car.rolling_resistance

    def rate(time: float, v: float, x: float, w: float) -> float:
        flow = v + heading * w
        force = rolling * weight + drag * flow * abs(flow)
        if slope is not None:
            force += weight * heading * slope(x)
        if day.late_clutch and time < day.late_clutch:
            force += 300.0
        return -(force + (day.brake * exp(-time / day.brake_time) if day.brake else 0.0)) / inertia

    speeds, places, h = [speed], [place], STEP
    for k, w in enumerate(air[:-1].tolist()):
        t = k * STEP
        a = rate(t, speed, place, w)
        b = rate(t + h / 2, speed + h / 2 * a, place + heading * h / 2 * speed, w)
        c = rate(t + h / 2, speed + h / 2 * b, place + heading * h / 2 * (speed + h / 2 * a), w)
        d = rate(t + h, speed + h * c, place + heading * h * (speed + h / 2 * b), w)
        place += heading * h * (speed + h / 6 * (a + b + c))
        speed += h / 6 * (a + 2 * b + 2 * c + d)
        speeds.append(speed)
        places.append(place)
        if speed < day.lower:
            break
    return np.array(speeds), np.array(places)


def reading(logger: Logger, clock: Array, speed: Array, time: Array, rng: np.random.Generator) -> Array:
    """What the logger writes at its times, m/s."""
    seen = speed
    if logger.smooth:
        seen = np.empty_like(speed)
        seen[0], share = speed[0], 1 - np.exp(-STEP / logger.smooth)
        for k in range(1, speed.size):
            seen[k] = seen[k - 1] + share * (speed[k] - seen[k - 1])
    own = time if not logger.held else np.arange(0.0, time[-1] + 1 / logger.held, 1 / logger.held)
    read = np.interp(own, clock, seen) + logger.noise * rng.standard_normal(own.size)
    if logger.held:
        read = read[np.searchsorted(own, time + 1e-9, side="right") - 1]
    return np.asarray(np.round(read / logger.step) * logger.step if logger.step else read)


def drive(seed: int, day: Day, car: Vehicle | None = None) -> Case:
    """A case as logged: a vehicle and a road of its own, runs out and back over about the same stretch."""
    rng = np.random.default_rng([seed, 0x3E55])
    car = vehicle(rng) if car is None else car
    still = replace(day, late_clutch=0.0, brake=0.0)
    level = coast(car, still, None, (1.0, 0.0, day.upper), np.zeros(int(LONGEST / STEP)))
    length = float(level[1][-1])
    slope, phase = road(day.rms, day.waves, length, rng), rng.uniform()
    runs, begin = [], 0.0
    gap = rng.uniform(0.0, 200.0)  # m by which the way back begins beyond the end of the way out
    for k in range(day.runs):
        heading = 1.0 if k % 2 == 0 else -1.0
        start = (0.0 if heading > 0 else length + gap) + rng.uniform(-20.0, 20.0)
        own = replace(car, rolling_resistance=car.rolling_resistance * (1 + day.scatter * rng.standard_normal()))
        clock = np.arange(0.0, LONGEST, STEP)
        air = wind(day.weather, clock, begin, phase, rng)
        speed, place = coast(own, day, slope.at(), (heading, start, day.upper + rng.uniform(-0.5, 0.5)), air)
        clock = clock[: speed.size]
        time = np.arange(0.0, clock[-1], 1 / day.logger.rate)
        shown = reading(day.logger, clock, speed, time, rng)
        position = np.interp(time, clock, place) + 0.5 * rng.standard_normal(time.size)
        runs.append(Run(time, shown, position, "out" if heading > 0 else "back", begin))
        begin += float(np.ceil(clock[-1] + 60.0))
    return Case(car, day, tuple(runs), slope)


def drawn_day(kind: str, seed: int) -> Day:
    """A day of a class: ``clean``, ``undulating``, ``drifting``, ``held``, ``filtered``, ``quantized``, ``late``,
    ``fading`` (a brake on an undulating road)."""
    rng = np.random.default_rng([seed, 0xDA7])
    rms = float(np.exp(rng.uniform(np.log(5e-4), np.log(3e-3))))
    waves = str(rng.choice(["sines", "random", "bowls"]))
    rate = float(rng.choice([5.0, 10.0, 20.0]))
    day = Day(rms=rms, waves=waves, logger=Logger(rate=rate))
    if kind == "clean":
        return replace(day, rms=0.0)
    if kind == "drifting":
        return replace(day, rms=min(rms, 1e-3), weather=Weather(drift=0.8))
    if kind == "held":
        return replace(day, rms=min(rms, 1e-3), logger=Logger(rate=50.0, held=5.0))
    if kind == "filtered":
        return replace(day, rms=min(rms, 1e-3), logger=Logger(rate=20.0, smooth=0.5, noise=0.01))
    if kind == "quantized":
        return replace(day, rms=min(rms, 1e-3), logger=Logger(rate=20.0, noise=0.02, step=0.1 / 3.6))
    if kind == "late":
        return replace(day, rms=min(rms, 1e-3), late_clutch=float(rng.uniform(1.0, 3.0)))
    if kind == "fading":
        return replace(day, rms=min(rms, 2e-3), brake=float(rng.uniform(90.0, 200.0)), brake_time=20.0)
    return day


CLASSES = ("clean", "undulating", "drifting", "held", "filtered", "quantized", "late", "fading")
