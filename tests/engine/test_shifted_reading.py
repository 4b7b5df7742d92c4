"""Readings at shifted times: delays of sensors, by the clock law."""

from __future__ import annotations

import numpy as np
import pytest

from tests.engine.effects import speed_delay, speed_scale
from vdyn_cli.engine.maths import sin
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.shifted_reading import read_at
from vdyn_cli.engine.simulate import Drive, Simulator


def oscillator(e, u):
    x, v = e.state("x", 1.0), e.state("v")
    e.integrate(x=v, v=-e.p.stiffness * x)
    e.sensor("speed", x)


def jittered(n=400, step=0.02):
    return np.arange(n) * step + np.random.default_rng(3).uniform(-0.2, 0.2, n) * step


@pytest.mark.parametrize("backend", ["llvm", "vm"])
def test_a_delayed_reading_of_states_is_exact_between_samples(backend):
    model = Model("oscillator", oscillator, ("stiffness",), ())
    unknowns = ("stiffness", "latency", "speed_gain")
    simulate = Simulator(model, {"stiffness": 9.0}, unknowns, (speed_scale, speed_delay), 4, backend)
    time = jittered()
    k, late, gain = 9.0, 0.133, 0.02
    found = simulate(Drive(time, {}), [k, late, gain])
    w = np.sqrt(k)
    t = time - late - time[0]
    inside = t >= 0
    assert 0.9 < inside.mean() < 1
    np.testing.assert_allclose(found.outputs["speed"][inside], (1.02 * np.cos(w * t))[inside], atol=2e-7)
    expected = [-1.02 * t / (2 * w) * np.sin(w * t), 1.02 * w * np.sin(w * t), np.cos(w * t)]
    np.testing.assert_allclose(found.sensitivities["speed"][inside], np.array(expected).T[inside], atol=2e-5)


def test_before_the_first_sample_a_reading_goes_straight_back():
    time = np.linspace(0, 1, 11)
    none = np.empty((11, 0))
    seen, _ = read_at(time, time**2 + time, 2 * time + 1, none, none, np.full(11, -0.25), none)
    np.testing.assert_allclose(seen[:3], time[:3] - 0.25)
    np.testing.assert_allclose(seen[3:], (time[3:] - 0.25) ** 2 + time[3:] - 0.25)
    ahead, _ = read_at(time, time**2, 2 * time, none, none, np.full(11, 0.5), none)
    assert ahead[-1] == pytest.approx(1 + 0.5 * 2)


def test_without_a_shift_a_reading_stays_as_it_is_to_the_last_bit():
    time = jittered(50)
    value = np.random.default_rng(0).normal(size=50)
    tangents = np.random.default_rng(1).normal(size=(50, 2))
    for rate, rate_tangents in ((None, None), (value[::-1], tangents[::-1])):
        seen, carried = read_at(time, value, rate, tangents, rate_tangents, np.zeros(50), np.zeros((50, 2)))
        assert np.array_equal(seen, value)
        assert np.array_equal(carried, tangents)


def test_a_static_model_is_read_at_shifted_times_too():
    def assemble(e, u):
        e.sensor("speed", e.p.gain * sin(u.x))

    simulate = Simulator(Model("map", assemble, ("gain",), ("x",)), {"gain": 2.0}, ("gain", "latency"), (speed_delay,))
    time = jittered(400, 0.02)
    found = simulate(Drive(time, {"x": 3 * time}), [2.0, 0.1])
    inside = slice(10, -1)
    late = 3 * (time - 0.1)
    np.testing.assert_allclose(found.outputs["speed"][inside], 2 * np.sin(late)[inside], atol=3e-4)
    expected = np.column_stack([np.sin(late), -6 * np.cos(late)])
    np.testing.assert_allclose(found.sensitivities["speed"][inside], expected[inside], atol=2e-2)


def test_its_sensitivity_is_that_of_the_reading_also_where_nothing_is_known_of_the_rate():
    def assemble(e, u):
        e.sensor("speed", e.p.gain * u.x)

    simulate = Simulator(Model("map", assemble, ("gain",), ("x",)), {"gain": 2.0}, ("gain", "latency"), (speed_delay,))
    time = jittered(60)
    drive = Drive(time, {"x": np.random.default_rng(5).normal(size=60)})
    theta = np.array([2.0, 0.0517])
    found = simulate(drive, theta).sensitivities["speed"]
    for j in range(2):
        step = 1e-7 * np.eye(2)[j]
        ahead, behind = (simulate(drive, theta + sign * step).outputs["speed"] for sign in (1, -1))
        np.testing.assert_allclose(found[:, j], (ahead - behind) / 2e-7, atol=1e-5 * np.max(np.abs(found[:, j])))


def test_a_single_sample_cannot_be_shifted():
    seen, _ = read_at(np.zeros(1), np.ones(1), None, np.empty((1, 0)), None, np.ones(1), np.empty((1, 0)))
    assert seen[0] == 1
