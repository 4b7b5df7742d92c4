"""Elements with laws of other shapes: which part is found, which law, and whether the curve holds the truth.

``python -m tests.bench.other_laws [SEEDS]`` writes ``other_laws.md``: every cell with SEEDS vehicles (1 by default).
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from tests.bench.cases import describe_crossings
from tests.bench.hidden_logs import make
from tests.plant import other_laws, shaft
from tests.plant.hidden import Scenario
from tests.plant.other_laws import Hidden, Law
from tests.plant.vehicle import AIR_DENSITY, GRAVITY, Vehicle, random_vehicle
from vdyn_cli.project.execute import execute

TABLE = Path(__file__).with_suffix(".md")
FIRST_SEED = 4100  # seeds of the table; those used while developing are below 100


def crossings(vehicle: Vehicle, seed: int, hidden: Hidden, folder: Path) -> Path:
    """Crossings of the bump by a car with hidden laws."""
    return describe_crossings(vehicle, folder, other_laws.campaign(vehicle, seed, hidden))


@dataclass(frozen=True)
class LawCell:
    """One row: a law hidden in an element of both axles or one, and what is to be said of it.

    ``law`` is the catalog's effect that is within 10 % rms of the hidden law; empty where there is none.
    ``truth`` is the whole law of one place over its coordinate; up to a constant where ``shifted``.
    """

    name: str
    step: str
    element: str
    law: str
    write: Callable[[int, Path], Path]
    truth: Callable[[Vehicle, str, np.ndarray], np.ndarray]
    coordinate: str
    shifted: bool = False


def _bump(name: str, element: str, law: Law, axles: Sequence[str] = ("front", "rear"), named: str = "") -> LawCell:
    hidden = Hidden({(element, axle): law for axle in axles})
    own = {"damper": "suspension_damping", "spring": "suspension_stiffness"}[element]

    def truth(vehicle: Vehicle, axle: str, at: np.ndarray) -> np.ndarray:
        added = law(at) if axle in axles else 0.0
        return np.asarray(getattr(vehicle, f"{own}_{axle}") * at + added)

    def write(seed: int, folder: Path) -> Path:
        return crossings(random_vehicle(seed), seed, hidden, folder)

    whole = element if len(axles) > 1 else f"{element}_{axles[0]}"
    return LawCell(name, "bump", whole, named, write, truth, {"damper": "stroke_rate", "spring": "stroke"}[element])


def _plain_load(vehicle: Vehicle, at: np.ndarray) -> np.ndarray:
    return vehicle.rolling_resistance * vehicle.mass * GRAVITY + 0.5 * AIR_DENSITY * vehicle.drag_area * at**2


def _bumped(bump: float) -> Callable[[Vehicle, str, np.ndarray], np.ndarray]:
    return lambda vehicle, place, at: _plain_load(vehicle, at) + bump * np.exp(-0.5 * ((at - 15.0) / 1.5) ** 2)


def _rising(size: float) -> Callable[[Vehicle, str, np.ndarray], np.ndarray]:
    return lambda vehicle, place, at: _plain_load(vehicle, at) + size * np.maximum(at - 20.0, 0.0) ** 2


def _bearing(bump: float) -> Callable[[Vehicle, str, np.ndarray], np.ndarray]:
    return lambda vehicle, place, at: np.asarray(bump * np.exp(-0.5 * ((at - 45.0) / 3.0) ** 2))


def _shaft(stiffening: float) -> Callable[[Vehicle, str, np.ndarray], np.ndarray]:
    return lambda vehicle, place, at: np.asarray(
        shaft.truth(vehicle)["shaft_stiffness_left"] * at * (1.0 + stiffening * at**2)
    )


_TRUTHS = {
    ("road_load", "drag_bump"): (_bumped, "speed"),
    ("road_load", "fast_drag"): (_rising, "speed"),
    ("bearing", "drag_bump"): (_bearing, "wheel_speed"),
    ("shaft", "stiffening"): (_shaft, "twist"),
}


def _hidden(name: str, step: str, element: str, effects: Mapping[str, float], variant: str = "") -> LawCell:
    def write(seed: int, folder: Path) -> Path:
        return make(Scenario(step, effects, seed, variant), folder).description

    ((effect, size),) = effects.items()
    truth_of, coordinate = _TRUTHS[element, effect]
    truth = truth_of(size)
    return LawCell(name, step, element, "", write, truth, coordinate, shifted=element == "bearing")


CELLS = (
    _bump("friction 290 N tanh(v / 5 mm/s)", "damper", other_laws.friction_tanh(290.0), named="suspension_friction"),
    _bump(
        "the same, rear axle alone", "damper", other_laws.friction_tanh(290.0), ("rear",), named="suspension_friction"
    ),
    _bump("Stribeck friction 250 N, 40 % more at rest", "damper", other_laws.friction_stribeck(250.0)),
    _bump("damper, -1000 N s/m beyond 0.2 m/s", "damper", other_laws.knee(0.2, -1000.0)),
    _bump("cubic spring 1.5e6 N/m^3", "spring", other_laws.cubic(1.5e6)),
    _bump("bump stop from 20 mm, front", "spring", other_laws.bump_stop(0.02, 3e6), ("front",)),
    _bump("asymmetric damper 600 N s/m", "damper", other_laws.asymmetry(600.0), named="asymmetric_damping"),
    _hidden("drag 60 N about 15 m/s", "coastdown", "road_load", {"drag_bump": 60.0}, "wide"),
    _hidden("drag that rises above 20 m/s, 77 N at 36 m/s", "coastdown", "road_load", {"fast_drag": 0.3}, "wide"),
    _hidden("drag 40 N about 15 m/s, powered", "coastdown", "road_load", {"drag_bump": 40.0}, "powered"),
    _hidden("bearing drag 3 N m about a speed", "inertia", "bearing", {"drag_bump": 3.0}),
    _hidden("half-shaft that stiffens, 200 N m at the end", "shaft", "shaft", {"stiffening": 200.0}),
)


def row(cell: LawCell, seed: int) -> tuple[str, ...]:
    """The cells of the table for one vehicle."""
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        path = cell.write(seed, Path(folder))
        description = yaml.safe_load(path.read_text(encoding="utf-8"))
        path.write_text(yaml.safe_dump({**description, "diagnose": {"extend": "learned"}}), encoding="utf-8")
        try:
            told = execute(cell.step, path).document["diagnosis"]
        except Exception as error:  # a failure is a result of the bench too
            return cell.name, str(seed), "failed", repr(error)[:60], "", "", "", ""
    part, learned, gain = told.get("part"), told.get("learned"), told.get("gain")
    causes = " + ".join(c["effect"] for c in told["causes"])
    right = "right" if part is not None and part["element"] == cell.element else "wrong"
    return (
        cell.name, str(seed), f"{part['element'] if part else '-'} ({right})", f"{told['verdict']}: {causes or '-'}",
        cell.law or "learned", learned["form"] if learned else "-", _band(cell, seed, part),
        f"{gain['before']:.3g} to {gain['after']:.3g} {gain['unit']}".strip() if gain else "-",
        f"{time.perf_counter() - begun:.0f} s",
    )  # fmt: skip


def _band(cell: LawCell, seed: int, part: Mapping[str, Any] | None) -> str:
    """Share of the curve's points whose interval holds the true law."""
    if part is None or not part["curve"] or not cell.element.startswith(part["element"][:6]):
        return "-"
    if part["coordinate"] != cell.coordinate:
        return f"over {part['coordinate']}"
    vehicle, curve = random_vehicle(seed), part["curve"]
    true = np.array([float(cell.truth(vehicle, p["place"], np.array([p["at"]]))[0]) for p in curve])
    if cell.shifted:  # what the fitted parameters absorb is not the curve's
        true += np.mean([p["value"] for p in curve]) - np.mean(true)
    low, high = np.array([p["interval95"] for p in curve]).T
    return f"{100 * np.mean((low <= true) & (true <= high)):.0f} %"


def main(seeds: int) -> None:
    """Write the table."""
    command = ["git", "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    head = ("hidden law", "seed", "part", "verdict", "expected law", "form", "band holds truth", "held-out rms", "time")
    lines = [
        "# Elements with laws of other shapes",
        "",
        f"`python -m tests.bench.other_laws {seeds}`, commit {commit}.",
    ]
    lines += ["", f"| {' | '.join(head)} |", f"|{'---|' * len(head)}"]
    for k in range(seeds):
        for cell in CELLS:
            lines.append(f"| {' | '.join(row(cell, FIRST_SEED + k))} |")
            TABLE.write_text("\n".join(lines) + "\n", encoding="utf-8")
            print(lines[-1], flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1)
