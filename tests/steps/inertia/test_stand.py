"""A wheel spun up and down on a stand: inertia and bearing drag without hub forces."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.bench.input_cases import SPIN_CHANNELS
from tests.effects.recovered import added
from tests.plant import stand as plant
from tests.plant.vehicle import random_vehicle
from vdyn_cli.effects import candidates, catalog
from vdyn_cli.effects.hub_torque_gain import hub_torque_gain
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.physics.models.free_wheel import FREE_WHEEL
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.inertia.spec import InertiaSpec
from vdyn_cli.steps.inertia.stand_problem import prepare_stand
from vdyn_cli.steps.inertia.step import ON_STAND, STEP

SEED = 3
CAR = random_vehicle(SEED)
ZERO = {"torque_zero": "0.3 N m"}


def logs(effects: Mapping[str, float] | None = None, duration: float = 40.0) -> tuple[Log, ...]:
    records = plant.campaign(CAR, SEED, effects, 2, duration)
    return tuple(
        Log(f"spin_{k}.csv", r["Time [s]"], {"hub_torque": r["Torque [N m]"], "wheel_speed": r["Wheel Speed [rad/s]"]})
        for k, r in enumerate(records)
    )


def spec(**settings: Any) -> InertiaSpec:
    return InertiaSpec.model_validate({"test": "inertia", "manoeuvre": "stand", "settings": {**ZERO, **settings}})


def estimated(data: tuple[Log, ...], **settings: Any) -> Result:
    return ON_STAND.estimate(spec(**settings), data, Parameters())


def test_inertia_and_drag_are_recovered_within_their_intervals() -> None:
    result = estimated(logs())
    for name, value in plant.truth(CAR, SEED).items():
        estimate = result.parameters[name]
        assert abs(estimate.value - value) < 4 * estimate.std, name
    # Beside the half percent of a torque sensor's gain.
    assert result.parameters["wheel_inertia"].std < 0.0054 * CAR.wheel_inertia
    assert not result.fit.warnings
    assert result.fit.rms == pytest.approx(result.fit.noise_floor, rel=0.2)


def test_the_noise_of_a_coarse_encoder_does_not_hide_that_the_wheel_turns() -> None:
    def counted(log: Log) -> Log:
        turned = np.concatenate([[0.0], np.cumsum(np.diff(log.time) * log["wheel_speed"][1:])])
        count = np.floor(turned / (2 * np.pi) * 90)  # teeth counted from sample to sample: steps of 7 rad/s
        speed = np.diff(count, prepend=count[0]) * (2 * np.pi / 90) / np.median(np.diff(log.time))
        return log.with_channels(wheel_speed=speed)

    found = estimated(tuple(counted(log) for log in logs())).parameters["wheel_inertia"]
    assert abs(found.value - CAR.wheel_inertia) < min(4 * found.std, 0.05 * CAR.wheel_inertia)


def test_what_turns_beside_the_wheel_is_taken_off_with_its_uncertainty() -> None:
    data = logs()
    whole, wheel = estimated(data), estimated(data, stand_inertia="0.1 +- 0.02 kg m^2")
    found = wheel.parameters["wheel_inertia"]
    assert found.value == pytest.approx(whole.parameters["wheel_inertia"].value - 0.1)
    assert found.std == pytest.approx(np.hypot(whole.parameters["wheel_inertia"].std, 0.02))
    assert any("includes the rotor and shaft" in f.what for f in whole.findings)
    assert not any("includes the rotor and shaft" in f.what for f in wheel.findings)


def test_the_gain_of_the_torque_is_a_scale_of_the_inertia() -> None:
    found = estimated(logs(), gain_std=0.01).parameters["wheel_inertia"]
    assert found.std == pytest.approx(0.01 * found.value, rel=0.02)


def test_the_sentence_states_what_a_stand_cannot_tell() -> None:
    """A torque constant 5 % off, a speed read twice as large and a zero of 0.9 N m were published without a word."""
    one_way = logs()
    said = estimated(one_way, stand_inertia="0.1 kg m^2")
    whole = said.parameters["wheel_inertia"].value + 0.1
    assert f"(pulses per turn) changes it by {0.01 * whole:.3f} kg m^2" in said.sentence
    assert "includes the zero of the torque, assumed as 0 +- 0.3 N m" in said.sentence
    turned = {n: -values for n, values in one_way[1].channels.items()}
    assert "includes the zero" not in estimated((one_way[0], one_way[1].with_channels(**turned))).sentence


def test_a_drag_below_the_zero_of_the_torque_is_said_to_be_open() -> None:
    """A bearing of 0.12 +- 4.5 N m was published without a word."""
    found = estimated(logs(), torque_zero="20 N m")
    said = [f for f in found.findings if f.where == "bearing_torque"]
    assert ("bearing_torque" in found.withheld, "bearing_torque" in found.parameters) == (True, False)
    assert [(f.doubt, "torque_zero" in f.remedy) for f in said] == [(True, True)]
    assert not [f for f in estimated(logs()).findings if f.where == "bearing_torque"]


def test_the_description_chooses_the_stand(tmp_path: Path) -> None:
    from tests.bench.cases import write

    channels = {**SPIN_CHANNELS, "hub_torque": ("Torque [N m]", "N m")}
    path = write(tmp_path, "inertia", {}, channels, plant.campaign(CAR, SEED, None, 1, 20.0), manoeuvre="stand")
    assert gather(STEP, path).step is ON_STAND


def test_a_torque_of_the_wrong_sign_is_named() -> None:
    data = tuple(log.with_channels(hub_torque=-log["hub_torque"]) for log in logs())
    with pytest.raises(InputError, match="sign: -1"):
        estimated(data)


def test_a_wheel_that_only_runs_down_does_not_determine_its_inertia() -> None:
    time = np.arange(0.0, 30.0, 0.01)
    rng = np.random.default_rng(1)
    speed = 80.0 * np.exp(-time / 40.0) + 0.05 * rng.standard_normal(time.size)
    log = Log("down.csv", time, {"hub_torque": 0.3 * rng.standard_normal(time.size), "wheel_speed": speed})
    with pytest.raises(InputError, match="constant within its noise"):
        estimated((log,))


def test_a_pendulum_beside_the_stand_is_refused() -> None:
    rig = {"kind": "compound", "mass": 20, "pivot_distance": 0.2, "period": "1.2 s"}
    both = InertiaSpec.model_validate({"test": "inertia", "manoeuvre": "stand", "pendulum": rig})
    with pytest.raises(InputError, match="two tests"):
        ON_STAND.prepare(both, logs(), Parameters())


def test_a_drifting_zero_of_the_torque_is_fitted() -> None:
    drifting = tuple(log.with_channels(hub_torque=log["hub_torque"] + 0.05 * log.time) for log in logs())
    drift = tuple(e for e in catalog() if e.name == "torque_zero_drift")
    result = prepare_stand(spec(), drifting, Parameters()).publish(added(*drift))
    found = result.amplitudes["torque_zero_drift"]
    assert found.value == pytest.approx(0.05, abs=4 * found.std)
    assert found.std < 0.01
    assert drift[0] in applicable(FREE_WHEEL, candidates(ON_STAND.situations))


def test_a_reading_times_minus_one_is_no_part_of_the_stand() -> None:
    """A free error over the torque's value takes all torque away, and with it inertia and drag: no residual is left."""
    assert [part.element for part in prepare_stand(spec(), logs(), Parameters()).parts] == ["bearing"]


def test_air_about_the_wheel_is_no_drag_of_its_bearing() -> None:
    windy = logs({"air": 3e-4})
    windage = tuple(e for e in catalog() if e.name == "wheel_windage")
    result = prepare_stand(spec(), windy, Parameters()).publish(added(*windage))
    assert result.amplitudes["wheel_windage"].value == pytest.approx(3e-4, rel=0.2)
    for name, value in plant.truth(CAR, SEED).items():
        low, high = result.parameters[name].interval95
        assert low < value < high, name


def test_a_gain_of_the_torque_leaves_the_residual_of_a_free_wheel_as_it_is() -> None:
    """Torque, inertia and drag scaled alike change no measurement; a smaller residual made the gain the first cause."""
    regression = prepare_stand(spec(), logs(), Parameters()).regression(added(hub_torque_gain))
    names = [u.name for u in regression.unknowns]
    at = dict(zip(names, [1.2, 0.8, 0.01, 0.0, 0.0], strict=True))
    scaled = {n: v / 1.1 for n, v in at.items()} | {"hub_torque_gain": 0.1}
    first, second = (regression.rows(0, np.array([x[n] for n in names])).residual for x in (at, scaled))
    assert np.allclose(first, second, rtol=1e-9, atol=1e-9)
