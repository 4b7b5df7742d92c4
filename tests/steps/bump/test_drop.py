"""Drops of quarter and half cars: springs, dampers and tires from the heights of body and wheels alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.bench.input_cases import drops
from tests.effects.recovered import given
from tests.plant import drop as plant
from tests.plant.drop import Rig, random_rig
from vdyn_cli.effects import Law, Number, Quantity, Signals, candidates, effect
from vdyn_cli.effects.bump_stop import bump_stop
from vdyn_cli.effects.clock_offset import clock_offset
from vdyn_cli.effects.suspension_friction import suspension_friction
from vdyn_cli.engine.maths import fmax, fmin
from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.inference import Unknown
from vdyn_cli.physics.models.dropped_car import dropped_car
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.bump.drop_run import drop_run
from vdyn_cli.steps.bump.spec import BumpSpec
from vdyn_cli.steps.bump.step import DROP, STEP


@effect(on="damper", unknowns=Quantity("softening", "N s/m", "slope added beyond 0.1 m/s", "q"), reference="test")
def softening(damper: Law, s: Signals, q: Signals) -> Number:
    """Dampers with a knee."""
    return damper(s) + q.softening * (s.stroke_rate - fmin(fmax(s.stroke_rate, -0.1), 0.1))


def logs(rig: Rig, seed: int, count: int = 2, duration: float = 2.5) -> tuple[Log, ...]:
    names = [f"{what}_height_{end}" for what in ("body", "wheel") for end in rig.axles]
    found = []
    for k, record in enumerate(plant.campaign(rig, seed, count, duration)):
        time, *heights = record.values()
        found.append(Log(f"drop_{k}.csv", time, dict(zip(names, heights, strict=True))))
    return tuple(found)


def known(rig: Rig) -> Parameters:
    return given(rig.known())


def spec(rig: Rig, **drop: Any) -> BumpSpec:
    kind = "half_car" if len(rig.axles) == 2 else "quarter_car"
    return BumpSpec.model_validate({"test": "bump", "manoeuvre": "drop", "drop": {"rig": kind, **drop}})


def estimated(rig: Rig, data: tuple[Log, ...], **drop: Any) -> Result:
    return DROP.estimate(spec(rig, **drop), data, known(rig))


@pytest.mark.parametrize("axles", [1, 2])
def test_springs_dampers_and_tires_are_recovered(axles: int) -> None:
    rig = random_rig(3, axles)
    result = estimated(rig, logs(rig, 3))
    assert set(result.parameters) == set(rig.truth())
    for name, value in rig.truth().items():
        estimate = result.parameters[name]
        assert abs(estimate.value - value) < 4 * estimate.std, name
        assert estimate.std < 0.02 * value, name
    assert result.fit.rms == pytest.approx(result.fit.noise_floor, rel=0.1)


def test_wheels_that_move_before_the_release_do_not_start_the_drop() -> None:
    rig = random_rig(3)
    log = logs(rig, 3, 1)[0]
    release = drop_run(log, ("body_height_front", "wheel_height_front"), None).time[0]
    early = log["wheel_height_front"] + 0.002 * np.exp(-40 * (log.time - log.time[0]))
    moved = log.with_channels(wheel_height_front=early)
    assert drop_run(moved, ("body_height_front", "wheel_height_front"), None).time[0] == release > log.time[0]


def test_one_wheel_on_the_rig_gives_an_axle_of_twice_its_values() -> None:
    rig = random_rig(3)
    data = logs(rig, 3, 1)
    whole, half = estimated(rig, data), estimated(rig, data, wheels=1)
    for name, one in whole.parameters.items():
        assert half.parameters[name].value == pytest.approx(2 * one.value)
        assert half.parameters[name].std == pytest.approx(2 * one.std)
    assert half.sentence.startswith("One wheel on the rig")


def test_dry_friction_can_be_taken_into_the_model() -> None:
    rig = replace(random_rig(5), friction=60.0, damping=(200.0,))
    data = logs(rig, 5, 1, 2.0)
    plain = DROP.prepare(spec(rig), data, known(rig))
    free = Unknown("suspension_friction", 30.0, 0.0, 600.0, "N")
    extended = plain.publish(AddedEffects((suspension_friction,), (free,)))
    assert extended.amplitudes["suspension_friction"].value == pytest.approx(60.0, rel=0.25)
    assert extended.fit.rms < 0.5 * plain.publish().fit.rms
    assert suspension_friction in candidates(DROP.situations)


def test_wheel_heights_that_are_logged_late_are_a_clock_offset() -> None:
    rig, late = random_rig(3), 0.015
    data = tuple(
        log.with_channels(wheel_height_front=np.interp(log.time - late, log.time, log["wheel_height_front"]))
        for log in logs(rig, 3)
    )
    plain = DROP.prepare(spec(rig), data, known(rig))
    extended = plain.publish(AddedEffects((clock_offset,), (Unknown("clock_offset", 0.0, -0.2, 0.2, "s"),)))
    found = extended.amplitudes["clock_offset"]
    assert found.value == pytest.approx(late, abs=3 * found.std)
    assert found.std < 1e-3
    assert plain.publish().fit.rms > 1.1 * extended.fit.rms
    assert clock_offset in candidates(DROP.situations)


def test_a_law_that_softens_the_damper_is_fitted_from_the_plain_car() -> None:
    rig = replace(random_rig(3), damping=(1600.0,), knee=0.1, beyond=0.35)
    plain = DROP.prepare(spec(rig), logs(rig, 3), known(rig))
    extended = plain.publish(AddedEffects((softening,), (Unknown("softening", -1000.0, -3000.0, 3000.0, "N s/m"),)))
    assert extended.amplitudes["softening"].value == pytest.approx(-0.65 * 1600.0, rel=0.02)
    for name, value in rig.truth().items():
        assert extended.parameters[name].value == pytest.approx(value, rel=0.01), name


def test_a_quarter_car_has_no_balance_of_its_axles() -> None:
    def acceleration(balance: float) -> float:
        q = {"bump_stop": 1500.0, "bump_stop_gap": 0.01, "bump_stop_balance": balance}
        given_values = {"suspension_stiffness_front": 3e4, "suspension_damping_front": 1e3} | {
            "tire_vertical_stiffness": 3e5, "sprung_mass": 300.0, "unsprung_mass_front": 40.0
        }  # fmt: skip
        drive = Drive(np.arange(50) / 500.0, {"elapsed": np.arange(50) / 500.0}, {"heave": -0.05})
        simulator = Simulator(dropped_car(("front",)), given_values, tuple(q), (bump_stop,))
        return float(simulator(drive, np.array([*q.values()])).outputs["body_height_front"][-1])

    assert acceleration(0.8) == acceleration(0.0)


def test_the_release_is_found_or_stated() -> None:
    (log,) = logs(random_rig(3), 3, 1)
    channels = tuple(log.channels)
    found = drop_run(log, channels, None)
    assert plant.HELD <= found.time[0] < plant.HELD + 0.03
    assert drop_run(log, channels, 1.0).time[0] == pytest.approx(1.0, abs=0.01)
    moving = log.between(0.6, 3.0)
    assert drop_run(moving, channels, None).time[0] == moving.time[0]


def test_a_log_in_which_nothing_moves_is_refused() -> None:
    rig, rng = random_rig(3), np.random.default_rng(1)
    (log,) = logs(rig, 3, 1)
    still = log.with_channels(**{n: 1e-4 * rng.standard_normal(log.time.size) for n in log.channels})
    with pytest.raises(InputError, match="does not move"):
        estimated(rig, (still,))


def test_a_missing_height_and_a_missing_mass_are_named() -> None:
    rig = random_rig(3)
    (log,) = logs(rig, 3, 1)
    alone = Log(log.name, log.time, {"body_height_front": log["body_height_front"]})
    with pytest.raises(InputError, match="channel wheel_height_front is needed"):
        estimated(rig, (alone,))
    with pytest.raises(InputError, match="sprung_mass"):
        DROP.estimate(spec(rig), (log,), Parameters())


def test_the_description_chooses_drop_or_crossing(tmp_path: Path) -> None:
    rig = random_rig(3)
    assert gather(STEP, drops(rig, 3, tmp_path, count=1)).step is DROP
    (tmp_path / "bump.yaml").write_text("test: bump\n")
    with pytest.raises(InputError, match="'bump' is missing"):
        gather(STEP, tmp_path / "bump.yaml")
    (tmp_path / "bump.yaml").write_text("test: bump\nmanoeuvre: drop\nbump: {height: 0.07, width: 0.4}\n")
    with pytest.raises(InputError, match="a drop has no bump"):
        gather(STEP, tmp_path / "bump.yaml")
