"""One scenario through the command's path, and what was said of it against what is true."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

from tests.bench.hidden_cases import Cell
from tests.bench.hidden_fresh import fresh_gain
from tests.bench.hidden_logs import make
from tests.plant.hidden import Scenario
from tests.plant.vehicle import Vehicle
from vdyn_cli.effects import catalog
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.errors import VdynError

SILENT = ("adequate", "not_testable")
CLAIMS = ("named", "data_fault")  # a named cause that is a sensor's is a data fault


@dataclass(frozen=True)
class Size:
    """A size that was reported, beside the one that was hidden."""

    effect: str
    true: float
    value: float
    low: float
    high: float

    @property
    def covered(self) -> bool:
        return self.low <= self.true <= self.high


@dataclass(frozen=True)
class Trial:
    """What came out for one vehicle.

    ``t`` and ``least`` of each hidden effect (empty where they were not asked for); ``verdict`` "refused" or "crashed"
    where there was no answer; ``fresh``: gain on fresh logs, and ``gain`` as stated with its interval.
    """

    seed: int
    t: Mapping[str, float]
    least: Mapping[str, float]
    verdict: str
    named: frozenset[str] = frozenset()
    among: tuple[frozenset[str], ...] = ()
    sizes: tuple[Size, ...] = ()
    gain: tuple[float, float, float] | None = None
    fresh: float | None = None
    says: str = ""
    seconds: float = 0.0
    listed: frozenset[str] = field(default_factory=frozenset)


def run(cell: Cell, seed: int, strengths: bool = True, fresh: bool = False) -> Trial:
    """Make one vehicle's logs, diagnose them, and weigh what they could tell."""
    scenario = Scenario(cell.step, cell.effects, seed, cell.variant, fault=cell.fault)
    t: Mapping[str, float] = {}
    least: Mapping[str, float] = {}
    if strengths and cell.effects:
        evidence = scenario.evidence()
        t, least = evidence.t(), evidence.least()
    with tempfile.TemporaryDirectory() as folder:
        made = make(scenario, Path(folder))
        begun = time.perf_counter()
        try:
            document = execute(cell.step, made.description).document
        except VdynError as error:
            return Trial(seed, t, least, "refused", says=error.findings[0].what)
        except Exception as error:  # a bug is a result of the bench too
            return Trial(seed, t, least, "crashed", says=repr(error)[:200])
        seconds = time.perf_counter() - begun
        trial = _read(document, scenario, seed, t, least, seconds)
        if fresh and trial.gain and trial.named == set(cell.effects):
            other = Path(folder) / "fresh"
            other.mkdir()
            again = make(scenario.fresh(), other)
            found = fresh_gain(cell.step, made.description, again.description, sorted(trial.named))
            trial = Trial(**{**vars(trial), "fresh": found})
    return trial


def _read(
    document: Mapping[str, Any],
    scenario: Scenario,
    seed: int,
    t: Mapping[str, float],
    least: Mapping[str, float],
    seconds: float,
) -> Trial:
    diagnosis = document.get("diagnosis") or {"verdict": "not_testable"}
    causes = diagnosis.get("causes") or []
    claimed = diagnosis["verdict"] in CLAIMS
    gain = diagnosis.get("gain")
    return Trial(
        seed,
        t,
        least,
        diagnosis["verdict"],
        frozenset(cause["effect"] for cause in causes) if claimed else frozenset(),
        _answers(diagnosis.get("ambiguous") or []),
        tuple(size for cause in causes if claimed for size in _size(cause, scenario)),
        (gain["before"] - gain["after"], *gain["interval95"]) if gain else None,
        says=" ".join([diagnosis.get("sentence", ""), *(f["what"] for f in document["findings"])]),
        seconds=seconds,
        listed=frozenset(entry["effect"] for entry in diagnosis.get("not_testable") or []),
    )


def _answers(sets: Sequence[Sequence[str]]) -> tuple[frozenset[str], ...]:
    """Every answer that the sets leave open: one cause, or a whole answer ``a+b``, out of each."""
    return tuple(frozenset("+".join(one).split("+")) for one in product(*sets)) if sets else ()


def _size(cause: Mapping[str, Any], scenario: Scenario) -> list[Size]:
    """The first unknown of a cause that was hidden; a road's profile has no size of its own."""
    effect = cause["effect"]
    if effect not in scenario.effects or effect == "grade_profile":
        return []
    unknown = next(iter(next(e for e in catalog() if e.name == effect).unknowns))
    if unknown not in cause["unknowns"]:
        return []
    entry = cause["unknowns"][unknown]
    true = scenario.effects[effect] * _unit(scenario.step, effect, scenario.vehicle)
    return [Size(effect, true, entry["value"], *entry["interval95"])]


def _unit(step: str, effect: str, vehicle: Vehicle) -> float:
    """The program's size of an effect whose plant's size is one."""
    if (step, effect) == ("inertia", "brake_drag"):
        return 1.0 / vehicle.wheel_radius
    if (step, effect) == ("validate", "tire_relaxation"):
        return vehicle.tire_relaxation_length
    return 1.0


def judged(cell: Cell, trial: Trial) -> str:
    """right, set, guess, part, silent, unknown, wrong, alarm, refused or crashed.

    ``set``: several are named, the truth among them. ``guess``: one of a class that no data can tell apart is named
    alone, and happens to be true. ``part``: one of two.
    """
    hidden = frozenset(cell.effects)
    if trial.verdict == "crashed":
        return "crashed"
    if cell.expect == "fault":
        return _fault(trial)
    if trial.verdict == "refused":
        return "refused"
    if not hidden:
        return "right" if trial.verdict in SILENT else "alarm"
    if cell.expect == "unknown":
        if trial.named and all(name.startswith("learned_") for name in trial.named):
            return "right"  # no law of the catalog is named: the part's own law is learned
        return {"unknown": "right", **dict.fromkeys(SILENT, "silent")}.get(trial.verdict, "wrong")
    if cell.expect == "not_testable":
        return "right" if trial.verdict in SILENT or trial.named == hidden or hidden in trial.among else "alarm"
    if trial.named == hidden:
        return "guess" if cell.expect == "class" else "right"
    if hidden in trial.among:
        return "right" if cell.expect == "class" else "set"
    if cell.expect == "both" and trial.named and trial.named < hidden:
        return "part"
    return {"unknown": "unknown", **dict.fromkeys(SILENT, "silent")}.get(trial.verdict, "wrong")


def _fault(trial: Trial) -> str:
    said = any(word in trial.says for word in ("stuck", "constant", "stands still", "holds", "frozen", "repeats"))
    if trial.verdict in ("refused", "data_fault"):
        return "right"
    if trial.verdict in SILENT:
        return "right" if said else "silent"
    return "unknown" if trial.verdict == "unknown" else "wrong"
