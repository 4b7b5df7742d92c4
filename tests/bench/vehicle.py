"""How fast the full vehicle is, against the road and against others: ``python -m tests.bench.vehicle`` writes a table.

One core, 1 kHz output, a drive torque that steps and carries white noise of 20 N m at 1 kHz. All contenders take turns,
over and over, and the best turn of each counts: the ratios then hold on a machine that others use too. No compiler has
a part in what is measured of the program itself; gcc is only asked what it makes of the same step.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.plant.vehicle import REFERENCE
from vdyn_cli.engine.c_source import c_program
from vdyn_cli.engine.graph import trace
from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.physics.models.vehicle import vehicle
from vdyn_cli.physics.models.vehicle_defaults import complete

Array = NDArray[np.float64]
Run = Callable[[Drive], Array]

TABLE = Path(__file__).with_suffix(".md")
NOISE = 20.0  # N m, of the torque
STEP = 1e-3
ROUNDS = 400
ONE_CORE = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
MODEL = vehicle()
CONTEXT = {"heading": 1.0, "temperature": 293.15}
CAR = complete(MODEL.parameters, {**asdict(REFERENCE), "cg_to_front": REFERENCE.cg_to_front}).values
FIXED = ("wind_variance", "tire_vertical_damping", "air_density", "wheelbase", "track_rear", "yaw_inertia", "mass")
UNKNOWNS = tuple(name for name in MODEL.parameters if name not in FIXED)[:30]
THETA = np.array([CAR[name] for name in UNKNOWNS])


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    what: str
    measured: str
    wanted: str
    good: bool | None


def drive(seconds: float) -> Drive:
    n = round(seconds / STEP) + 1
    time = np.arange(n) * STEP
    noise = np.random.default_rng(1).normal(0.0, NOISE, n)
    torque = np.where(time % 8.0 < 4.0, 250.0, 60.0) + noise
    inputs: dict[str, Array | float] = {**dict.fromkeys(MODEL.inputs, 0.0), "drive_torque": torque}
    return Drive(time, inputs, {"speed": 10.0}, {}, CONTEXT)


def in_turns(contenders: Mapping[Any, Callable[[], object]], rounds: int = ROUNDS) -> dict[Any, float]:
    """The shortest time of each, s, of several rounds in which all take their turn."""
    best = dict.fromkeys(contenders, np.inf)
    for _ in range(rounds):
        for name, run in contenders.items():
            begun = perf_counter()
            run()
            best[name] = min(best[name], perf_counter() - begun)
    return best


def in_c(folder: Path, flags: str) -> Run | None:
    """The exported step in a loop, compiled by gcc; None without gcc. Gives the outputs at every sample."""
    if shutil.which("gcc") is None:
        return None
    program = c_program(trace(MODEL), defaults={**CAR, **CONTEXT}, start=("speed",))
    loop = """
void run(long n, double speed, const model_input *u, const double *dt, model_output *y) {
    model_state x;
    model_init(&x, u, &model_defaults, speed);
    for (long i = 0; i < n; i++) model_step(&x, u + i, u + i + 1, dt[i], &model_defaults, y + i);
}
"""
    source, library = folder / "model.c", folder / f"model{abs(hash(flags))}.so"
    source.write_text(program.text + loop)
    options = ["-std=c99", *flags.split(), "-ffp-contract=off", "-fPIC", "-shared"]
    subprocess.run(["gcc", *options, str(source), "-o", str(library), "-lm"], check=True)
    function = ctypes.CDLL(str(library)).run
    function.argtypes = [ctypes.c_long, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]

    def run(drive: Drive) -> Array:
        n = drive.time.size
        inputs = np.column_stack([np.broadcast_to(drive.inputs[name], n) for name in MODEL.inputs])
        steps, found = np.diff(drive.time), np.empty((n - 1, len(program.outputs)))
        function(n - 1, drive.start["speed"], inputs.ctypes.data, steps.ctypes.data, found.ctypes.data)
        return found

    return run


def others(seconds: float, noisy: bool) -> Callable[[], object] | None:
    """CommonRoad's multi-body model under scipy's odeint, 1 kHz output, at its default tolerance; None without it.

    ``noisy`` : the pull is as noisy as the torque that drives our model; else it is constant, the best case for an
    integrator that chooses its steps.
    """
    try:
        from vehiclemodels.init_mb import init_mb
        from vehiclemodels.parameters_vehicle2 import parameters_vehicle2
        from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb
    except ImportError:
        return None
    from scipy.integrate import odeint

    car = parameters_vehicle2()
    start, time = init_mb([0.0, 0.0, 0.0, 15.0, 0.0, 0.0, 0.0], car), np.arange(0.0, seconds, STEP)
    noise = np.random.default_rng(1).normal(0.0, NOISE / (car.m * car.R_w), time.size) if noisy else np.zeros(time.size)
    pull = (0.3 + noise).tolist()

    def rates(x: Array, t: float) -> list[float]:
        k = min(int(t / STEP), time.size - 2)
        share = t / STEP - k
        return list(vehicle_dynamics_mb(x, [0.0, (1.0 - share) * pull[k] + share * pull[k + 1]], car))

    return lambda: odeint(rates, start, time)


def speed_rows(folder: Path) -> list[Row]:
    simulate, exact = Simulator(MODEL, CAR, backend="llvm"), Simulator(MODEL, CAR, UNKNOWNS, backend="llvm")
    values, tangents = drive(2.0), drive(0.25)
    contenders: dict[str, Callable[[], object]] = {
        "values": lambda: simulate(values),
        "sensitivities": lambda: exact(tangents, THETA),
    }
    compiled = {flags: in_c(folder, flags) for flags in ("-O3", "-O3 -march=native")}
    contenders |= {flags: partial(run, values) for flags, run in compiled.items() if run is not None}
    for run in contenders.values():
        run()  # compiled, drives packed
    best = in_turns(contenders)
    rows = [
        faster("values, times real time", 2.0 / best["values"], 600),
        faster(f"values and {len(UNKNOWNS)} sensitivities, times real time", 0.25 / best["sensitivities"], 80),
    ]
    for flags in compiled:
        if flags in best:
            ratio, step = best["values"] / best[flags], best[flags] / 2000 * 1e6
            rows.append(Row(f"time over that of the exported C, gcc {flags}", f"{ratio:.2f}", "<= 1.5", ratio <= 1.5))
            rows.append(Row(f"mean step of the exported C, gcc {flags}, us", f"{step:.2f}", "< 2", step < 2.0))
    for road, noisy in ((4.0, True), (20.0, False)):
        rest = others(road, noisy)
        if rest is None:
            continue
        again = in_turns({"others": rest, **dict.fromkeys(range(8), contenders["values"])}, 8)
        theirs, ours = road / again.pop("others"), 2.0 / min(again.values())
        what = "speed over CommonRoad's 29-state multi-body model with odeint"
        if noisy:
            rows.append(faster(f"{what}, its pull as noisy", ours / theirs, 8))
        else:
            rows.append(Row(f"{what}, at a constant pull", f"{ours / theirs:.0f}", "", None))
        kind = "noisy" if noisy else "constant"
        rows.append(Row(f"CommonRoad's at a {kind} pull, times real time", f"{theirs:.0f}", "", None))
    return rows


def faster(what: str, ratio: float, wanted: float) -> Row:
    return Row(what, f"{ratio:.0f}", f">= {wanted:.0f}", ratio >= wanted)


def equal_rows(folder: Path) -> list[Row]:
    """Machine code, virtual machine and C: the same bits."""
    run = drive(0.5)
    fast, slow = (Simulator(MODEL, CAR, UNKNOWNS, backend=backend)(run, THETA) for backend in ("llvm", "vm"))
    same = all(np.array_equal(value, slow.outputs[name]) for name, value in fast.outputs.items())
    rows = [Row("machine code and virtual machine agree bit for bit", "yes" if same else "no", "yes", same)]
    pairs = [(value, slow.sensitivities[name]) for name, value in fast.sensitivities.items()]
    gap = max(float(np.max(np.abs(a - b).max(axis=0) / (np.abs(b).max(axis=0) + 1e-300))) for a, b in pairs)
    rows.append(Row("their sensitivities, largest difference over the peak", f"{gap:.0e}", "<= 1e-11", gap <= 1e-11))
    in_gcc = in_c(folder, "-O3")
    if in_gcc is not None:
        found = in_gcc(run)
        gap = max(float(np.max(np.abs(found[:, i] - fast.outputs[n][:-1]))) for i, n in enumerate(fast.outputs))
        rows.append(Row("largest difference of the exported C", f"{gap:.1g}", "0", gap == 0.0))
    return rows


def table(rows: list[Row]) -> str:
    graph = trace(MODEL)
    verdict = {True: "yes", False: "**no**", None: ""}
    lines = [
        "# The full vehicle's engine",
        "",
        f"{len(graph.states)} states, {len(graph.outputs)} outputs, Runge-Kutta at 1 ms, 1 kHz noisy torque, one core, "
        "double precision. Written by `python -m tests.bench.vehicle`; all figures from one run, contenders in turns.",
        "",
        "| what | measured | wanted | met |",
        "|---|---:|---:|---|",
        *(f"| {row.what} | {row.measured} | {row.wanted} | {verdict[row.good]} |" for row in rows),
        "",
    ]
    return "\n".join(lines)


def main() -> None:
    if any(os.environ.get(n) != v for n, v in ONE_CORE.items()):
        os.execve(sys.executable, [sys.executable, "-m", "tests.bench.vehicle"], {**os.environ, **ONE_CORE})
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows = [*speed_rows(folder), *equal_rows(folder)]
    text = table(rows)
    TABLE.write_text(text)
    print(text)


if __name__ == "__main__":
    main()
