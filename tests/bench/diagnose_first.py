"""Logs on which the baseline fails: ``python -m tests.bench.diagnose_first [CASES SEED WORKERS]`` writes the table.

Each case is a fresh vehicle with a fresh size of what is hidden. No case may end before its candidates were tried:
what is hidden is named, in a set that holds it, or said to be collinear with what is fitted; where nothing is hidden,
the parameter that the logs determine is published, its interval holding the truth.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from tests.bench import cases
from tests.plant import small_excitation
from tests.plant.vehicle import random_vehicle
from vdyn_cli.commands.run_step import write_step
from vdyn_cli.project.execute import RefusedResultError
from vdyn_cli.project.result_document import to_json
from vdyn_cli.quantities.errors import VdynError

TABLE = Path(__file__).with_suffix(".md")
CASES, FIRST_SEED = 20, 52_000  # seeds of the table; those below 10 000 are for development
WANTED = 0.95
REPEATS = 0.04  # relative: to which the slope of one tire repeats from day to day


@dataclass(frozen=True)
class Row:
    """One class of cases.

    Parameters
    ----------
    effect : what is hidden; empty where nothing is. low, high : range of its size, of either sign where ``signed``.
    parameter : what must be published where nothing is hidden.
    """

    step: str
    about: str
    effect: str = ""
    low: float = 0.0
    high: float = 0.0
    parameter: str = ""

    def size(self, seed: int) -> float:
        """The hidden size of a case."""
        rng = np.random.default_rng([seed, 0xD1A6])
        return float(rng.uniform(self.low, self.high) * rng.choice([-1.0, 1.0]))


ROWS = (
    Row("inertia", "clocks 20 to 150 ms apart", "clock_offset", 0.02, 0.15),
    Row("inertia", "hub torque gain 3 to 6 % off", "hub_torque_gain", 0.03, 0.06),
    Row("inertia", "radius 2 to 4 % off", "wheel_radius", 0.02, 0.04),
    Row("cg", "clocks 20 to 150 ms apart", "clock_offset", 0.02, 0.15),
    Row("cg", "accelerometer tilted by 1.5 to 2 deg beside a speed", "accelerometer_tilt", 0.026, 0.035),
    Row("shaft", "0.2 to 0.6 N m rms of torque at 1 kHz", parameter="shaft_stiffness_left"),
    Row("tire", "flat track, slip to 0.18", parameter="tire_longitudinal_stiffness"),
)


@dataclass(frozen=True)
class FirstTrial:
    """How one case ended: refused, named, set, collinear, published or neither; ``says`` in the program's words."""

    row: int
    seed: int
    outcome: str
    code: int
    says: str
    report: bool


def _shaft_line(seed: int, folder: Path) -> tuple[Path, Mapping[str, float]]:
    record, truth = small_excitation.shaft_line(seed)
    channels = {
        "time": ("Time [s]", "s"),
        "shaft_torque": ("Torque [N m]", "N m"),
        "motor_speed": ("Drive End [rad/s]", "rad/s"),
        "wheel_speed": ("Brake End [rad/s]", "rad/s"),
        "twist": ("Twist [rad]", "rad"),
    }
    return cases.write(folder, "shaft", {}, channels, [record], [{"side": "left"}]), truth


def _flat_track(seed: int, folder: Path) -> tuple[Path, Mapping[str, float]]:
    vehicle = random_vehicle(seed)
    channels = {
        "time": ("Time [s]", "s"),
        "slip": ("Slip [1]", "1"),
        "force_x": ("Fx [N]", "N"),
        "force_z": ("Fz [N]", "N"),
    }
    path = cases.write(folder, "tire", {}, channels, small_excitation.flat_track(vehicle, seed))
    return path, {"tire_longitudinal_stiffness": vehicle.tire_longitudinal_stiffness}


HIDDEN: Mapping[str, Callable[..., Path]] = {"inertia": cases.wheel_drives, "cg": cases.launches}
PLAIN = {"shaft": _shaft_line, "tire": _flat_track}


def run(index: int, seed: int) -> FirstTrial:
    """Make one case's logs and run its step as the command does."""
    row = ROWS[index]
    with tempfile.TemporaryDirectory() as name:
        folder, truth = Path(name), dict[str, float]()
        if row.effect:
            path = HIDDEN[row.step](random_vehicle(seed), seed, folder, {row.effect: row.size(seed)})
        else:
            path, truth = PLAIN[row.step](seed, folder)
        code, document = 0, {}
        try:
            document = json.loads(to_json(write_step(row.step, path, (), folder / "out", 0.05).document))
        except RefusedResultError as error:
            code, document = error.exit_code, json.loads(to_json(error.record.document))
        except VdynError as error:
            return FirstTrial(index, seed, "refused", error.exit_code, str(error).replace("\n", " "), False)
        report = (folder / "out" / f"{row.step}.html").is_file()
    found = document["diagnosis"]
    says = f"{document['sentence']} | {found['sentence'] if found else ''}"
    return FirstTrial(index, seed, _outcome(row, document, truth), code, says, report)


def _outcome(row: Row, document: Mapping[str, Any], truth: Mapping[str, float]) -> str:
    diagnosis = document["diagnosis"]
    if document["refused"] and (diagnosis is None or diagnosis["sentence"].startswith("Diagnosis not possible")):
        return "refused"
    if not row.effect:
        found = document["parameters"].get(row.parameter)
        low, high = found["interval95"] if found else (1.0, 0.0)
        true = truth[row.parameter]
        near = bool(found) and abs(found["value"] / true - 1.0) < REPEATS
        return "published" if near or low <= true <= high else "neither"
    if row.effect in [cause["effect"] for cause in diagnosis["causes"]]:
        return "named"
    answers = [set("+".join(one).split("+")) for one in product(*diagnosis["ambiguous"])]
    if any(row.effect in answer for answer in answers if answer):
        return "set"
    collinear = [n["effect"] for n in diagnosis["not_testable"] if "collinear" in n["because"]]
    return "collinear" if row.effect in collinear else "neither"


def trials(count: int, first: int, workers: int = 2) -> Iterator[FirstTrial]:
    """All rows' cases, in order."""
    jobs = [(i, first + 100 * i + k) for i in range(len(ROWS)) for k in range(count)]
    with ProcessPoolExecutor(workers) as pool:
        yield from pool.map(run, *zip(*jobs, strict=True))


HEAD = """# Diagnose first

`python -m tests.bench.diagnose_first`, version {version}. Every case is a fresh vehicle with a fresh size. *Refused
first*: ended before the candidates were tried (wanted: none). *Named*: the cause, alone or with others; *set*: an
ambiguous set that holds it; *collinear*: said to be collinear with what is fitted; *published*: nothing hidden, and
the parameter that the logs determine is published, within 4 % or its interval of the truth. Wanted: at least 95 % of
each row. *Exit 1*: no result is published, and the report says why.

| step | what was driven | cases | refused first | named | set | collinear | published | neither | exit 1 | good |
|---|---|---|---|---|---|---|---|---|---|---|
"""


def table(found: list[FirstTrial]) -> str:
    """The table as text."""
    from importlib.metadata import version

    lines = []
    for i, row in enumerate(ROWS):
        mine = [t for t in found if t.row == i]
        counts = {o: sum(t.outcome == o for t in mine) for o in ("refused", *GOOD, "neither")}
        good = sum(counts[o] for o in GOOD) / max(len(mine), 1)
        exits = sum(t.code == 1 for t in mine)
        share = f"{good:.0%}{'' if good >= WANTED else ' short'}"
        cells = [row.step, row.about, len(mine), *counts.values(), exits, share]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    short = [t for t in found if t.outcome not in GOOD]
    if short:
        lines += ["", "Short:", ""]
        lines += [f"- {ROWS[t.row].step}, {ROWS[t.row].about}, seed {t.seed}: {t.says}" for t in short]
    return HEAD.format(version=version("vdyn_cli")) + "\n".join(lines) + "\n"


GOOD = ("named", "set", "collinear", "published")


def main(count: int = CASES, first: int = FIRST_SEED, workers: int = 2) -> None:
    found = []
    for trial in trials(count, first, workers):
        found.append(trial)
        print(ROWS[trial.row].step, trial.seed, trial.outcome, trial.code, trial.says[:300], flush=True)
    TABLE.write_text(table(found), encoding="utf-8")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:4]))
