"""How long the engine takes: ``python -m tests.bench.engine`` prints a table.

Eight coast-downs of 750 samples and four bump crossings of 3.5 s at 500 Hz, on clocks that jitter, with ten unknowns,
in processor time of one core. "first" is the first simulation, with tracing and compiling; "pass" is all runs once, the
best of several.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from collections.abc import Callable
from time import process_time

import numpy as np

from tests.engine.effects import FADING
from tests.engine.plants import HALF, HALF_CAR, ROAD, ROAD_LOAD
from vdyn_cli.effects import catalog
from vdyn_cli.engine.graph import trace
from vdyn_cli.engine.simulate import Drive, Simulator

ROAD_UNKNOWNS = (
    "rolling_resistance",
    "drag_area",
    "headwind",
    "extra_drag_area",
    "air_density",
    "mass",
    "rotating_mass",
)
HALF_UNKNOWNS = ("stiffness_front", "stiffness_rear", "damping_front", "damping_rear", "tire_stiffness", "bump_front")
CASES = {
    "road load, 8 x 750 samples": (
        ROAD_LOAD,
        ROAD,
        ("headwind", "extra_drag_area", "fading_drag"),
        (*ROAD_UNKNOWNS, "fading", "start.speed", "start.position"),
        8,
    ),
    "half car, 4 x 1750 samples, 2 substeps": (
        HALF_CAR,
        HALF,
        ("asymmetric_damping",),
        (*HALF_UNKNOWNS, "bump_rear", "damping_asymmetry", "start.heave", "start.pitch"),
        4,
    ),
}


def drives(name: str, count: int) -> list[Drive]:
    n, step = (750, 0.1) if name.startswith("road") else (1750, 0.002)
    found = []
    for seed in range(count):
        time = (np.arange(n) + np.random.default_rng(seed).uniform(-0.2, 0.2, n)) * step
        if name.startswith("road"):
            still = {"drive_force": 0.0, "wind": 0.0, "grade": 0.001}
            found.append(Drive(time, still, {"speed": 20.0}, {}, {"heading": (-1.0) ** seed}))
        else:
            found.append(Drive(time, {"speed": 25 / 3.6}))
    return found


def best(function: Callable[[], object], repeats: int) -> float:
    """The shortest of several times, s."""
    times = []
    for _ in range(repeats):
        begin = process_time()
        function()
        times.append(process_time() - begin)
    return min(times)


def row(name: str, backend: str, with_sensitivities: bool) -> str:
    model, parameters, effects, unknowns, count = CASES[name]
    chosen = tuple(effect for effect in (*catalog(), FADING) if effect.name in effects)
    runs = drives(name, count)
    theta = [{**parameters, "start.speed": 20.0}.get(unknown, 0.0) for unknown in unknowns]
    trace.cache_clear()
    begin = process_time()
    simulate = Simulator(model, parameters, unknowns, chosen, 1 if name.startswith("road") else 2, backend)
    simulate(runs[0], theta, sensitivities=with_sensitivities)
    first = process_time() - begin
    repeats = 20 if backend == "llvm" else 3
    whole = best(lambda: [simulate(run, theta, sensitivities=with_sensitivities) for run in runs], repeats)
    samples = sum(run.time.size for run in runs)
    what = f"{len(unknowns)} sensitivities" if with_sensitivities else "values"
    return f"{name:40s} {backend:5s} {what:17s} {first * 1e3:8.1f} {whole * 1e3:9.2f} {whole / samples * 1e9:9.0f}"


def main() -> None:
    from vdyn_cli.engine.native import available

    available()  # loading the compiler is not part of the times
    print(f"{'case':40s} {'':5s} {'':17s} {'first ms':>8s} {'pass ms':>9s} {'ns/sample':>9s}")
    for name in CASES:
        for backend in ("llvm", "vm"):
            for with_sensitivities in (False, True):
                print(row(name, backend, with_sensitivities))


if __name__ == "__main__":
    main()
