"""The inertia step: recovery on the plant, the traps that it names, wrong signs, and both ways at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.effects.recovered import given
from tests.plant import pendulum as hung
from tests.plant import wheel as plant
from tests.plant.vehicle import Vehicle, random_vehicle
from vdyn_cli.effects import effect
from vdyn_cli.effects.wheel_mass import wheel_mass
from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.inference import Unknown, solve
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import InputError, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import Given, Quantity
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.inertia import problem
from vdyn_cli.steps.inertia.drive_checks import contradicted_wheel_speed, radius_contradiction
from vdyn_cli.steps.inertia.moment_balance import MomentBalance, drive_windows
from vdyn_cli.steps.inertia.problem import InertiaData
from vdyn_cli.steps.inertia.spec import InertiaSpec
from vdyn_cli.steps.inertia.step import STEP

NAMES = ("hub_torque", "wheel_speed", "hub_force_x", "hub_force_z", "acceleration", "vehicle_speed")
SETTINGS = {"torque_zero": "1 N m", "force_zero": "10 N"}
SPEC = InertiaSpec.model_validate({"test": "inertia", "settings": SETTINGS})


def logs(vehicle: Vehicle, seed: int, effects: Mapping[str, float] | None = None) -> tuple[Log, ...]:
    found = []
    for k, record in enumerate(plant.campaign(vehicle, seed, effects)):
        time, *columns = record.values()
        channels = dict(zip(NAMES, columns, strict=True))
        found.append(Log(f"wheel_{k + 1}.csv", time, channels | {"vehicle_speed": channels["vehicle_speed"] / 3.6}))
    return tuple(found)


def known(vehicle: Vehicle, **std: float) -> Parameters:
    return given(plant.known(vehicle), **std)


def changed(parameters: Parameters, **to: float) -> Parameters:
    return Parameters({n: replace(e, value=to.get(n, e.value)) for n, e in parameters.items()})


@pytest.fixture(scope="module")
def car() -> tuple[Vehicle, tuple[Log, ...]]:
    vehicle = random_vehicle(7)
    return vehicle, logs(vehicle, 7)


@pytest.mark.parametrize("seed", [1, *(pytest.param(n, marks=pytest.mark.slow) for n in (2, 3, 4))])
def test_the_inertia_is_recovered_near_the_bound(seed: int) -> None:
    vehicle = random_vehicle(seed)
    result = STEP.estimate(SPEC, InertiaData(logs(vehicle, seed)), known(vehicle))
    estimate, bound = result.parameters["wheel_inertia"], plant.information(vehicle, seed).bound()["wheel_inertia"]
    assert abs(estimate.value - vehicle.wheel_inertia) < 3.5 * bound
    assert 0.5 * bound < estimate.std < 2 * bound
    assert result.fit.rms == pytest.approx(result.fit.noise_floor, rel=0.15)
    assert len(result.comparisons) == 3
    assert len(result.figures) == 2


def test_a_noisy_wheel_speed_raises_the_noise_floor() -> None:
    vehicle = random_vehicle(5)
    random = np.random.default_rng(5)
    noisy = []
    for log in logs(vehicle, 5):
        speed = log.channels["wheel_speed"]
        noisy.append(replace(log, channels={**log.channels, "wheel_speed": speed + random.normal(0, 0.5, speed.size)}))
    fit = STEP.estimate(SPEC, InertiaData(tuple(noisy)), known(vehicle)).fit
    assert fit.rms == pytest.approx(fit.noise_floor, rel=0.3)
    assert not fit.misfit


def test_a_differentiated_speed_is_biased_where_the_integral_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    # At 1 kHz the noise of a differentiated wheel speed takes away half of the inertia, smoothed over three samples
    # still a seventh; smoothed over a second it adds. The integral form does not mind.
    monkeypatch.setattr(plant, "RATE", 1000.0)
    vehicle = random_vehicle(11)
    data = logs(vehicle, 11)
    raw, little, much = (_by_derivative(vehicle, data, width) / vehicle.wheel_inertia - 1 for width in (1, 3, 1000))
    integral = STEP.estimate(SPEC, InertiaData(data), known(vehicle)).parameters["wheel_inertia"]
    assert raw < -1 / 3
    assert little < -0.1
    assert much > 0.03
    assert abs(integral.value / vehicle.wheel_inertia - 1) < 0.01


def _by_derivative(vehicle: Vehicle, data: tuple[Log, ...], width: int) -> float:
    """Least squares of the net torque on the derivative of the wheel's speed, smoothed over ``width`` samples."""
    above = below = 0.0
    for log in data:
        force = log["hub_force_x"] + vehicle.wheel_mass * log["acceleration"]
        force = force + vehicle.rolling_resistance * log["hub_force_z"]
        speed = np.convolve(log["wheel_speed"], np.ones(width) / width, "same")
        inside = slice(width, -width)
        rate = np.gradient(speed, log.time)[inside]
        torque = (log["hub_torque"] - vehicle.wheel_radius * force)[inside]
        above += float(np.sum((rate - rate.mean()) * torque))
        below += float(np.sum((rate - rate.mean()) ** 2))
    return above / below


def test_two_kilograms_of_wheel_mass_are_two_r_squared(car: tuple[Vehicle, tuple[Log, ...]]) -> None:
    vehicle, data = car
    right = STEP.estimate(SPEC, InertiaData(data), known(vehicle)).parameters["wheel_inertia"]
    heavier = changed(known(vehicle), wheel_mass=vehicle.wheel_mass + 2.0)
    wrong = STEP.estimate(SPEC, InertiaData(data), heavier).parameters["wheel_inertia"]
    assert wrong.value - right.value == pytest.approx(-2.0 * vehicle.wheel_radius**2, rel=0.06)


def test_what_is_known_carries_its_uncertainty_over(car: tuple[Vehicle, tuple[Log, ...]]) -> None:
    vehicle, data = car
    std = {"wheel_mass": 0.5, "wheel_radius": 0.0005}
    result = STEP.estimate(SPEC, InertiaData(data), known(vehicle, **std))
    estimate = result.parameters["wheel_inertia"]
    moved = {
        name: STEP.estimate(
            SPEC, InertiaData(data), changed(known(vehicle), **{name: plant.known(vehicle)[name] + size})
        )
        for name, size in std.items()
    }
    parts = [m.parameters["wheel_inertia"].value - estimate.value for m in moved.values()]
    assert estimate.std == pytest.approx(np.hypot(*parts), rel=0.02)
    assert {row[0]: row[1] for row in result.tables[1].rows}.keys() >= {"1 mm of wheel radius"}
    assert "only Jw + mw r^2 is observable" in result.sentence


def test_a_gain_between_torque_and_force_is_named_and_carried(car: tuple[Vehicle, tuple[Log, ...]]) -> None:
    vehicle, data = car
    spec = SPEC.model_copy(update={"settings": SPEC.settings.model_copy(update={"gain_std": Given(0.001)})})
    honest = STEP.estimate(spec, InertiaData(data), known(vehicle)).parameters["wheel_inertia"]
    louder = tuple(log.with_channels(hub_torque=1.001 * log["hub_torque"]) for log in data)
    there = STEP.estimate(SPEC, InertiaData(louder), known(vehicle)).parameters["wheel_inertia"].value
    here = STEP.estimate(SPEC, InertiaData(data), known(vehicle)).parameters["wheel_inertia"]
    assert honest.std == pytest.approx(np.hypot(there - here.value, here.std), rel=0.03)


@pytest.mark.parametrize("channel", ["hub_torque", "hub_force_x", "hub_force_z", "wheel_speed", "acceleration"])
def test_a_wrong_sign_is_noticed_and_the_line_is_named(car: tuple[Vehicle, tuple[Log, ...]], channel: str) -> None:
    vehicle, data = car
    flipped = tuple(log.with_channels(**{channel: -log[channel]}) for log in data)
    with pytest.raises(InputError, match=f"(?s){channel}: .*add 'sign: -1' to its channel") as error:
        STEP.estimate(SPEC, InertiaData(flipped), known(vehicle))
    assert len(error.value.findings) == 3  # one a log, and no other channel


def test_the_energy_decides_an_overall_sign_that_vibration_hides(car: tuple[Vehicle, tuple[Log, ...]]) -> None:
    vehicle, data = car
    shaken = []
    for log in data:
        shake = np.sin(
            2 * np.pi * 31.0 * log.time
        )  # of the hub: the samples' correlation with the acceleration is lost
        channels = {
            "hub_torque": -log["hub_torque"] + 4000.0 * vehicle.wheel_radius * shake,
            "hub_force_x": -log["hub_force_x"] + 4000.0 * shake,
            "acceleration": log["acceleration"] + 20.0 * np.cos(2 * np.pi * 31.0 * log.time),
        }
        shaken.append(log.with_channels(**channels))
    with pytest.raises(InputError, match=r"(?s)positive where the car slows down.*add 'sign: -1' to its channel"):
        STEP.estimate(SPEC, InertiaData(tuple(shaken)), known(vehicle))


def test_gaps_and_missing_values_are_left_out(car: tuple[Vehicle, tuple[Log, ...]]) -> None:
    vehicle, data = car
    whole = STEP.estimate(SPEC, InertiaData(data), known(vehicle)).parameters["wheel_inertia"]
    holed = []
    for log in data:
        torque = log["hub_torque"].copy()
        torque[1000:1100] = np.nan
        torque[3000] = np.nan
        keep = np.r_[0:4000, 4300 : log.time.size]
        channels = {n: (torque if n == "hub_torque" else v)[keep] for n, v in log.channels.items()}
        holed.append(Log(log.name, log.time[keep], channels))
    part = STEP.estimate(SPEC, InertiaData(tuple(holed)), known(vehicle)).parameters["wheel_inertia"]
    assert abs(part.value - whole.value) < 2 * whole.std


def test_logs_that_cannot_serve_are_refused(car: tuple[Vehicle, tuple[Log, ...]]) -> None:
    vehicle, (log, *_) = car
    cases = {
        "every channel has readings: 12 are needed": log.between(5.0, 6.0),
        "wheel speed is constant within its noise": log.with_channels(wheel_speed=np.full(log.time.size, 40.0)),
        "the channel is empty": log.with_channels(hub_force_x=np.full(log.time.size, np.nan)),
    }
    for message, bad in cases.items():
        with pytest.raises(InputError, match=message):
            STEP.estimate(SPEC, InertiaData((bad,)), known(vehicle))
    with pytest.raises(InputError, match="neither a drive nor a pendulum"):
        STEP.estimate(SPEC, InertiaData(()), known(vehicle))
    with pytest.raises(InputError, match="wheel_radius"):
        STEP.estimate(SPEC, InertiaData((log,)), Parameters())


def test_a_radius_far_off_leaves_no_inertia_and_says_so(car: tuple[Vehicle, tuple[Log, ...]]) -> None:
    vehicle, data = car
    wide = changed(known(vehicle), wheel_radius=1.04 * vehicle.wheel_radius)
    with pytest.raises(ResultError, match=r"negative inertia .*1 mm of wheel_radius"):
        STEP.estimate(SPEC, InertiaData(data), wide)
    off = changed(known(vehicle), wheel_radius=0.97 * vehicle.wheel_radius)
    findings = STEP.estimate(SPEC, InertiaData(data), off).findings
    assert any("is not wheel_radius" in finding.what for finding in findings)


def test_a_radius_above_the_rolling_one_is_doubted_and_its_error_included(
    car: tuple[Vehicle, tuple[Log, ...]],
) -> None:
    vehicle, data = car
    found, findings = radius_contradiction(data, Given(1.008 * vehicle.wheel_radius, 2e-4))
    assert found.std == pytest.approx(0.008 * vehicle.wheel_radius, rel=0.2)
    assert all("above the rolling radius" in f.what and f.doubt for f in findings)
    for share in (0.99, 1.002):  # a loaded radius is below the rolling one
        stated = Given(share * vehicle.wheel_radius, 2e-4)
        assert radius_contradiction(data, stated) == (stated, ())
    high = changed(known(vehicle, wheel_radius=0.0002), wheel_radius=1.008 * vehicle.wheel_radius)
    with pytest.raises(ResultError, match="interval contains zero"):
        STEP.estimate(SPEC, InertiaData(data), high)


def test_rolling_resistance_may_be_unknown(car: tuple[Vehicle, tuple[Log, ...]]) -> None:
    vehicle, data = car
    bare = Parameters({n: e for n, e in known(vehicle).items() if n != "rolling_resistance"})
    result = STEP.estimate(SPEC, InertiaData(data), bare)
    low, high = result.parameters["wheel_inertia"].interval95
    assert low < vehicle.wheel_inertia < high
    assert any(finding.where == "rolling_resistance" for finding in result.findings)


def test_an_effect_can_be_added_and_is_found() -> None:
    vehicle = random_vehicle(9)
    data = logs(vehicle, 9, {"bearing_drag": 0.4})

    @effect(on="bearing", unknowns=(Quantity("bearing_drag", "N m s/rad", "drag", "", -5, 5),), reference="a test")
    def bearing_drag(bearing: Law, s: Signals, q: Signals) -> Number:
        """Drag that grows with speed."""
        return bearing(s) + q.bearing_drag * s.wheel_speed

    values = plant.known(vehicle)
    runs = tuple(drive_windows(log, 0.25, values) for log in data)
    unknown = Unknown("bearing_drag", 0.0, -5.0, 5.0)
    solution = solve(
        MomentBalance(runs, values, 3.3).regression(vehicle.wheel_inertia, AddedEffects((bearing_drag,), (unknown,)))
    )
    assert solution.values["bearing_drag"] == pytest.approx(0.4, abs=4 * solution.std["bearing_drag"])
    assert solution.std["bearing_drag"] < 0.1
    assert solution.values["wheel_inertia"] == pytest.approx(vehicle.wheel_inertia, rel=0.02)


def pendulum_spec(vehicle: Vehicle, **more: object) -> InertiaSpec:
    rig = {n: f"{v} +- {0.0005 * v}" for n, v in hung.known(vehicle).items()}
    period = hung.period(hung.rig(vehicle), vehicle.wheel_inertia, 0.1)
    stated = {
        "kind": "compound",
        **rig,
        "gravity": hung.GRAVITY,
        "amplitude": "0.1 rad",
        "period": f"{period} +- 1e-4 s",
    }
    return InertiaSpec.model_validate({"test": "inertia", "settings": SETTINGS, "pendulum": {**stated, **more}})


def test_road_and_pendulum_that_agree_are_weighted(car: tuple[Vehicle, tuple[Log, ...]]) -> None:
    vehicle, data = car
    doubts = {"wheel_mass": 0.1, "wheel_radius": 0.0005}
    result = STEP.estimate(pendulum_spec(vehicle), InertiaData(data), known(vehicle, **doubts))
    estimate, road, swing = result.parameters["wheel_inertia"], result.extra["road"], result.extra["pendulum"]
    assert estimate.value == pytest.approx(vehicle.wheel_inertia, rel=0.005)
    assert estimate.std < min(road["std"], swing["std"])
    weight = road["std"] ** -2 / (road["std"] ** -2 + swing["std"] ** -2)
    assert estimate.value == pytest.approx(weight * road["wheel_inertia"] + (1 - weight) * swing["wheel_inertia"])
    assert "pendulum agree" in result.sentence


def test_where_they_disagree_the_pendulum_stands_and_the_gap_is_explained(
    car: tuple[Vehicle, tuple[Log, ...]],
) -> None:
    vehicle, data = car
    wrong = changed(known(vehicle, wheel_mass=0.2, wheel_radius=0.0002), wheel_mass=vehicle.wheel_mass - 6.0)
    result = STEP.estimate(pendulum_spec(vehicle), InertiaData(data), wrong)
    assert result.parameters["wheel_inertia"].value == result.extra["pendulum"]["wheel_inertia"]
    assert result.extra["road_less_pendulum_in_std"] > 5
    assert "5.9 kg of wheel mass would explain the difference" in result.sentence


def test_a_road_without_stated_doubts_does_not_outvote_the_pendulum(car: tuple[Vehicle, tuple[Log, ...]]) -> None:
    vehicle, data = car
    result = STEP.estimate(pendulum_spec(vehicle), InertiaData(data), known(vehicle))
    assert result.parameters["wheel_inertia"].value == result.extra["pendulum"]["wheel_inertia"]
    assert "no standard deviation" in result.sentence


def test_a_stopwatch_serves(car: tuple[Vehicle, tuple[Log, ...]]) -> None:
    vehicle, _ = car
    period = hung.period(hung.rig(vehicle), vehicle.wheel_inertia, 0.1)
    readings = [f"{20 * period + late} s" for late in (-0.06, 0.02, 0.05, -0.03, 0.02)]
    spec = pendulum_spec(vehicle, period=None, timing={"count": 20, "durations": readings})
    estimate = STEP.estimate(spec, InertiaData(()), Parameters()).parameters["wheel_inertia"]
    assert estimate.value == pytest.approx(vehicle.wheel_inertia, rel=0.01)
    assert estimate.interval95[0] < vehicle.wheel_inertia < estimate.interval95[1]
    alone = pendulum_spec(vehicle, period=None, timing={"count": 20, "durations": readings[:1]})
    result = STEP.estimate(alone, InertiaData(()), Parameters())
    assert result.parameters["wheel_inertia"].std > 2 * estimate.std
    assert any("stopwatch by hand" in finding.what for finding in result.findings)


def test_the_sample_logs_give_the_truth(root: Path) -> None:
    for name in ("inertia", "inertia_pendulum"):
        inputs = gather(STEP, root / "configs" / f"{name}.yaml")
        result = STEP.estimate(inputs.spec, inputs.data, inputs.known)
        low, high = result.parameters["wheel_inertia"].interval95
        assert low < 1.25 < high
        assert high - low < 0.005


@pytest.mark.parametrize(
    ("pendulum", "message"),
    [
        ({"kind": "compound", "mass": "20 kg", "period": "1.4 s"}, "needs 'pivot_distance'"),
        ({"kind": "torsional", "period": "1.4 s"}, "'torsional_stiffness' and 'calibration'"),
        ({"kind": "bifilar", "mass": 20, "separation": 0.4, "length": 2}, "'period', 'timing' and 'log'"),
        ({"kind": "bifilar", "log": "x.csv"}, "'mass', 'separation', 'length', 'channels'"),
        ({"kind": "trifilar"}, "compound"),
    ],
)
def test_an_incomplete_pendulum_is_explained(pendulum: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        InertiaSpec.model_validate({"test": "inertia", "pendulum": pendulum})


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_noisy_wheel_speed_is_not_taken_for_a_heavier_wheel(seed: int) -> None:
    """Beside the wheel's mass little tells the inertia but the tire's slip, which is no larger than this noise."""
    vehicle, rng = random_vehicle(seed), np.random.default_rng(seed)
    values, found = plant.known(vehicle), []
    for noise in (0.0, 0.1):
        data = [
            log.with_channels(wheel_speed=log["wheel_speed"] + noise * rng.standard_normal(log.time.size))
            for log in logs(vehicle, seed)
        ]
        runs = tuple(drive_windows(log, 0.25, values) for log in data)
        unknown = Unknown("wheel_mass_error", 0.0, -20.0, 20.0)
        balance = MomentBalance(runs, values, 3.3)
        found.append(solve(balance.regression(vehicle.wheel_inertia, AddedEffects((wheel_mass,), (unknown,)))))
    quiet, noisy = found
    for name, value in noisy.values.items():
        assert value == pytest.approx(quiet.values[name], abs=2.5 * noisy.std[name])


def test_each_drive_is_cut_once_for_the_result_and_once_for_the_diagnosis(
    car: tuple[Vehicle, tuple[Log, ...]], monkeypatch: pytest.MonkeyPatch
) -> None:
    vehicle, data = car
    cuts: list[str] = []
    monkeypatch.setattr(problem, "drive_windows", lambda log, *rest: cuts.append(log.name) or drive_windows(log, *rest))
    prepared = STEP.prepare(SPEC, InertiaData(data), known(vehicle))
    assert prepared.publish().parameters == prepared.publish().parameters
    for _ in range(2):
        prepared.regression()
    assert sorted(cuts) == sorted(2 * [log.name for log in data])


def test_a_wheel_speed_of_twice_the_true_one_is_refused_without_a_vehicle_speed() -> None:
    """Twice the pulses per turn halved the inertia without a word."""
    vehicle = random_vehicle(7)
    without = [replace(log, channels={n: log[n] for n in NAMES[:-1]}) for log in logs(vehicle, 7)]
    twice = tuple(log.with_channels(wheel_speed=2.0 * log["wheel_speed"]) for log in without)
    with pytest.raises(ResultError, match=r"changes 2(\.\d+)? times as fast as the acceleration states in all 3 runs"):
        STEP.estimate(SPEC, InertiaData(twice), known(vehicle))
    assert contradicted_wheel_speed(without, vehicle.wheel_radius) == ()
    assert contradicted_wheel_speed(without, 2.0 * vehicle.wheel_radius) == ()  # a diameter: a candidate effect
