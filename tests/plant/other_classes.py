"""A truck of 12 t, a kart of 200 kg and an electric car of 2.2 t that coast down, and the description of such a day.

    (M + mr) dV = -(1/2 rho CdA (V + w)^2 + frr M g cos a + M g sin a) dt,   step 0.05 s, midpoint rule

with w a first-order random gust. Shares nothing with ``coast_motion`` and imports nothing from the program.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

STEP = 0.05  # s
GRAVITY, AIR = 9.81, 1.19


@dataclass(frozen=True)
class Coaster:
    """Masses in kg, drag area in m^2, first and last speed in m/s, share of the drag area shed at speed."""

    mass: float
    rotating: float
    rolling: float
    drag_area: float
    first: float
    last: float
    shed: float = 0.0


TRUCK = Coaster(12_000.0, 450.0, 0.0062, 6.1, 25.0, 4.5)
KART = Coaster(201.0, 7.0, 0.021, 0.72, 23.0, 3.5)
HEAVY_EV = Coaster(2210.0, 120.0, 0.0093, 0.59, 32.5, 4.5)


def coast(
    car: Coaster, slope: float, rng: np.random.Generator, dragging: float = 0.0, fading: float = 0.0
) -> NDArray[np.float64]:
    """Time (s) and measured speed (m/s) at 5 Hz, two columns.

    ``slope`` uphill; brakes in m/s^2: ``dragging`` throughout, ``fading`` with 15 s. A car sheds ``car.shed`` of its
    drag area above 22 m/s.
    """
    speed, gust, rows = car.first + rng.normal(0.0, 0.2), 0.0, []

    def slower(v: float, time: float) -> float:
        area = car.drag_area * (1.0 - car.shed / (1.0 + np.exp(-(v - 22.0) / 0.8)))
        air = 0.5 * AIR * area * (v + gust) * abs(v + gust)
        return (air + car.mass * GRAVITY * (car.rolling + slope)) / (car.mass + car.rotating) + brake(time)

    def brake(time: float) -> float:
        return dragging + fading * float(np.exp(-time / 15.0))

    for k in range(8000):
        if k % 4 == 0:
            rows.append((k * STEP, speed + rng.normal(0.0, 0.03)))
        gust += -gust * STEP / 7.0 + rng.normal(0.0, 0.4 * np.sqrt(2 * STEP / 7.0))
        time = k * STEP
        speed -= STEP * slower(speed - 0.5 * STEP * slower(speed, time), time)
        if speed < car.last:
            break
    return np.array(rows)


def write_table(folder: Path, car: Coaster, slope: float, seed: int, pairs: int = 3) -> Path:
    """Split times at twelve speed levels, read from a display to 0.1 s, and their description."""
    rng, runs = np.random.default_rng(seed), []
    levels = np.linspace(car.first - 1.0, car.last + 1.0, 12)
    columns = [levels]
    for k in range(2 * pairs):
        rows = coast(car, slope if k % 2 == 0 else -slope, rng)
        smooth = np.convolve(rows[:, 1], np.ones(5) / 5, "valid")
        passed = np.array([rows[2:-2, 0][np.flatnonzero(smooth >= v)[-1]] for v in levels])
        columns.append(np.round(passed - passed[0] + rng.normal(0.0, 0.05, levels.size), 1))
        columns[-1][0] = 0.0
        way = "back" if k % 2 else "out"
        runs.append(f"  - {{log: splits.csv, direction: {way}, columns: {{time: t{k}}}}}")
    header = ",".join(["v", *(f"t{k}" for k in range(2 * pairs))])
    np.savetxt(folder / "splits.csv", np.column_stack(columns), fmt="%.3f", delimiter=",", header=header, comments="")
    text = f"""test: coastdown
vehicle: {{mass: {car.mass} kg, rotating_mass: {car.rotating} kg, air_density: {AIR} kg/m^3}}
reading: {{split_times: elapsed}}
channels:
  time: {{column: t0, unit: s}}
  speed: {{column: v, unit: m/s}}
runs:
"""
    (folder / "table.yaml").write_text(text + "\n".join(runs) + "\n")
    return folder / "table.yaml"


# By keyword: what differs between days.
def write_day(
    folder: Path,
    car: Coaster,
    slope: float,
    seed: int,
    pairs: int = 2,
    dragging: dict[int, float] | None = None,
    fading: float = 0.0,
) -> Path:
    """Coasts out and back in turn as CSV files and their description; ``dragging`` by number of the run."""
    rng, runs = np.random.default_rng(seed), []
    for k in range(2 * pairs):
        rows = coast(car, slope if k % 2 == 0 else -slope, rng, (dragging or {}).get(k, 0.0), fading)
        np.savetxt(folder / f"run{k}.csv", rows, fmt="%.3f", delimiter=";", header="zeit;v", comments="")
        runs.append(f"  - {{log: run{k}.csv, direction: {'back' if k % 2 else 'out'}}}")
    text = f"""test: coastdown
vehicle: {{mass: {car.mass} kg, rotating_mass: {car.rotating} kg, air_density: {AIR} kg/m^3}}
channels:
  time: {{column: zeit, unit: s}}
  speed: {{column: v, unit: m/s}}
runs:
""" + "\n".join(runs)
    window = f"settings: {{speed_window: [{car.first - 1} m/s, {car.last + 0.5} m/s]}}"
    (folder / "day.yaml").write_text(f"{text}\n{window}\n")
    return folder / "day.yaml"
