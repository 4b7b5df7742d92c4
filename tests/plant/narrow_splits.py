"""Coast-down reports over a narrow range of speed: a few levels, many runs, wind, and a force that no law has.

    (M + mr) V' = -(frr M g + 1/2 rho Cd A (V + w)|V + w| + M g i + extra(V, t)),   midpoint rule, step 0.02 s

with w the mean wind of a run and first-order gusts. A report holds the instants at which levels of speed are passed,
each read with the error of a speed that jitters. Imports nothing from the program.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.plant.messy_day import GRAVITY, Array, Case, Day, Run, Vehicle, vehicle

STEP = 0.02  # s
KMH = 1 / 3.6
SHAPES = ("none", "step", "hump", "start")


@dataclass(frozen=True)
class Report:
    """How a report is driven.

    Parameters
    ----------
    levels : km/h, falling. runs : out and back in turn. wind : m/s, mean wind of the day; its scatter between runs and
        its gusts are ``scatter`` and ``gust``. slope : m/m, uphill on the way out. jitter : m/s, of the speed as read.
    shape, extra : of the force that no law has: a ``step`` or a ``hump`` of this size (N) over the speed, or one that
        fades after the ``start``.
    """

    levels: tuple[float, ...] = (95.0, 90.0, 85.0, 80.0, 75.0, 70.0)
    runs: int = 13
    wind: float = 1.0
    scatter: float = 0.4
    gust: float = 0.5
    slope: float = 0.0
    jitter: float = 0.03
    shape: str = "none"
    extra: float = 0.0


def extra_force(report: Report, speed: float, time: float) -> float:
    """The force that no law has, N, at m/s and s since the start."""
    middle = 0.5 * (report.levels[0] + report.levels[-1]) * KMH
    if report.shape == "step":
        return report.extra * 0.5 * (1.0 + float(np.tanh((speed - middle) / 0.6)))
    if report.shape == "hump":
        return report.extra * float(np.exp(-0.5 * ((speed - middle) / 1.2) ** 2))
    return report.extra * float(np.exp(-time / 6.0)) if report.shape == "start" else 0.0


def load_of(car: Vehicle, report: Report, speed: float) -> float:
    """Road load with what the force adds over the speed, N, at m/s; one that fades is not the car's."""
    return car.load(speed) + (extra_force(report, speed, 0.0) if report.shape != "start" else 0.0)


def drive(seed: int, report: Report, car: Vehicle | None = None) -> Case:
    """A case as reported: the instants of the levels of each run."""
    rng = np.random.default_rng([seed, 0x5B1])
    car = vehicle(rng) if car is None else car
    levels, runs = np.array(report.levels) * KMH, []
    for k in range(report.runs):
        heading = 1.0 if k % 2 == 0 else -1.0
        mean = heading * (report.wind + report.scatter * rng.standard_normal())
        time, speed = _coast(car, report, (heading, mean, levels[0] + rng.uniform(0.3, 1.0), levels[-1] - 0.5), rng)
        passed = np.interp(-levels, -speed, time)
        slower = -np.interp(passed, time, np.gradient(speed, time))
        passed += report.jitter * rng.standard_normal(levels.size) / slower
        way = "out" if heading > 0 else "back"
        runs.append(Run(passed - passed[0], levels, np.zeros(levels.size), way, 150.0 * k))
    return Case(car, Day(runs=report.runs), tuple(runs))


def _coast(
    car: Vehicle, report: Report, begin: tuple[float, float, float, float], rng: np.random.Generator
) -> tuple[Array, Array]:
    """Time and falling speed; ``begin`` is heading, headwind, first and last speed."""
    heading, mean, speed, last = begin
    gust, stay = report.gust * rng.standard_normal(), np.exp(-STEP / 8.0)
    times, speeds, time = [0.0], [speed], 0.0

    def rate(v: float, t: float) -> float:
        air = v + mean + gust
        force = car.mass * GRAVITY * (car.rolling_resistance + heading * report.slope)
        force += 0.5 * car.air_density * car.drag_area * air * abs(air) + extra_force(report, v, t)
        return -force / (car.mass + car.rotating_mass)

    while speed > last:
        speed += STEP * rate(speed + 0.5 * STEP * rate(speed, time), time + 0.5 * STEP)
        gust = stay * gust + report.gust * np.sqrt(1 - stay**2) * rng.standard_normal()
        time += STEP
        times.append(time)
        speeds.append(speed)
    return np.array(times), np.array(speeds)


def drawn_report(seed: int) -> Report:
    """A report of this class: five or six levels, eight to fourteen runs, some wind, any small force."""
    rng = np.random.default_rng([seed, 0x7E9])
    top, step = float(rng.choice([130.0, 110.0, 95.0, 80.0])), float(rng.choice([5.0, 10.0]))
    count = 6 if step == 5.0 else 4
    return Report(
        levels=tuple(top - step * k for k in range(count)),
        runs=int(rng.integers(8, 15)),
        wind=float(rng.uniform(-2.0, 2.0)),
        scatter=float(rng.uniform(0.2, 0.5)),
        gust=float(rng.uniform(0.3, 0.8)),
        slope=float(rng.normal(0.0, 0.001)),
        jitter=float(rng.choice([0.01, 0.03])),
        shape=str(rng.choice(SHAPES)),
        extra=float(rng.choice([-1.0, 1.0]) * rng.uniform(10.0, 40.0)),
    )
