"""Coast-downs on undulating roads, by what is known of the road: ``python -m tests.bench.road_profile [cases] [seed]``.

The survey has a point each 25 m, with an error of 5 mm of elevation. The other kinds log the position, the elevation
alone (in steps of 1 m, or to 0.1 m with the drift of a receiver), or neither. Writes road_profile.md.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import yaml

from tests.plant.messy_day import Array, Case, Run, drawn_day, drive, road_of
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.errors import VdynError
from vdyn_cli.quantities.result import Result

SEEDS = 9100  # of the published table
SPACING, ERROR = 25.0, 0.005  # m
NAMES = ("rolling_resistance", "drag_area")
KINDS = ("surveyed", "position", "elevation in steps of 1 m", "elevation that drifts by 1 m", "speed alone")
DRIFT, DRIFT_TIME = 1.0, 60.0  # m, s: standard deviation and correlation time of a receiver's elevation


def described(case: Case, seed: int, folder: Path, kind: str, sign: float = 1.0) -> Path:
    """The logs, the survey, and their description; ``kind`` is one of ``KINDS``."""
    random = np.random.default_rng([seed, 5])
    columns = {"time": ("Time [s]", "s"), "speed": ("Speed [km/h]", "km/h")}
    columns |= {"position": ("Position [m]", "m")} if kind in ("surveyed", "position") else {}
    columns |= {"elevation": ("Height [m]", "m")} if kind.startswith("elevation") else {}
    runs = []
    for k, run in enumerate(case.runs, start=1):
        read = {"time": run.time, "speed": 3.6 * run.speed, "position": run.position}
        if "elevation" in columns:
            read["elevation"] = _logged_height(case, run, kind, random)
        rows = np.column_stack([read[n] for n in columns])
        head = ",".join(column for column, _ in columns.values())
        np.savetxt(folder / f"run_{k}.csv", rows, "%.4f", ",", header=head, comments="")
        runs.append({"log": f"run_{k}.csv", "direction": run.direction, "start": float(run.start)})
    _write_survey(case, random, folder, sign)
    car = case.vehicle
    text = {
        "test": "coastdown",
        "vehicle": {n: float(getattr(car, n)) for n in ("mass", "rotating_mass", "air_density")},
        "channels": {n: {"column": c, "unit": u} for n, (c, u) in columns.items()},
        "runs": runs,
        "settings": {"crosswind": "0 m/s"} | ({"road": {"profile": "road.csv"}} if kind == "surveyed" else {}),
    }
    (folder / "coast.yaml").write_text(yaml.safe_dump(text))
    return folder / "coast.yaml"


def _heights(case: Case, begin: float, end: float) -> tuple[Array, Array]:
    """Road coordinate, m, and elevation, m."""
    fine = np.arange(begin, end + 1.0, 1.0)
    return fine, np.concatenate([[0.0], np.cumsum(road_of(case)(0.5 * (fine[1:] + fine[:-1])))])


def _logged_height(case: Case, run: Run, kind: str, random: np.random.Generator) -> Array:
    fine, height = _heights(case, float(run.position.min()) - 60.0, float(run.position.max()) + 60.0)
    seen = np.interp(run.position, fine, height)
    if kind.endswith("steps of 1 m"):
        return np.round(seen)
    keep = np.exp(-np.gradient(run.time) / DRIFT_TIME)
    drift = np.empty_like(seen)
    drift[0] = DRIFT * random.standard_normal()
    for k in range(1, drift.size):
        drift[k] = keep[k] * drift[k - 1] + DRIFT * np.sqrt(1 - keep[k] ** 2) * random.standard_normal()
    return np.asarray(np.round(seen + drift, 1))


def _write_survey(case: Case, random: np.random.Generator, folder: Path, sign: float) -> None:
    place = np.concatenate([run.position for run in case.runs])
    at = np.arange(place.min() - 60.0, place.max() + 60.0, SPACING)
    fine, height = _heights(case, float(at[0]), float(at[-1]))
    shown = sign * np.interp(at, fine, height) + random.normal(0.0, ERROR, at.size)
    table = np.column_stack([at, shown, np.full(at.size, ERROR)])
    head = "position [m],elevation [m],elevation_std [m]"
    np.savetxt(folder / "road.csv", table, "%.5f", ",", header=head, comments="")


def result(case: Case, seed: int, kind: str, sign: float = 1.0) -> Result:
    """The step's result, without a diagnosis."""
    with tempfile.TemporaryDirectory() as name:
        return execute("coastdown", described(case, seed, Path(name), kind, sign), level=None).result


def main(arguments: list[str]) -> int:
    count, first = (int(arguments[0]) if arguments else 30), (int(arguments[1]) if len(arguments) > 1 else SEEDS)
    lines = ["| road | parameter | covered | median half width | refused |", "|---|---|---|---|---|"]
    for kind in KINDS:
        inside, width, refused = {n: list[bool]() for n in NAMES}, {n: list[float]() for n in NAMES}, 0
        for seed in range(first, first + count):
            case = drive(seed, replace(drawn_day("undulating", seed), runs=8))
            try:
                found = result(case, seed, kind).parameters
            except VdynError:
                refused += 1
                continue
            for n in NAMES:
                low, high = found[n].interval95
                inside[n].append(low <= case.truth[n] <= high)
                width[n].append(0.5 * (high - low) / case.truth[n])
        for n in NAMES:
            lines.append(f"| {kind} | {n} | {np.mean(inside[n]):.0%} | {np.median(width[n]):.2%} | {refused} |")
            print(lines[-1], flush=True)
    if first == SEEDS:
        head = f"# Surveyed roads\n\n`python -m tests.bench.road_profile`: {count} undulating roads, eight coasts "
        head += "each.\n\n"
        Path(__file__).with_name("road_profile.md").write_text(head + "\n".join(lines) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
