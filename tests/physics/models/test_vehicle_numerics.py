"""Trust in the vehicle's numbers: an independent integrator, order of convergence, energy, jerk as a derivative."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, solve_ivp

from tests.physics.models.vehicle_cases import CONTEXT, Array, drive, parameters, pedals, simulate
from tests.physics.models.vehicle_energy import Account
from vdyn_cli.engine.graph import trace
from vdyn_cli.physics.models.vehicle import vehicle

SECONDS = 3.0


GRID = np.arange(round(SECONDS / 8e-3) + 1) * 8e-3  # inputs are linear from one of these times to the next
# A tip-in and a back-out without corners, N m at the planetary output.
TORQUE = 150.0 * (np.tanh((GRID - 0.8) / 0.08) - np.tanh((GRID - 2.0) / 0.08))
NAMES = ("speed", "shaft_torque_left", "wheel_speed_fr")
RUN = drive(GRID, {"speed": 5.0}, drive_torque=TORQUE)


def rolling_off(step: float) -> Mapping[str, Array]:
    return simulate(RUN, substeps=round(8e-3 / step)).outputs


@pytest.fixture(scope="module")
def exact() -> dict[str, Array]:
    """The same equations by an adaptive integrator of eighth order, from one time of the grid to the next."""
    graph = trace(vehicle())
    p = parameters()
    constants = np.array([CONTEXT.get(name, p.get(name, 0.0)) for name in graph.constants])
    driven = np.eye(len(graph.inputs))[graph.inputs.index("drive_torque")]
    first = simulate(RUN, substeps=8).states
    state, read = np.array([first[name][0] for name in graph.states]), []

    def field(t: float, x: Array) -> tuple[Array, Array]:
        rates, readings = graph.field(x, driven * np.interp(t, GRID, TORQUE), constants)
        return rates.full()[:, 0], readings.full()[:, 0]

    for begin, end in pairwise(GRID):
        read.append(field(begin, state)[1])
        found = solve_ivp(lambda t, x: field(t, x)[0], (begin, end), state, "DOP853", rtol=1e-10, atol=1e-12)
        state = found.y[:, -1]
    read.append(field(GRID[-1], state)[1])
    return dict(zip(graph.outputs, np.array(read).T, strict=True))


@pytest.mark.slow
def test_it_agrees_with_an_adaptive_integrator_at_the_default_step(exact: dict[str, Array]) -> None:
    found = rolling_off(1e-3)
    assert np.max(np.abs(found["speed"] / exact["speed"] - 1)) < 1e-6
    assert np.max(np.abs(found["shaft_torque_left"] - exact["shaft_torque_left"])) < 1e-3


@pytest.mark.slow
def test_the_error_falls_with_the_fourth_power_of_the_step(exact: dict[str, Array]) -> None:
    found = {step: rolling_off(step) for step in (2e-3, 1e-3, 5e-4)}
    for name in NAMES:
        errors = [np.max(np.abs(found[step][name] - exact[name])) for step in (2e-3, 1e-3, 5e-4)]
        orders = np.log2(np.array(errors[:-1]) / errors[1:])
        assert np.all((orders > 3.6) & (orders < 4.5)), (name, errors)


@pytest.mark.parametrize(("grade", "differential"), [(0.0, "open"), (0.03, "open"), (0.0, "locked")])
def test_energy_is_neither_made_nor_lost(grade: float, differential: str) -> None:
    time = np.arange(14_001) * 1e-3
    knots = ((0, 0, 0), (0.5, 0, 0), (0.8, 300, 0), (5, 250, 0), (5.2, 0, 0), (8, 0, 0), (8.4, 0, 3000), (14, 0, 3000))
    inputs = pedals(time, *knots)
    found = simulate(drive(time, grade=grade, **inputs), differential=differential)
    account = Account(found, parameters(), inputs["drive_torque"], inputs["brake_torque"], grade)
    held = account.kinetic + account.stored
    open_balance = held - held[0] - cumulative_simpson(account.put_in - account.lost, x=time, initial=0.0)
    work = cumulative_simpson(np.maximum(account.put_in, 0.0), x=time)[-1]
    assert found.outputs["speed"][-1] == pytest.approx(0.0, abs=1e-3)
    assert work > 2e4
    assert np.max(np.abs(open_balance)) < 1e-7 * work


def test_jerk_is_the_derivative_of_the_acceleration() -> None:
    time = np.arange(3001) * 1e-3
    found = simulate(drive(time, **pedals(time, (0, 0, 0), (0.5, 0, 0), (0.7, 400, 0), (1.5, 400, 0), (1.6, 0, 0))))
    acceleration, jerk = found.outputs["acceleration"], found.outputs["jerk"]
    middle = (acceleration[2:] - acceleration[:-2]) / 2e-3
    moving = found.outputs["speed"][1:-1] > 0.2
    assert np.max(np.abs(jerk)) > 10.0  # the shuffle of a tip-in
    assert np.max(np.abs(middle - jerk[1:-1])[moving]) < 0.01 * np.max(np.abs(jerk))
