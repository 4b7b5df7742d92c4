"""Coast-downs on undulating roads, with and without a survey: ``python -m tests.bench.road_profile [cases] [seed]``.

The survey has a point each 25 m, with an error of 5 mm of elevation. Writes road_profile.md.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import yaml

from tests.plant.messy_day import Case, drawn_day, drive, road_of
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.errors import VdynError
from vdyn_cli.quantities.result import Result

SEEDS = 9100  # of the published table
SPACING, ERROR = 25.0, 0.005  # m
NAMES = ("rolling_resistance", "drag_area")


def described(case: Case, seed: int, folder: Path, survey: bool, sign: float = 1.0) -> Path:
    """The logs, the survey, and their description."""
    runs = []
    for k, run in enumerate(case.runs, start=1):
        rows = np.column_stack([run.time, 3.6 * run.speed, run.position])
        head = "Time [s],Speed [km/h],Position [m]"
        np.savetxt(folder / f"run_{k}.csv", rows, "%.4f", ",", header=head, comments="")
        runs.append({"log": f"run_{k}.csv", "direction": run.direction, "start": float(run.start)})
    place = np.concatenate([run.position for run in case.runs])
    at = np.arange(place.min() - 60.0, place.max() + 60.0, SPACING)
    fine = np.arange(at[0], at[-1] + 1.0, 1.0)
    height = np.concatenate([[0.0], np.cumsum(road_of(case)(0.5 * (fine[1:] + fine[:-1])))])
    shown = sign * np.interp(at, fine, height) + np.random.default_rng([seed, 5]).normal(0.0, ERROR, at.size)
    table = np.column_stack([at, shown, np.full(at.size, ERROR)])
    head = "position [m],elevation [m],elevation_std [m]"
    np.savetxt(folder / "road.csv", table, "%.5f", ",", header=head, comments="")
    car = case.vehicle
    known = {n: float(getattr(car, n)) for n in ("mass", "rotating_mass", "air_density")}
    channels = {"time": ("Time [s]", "s"), "speed": ("Speed [km/h]", "km/h"), "position": ("Position [m]", "m")}
    text = {
        "test": "coastdown",
        "vehicle": known,
        "channels": {n: {"column": c, "unit": u} for n, (c, u) in channels.items()},
        "runs": runs,
        "settings": {"road": {"profile": "road.csv"}} if survey else {},
    }
    (folder / "coast.yaml").write_text(yaml.safe_dump(text))
    return folder / "coast.yaml"


def result(case: Case, seed: int, survey: bool, sign: float = 1.0) -> Result:
    """The step's result, without a diagnosis."""
    with tempfile.TemporaryDirectory() as name:
        return execute("coastdown", described(case, seed, Path(name), survey, sign), level=None).result


def main(arguments: list[str]) -> int:
    count, first = (int(arguments[0]) if arguments else 30), (int(arguments[1]) if len(arguments) > 1 else SEEDS)
    lines = ["| road | parameter | covered | median half width | refused |", "|---|---|---|---|---|"]
    for survey in (True, False):
        inside, width, refused = {n: list[bool]() for n in NAMES}, {n: list[float]() for n in NAMES}, 0
        for seed in range(first, first + count):
            case = drive(seed, replace(drawn_day("undulating", seed), runs=8))
            try:
                found = result(case, seed, survey).parameters
            except VdynError:
                refused += 1
                continue
            for n in NAMES:
                low, high = found[n].interval95
                inside[n].append(low <= case.truth[n] <= high)
                width[n].append(0.5 * (high - low) / case.truth[n])
        for n in NAMES:
            kind = "surveyed" if survey else "position only"
            lines.append(f"| {kind} | {n} | {np.mean(inside[n]):.0%} | {np.median(width[n]):.2%} | {refused} |")
            print(lines[-1], flush=True)
    if first == SEEDS:
        head = f"# Surveyed roads\n\n`python -m tests.bench.road_profile`: {count} undulating roads, eight coasts "
        head += "each.\n\n"
        Path(__file__).with_name("road_profile.md").write_text(head + "\n".join(lines) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
