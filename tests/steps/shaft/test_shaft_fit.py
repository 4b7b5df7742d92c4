"""Half-shafts: torsion of bars in closed form, and the fit with noise in every channel."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.plant import shaft as plant
from tests.plant.vehicle import Vehicle, random_vehicle
from vdyn_cli.diagnosis.diagnose import diagnosed
from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep
from vdyn_cli.effects import catalog, effect
from vdyn_cli.engine.maths import sqrt
from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.inference import Solution, Unknown
from vdyn_cli.quantities.diagnosis import Diagnosis
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import Given, Quantity
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.shaft.sections import compliance, drawing_budget, polar_moment, shared_modulus_correlation, shares
from vdyn_cli.steps.shaft.shaft_fit import ShaftFit, linear_solution
from vdyn_cli.steps.shaft.shaft_readings import ShaftReadings
from vdyn_cli.steps.shaft.shaft_side import ShaftSide
from vdyn_cli.steps.shaft.spec import SectionSpec, ShaftSpec
from vdyn_cli.steps.shaft.step import STEP

G = 79.3e9
CHANNELS = ("shaft_torque", "motor_speed", "wheel_speed", "twist")


def log(vehicle: Vehicle, seed: int, names: tuple[str, ...] = CHANNELS, **effects: float) -> Log:
    (record,) = plant.campaign(vehicle, seed, effects or None)
    time, torque, motor, wheel, twist = record.values()
    channels = dict(zip(CHANNELS, (torque, motor, wheel, np.radians(twist)), strict=True))
    return Log("tip_in.csv", time, {name: channels[name] for name in names})


def piece(outer: float, length: float, inner: float = 0.0, std: float = 0.0) -> SectionSpec:
    return SectionSpec(outer_diameter=Given(outer, std), inner_diameter=Given(inner), length=Given(length))


def fitted(data: Log) -> tuple[Solution, np.ndarray]:
    runs = (ShaftReadings.of(data, 1.0),)
    return ShaftFit(runs).solve(linear_solution(runs))


def test_a_solid_bar() -> None:
    # 25 mm by 700 mm: pi/32 d^4 G / L
    assert 1 / compliance(0.025, 0.0, 0.7, G) == pytest.approx(math.pi / 32 * 0.025**4 * G / 0.7)
    assert 1 / compliance(0.025, 0.0, 0.7, G) == pytest.approx(4344, rel=1e-3)


def test_a_tube_is_the_bar_less_its_bore() -> None:
    assert polar_moment(0.04, 0.03) == pytest.approx(polar_moment(0.04) - polar_moment(0.03))


def test_sections_twist_one_after_the_other() -> None:
    budget = drawing_budget([piece(0.03, 0.2), piece(0.03, 0.2)], Given(G))
    assert budget.value == pytest.approx(1 / compliance(0.03, 0.0, 0.4, G))
    assert shares([piece(0.03, 0.2), piece(0.03, 0.2)]) == pytest.approx([0.5, 0.5])
    assert shares([piece(0.02, 0.1), piece(0.04, 0.1)])[0] == pytest.approx(16 / 17)


@pytest.mark.parametrize(("start", "end"), [(0.03, 0.03), (0.03, 0.036), (0.024, 0.048)])
def test_a_taper_has_its_closed_form(start: float, end: float) -> None:
    closed = 32 * 0.3 / (math.pi * G) * (start**2 + start * end + end**2) / (3 * start**3 * end**3)
    assert compliance(start, 0.0, 0.3, G, end) == pytest.approx(closed, rel=1e-5)
    assert compliance(end, 0.0, 0.3, G, start) == pytest.approx(closed, rel=1e-5)


def test_one_per_cent_of_diameter_is_four_of_stiffness() -> None:
    budget = drawing_budget([piece(0.026, 0.6, std=0.00026)], Given(G, 0.01 * G))
    assert budget.std / budget.value == pytest.approx(math.hypot(0.04, 0.01), rel=1e-3)
    assert {c.name for c in budget.contributions} == {"shear_modulus", "outer_diameter_1", "length_1"}


def test_two_sides_share_the_error_of_the_modulus() -> None:
    modulus = Given(G, 0.01 * G)
    left, right = (drawing_budget([piece(d, 0.5, std=1e-4)], modulus) for d in (0.026, 0.030))
    matrix = shared_modulus_correlation({"left": left, "right": right})
    expected = 0.01**2 / math.hypot(0.01, 4e-4 / 0.026) / math.hypot(0.01, 4e-4 / 0.030)
    assert matrix["left"]["right"] == pytest.approx(expected, rel=1e-3)
    assert matrix["left"]["left"] == 1.0


def test_the_drawing_of_the_plant_has_its_stiffness() -> None:
    vehicle = random_vehicle(2)
    for side in plant.PATTERN:
        drawn = [piece(s.outer_diameter, s.length, s.inner_diameter) for s in plant.drawing(vehicle, side)]
        stiffness = drawing_budget(drawn, Given(vehicle.shear_modulus)).value
        assert stiffness == pytest.approx(plant.truth(vehicle)[f"shaft_stiffness_{side}"], rel=1e-9)


def test_the_gradient_is_that_of_the_cost() -> None:
    fit = ShaftFit((ShaftReadings.of(log(random_vehicle(3), 3), 1.0),)).regression
    theta = np.array([1.05 * fit.unknowns[0].start, 60.0, -5.0, 0.01])
    rows = fit.rows(0, theta)
    gradient = rows.jacobian.T @ rows.residual
    for i, step in enumerate((1.0, 0.01, 1e-3, 1e-5)):
        shift = np.zeros(4)
        shift[i] = step
        above, below = (0.5 * np.sum(fit.rows(0, theta + s).residual ** 2) for s in (shift, -shift))
        assert gradient[i] == pytest.approx((above - below) / (2 * step), rel=2e-3)


@pytest.mark.parametrize(
    "names",
    [
        CHANNELS,
        pytest.param(("shaft_torque", "twist"), marks=pytest.mark.slow),
        pytest.param(("shaft_torque", "motor_speed", "wheel_speed"), marks=pytest.mark.slow),
    ],
)
def test_stiffness_and_damping_from_whatever_was_logged(names: tuple[str, ...]) -> None:
    for seed in (1, 2):
        vehicle = random_vehicle(seed)
        truth = plant.truth(vehicle)
        solution, covariance = fitted(log(vehicle, seed, names))
        std = np.sqrt(np.diag(covariance))
        assert abs(solution.values["shaft_stiffness"] - truth["shaft_stiffness_left"]) < 4 * std[0]
        assert abs(solution.values["shaft_damping"] - truth["shaft_damping_left"]) < 4 * std[1]
        assert std[0] < 0.01 * truth["shaft_stiffness_left"]
        if "twist" in names:
            bound = plant.information(vehicle, seed).bound()
            assert std[0] < 2 * bound["shaft_stiffness_left"]
            assert std[1] < 2.5 * bound["shaft_damping_left"]


@pytest.mark.slow
def test_plain_least_squares_loses_damping_to_the_noise_of_the_rate() -> None:
    lost, kept = [], []
    for seed in range(1, 5):
        vehicle = random_vehicle(seed)
        data = log(vehicle, seed)
        rate = data["motor_speed"] - data["wheel_speed"]
        basis = np.column_stack([data["twist"], rate, np.ones_like(rate)])
        plain = np.linalg.lstsq(basis, data["shaft_torque"], rcond=None)[0]
        lost.append(plain[1] / vehicle.shaft_damping_left - 1)
        solution = linear_solution([ShaftReadings.of(data, 1.0)])
        kept.append(solution.values["shaft_damping"] / vehicle.shaft_damping_left - 1)
    assert np.mean(lost) < -0.05
    assert abs(np.mean(kept)) < 0.01


def test_a_gap_in_the_log_does_no_harm() -> None:
    vehicle = random_vehicle(4)
    data = log(vehicle, 4)
    torque = data["shaft_torque"].copy()
    torque[900:1100] = np.nan
    solution, covariance = fitted(data.with_channels(shaft_torque=torque))
    truth = plant.truth(vehicle)["shaft_stiffness_left"]
    assert abs(solution.values["shaft_stiffness"] - truth) < 4 * np.sqrt(covariance[0, 0])


def test_an_effect_on_the_shaft_can_be_added_and_is_found() -> None:
    vehicle = random_vehicle(5)
    gap = 0.004

    @effect(on="shaft", unknowns=(Quantity("backlash", "rad", "free play", "", 0, 0.2),), reference="a test")
    def backlash(shaft: Law, s: Signals, q: Signals) -> Number:
        """Free play to either side."""
        before, after = (sqrt((s.twist + side * q.backlash) ** 2 + 1e-4**2) for side in (-1.0, 1.0))
        return shaft(s.but(twist=s.twist + (before - after) / 2))

    runs = (ShaftReadings.of(log(vehicle, 5, backlash=gap), 1.0),)
    # The law damps also where the flanks are apart and nothing resists: hence a few percent.
    fit = ShaftFit(runs, AddedEffects((backlash,), (Unknown("backlash", 0.003, 0.0, 0.2),)))
    found = fit.solve(linear_solution(runs))[0].values
    assert found["backlash"] == pytest.approx(gap, rel=0.05)
    assert found["shaft_stiffness"] == pytest.approx(plant.truth(vehicle)["shaft_stiffness_left"], rel=0.03)


def test_solid_is_no_bore() -> None:
    assert SectionSpec(outer_diameter=Given(0.03), length=Given(0.1)).inner_diameter.value == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.0, 3.0])
def test_the_noise_of_an_unread_rate_holds_what_the_torque_leaves_in_it(noise: float) -> None:
    """Torque noise over damping is in the adjusted rate where none was read: neighbors alternate freely."""
    vehicle = random_vehicle(911)
    true, known = log(vehicle, 911), log(vehicle, 911, ("shaft_torque", "twist"))
    more = np.random.default_rng(911).normal(0.0, noise, known.time.size) if noise else 0.0
    known = known.with_channels(shaft_torque=known["shaft_torque"] + more)
    side = ShaftSide("left", (ShaftReadings.of(known, 1.0),), (), None, None, 0.0, Given(0.0))
    (stated,) = side.rate_noise
    (rate,) = side.logged(NO_EFFECTS).rate
    assert stated == pytest.approx(np.std(rate - true["motor_speed"] + true["wheel_speed"]), rel=0.35)


def oscillation(rate: float, frequency: float, angles: bool) -> Log:
    """A clean log of 20 s: a twist that follows steps of torque as an oscillator does, damped by 6 %."""
    rng, time = np.random.default_rng(7), np.arange(0.0, 20.0, 1 / rate)
    omega, decay = 2 * np.pi * frequency, 2 * np.pi * frequency * 0.06
    twist, speed = np.zeros_like(time), np.zeros_like(time)
    for start, size in ((1, 0.03), (4, -0.03), (7, -0.02), (10, 0.02), (13, 0.03), (16, -0.03)):
        since = np.maximum(time - start, 0.0)
        left = size * np.exp(-decay * since)
        twist += size - left * (np.cos(omega * since) + decay / omega * np.sin(omega * since))
        speed += left * (omega + decay**2 / omega) * np.sin(omega * since)
    noisy = {"shaft_torque": 7260.0 * twist + 7.0 * speed + rng.normal(0, 1.5, time.size)}
    if angles:
        return Log("rig.csv", time, {**noisy, "twist": twist + rng.normal(0, 3.2e-4, time.size)})
    wheel = 25.0 + rng.normal(0, 0.005, time.size)
    motor = 25.0 + speed + rng.normal(0, 0.005, time.size)
    return Log("rig.csv", time, {**noisy, "motor_speed": motor, "wheel_speed": wheel})


def diagnosis_of(data: Log) -> Diagnosis:
    spec = ShaftSpec.model_validate({"test": "shaft", "runs": [{"log": "rig.csv", "side": "left"}]})
    problem = STEP.prepare(spec, (data,), Parameters())
    found = diagnosed(PreparedStep(STEP, spec, Parameters(), problem), problem.publish()).diagnosis
    assert found is not None
    return found


def test_speeds_logged_at_twelve_samples_per_oscillation_give_the_stiffness() -> None:
    """The trapezoidal rule makes the twist 2 % too small there."""
    solution, _ = fitted(oscillation(100.0, 8.0, angles=False))
    assert solution.values["shaft_stiffness"] == pytest.approx(7260.0, rel=0.01)


@pytest.mark.slow
def test_a_clean_log_has_no_play_within_the_noise_of_its_encoders() -> None:
    """Each reading chooses the flank that suits its noise: play of 0.1 to 0.3 mrad fitted clean logs better."""
    found = diagnosis_of(oscillation(500.0, 20.0, angles=True))
    assert found.verdict == "adequate", found.sentence


@pytest.mark.thorough
@pytest.mark.slow
def test_friction_on_a_stand_is_not_named_free_play() -> None:
    """Friction of 60 N m over slow ramps was free play of 0.75 mrad with a damping of 0.3 s times the stiffness."""
    rng, time = np.random.default_rng(4), np.arange(0.0, 40.0, 0.01)
    twist = np.interp(time, [0, 1, 10, 12, 26, 28, 39, 40], [0, 0, 0.05, 0.05, -0.05, -0.05, 0, 0])
    friction = np.zeros(time.size)
    for k, change in enumerate(np.diff(twist), start=1):
        friction[k] = np.clip(friction[k - 1] + 60.0 / 0.003 * change, -60.0, 60.0)
    torque = 31000.0 * twist + friction + rng.normal(0, 4.0, time.size)
    log_ = Log("rig.csv", time, {"shaft_torque": torque, "twist": twist + rng.normal(0, 5e-5, time.size)})
    found = diagnosis_of(log_)
    assert found.verdict in ("unknown", "named")
    assert not any(cause.effect == "backlash" for cause in found.causes)


def test_a_law_with_effects_explains_a_large_zero_of_the_torque() -> None:
    """Without effects the zero is free; priors that exclude it would make every candidate contradict the log."""
    data, drift = log(random_vehicle(4), 4), next(e for e in catalog() if e.name == "torque_zero_drift")

    def cost(twist: float) -> float:
        zero = twist * plant.truth(random_vehicle(4))["shaft_stiffness_left"]
        runs = (ShaftReadings.of(data.with_channels(shaft_torque=data["shaft_torque"] + zero), 1.0),)
        return ShaftFit(runs, AddedEffects((drift,))).fit_holding_effects(linear_solution(runs))[1]

    assert cost(0.02) < cost(0.0) + 2.0
