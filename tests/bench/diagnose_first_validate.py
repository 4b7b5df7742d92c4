"""Validations of light electric vehicles whose description or logs are wrong: what the program says of each.

    python -m tests.bench.diagnose_first_validate [--cases 20] [--first 7000] [--row TEXT] [--print]

writes tests/bench/diagnose_first_validate.md. Every case draws a vehicle, its drives and what the tester states of it
(``tests.plant.light_ev``), and goes the command's way, from files to the JSON document. A size is drawn evenly from the
row's range; of ranges that begin above 1 its logarithm, up or down. Set OPENBLAS_NUM_THREADS=1; 2 s a case.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from tests.plant import light_ev
from vdyn_cli.project.execute import RefusedResultError, execute
from vdyn_cli.quantities.errors import VdynError

PAGE = Path(__file__).with_name("diagnose_first_validate.md")
FIRST_SEED = 7000  # development used seeds below 1000
UNITS = {"mass": "kg", "rotating_mass": "kg", "wheel_radius": "m", "drag_area": "m^2", "air_density": "kg/m^3"}
CHANNELS = {
    "time": {"column": "t [s]", "unit": "s"},
    "drive_torque": {"column": "Motor Torque [N m]", "unit": "N m"},
    "speed": {"column": "Speed [m/s]", "unit": "m/s"},
}
OUTCOMES = ("named", "in a set", "collinear", "not detected", "unknown", "wrong", "refused", "crashed")
RIGHT = ("named", "in a set", "collinear")


@dataclass(frozen=True)
class Row:
    """One kind of mistake: the plant's ``fault``, the candidate that is true, and the range of sizes."""

    title: str
    fault: str
    truth: str
    sizes: tuple[float, float]
    both_signs: bool = False
    ratio: bool = False

    def size(self, rng: np.random.Generator) -> float:
        """A size of this row."""
        low, high = self.sizes
        if self.ratio:
            factor = float(np.exp(rng.uniform(np.log(low), np.log(high))))
            return factor if rng.random() < 0.5 else 1.0 / factor
        size = float(rng.uniform(low, high))
        return -size if self.both_signs and rng.random() < 0.5 else size


ROWS = (
    Row("nothing wrong", "", "", (0.0, 0.0)),
    Row("torque gain 3 to 6 %", "torque_gain", "torque_gain", (0.03, 0.06), both_signs=True),
    Row("torque constant 1.2 to 2 times or the reciprocal", "torque_gain", "torque_gain", (1.2, 2.0), ratio=True),
    Row("stated mass 5 to 30 % off", "stated_mass", "mass_error", (0.05, 0.30), both_signs=True),
    Row("wheel radius 2 to 4 % off", "wheel_radius", "wheel_radius", (0.02, 0.04), both_signs=True),
    Row("driveline drag 0.3 to 1 N m s", "viscous", "driveline_viscous", (0.3, 1.0)),
    Row("gears lose 6 to 12 % of the largest torque", "gear_loss", "driveline_loss", (0.06, 0.12)),
    Row("speed scale 1.5 to 10 times or the reciprocal", "speed_scale", "speed_scale", (1.5, 10.0), ratio=True),
    Row("motor inertia left out", "motor_inertia", "rotating_mass", (1.0, 1.0)),
)


@dataclass(frozen=True)
class Outcome:
    """What came out of one case, and how long it took."""

    seed: int
    size: float
    said: str
    detail: str
    seconds: float


def description(folder: Path, seed: int, faults: Mapping[str, float], runs: int = 4, seconds: float = 60.0) -> Path:
    """Write the logs and the YAML of one case."""
    car, logger = light_ev.drawn(seed), light_ev.Logger()
    for k in range(runs):
        record = light_ev.drive(car, seed, k, seconds, logger, faults)
        header = ",".join(f'"{name}"' for name in record)
        np.savetxt(
            folder / f"run_{k + 1}.csv", np.column_stack(list(record.values())), "%.4f", ",", header=header, comments=""
        )
    vehicle = {}
    for name, (value, sd) in light_ev.stated(car, seed, faults).items():
        text = f"{value!r} +- {sd!r}" if sd else f"{value!r}"
        vehicle[name] = f"{text} {UNITS.get(name, '')}".strip()
    data = {
        "test": "validate",
        "title": "Light electric vehicle in town",
        "vehicle": vehicle,
        "channels": CHANNELS,
        "runs": [{"log": f"run_{k + 1}.csv", "direction": ("out", "back")[k % 2]} for k in range(runs)],
        "settings": {"model": "road_load"},
    }
    path = folder / "validate.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    return path


def tried(row: Row, seed: int) -> Outcome:
    """One case of a row."""
    size = row.size(np.random.default_rng([seed, 0x21]))
    faults = {row.fault: size - 1.0 if row.ratio and row.fault == "torque_gain" else size} if row.fault else {}
    with tempfile.TemporaryDirectory() as folder:
        path = description(Path(folder), seed, faults)
        begun = time.perf_counter()
        try:
            try:
                diagnosis = execute("validate", path).document["diagnosis"]
            except RefusedResultError as refused:  # diagnosed, and not published: the page shows why
                diagnosis = refused.record.document["diagnosis"]
            said, detail = judged(row, diagnosis), diagnosis["sentence"]
        except VdynError as error:
            said, detail = "refused", error.findings[0].what
        except Exception as error:  # a bug is a result of the bench too
            said, detail = "crashed", repr(error)[:200]
        return Outcome(seed, size, said, detail, time.perf_counter() - begun)


def judged(row: Row, diagnosis: Mapping[str, object]) -> str:
    """One of OUTCOMES."""
    causes = diagnosis.get("causes") or []
    named = {c["effect"] for c in causes} if diagnosis["verdict"] in ("named", "data_fault") else set()  # type: ignore[attr-defined]
    sets = diagnosis.get("ambiguous") or []
    among = {e for one in sets for entry in one for e in entry.split("+")}  # type: ignore[attr-defined]
    silent = diagnosis["verdict"] in ("adequate", "not_testable")
    if not row.truth:
        return "named" if silent else "wrong"
    if named == {row.truth}:
        return "named"
    if diagnosis["verdict"] == "ambiguous" and row.truth in among:
        return "in a set"
    untested = {e["effect"] for e in diagnosis.get("not_testable") or [] if "collinear" in e["because"]}  # type: ignore[attr-defined]
    if silent:
        return "collinear" if row.truth in untested else "not detected"
    return "unknown" if diagnosis["verdict"] == "unknown" else "wrong"


def table(results: Mapping[str, Sequence[Outcome]]) -> str:
    """The page."""
    made = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False)
    lines = [
        "# Validations whose description or logs are wrong",
        "",
        "Light electric vehicles of 60 to 400 kg, four town drives of 60 s at 50 Hz, each vehicle drawn afresh "
        "(`python -m tests.bench.diagnose_first_validate`). Wanted: nothing refused before the diagnosis; named, in a "
        "set that holds the truth, or said to be collinear in 95 % or more. Of the row without a mistake, 'named' "
        f"counts the silent ones. Commit {made.stdout.strip()}.",
        "",
        f"| mistake | cases | {' | '.join(OUTCOMES)} | right | s, median | s, most |",
        f"|---|{'---|' * (len(OUTCOMES) + 4)}",
    ]
    for title, found in results.items():
        counts = Counter(one.said for one in found)
        right = sum(counts[o] for o in RIGHT) / len(found)
        seconds = [one.seconds for one in found]
        cells = " | ".join(str(counts[o] or "") for o in OUTCOMES)
        lines.append(
            f"| {title} | {len(found)} | {cells} | {right:.0%} | {np.median(seconds):.1f} | {max(seconds):.1f} |"
        )
    short = [
        f"* {title}, seed {one.seed}, size {one.size:.3g}: {one.said}. {one.detail}"
        for title, found in results.items()
        for one in found
        if one.said not in RIGHT
    ]
    return "\n".join([*lines, "", "What is not right:" if short else "Every case is right.", "", *short]) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=20, help="vehicles a row")
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="seed of the first vehicle")
    parser.add_argument("--row", default="", help="only rows whose title holds this text")
    parser.add_argument("--print", action="store_true", help="only print, leave the page as it is")
    options = parser.parse_args()
    results: dict[str, list[Outcome]] = {}
    for row in (r for r in ROWS if options.row in r.title):
        results[row.title] = []
        for seed in range(options.first, options.first + options.cases):
            results[row.title].append(one := tried(row, seed))
            print(f"{row.title} [{seed}] {one.size:.3g}: {one.said} ({one.seconds:.1f} s) {one.detail}", flush=True)
    if options.print or options.row:
        print(table(results))
    else:
        PAGE.write_text(table(results), encoding="utf-8")


if __name__ == "__main__":
    main()
