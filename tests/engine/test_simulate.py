"""The integrator and its sensitivities compared with independent solutions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.engine.plants import HALF, HALF_CAR, ROAD, ROAD_LOAD
from vdyn_cli.effects import catalog
from vdyn_cli.engine.maths import sin
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.simulate import Drive, Simulator, sensitive_to
from vdyn_cli.quantities.errors import ResultError

HEADWIND = next(effect for effect in catalog() if effect.name == "headwind")
ASYMMETRY = next(effect for effect in catalog() if effect.name == "asymmetric_damping")
BACKENDS = ("llvm", "vm")
ROAD_UNKNOWNS = ("rolling_resistance", "drag_area", "headwind", "mass", "start.speed")
ROAD_THETA = np.array([0.011, 0.62, 1.5, 1480.0, 20.0])
HALF_UNKNOWNS = ("stiffness_front", "stiffness_rear", "damping_front", "tire_stiffness", "bump_front", "start.heave")
HALF_THETA = np.array([45e3, 42e3, 3200.0, 4e5, 5.01, 0.002])


def jittered(duration: float, step: float, seed: int = 1) -> np.ndarray:
    """A clock that wanders by a fifth of its step."""
    n = round(duration / step) + 1
    return np.arange(n) * step + np.random.default_rng(seed).uniform(-0.2, 0.2, n) * step


def coast(step: float = 0.1) -> Drive:
    time = jittered(60.0, step)
    grade = 0.002 * np.sin(time / 7)
    return Drive(time, {"drive_force": 0.0, "wind": 0.3, "grade": grade}, {"speed": 20.0}, {}, {"heading": -1.0})


def bump(step: float = 0.002) -> Drive:
    return Drive(jittered(2.0, step), {"speed": 25 / 3.6})


def road(backend: str = "auto", substeps: int = 1) -> Simulator:
    return Simulator(ROAD_LOAD, ROAD, ROAD_UNKNOWNS, (HEADWIND,), substeps, backend)


def half(backend: str = "auto", substeps: int = 1) -> Simulator:
    return Simulator(HALF_CAR, HALF, HALF_UNKNOWNS, (), substeps, backend)


def test_road_load_agrees_with_an_adaptive_integrator():
    drive = coast()
    frr, area, headwind, mass, start = ROAD_THETA

    def rate(t, v):
        grade = np.interp(t, drive.time, drive.inputs["grade"])
        flow = v + 0.3 - headwind
        drag = 0.5 * 1.2 * area * flow * abs(flow) + mass * 9.80665 * (frr * np.cos(grade) + np.sin(grade))
        return -drag / (mass + 45.0)

    truth = [start]
    for span in zip(drive.time[:-1], drive.time[1:], strict=True):  # from kink to kink of the inputs
        truth.append(solve_ivp(rate, span, truth[-1:], "DOP853", rtol=1e-12, atol=1e-13).y[0, -1])
    simulated = road()(drive, ROAD_THETA)
    assert np.max(np.abs(simulated.outputs["speed"] - truth)) < 1e-11
    assert simulated.outputs["speed"][0] == start


def test_half_car_agrees_with_an_adaptive_integrator_through_lift_off():
    drive = bump()
    K, C, m, arm, D = (45e3, 42e3), (3200.0, 3000.0), (80.0, 80.0), (1.25, -1.45), (5.01, 7.7)
    static = [1400 * 9.80665 * other / 2.7 + 80 * 9.80665 for other in (1.45, 1.25)]
    speed = 25 / 3.6

    def loads(t, y):
        phase = [(speed * (t - drive.time[0]) - d) / 0.48 for d in D]
        road = [0.035 * (1 - np.cos(2 * np.pi * p)) if 0 < p < 1 else 0.0 for p in phase]
        return [max(static[i] - 4e5 * (y[4 + 2 * i] - road[i]), 0.0) for i in range(2)]

    def rate(t, y):
        strut = [
            K[i] * (y[0] + arm[i] * y[2] - y[4 + 2 * i]) + C[i] * (y[1] + arm[i] * y[3] - y[5 + 2 * i]) for i in (0, 1)
        ]
        load = loads(t, y)
        body = [y[1], -sum(strut) / 1400, y[3], -(arm[0] * strut[0] + arm[1] * strut[1]) / 2100]
        wheels = [[y[5 + 2 * i], (strut[i] + load[i] - static[i]) / m[i]] for i in (0, 1)]
        return [*body, *wheels[0], *wheels[1]]

    start = [0.002, *[0.0] * 7]
    truth = solve_ivp(rate, drive.time[[0, -1]], start, "DOP853", drive.time, rtol=1e-10, atol=1e-12, max_step=1e-3)
    expected = np.array([loads(t, y) for t, y in zip(truth.t, truth.y.T, strict=True)]).T
    simulated = half(substeps=8)(drive, HALF_THETA)
    assert np.min(expected) == 0  # the tire leaves the ground
    for got, load in zip(simulated.outputs.values(), expected, strict=True):
        assert np.max(np.abs(got - load)) < 0.2  # of 20 kN; the corners of lift-off and bump cost the high order


def test_the_integrator_is_of_fourth_order():
    drive = Drive(np.linspace(0, 1, 51), {"speed": 0.0}, {"heave": 0.02, "pitch": 0.01})
    exact = Simulator(HALF_CAR, HALF, substeps=160)(drive).outputs["load_front"]
    errors = [
        np.max(np.abs(Simulator(HALF_CAR, HALF, substeps=sub)(drive).outputs["load_front"] - exact))
        for sub in (5, 10, 20)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all((orders > 3.8) & (orders < 4.3))


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    ("simulator", "drive", "theta"), [(road, coast(0.5), ROAD_THETA), (half, bump(0.004), HALF_THETA)]
)
def test_sensitivities_are_those_of_the_simulation(simulator, drive, theta, backend):
    simulate = simulator(backend)
    found = simulate(drive, theta)
    for j, value in enumerate(theta):
        step = np.zeros_like(theta)
        step[j] = 1e-6 * max(abs(value), 1.0)
        ahead, behind = (simulate(drive, theta + sign * step, sensitivities=False).outputs for sign in (1, -1))
        for name, sensitivity in found.sensitivities.items():
            difference = (ahead[name] - behind[name]) / (2 * step[j])
            assert np.max(np.abs(sensitivity[:, j] - difference)) < 1e-6 * np.max(np.abs(difference)), (name, j)


@pytest.mark.parametrize("backend", BACKENDS)
def test_an_effect_with_own_states_and_a_nominal_value_has_exact_sensitivities(backend):
    from tests.engine.effects import FADING

    simulate = Simulator(ROAD_LOAD, ROAD, ("fading", "fading_time"), (FADING,), 1, backend)
    drive, theta = coast(0.5), np.array([0.2, 30.0])
    found = simulate(drive, theta).sensitivities["speed"]
    for j in range(2):
        step = 1e-5 * theta[j] * np.eye(2)[j]
        ahead, behind = (simulate(drive, theta + sign * step).outputs["speed"] for sign in (1, -1))
        difference = (ahead - behind) / (2 * step[j])
        assert np.max(np.abs(found[:, j] - difference)) < 1e-6 * np.max(np.abs(difference))


def test_more_unknowns_than_lanes_take_several_passes_to_the_same_answer():
    count = 40

    def assemble(e, u):
        x = e.state("x", 1.0)
        e.integrate(x=sum(getattr(e.p, f"a{i}") * sin((i + 1) * x) for i in range(count)))
        e.sensor("x", x)

    names = tuple(f"a{i}" for i in range(count))
    parameters = {name: 0.1 / (i + 1) for i, name in enumerate(names)}
    drive = Drive(np.linspace(0, 1, 11), {})
    whole = Simulator(Model("wide", assemble, names, ()), parameters, names)(drive, list(parameters.values()))
    for i in (0, 31, 32, 39):
        single = Simulator(Model("wide", assemble, names, ()), parameters, names[i : i + 1])(
            drive, [parameters[names[i]]]
        )
        np.testing.assert_allclose(whole.sensitivities["x"][:, i], single.sensitivities["x"][:, 0], rtol=1e-13)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_run_continued_from_its_last_states_has_no_seam(backend):
    time = np.arange(0, 260, 0.1)
    still = {"drive_force": 300.0, "wind": 0.0, "grade": 0.0}
    whole = road(backend)(Drive(time, still, {"speed": 5.0}, {}, {"heading": 1.0}), ROAD_THETA, states=True)
    cut = 1500
    first = road(backend)(Drive(time[: cut + 1], still, {}, {}, {"heading": 1.0}), ROAD_THETA, states=True).states
    theta = np.array([*ROAD_THETA[:-1], first["speed"][-1]])
    start = {"position": first["position"][-1]}
    second = road(backend)(Drive(time[cut:], still, start, {}, {"heading": 1.0}), theta, states=True)
    joined = np.concatenate([first["speed"][:-1], second.outputs["speed"]])
    np.testing.assert_allclose(whole.outputs["speed"], joined, rtol=1e-12)
    assert whole.states["position"].shape == time.shape
    assert whole.states["position"][-1] == pytest.approx(second.states["position"][-1], rel=1e-12)


def test_substeps_follow_inputs_linearly():
    def assemble(e, u):
        e.integrate(x=u.push)
        e.sensor("x", e.state("x"))

    time = np.array([0.0, 0.3, 1.0, 1.1, 2.0])
    push = np.array([0.0, 1.0, -2.0, 0.5, 3.0])
    exact = np.concatenate([[0], np.cumsum(np.diff(time) * (push[1:] + push[:-1]) / 2)])
    for substeps in (1, 3, 2000):
        simulated = Simulator(Model("sum", assemble, (), ("push",)), {}, substeps=substeps)(Drive(time, {"push": push}))
        np.testing.assert_allclose(simulated.outputs["x"], exact, atol=1e-13)


def test_the_values_do_not_depend_on_the_sensitivities_beside_them():
    simulate, drive = road(), coast()
    with_them, without = simulate(drive, ROAD_THETA), simulate(drive, ROAD_THETA, sensitivities=False)
    assert np.array_equal(with_them.outputs["speed"], without.outputs["speed"])
    assert without.sensitivities["speed"].shape == (drive.time.size, 0)


def test_a_run_overrides_parameters_for_itself_alone():
    simulate = Simulator(ROAD_LOAD, ROAD, ("drag_area",))
    still = {"drive_force": 0.0, "wind": 0.0, "grade": 0.0}
    time = np.linspace(0, 20, 41)
    thick = Drive(time, still, {}, {"air_density": 1.3}, {"heading": 1.0})
    usual = Drive(time, still, {}, {}, {"heading": 1.0})
    dense = Simulator(ROAD_LOAD, {**ROAD, "air_density": 1.3}, ("drag_area",))
    before = simulate(usual, [0.6]).outputs["speed"]
    assert np.array_equal(simulate(thick, [0.6]).outputs["speed"], dense(usual, [0.6]).outputs["speed"])
    assert np.array_equal(simulate(usual, [0.6]).outputs["speed"], before)


def test_effects_are_nothing_until_they_are_given_a_size():
    still = {"drive_force": 0.0, "wind": 1.0, "grade": 0.0}
    drive = Drive(np.linspace(0, 20, 41), still, {}, {}, {"heading": 1.0})
    plain = Simulator(ROAD_LOAD, ROAD)(drive).outputs["speed"]
    assert np.array_equal(Simulator(ROAD_LOAD, ROAD, (), (HEADWIND,))(drive).outputs["speed"], plain)
    fixed = Simulator(ROAD_LOAD, {**ROAD, "headwind": 2.0}, (), (HEADWIND,))(drive).outputs["speed"]
    free = Simulator(ROAD_LOAD, ROAD, ("headwind",), (HEADWIND,))(drive, [2.0]).outputs["speed"]
    assert np.array_equal(fixed, free)
    assert fixed[-1] < plain[-1]


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_start_may_follow_from_another_start(backend):
    def assemble(e, u):
        v = e.state("speed", 10.0)
        turn = e.state("wheel_speed", v / e.p.radius)
        e.integrate(speed=-0.1 * v, wheel_speed=-0.1 * turn)
        e.sensor("rim_speed", turn * 0.3)

    model = Model("rolling", assemble, ("radius",), ())
    simulate = Simulator(model, {"radius": 0.3}, ("start.speed", "radius"), backend=backend)
    drive = Drive(np.linspace(0, 1, 5), {})
    found = simulate(drive, [12.0, 0.25])
    decay = np.exp(-0.1 * drive.time)
    np.testing.assert_allclose(found.outputs["rim_speed"], 12 * 0.3 / 0.25 * decay, rtol=1e-8)
    slopes = np.column_stack([0.3 / 0.25 * decay, -12 * 0.3 / 0.25**2 * decay])
    np.testing.assert_allclose(found.sensitivities["rim_speed"], slopes, rtol=1e-8)
    given = simulate(Drive(drive.time, {}, {"wheel_speed": 40.0}), [12.0, 0.25])
    assert given.outputs["rim_speed"][0] == 12.0
    assert not given.sensitivities["rim_speed"].any()


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_model_without_states_is_a_map(backend):
    def assemble(e, u):
        e.sensor("force", e.p.stiffness * u.twist**3 + e.p.offset)

    model = Model("shaft", assemble, ("stiffness", "offset"), ("twist",))
    twist = np.random.default_rng(0).normal(size=1500)
    simulate = Simulator(model, {"stiffness": 2.0, "offset": 0.5}, ("stiffness", "offset"), backend=backend)
    found = simulate(Drive(np.arange(1500.0), {"twist": twist}), [3.0, 0.25])
    np.testing.assert_allclose(found.outputs["force"], 3 * twist**3 + 0.25, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(found.sensitivities["force"], np.column_stack([twist**3, np.ones(1500)]), rtol=1e-14)


def test_some_outputs_can_be_read_alone():
    some, whole = Simulator(replace(HALF_CAR, outputs=("load_rear",)), HALF, HALF_UNKNOWNS), half()
    found, both = some(bump(), HALF_THETA), whole(bump(), HALF_THETA)
    assert some.outputs == ("load_rear",) != whole.outputs
    np.testing.assert_array_equal(found.outputs["load_rear"], both.outputs["load_rear"])
    np.testing.assert_array_equal(found.sensitivities["load_rear"], both.sensitivities["load_rear"])
    with pytest.raises(ValueError, match="'load_raer' is not known; did you mean 'load_rear'"):
        Simulator(replace(HALF_CAR, outputs=("load_raer",)), HALF)


def test_sensitivities_to_some_unknowns_are_those_among_all():
    names = ("tire_stiffness", "start.heave")
    found, whole = sensitive_to(half(), names)(bump(), HALF_THETA), half()(bump(), HALF_THETA)
    for name, columns in whole.sensitivities.items():
        np.testing.assert_array_equal(found.outputs[name], whole.outputs[name])
        np.testing.assert_allclose(
            found.sensitivities[name], columns[:, [HALF_UNKNOWNS.index(n) for n in names]], rtol=1e-12, atol=1e-12
        )


def test_a_single_sample_is_read_without_a_step():
    found = half()(Drive([3.0], {"speed": 5.0}), HALF_THETA)
    assert found.outputs["load_front"].shape == (1,)
    assert found.sensitivities["load_front"].shape == (1, 6)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_simulation_that_leaves_the_numbers_says_when(backend):
    def assemble(e, u):
        x = e.state("x", 1.0)
        e.integrate(x=x * x)  # 1 / (1 - t)
        e.sensor("x", x)

    simulate = Simulator(Model("blow_up", assemble, (), ()), {}, backend=backend)
    with pytest.raises(ResultError, match=r"blow_up.* at t = 1\.\d* s.*not a finite number.*unstable"):
        simulate(Drive(np.arange(0, 50, 0.1), {}))


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_derivative_that_leaves_the_numbers_says_so(backend):
    def assemble(e, u):
        from vdyn_cli.engine.maths import sqrt

        e.sensor("root", sqrt(e.p.a * u.x))

    simulate = Simulator(Model("root", assemble, ("a",), ("x",)), {"a": 1.0}, ("a",), backend=backend)
    with pytest.raises(ResultError, match=r"t = 2 s.*derivative"):
        simulate(Drive([1.0, 2.0], {"x": [1.0, 0.0]}), [1.0])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"parameters": {**ROAD, "mas": 1.0}}, "did you mean 'mass'"),
        ({"parameters": {"mass": 1.0}}, "needs a value for rotating_mass"),
        ({"unknowns": ("drag_aera",)}, "did you mean 'drag_area'"),
        ({"unknowns": ("start.sped",)}, "did you mean 'start.speed'"),
        ({"unknowns": ("heading",)}, "not known"),
        ({"unknowns": ("mass", "mass")}, "twice"),
        ({"effects": (ASYMMETRY,)}, "no element for the effect asymmetric_damping"),
        ({"substeps": 0}, "at least one step"),
    ],
)
def test_names_that_do_not_fit_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        Simulator(**{"model": ROAD_LOAD, "parameters": ROAD, **change})


@pytest.mark.parametrize(
    ("drive", "message"),
    [
        (lambda: Drive([0, 1], {"wnd": 0.0}), "did you mean 'wind'"),
        (lambda: Drive([0, 1], {"wind": 0.0}), "needs drive_force, grade, heading"),
        (lambda: Drive([0, 1], {}, {"sped": 0.0}), "did you mean 'speed'"),
        (lambda: Drive([0, 1], {}, {}, {"drag_are": 0.0}), "did you mean 'drag_area'"),
        (lambda: Drive([0, 1], {}, {}, {}, {"heding": 0.0}), "did you mean 'heading'"),
        (lambda: Drive([1, 1], {}), "increasing"),
        (lambda: Drive([0, 1], {"wind": [0.0, 1.0, 2.0]}), r"shape \(3,\)"),
        (lambda: Drive([0, 1], {"wind": [0.0, np.nan]}), "not finite"),
    ],
)
def test_drives_that_do_not_fit_are_refused(drive, message):
    with pytest.raises(ValueError, match=message):
        Simulator(ROAD_LOAD, ROAD)(drive())


def test_an_unknown_cannot_be_given_by_a_drive():
    drive = Drive([0, 1], {"drive_force": 0.0, "wind": 0.0, "grade": 0.0}, {}, {"mass": 1.0}, {"heading": 1.0})
    with pytest.raises(ValueError, match="mass is both an unknown"):
        road()(drive, ROAD_THETA)


def test_theta_must_have_one_number_for_each_unknown():
    with pytest.raises(ValueError, match="there are 5 unknowns"):
        road()(coast(), [1.0])


def test_a_function_without_a_rule_is_refused_in_words():
    import casadi

    def assemble(e, u):
        e.sensor("y", casadi.erf(u.x))

    with pytest.raises(NotImplementedError, match=r"erf .*maths"):
        Simulator(Model("odd", assemble, (), ("x",)), {})


def test_the_state_that_led_the_way_out_is_named():
    def assemble(e, u):
        calm, wild = e.state("calm", 1.0), e.state("wild", 1e-3)
        e.integrate(calm=-calm + 1e-3 * wild, wild=-5000.0 * wild)
        e.sensor("calm", calm)

    simulate = Simulator(Model("stiff", assemble, (), ()), {})
    with pytest.raises(ResultError, match=r"'stiff' at t = .* s: wild, .*step of 10 ms is too large") as caught:
        simulate(Drive(np.arange(0, 2, 0.01), {}))
    assert "check the parameters" in caught.value.findings[0].remedy


def test_steps_too_large_are_found_where_the_numbers_stay_finite():
    def assemble(e, u):
        x, v = e.state("x", 0.1), e.state("v")
        e.integrate(x=v, v=-100.0 * sin(400.0 * x) - v)  # a spring that lets go
        e.sensor("place", x)

    simulate = Simulator(Model("loose", assemble, (), ()), {})
    coarse, fine = Drive(np.arange(0, 1, 0.04), {}), Drive(np.arange(0, 1, 0.0005), {})
    assert np.all(np.isfinite(simulate(coarse).outputs["place"]))
    assert simulate.step_error(coarse)["place"] > 0.05
    assert simulate.step_error(fine)["place"] < 1e-3
