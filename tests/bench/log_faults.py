"""Generated faults in healthy logs: found, not accused, and the answer after the automatic cuts.

``python -m tests.bench.log_faults`` writes tests/bench/log_faults.md; ``--draws N --seed S`` runs a smaller table on
development seeds and prints it. Faults are put into the sample logs and, where they are, into an electric car's trips
(../shared/data/bmw_i3): single samples of 10 to 100 times the channel's noise, and segments of 1 to 60 s that are
frozen, filled with straight lines, or dropped to zero, in one channel or in all; gains that change by 10 % in the
middle.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from tests.bench.fault_signals import FAULTS, Place, faulty, resolution
from tests.plant.messy_day import CLASSES, drawn_day, drive
from vdyn_cli.description.spec_loading import load_spec
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.quality.gain_changes import gain_changes
from vdyn_cli.io.quality.log_flags import flags
from vdyn_cli.io.reader import Column
from vdyn_cli.project.execute import RefusedResultError, execute
from vdyn_cli.project.result_document import to_json
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quality_flags import Flag
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import load_step

ROOT = Path(__file__).resolve().parent.parent.parent
TRIPS = Path(os.environ.get("VDYN_DATA", ROOT.parent / "shared" / "data")) / "bmw_i3"
FAULTY_TRIPS = ("TripB02", "TripB13", "TripB34")
SAMPLES = ("coastdown", "cg", "bump", "inertia", "tire", "shaft", "validate")
ANSWERS = ("coastdown", "cg", "bump", "inertia", "tire", "shaft")
GAIN = "gain changes by 10 %"
TIED = ("speed", "vehicle_speed", "wheel_speed_", "front_left", "front_right", "rear_left", "rear_right", "hub_")
RESTING = ("elevation", "grade", "position")
DURATIONS = (1.0, 3.0, 10.0, 60.0)
TABLE_SEED = 7301
LONGEST = 0.4  # of the log
MOVING = 2.0  # m/s, of the car during a fault
VISIBLE = ("spike", "straight line in a channel")  # kinds whose size may be below what the healthy log contains
APART = 1.8  # times the largest excursion of the healthy log
ACCUSED = 0.01  # of healthy logs, at the most
BLOCK, CHORD = 16, 6  # samples: of a local scatter, and on one chord
FOUND = 0.9  # of the faulty samples that must have failed
Array = NDArray[np.float64]


@dataclass
class Count:
    """How many of how many, and which were not."""

    cases: int = 0
    good: int = 0
    named: int = 0
    held: int = 0
    missed: list[str] = field(default_factory=list)

    def add(self, good: bool, what: str) -> None:
        self.cases, self.good = self.cases + 1, self.good + good
        if not good:
            self.missed.append(what)


def sample_logs() -> Iterator[tuple[str, Log]]:
    """Every log of the samples, with the channels that its description maps."""
    for name in SAMPLES:
        path = ROOT / "configs" / f"{name}.yaml"
        step = load_step(name)
        spec, _ = load_spec(path, step.spec)
        columns = {n: Column(c.column, c.unit, step.channels()[n].unit, c.sign) for n, c in spec.channels.items()}
        for run in spec.runs:
            if run.log is not None:
                yield "samples", read_log(path.parent / run.log, columns)


def trips() -> Iterator[tuple[str, Log]]:
    """The healthy trips, with the channels that the shipped description maps."""
    path = ROOT / "configs" / "bmw_i3_winter.yaml"
    step = load_step("coastdown")
    spec, _ = load_spec(path, step.spec)
    columns = {n: Column(c.column, c.unit, step.channels()[n].unit, c.sign) for n, c in spec.channels.items()}
    for file in sorted(TRIPS.glob("Trip*.csv.gz")) if TRIPS.is_dir() else ():
        if not file.name.startswith(FAULTY_TRIPS):
            yield "i3 trips", read_log(file, columns)


def generated_days(seed: int) -> Iterator[tuple[str, Log]]:
    """Coasts of an independent plant, one day of each class: held, filtered and coarse receivers among them."""
    for kind in CLASSES:
        for k, run in enumerate(drive(seed, drawn_day(kind, seed)).runs):
            yield "generated days", Log(f"{kind}_{k}.csv", run.time, {"speed": run.speed, "position": run.position})


def detection(draws: int, seed: int) -> dict[tuple[str, str, float], Count]:
    """Faults found, by (kind, logs, duration); ``("healthy", logs, 0)`` counts logs that are not accused."""
    table: dict[tuple[str, str, float], Count] = {}
    for k, (group, log) in enumerate([*sample_logs(), *trips(), *generated_days(seed)]):
        rng = np.random.default_rng([seed, k])
        accused = flags(log).faults or gain_changes(log)
        table.setdefault(("healthy", group, 0.0), Count()).add(not accused, log.name)
        if group == "generated days":
            continue
        for channel in log.channels:
            if draws and channel not in RESTING:
                changed = Log(log.name, log.time, faulty(log.channels, GAIN, channel, Place(0, 1), rng))
                good = bool(gain_changes(changed)) or any(f.test == "level_step" for f in flags(changed).faults)
                where = f"{group}, {'tied channels' if channel.startswith(TIED) else 'other channels'}"
                table.setdefault((GAIN, where, 0.0), Count()).add(good, f"{log.name} {channel}")
        for kind, fault in FAULTS.items():
            if kind == GAIN:
                continue
            for duration in DURATIONS if fault.lasts else (0.0,):
                for _ in range(draws):
                    place = placed(log, duration, rng)
                    if place is None:
                        continue
                    names = [n for n in log.channels if n not in RESTING]
                    channel = str(rng.choice(names))
                    channels = faulty(log.channels, kind, channel, place, rng)
                    states = flags(Log(log.name, log.time, channels)).states[channel]
                    good = float(np.mean(states[place.first : place.stop] == Flag.FAILED)) >= FOUND
                    rests = group != "samples" and channel == "drive_torque" and not fault.every
                    where = f"{group}, drive torque" if rests else group
                    table.setdefault((kind, where, duration), Count()).add(good, f"{log.name} {channel}")
                    if kind in VISIBLE and visible(kind, log, channel, channels[channel], place):
                        key = (f"{kind}, beyond the log's own", where, duration)
                        table.setdefault(key, Count()).add(good, f"{log.name} {channel}")
    return table


def visible(kind: str, log: Log, channel: str, changed: Array, place: Place) -> bool:
    """Whether a fault stands out of what the healthy log itself contains, so that a test can tell it at all.

    A spike: beside the steps to its neighbors it is more than APART times the largest single-sample excursion of the
    healthy log, both over the local scatter; a smaller one is accused only where healthy logs are (the largest
    excursion of a healthy trip is up to 1.7 times its next). A line of L samples: of n segments on one chord, which go
    on with a probability c from sample to sample, one in ACCUSED logs has L by chance, n c^L < ACCUSED.
    """
    healthy = log[channel]
    if kind == "spike":
        i = place.first
        excursion, scatter = excursions(healthy)
        flank = max(abs(healthy[i] - healthy[i - 1]), abs(healthy[i] - healthy[i + 1]))
        return bool(abs(changed[i] - healthy[i]) - flank > APART * float(np.max(excursion / scatter)) * scatter[i - 1])
    windows = np.lib.stride_tricks.sliding_window_view(healthy, CHORD)
    share = np.arange(CHORD) / (CHORD - 1)
    off = windows - windows[:, :1] - share * (windows[:, -1:] - windows[:, :1])
    ends = np.abs(off).max(axis=1) <= resolution(healthy)
    follows, segments = ends[1:] & ends[:-1], np.count_nonzero(ends[1:] & ~ends[:-1]) + 1
    going = (follows.sum() + 1.0) / (ends.sum() + 2.0) if ends.any() else 0.0
    length = place.stop - place.first + 2 - CHORD + 1  # windows on a line with both its ends
    return bool(segments * going ** (length - 1) < ACCUSED)


def excursions(values: Array) -> tuple[Array, Array]:
    """How far each inner sample (n - 2,) lies out of both neighbors, and the largest median bend about it."""
    up, down = values[1:-1] - values[:-2], values[1:-1] - values[2:]
    bend = np.abs(up + down) / 3.0
    blocks = np.pad(bend, (0, -bend.size % BLOCK), mode="edge").reshape(-1, BLOCK)
    level = np.pad(np.median(blocks, axis=1), 1, mode="edge")
    near = np.repeat(np.max([level[:-2], level[1:-1], level[2:]], axis=0), BLOCK)[: bend.size]
    least = max(0.5 * float(np.median(near)), resolution(values), 1e-12)
    return np.where(up * down > 0.0, np.minimum(np.abs(up), np.abs(down)), 0.0), np.maximum(near, least)


def placed(log: Log, duration: float, rng: np.random.Generator) -> Place | None:
    """Where a fault of a duration lies while the car moves; None where the log is too short for it."""
    step = log.duration / (log.time.size - 1)
    length = max(round(duration / step), 1)
    if length > LONGEST * log.time.size:
        return None
    name = next((n for n in ("speed", "vehicle_speed") if n in log), None)
    moving = np.abs(log[name]) > MOVING if name else np.ones(log.time.size, dtype=bool)
    starts = rng.integers(10, log.time.size - length - 10, 50)
    good = [int(a) for a in starts if moving[a : a + length].all()]
    return Place(good[0], good[0] + length) if good else None


def answers(draws: int, seed: int, steps: tuple[str, ...] = ANSWERS) -> dict[tuple[str, str], Count]:
    """Answers within the clean answer's interval, by (kind, step)."""
    table: dict[tuple[str, str], Count] = {}
    for k, name in enumerate(steps):
        path = ROOT / "configs" / f"{name}.yaml"
        description = yaml.safe_load(path.read_text(encoding="utf-8"))
        if isinstance(description.get("vehicle"), str):
            description["vehicle"] = str(path.parent / description["vehicle"])
        known = _known(name, Path(tempfile.mkdtemp()))
        clean = execute(name, path, known, level=None).result
        for kind, fault in FAULTS.items():
            for duration in (1.0, 3.0) if fault.lasts else (0.0,):
                for i in range(draws):
                    rng = np.random.default_rng([seed, k, i, sum(map(ord, kind)), int(duration)])
                    with tempfile.TemporaryDirectory() as folder:
                        told = _damaged(description, path, Path(folder), kind, duration, rng)
                        if told:
                            outcome = _outcome(name, Path(folder) / path.name, clean, known)
                            count = table.setdefault((kind, name), Count())
                            count.named += outcome == "named"
                            count.held += outcome == "held"
                            count.add(outcome in ("within", "named", "held"), f"{told}: {outcome}")
    return table


def _damaged(
    description: Mapping[str, Any], path: Path, folder: Path, kind: str, duration: float, rng: np.random.Generator
) -> str:
    """Write the description with one log damaged; what was damaged, empty where no place is long enough."""
    runs = [dict(run) for run in description["runs"]]
    for run in runs:
        run["log"] = str((path.parent / run["log"]).resolve())
    chosen = runs[int(rng.integers(len(runs)))]
    step = load_step(path.stem)
    units = {n: step.channels()[n].unit for n in description["channels"]}
    columns = {
        n: Column(c["column"], c["unit"], units[n], c.get("sign", 1)) for n, c in description["channels"].items()
    }
    log = read_log(Path(chosen["log"]), columns)
    place = placed(log, duration, rng)
    if place is None:
        return ""
    channel = str(rng.choice([n for n in log.channels if n not in RESTING]))
    changed = faulty(log.channels, kind, channel, place, rng)
    for run, number in ((r, i) for i, r in enumerate(runs)):
        one = log if run is chosen else read_log(Path(run["log"]), columns)
        channels = changed if run is chosen else one.channels
        name = f"damaged_{number}.csv" if run is chosen else f"healthy_{number}.csv"
        table = np.column_stack([one.time, *channels.values()])
        np.savetxt(folder / name, table, delimiter=",", fmt="%.10g", header=",".join(["time", *channels]), comments="")
        run["log"] = name
    mapped = {n: {"column": n, "unit": units[n]} for n in units}
    made = {**description, "channels": mapped, "runs": runs}
    made.pop("reading", None)
    made.pop("pendulum", None)
    (folder / path.name).write_text(yaml.safe_dump(made), encoding="utf-8")
    name = str(runs.index(chosen))
    return f"run {name} {channel} at {place.first}"


def _known(step: str, folder: Path) -> list[Path]:
    """Parameter files of the earlier steps of a test day."""
    files: list[Path] = []
    for earlier in ("coastdown", "cg") if step in ("bump", "inertia") else ():
        record = execute(earlier, ROOT / "configs" / f"{earlier}.yaml", files, level=None)
        (folder / f"{earlier}.json").write_text(to_json(record.document), encoding="utf-8")
        files.append(folder / f"{earlier}.json")
    return files


def _outcome(step: str, path: Path, clean: Result, known: list[Path]) -> str:
    """``within`` the clean intervals, ``named`` where a doubt or a refusal names the log, else what is off.

    ``held``: the answer is beyond them, but its own intervals, which the fault widened, hold the clean answer.
    """
    try:
        found = execute(step, path, known, level=None).result
    except (RefusedResultError, InputError) as error:
        return "named" if "damaged_" in str(error) else f"refused: {str(error)[:80]}"
    own = [n for n, e in clean.parameters.items() if e.source == step]
    off = {
        n: (found.parameters[n].value - clean.parameters[n].value) / _half(clean, n)
        for n in own
        if n in found.parameters and _half(clean, n) > 0
    }
    worst = max(off, key=lambda n: abs(off[n]), default="")
    if not worst or abs(off[worst]) <= 1.0:
        return "within"
    doubted = any("damaged_" in w for w in found.fit.warnings)
    if doubted:
        return "named"
    ends = {n: found.parameters[n].interval95 for n in off}
    if all(low <= clean.parameters[n].value <= high for n, (low, high) in ends.items()):
        return "held"
    return f"silent, {worst} off by {off[worst]:.1f} half intervals"


def _half(result: Result, name: str) -> float:
    low, high = result.parameters[name].interval95
    return 0.5 * (high - low)


def text(found: Mapping[tuple[str, str, float], Count], within: Mapping[tuple[str, str], Count], draws: int) -> str:
    """The tables in Markdown."""
    commit = subprocess.run(
        ["git", "log", "-1", "--format=%h"], capture_output=True, text=True, cwd=ROOT, check=False
    ).stdout.strip()
    lines = [
        "# Generated faults in healthy logs",
        "",
        f"Written by `python -m tests.bench.log_faults` at {commit}, {draws} draws. Found: at least {FOUND:.0%} of",
        "the faulty samples failed a test. The drive torque of the i3 trips is an estimate that rests by itself, so",
        "that it has rows of its own. Beyond the log's own: of the spikes that are more than 1.8 times the largest",
        "excursion of the healthy log over the local scatter, and of the lines that the healthy log holds by chance in",
        "less than one of 100 cases; smaller ones cannot be told from healthy logs without accusing these.",
        "",
        "| fault | logs | length | found | of |",
        "|---|---|---|---|---|",
    ]
    for (kind, where, duration), c in sorted(found.items(), key=lambda x: (x[0][0] != "healthy", *x[0])):
        span = (
            f"{duration:g} s"
            if duration
            else "1 sample"
            if kind.startswith("spike")
            else "half"
            if kind == GAIN
            else "log"
        )
        shown = "healthy, not accused" if kind == "healthy" else kind
        lines.append(f"| {shown} | {where} | {span} | {c.good / c.cases:.0%} | {c.cases} |")
    lines += [
        "",
        "Answers after the automatic cuts, of 1 s and 3 s and single samples: within the clean answer's 95 % interval,",
        "or the result names the damaged log, or its own intervals, widened by the fault, hold the clean answer.",
        "",
        "| fault | step | within | named | held | of | none of these |",
        "|---|---|---|---|---|---|---|",
    ]
    for (kind, step), a in sorted(within.items()):
        missed = "; ".join(a.missed[:3])
        lines.append(f"| {kind} | {step} | {a.good - a.named - a.held} | {a.named} | {a.held} | {a.cases} | {missed} |")
    every = [sum(c.good for c in within.values()), sum(c.cases for c in within.values())]
    if every[1]:
        lines += ["", f"In all: {every[0]} of {every[1]} ({every[0] / every[1]:.0%}) within, named or held."]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the table, or print a smaller one."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--draws", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--steps", nargs="*", default=list(ANSWERS))
    asked = parser.parse_args()
    draws, seed = asked.draws or 3, asked.seed if asked.draws else TABLE_SEED
    within = answers(asked.draws or 1, seed, tuple(asked.steps)) if asked.steps else {}
    table = text(detection(draws, seed), within, draws)
    if asked.draws:
        print(table)
    else:
        Path(__file__).with_suffix(".md").write_text(table, encoding="utf-8")


if __name__ == "__main__":
    main()
