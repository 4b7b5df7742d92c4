"""Simulation in chunks: the same numbers, and memory that does not depend on the length of the log."""

from __future__ import annotations

import gc
import tracemalloc

import numpy as np
import pytest

from tests.engine.plants import HALF, HALF_CAR, ROAD, ROAD_LOAD
from vdyn_cli.effects import effect
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.inference.qr_factors import qr_factor
from vdyn_cli.quantities.quantity import Quantity

UNKNOWNS = ("stiffness_front", "stiffness_rear", "damping_front", "tire_stiffness", "bump_front", "start.heave")
THETA = np.array([45e3, 42e3, 3200.0, 4e5, 5.01, 0.002])


def late(sensor: str):
    """A sensor read late, by its own clock."""

    @effect(on=f"{sensor}_clock", unknowns=(Quantity("delay", "s", "delay"),), reference="none")
    def read_late(clock, s, q):
        """A reading that comes late."""
        return clock(s) - q.delay

    return read_late


def drive(n: int, seed: int = 3) -> Drive:
    rng = np.random.default_rng(seed)
    time = (np.arange(n) + rng.uniform(-0.2, 0.2, n)) * 0.005
    return Drive(time, {"speed": 3.0 + 0.2 * rng.standard_normal(n)})


def joined(pieces, what: str) -> dict[str, np.ndarray]:
    parts = [getattr(piece, what) for piece in pieces]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


@pytest.mark.parametrize("backend", ["llvm", "vm"])
@pytest.mark.parametrize(("samples", "substeps"), [(1, 1), (37, 3), (200, 1), (5000, 2)])
def test_pieces_joined_are_the_whole_bit_for_bit(backend, samples, substeps):
    run = drive(412)
    simulate = Simulator(HALF_CAR, HALF, UNKNOWNS, (), substeps, backend)
    whole, pieces = simulate(run, THETA), list(simulate.chunks(run, THETA, samples=samples))
    assert np.array_equal(np.concatenate([piece.time for piece in pieces]), run.time)
    for what in ("outputs", "sensitivities"):
        for name, value in joined(pieces, what).items():
            assert np.array_equal(value, getattr(whole, what)[name]), (what, name)
    assert pieces[-1].final == whole.final


@pytest.mark.parametrize(("model", "on", "needs"), [(ROAD_LOAD, "speed", "states"), (None, "force", "")])
@pytest.mark.parametrize("delay", [0.0, 0.163, -0.31])
@pytest.mark.parametrize("samples", [1, 7, 100])
def test_a_shifted_clock_looks_across_the_edges_of_pieces(model, on, needs, delay, samples):
    def assemble(e, u):
        x = e.state("x", 0.3)
        e.integrate(x=-e.p.rate * x + u.push)
        e.sensor("force", 2.0 * x + u.push)  # jumps with its input: its rate comes from the samples

    rng = np.random.default_rng(5)
    time = np.arange(300) * 0.05 + rng.uniform(-0.01, 0.01, 300)
    if needs:
        parameters, unknowns, theta = ROAD, ("drag_area", "delay", "start.speed"), [0.6, delay, 15.0]
        inputs = {"drive_force": 500 * rng.standard_normal(300), "wind": 0.0, "grade": 0.0}
        run = Drive(time, inputs, {}, {}, {"heading": 1.0})
    else:
        model = Model("push", assemble, ("rate",), ("push",))
        parameters, unknowns, theta = {"rate": 0.5}, ("rate", "delay"), [0.5, delay]
        run = Drive(time, {"push": rng.standard_normal(300)})
    simulate = Simulator(model, parameters, unknowns, (late(on),), 2)
    whole, pieces = simulate(run, theta), list(simulate.chunks(run, theta, samples=samples, reach=0.4))
    assert np.array_equal(np.concatenate([piece.time for piece in pieces]), time)
    for what in ("outputs", "sensitivities"):
        for name, value in joined(pieces, what).items():
            assert np.array_equal(value, getattr(whole, what)[name]), (what, name)


def test_a_clock_beyond_reach_is_refused():
    run = Drive(np.arange(100) * 0.1, {"drive_force": 0.0, "wind": 0.0, "grade": 0.0}, {}, {}, {"heading": 1.0})
    simulate = Simulator(ROAD_LOAD, ROAD, ("delay",), (late("speed"),))
    with pytest.raises(ValueError, match=r"shifted by 1\.5 s, beyond the limit of 1 s"):
        list(simulate.chunks(run, [1.5], samples=10))


def triangle(simulate: Simulator, run: Drive, samples: int) -> np.ndarray:
    """[J r] of both loads in kN, folded piece by piece."""
    width = len(UNKNOWNS) + 1
    kept = np.zeros((width, width))
    for piece in simulate.chunks(run, THETA, samples=samples):
        rows = [
            np.column_stack([piece.sensitivities[name] * THETA, piece.outputs[name] - 7e3]) / 1e3
            for name in ("load_front", "load_rear")
        ]
        kept = qr_factor(np.vstack([kept, *rows]))
    return kept


def test_a_fit_keeps_a_triangle_whatever_the_length_of_the_log():
    simulate = Simulator(HALF_CAR, HALF, UNKNOWNS)
    triangle(simulate, drive(100), 100)  # compiled
    peaks = []
    for n in (4_000, 32_000):
        run = drive(n)
        gc.collect()
        tracemalloc.start()
        found = triangle(simulate, run, 500)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        at_once = triangle(simulate, run, n)
        np.testing.assert_allclose(found.T @ found, at_once.T @ at_once, rtol=1e-10, atol=1e-9 * np.max(at_once) ** 2)
    assert peaks[1] < 1.1 * peaks[0]  # the rest is rubbish of the interpreter, not yet collected
    assert peaks[1] < 32_000 * 2 * len(UNKNOWNS) * 8 / 2  # a half of what the sensitivities alone would take
