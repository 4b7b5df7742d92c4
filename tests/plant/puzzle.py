"""A car that is slower than its simulation: launches to 90 km/h in which the motor-generators' inertia is in the truth
and not in what the tester knows.

From outside it looks like heavier wheels, like drag of the measuring rig, or like a torque sensor that reads too much.
What tells them apart: the half-shafts' torque is measured outboard of the motors, so that inertia before the shafts and
inertia behind them show in different channels; and each launch has another acceleration, so that what goes with
acceleration, with torque and with speed do not go together.
"""

from __future__ import annotations

from collections.abc import Sequence

from tests.plant import drive, drive_information, sample
from tests.plant.drive import Driver, Rig, Run
from tests.plant.drive_motion import Pedals
from tests.plant.hidden import Evidence
from tests.plant.information import prior, total
from tests.plant.sample import Samples
from tests.plant.sensors import Record
from tests.plant.vehicle import REFERENCE, Vehicle
from tests.plant.write_csv import csv_bytes

SEED = 20173
KNOWN = 0.10, 0.05  # kg m^2 at the driven wheels: what the tester takes the driveline's inertia for, and its spread
LEVELS = (0.8, 1.3, 1.9, 2.6)  # m/s^2 before road load
TOP = 90 / 3.6
LEFT_OUT = ("Brake Torque [N m]", "Long Accel [m/s^2]")  # of a drive's columns
RIVALS = {
    "wheel_inertia": 0.32,
    "extra_drag_area": 0.1,
    "torque_gain": 0.02,
    "mass_error": 0.02,
    "driveline_drag": 50.0,
}
RIG = Rig(air_density=sample.AIR_DENSITY, temperature=sample.TEMPERATURE)


def pedals(vehicle: Vehicle = REFERENCE, levels: Sequence[float] = LEVELS) -> list[Pedals]:
    """From rest to 90 km/h, each at its own level, half of it for a while in between; then a few seconds' coasting."""
    per_force = vehicle.mass * vehicle.wheel_radius / vehicle.gear_ratio
    result = []
    for k, level in enumerate(levels):
        driver = Driver(vehicle)
        driver.press(0.0, 0.0, 0.3, 0.7)
        driver.press(level * per_force, 0.0, 0.25, 0.0, until=0.5 * TOP)
        driver.press(0.5 * level * per_force, 0.0, 0.25, 2.0)
        driver.press(level * per_force, 0.0, 0.25, 0.0, until=TOP)
        driver.press(0.0, 0.0, 0.25, 5.0)
        result.append(driver.pedals(1.0 if k % 2 == 0 else -1.0))
    return result


def truth(vehicle: Vehicle = REFERENCE) -> dict[str, float]:
    """What is to be found: the inertia that the tester does not know of."""
    return {"motor_inertia": vehicle.driveline_inertia - KNOWN[0]}


def campaign(vehicle: Vehicle = REFERENCE, seed: int = SEED) -> list[Run]:
    """The launches as logged, without brakes and accelerometer."""
    runs = drive.logged(vehicle, pedals(vehicle), seed, rig=RIG)
    return [Run(_without(run.record), run.direction, run.temperature) for run in runs]


def evidence(vehicle: Vehicle = REFERENCE, shaft_torque: bool = True, levels: Sequence[float] = LEVELS) -> Evidence:
    """How well the logs tell the inertia, and from what, at best; without the half-shafts' torque if so wanted."""
    seen = [header for header in drive_information.SEEN if header not in LEFT_OUT]
    if not shaft_torque:
        seen = [header for header in seen if not header.startswith("Shaft")]
    sizes = {**truth(vehicle), **RIVALS}
    spread = {**drive_information.SPREAD, "driveline_inertia": KNOWN[1] / vehicle.driveline_inertia}
    plans = pedals(vehicle, levels)
    info = drive_information.information(vehicle, SEED, tuple(sizes), spread, plans, RIG, seen)
    loose = prior({name: 10.0 * size for name, size in sizes.items()})
    return Evidence(sizes, ("motor_inertia",), info.known(list(RIVALS)), total([info, loose]))


def _without(record: Record) -> Record:
    kept = {header: values for header, values in record.columns.items() if header not in LEFT_OUT}
    return Record(kept, record.decimals)


def samples() -> Samples:
    """puzzle_1.csv to puzzle_4.csv."""
    runs = campaign()
    return Samples(
        title="Launches of a car that is slower than its simulation",
        files={f"puzzle_{k}.csv": csv_bytes(run.record) for k, run in enumerate(runs, start=1)},
        truth={**drive.truth(REFERENCE), **truth(), "air_density": sample.AIR_DENSITY},
        about=(
            "From rest to 90 km/h at four levels of drive torque, half of it for a while in between, then coasting; "
            "out (1, 3) and back (2, 4), without brakes. The motor-generators turn with the differential's "
            "carrier and have driveline_inertia (kg m^2 at the driven wheels). The tester knows of "
            f"{KNOWN[0]:.2f} +- {KNOWN[1]:.2f} kg m^2 only; motor_inertia is the rest, which the diagnosis must find. "
            "The half-shafts' torque is measured outboard of the motors. Drive torque, directions, gusts and clock as "
            "in the drives above."
        ),
    )
