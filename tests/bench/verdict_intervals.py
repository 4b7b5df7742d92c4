"""Whether intervals know the verdict: ``python -m tests.bench.verdict_intervals`` writes verdict_intervals.md.

Effects that the catalog lacks, and effects that these data cannot tell from others, are hidden in the logs of random
vehicles. Where the verdict is ambiguous or unknown, the published intervals must hold the true parameters all the same.
The last rows hide the same at a size that does not matter: any verdict that claims something is then an alarm.

    python -m tests.bench.verdict_intervals --first 6001 --seeds 10 --jobs 2
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tests.bench.hidden_logs import make
from tests.plant.hidden import Scenario
from tests.plant.vehicle import Vehicle
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.errors import VdynError

PAGE = Path(__file__).with_suffix(".md")
OPEN = ("ambiguous", "unknown")
CLAIMS = ("named", "data_fault", *OPEN)
GRAVITY = 9.80665
AIR = 287.055  # J/(kg K)


@dataclass(frozen=True)
class Row:
    """One row: what is hidden in which test; ``trivial``: at a size that does not matter."""

    step: str
    variant: str
    effects: Mapping[str, float]
    trivial: bool = False

    @property
    def name(self) -> str:
        inside = " and ".join(f"{name} {size:g}" for name, size in self.effects.items())
        return f"{self.step}{f' ({self.variant})' if self.variant else ''}: {inside}"


@dataclass(frozen=True)
class Outcome:
    """What was published for one vehicle: of each parameter whether it is covered, and width over the fit's own."""

    verdict: str
    covered: Mapping[str, bool] = field(default_factory=dict)
    alone: Mapping[str, bool] = field(default_factory=dict)
    width: Mapping[str, float] = field(default_factory=dict)


ROWS = (
    Row("inertia", "", {"drag_bump": 3.0}),
    Row("inertia", "", {"drag_bump": 10.0}),
    Row("inertia", "", {"hub_torque_gain": 0.005}),
    Row("inertia", "", {"wheel_radius": 0.005}),
    Row("inertia", "", {"wheel_mass": 2.0}),
    Row("inertia", "", {"drag_bump": 0.1}, trivial=True),
    Row("inertia", "", {"hub_torque_gain": 1e-4}, trivial=True),
    Row("cg", "", {"load_crosstalk": 0.02}),
    Row("cg", "", {"load_crosstalk": 0.05}),
    Row("cg", "", {"pitch_axis": 0.12}),
    Row("cg", "", {"clock_offset": 1e-3}),
    Row("cg", "", {"load_crosstalk": 5e-4}, trivial=True),
    Row("tire", "", {"braking_friction": 0.05}),
    Row("tire", "", {"braking_friction": 1e-3}, trivial=True),
    Row("coastdown", "wide", {"drag_bump": 25.0}),
    Row("coastdown", "wide", {"drag_bump": 75.0}),
    Row("coastdown", "fixed", {"drag_bump": 25.0}),
    Row("coastdown", "fixed", {"extra_drag_area": 0.05}),
    Row("coastdown", "fixed", {"speed_scale": 0.07}),
    Row("coastdown", "fixed", {"mass_error": 0.08}),
    Row("coastdown", "fixed", {"rotating_mass": 100.0}),
    Row("coastdown", "wide", {"drag_bump": 1.0}, trivial=True),
    Row("coastdown", "wide", {"headwind": 0.03}, trivial=True),
    Row("bump", "", {"degressive_damping": 0.1}),
    Row("bump", "", {"asymmetric_damping": 2e-4}, trivial=True),
)


def outcome(row: Row, seed: int) -> Outcome:
    """One vehicle through the command's path, with the diagnosis and without."""
    scenario = Scenario(row.step, row.effects, seed, row.variant)
    with tempfile.TemporaryDirectory() as folder:
        path = make(scenario, Path(folder)).description
        try:
            document = execute(row.step, path).document
            if not document["diagnosis"]:
                return Outcome("none")
            plain = execute(row.step, path, level=None).document
        except VdynError as error:
            return Outcome(f"refused: {error.findings[0].what[:60]}")
    true = truth(scenario.vehicle)
    found, before = document["parameters"], plain["parameters"]
    names = [n for n, e in found.items() if n in true and e["source"] != "given"]
    return Outcome(
        document["diagnosis"]["verdict"],
        {n: _holds(found[n], true[n]) for n in names},
        {n: _holds(before[n], true[n]) for n in names},
        {n: _width(found[n]) / _width(before[n]) for n in names},
    )


def truth(vehicle: Vehicle) -> dict[str, float]:
    """The parameters that are published, of the true vehicle; the road load depends on the day and is left out."""
    names = ("rolling_resistance", "cg_to_rear", "cg_to_front", "cg_height", "pitch_inertia", "wheel_inertia")
    names += ("tire_B", "tire_C", "tire_D", "tire_E", "suspension_stiffness_front", "suspension_stiffness_rear")
    names += ("suspension_damping_front", "suspension_damping_rear", "tire_vertical_stiffness")
    found = {n: float(getattr(vehicle, n)) for n in names}
    found["drag_area"] = vehicle.frontal_area * vehicle.drag_coefficient
    found["road_load_f0"] = vehicle.rolling_resistance * vehicle.mass * GRAVITY
    found["tire_longitudinal_stiffness"] = vehicle.tire_B * vehicle.tire_C * vehicle.tire_D
    return found


def _holds(entry: Mapping[str, Any], true: float) -> bool:
    low, high = entry["interval95"]
    return bool(low <= true <= high)


def _width(entry: Mapping[str, Any]) -> float:
    low, high = entry["interval95"]
    return max(high - low, 1e-300)


def line(row: Row, outcomes: Sequence[Outcome]) -> str:
    """One line of the table."""
    verdicts = [o.verdict for o in outcomes]
    counts = ", ".join(f"{v} {verdicts.count(v)}" for v in dict.fromkeys(sorted(verdicts)))
    if row.trivial:
        alarms = sum(v in CLAIMS for v in verdicts)
        return f"| {row.name} | {counts} | - | - | - | {alarms}/{len(verdicts)} |"
    known = [o for o in outcomes if o.verdict in OPEN]
    covered = [c for o in known for c in o.covered.values()]
    alone = [c for o in known for c in o.alone.values()]
    widths = [w for o in known for w in o.width.values()]
    if not covered:
        return f"| {row.name} | {counts} | - | - | - | - |"
    share = f"{sum(covered)}/{len(covered)}"
    share = share if np.mean(covered) >= 0.9 else f"**{share}**"
    return f"| {row.name} | {counts} | {share} | {sum(alone)}/{len(alone)} | {np.median(widths):.1f} | - |"


def table(results: Sequence[tuple[Row, Sequence[Outcome]]], first: int, seeds: int) -> str:
    """The page: rows, and the totals."""
    lines = [line(row, outcomes) for row, outcomes in results]
    known = [o for row, outcomes in results if not row.trivial for o in outcomes if o.verdict in OPEN]
    covered = [c for o in known for c in o.covered.values()]
    alone = [c for o in known for c in o.alone.values()]
    quiet = [o.verdict in CLAIMS for row, outcomes in results if row.trivial for o in outcomes]
    lines.append(
        f"| all | | {sum(covered)}/{len(covered)} | {sum(alone)}/{len(alone)} | "
        f"{np.median([w for o in known for w in o.width.values()] or [1.0]):.1f} | {sum(quiet)}/{len(quiet)} |"
    )
    return (
        (
            "# Intervals that know the verdict\n\n"
            f"Written by `python -m tests.bench.verdict_intervals`; seeds {first} to {first + seeds - 1}, version "
            f"{_version()}. *covered*: true parameters inside the published 95 % interval where the verdict is "
            "ambiguous or unknown (wanted 90 %; bold: short of that). *fit alone*: the same for the interval of the "
            "fit, without diagnosis. *width*: median of the published width over the fit's. *alarms*: verdicts that "
            "claim something where the size does not matter (wanted at most 5 %).\n\n"
            "| hidden | verdicts | covered | fit alone | width | alarms |\n|---|---|---|---|---|---|\n"
        )
        + "\n".join(lines)
        + "\n"
    )


def _version() -> str:
    found = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False)
    return found.stdout.strip() or "unknown"


def _one(task: tuple[Row, int]) -> Outcome:
    return outcome(*task)


def main() -> None:
    parser = argparse.ArgumentParser(description="Coverage of intervals where the verdict is ambiguous or unknown.")
    parser.add_argument("--first", type=int, default=6001)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="", help="part of a row's name")
    parser.add_argument("--print", action="store_true", help="only print, leave the page as it is")
    options = parser.parse_args()
    rows = [r for r in ROWS if options.only in r.name]
    results: list[tuple[Row, list[Outcome]]] = []
    seeds = range(options.first, options.first + options.seeds)
    with ProcessPoolExecutor(options.jobs) as pool:
        every = pool.map(_one, [(row, seed) for row in rows for seed in seeds])
        for row in rows:
            results.append((row, []))
            for seed in seeds:
                found = next(every)
                results[-1][1].append(found)
                missed = [n for n, c in found.covered.items() if not c]
                print(f"{row.name} [{seed}] {found.verdict} missed {missed}", file=sys.stderr, flush=True)
            if not options.print:  # a long run leaves what is through
                PAGE.write_text(table(results, options.first, options.seeds), encoding="utf-8")
    print(table(results, options.first, options.seeds))


if __name__ == "__main__":
    main()
