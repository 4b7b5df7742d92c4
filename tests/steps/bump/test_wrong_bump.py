"""Bump logs and descriptions that are wrong: refused, or used with a finding."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.effects.recovered import given as stated
from tests.plant import bump as plant
from tests.plant.obstacle import Bump
from tests.plant.vehicle import GRAVITY
from tests.steps.bump.test_bump import LOGS, SEED, SPEC, VEHICLE, changed, described, known, logs, missed, run, spec
from vdyn_cli.physics.laws.road import Hump
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.bump.known_car import known_car
from vdyn_cli.steps.bump.measured_profile import BumpData
from vdyn_cli.steps.bump.policy import BUMP_POLICY
from vdyn_cli.steps.bump.rolling_path import rolling_path
from vdyn_cli.steps.bump.spec import BumpSpec
from vdyn_cli.steps.bump.step import STEP


def scaled(name: str, factor: float, offset: float = 0.0) -> Callable[[Log], Log]:
    return lambda log: log.with_channels(**{name: log[name] * factor + offset})


def swapped(log: Log) -> Log:
    return log.with_channels(front_load=log["rear_load"], rear_load=log["front_load"])


def thinner(log: Log) -> Log:
    return Log(log.name, log.time[::10], {n: log[n][::10] for n in log.channels})


WRONG = {
    "upside-down load": (scaled("front_load", -1), "negative axle load", "sign: -1"),
    "load in kN": (scaled("rear_load", 1e-3), "not the axle's load at rest", "kN"),
    "one wheel's load": (scaled("front_load", 0.5), "not the axle's load at rest", "load of one wheel"),
    "load without weight": (scaled("front_load", 1, -VEHICLE.front_load), "load at rest", "zero the sensor without"),
    "axles swapped": (swapped, "rear axle meets the bump before", "swap"),
    "acceleration down": (scaled("vertical_acceleration", -1), "opposite sign to the loads", "sign: -1"),
    "acceleration in g": (scaled("vertical_acceleration", 1 / GRAVITY), "times that of a typical car", "unit g"),
    "nose-down pitch rate": (scaled("pitch_rate", -1), "positive nose-up", "sign: -1"),
    "pitch rate in degrees": (scaled("pitch_rate", 57.3), "times that of a typical car", "deg/s"),
    "dead channel": (scaled("pitch_rate", 0), "never changes", "leave the channel out"),
    "speed in km/h": (scaled("speed", 3.6), "after the front axle", "km/h"),
    "speed taken for km/h": (scaled("speed", 1 / 3.6), "after the front axle", "km/h"),
    "standing": (scaled("speed", 0), "almost at rest", "unit"),
    "reversing": (scaled("speed", -1), "reverses", "sign: -1"),
    "no speed": (scaled("speed", np.nan), "no reading", ""),
    "no bump": (lambda log: log.between(0.0, 0.4), "shows no bump", "time window"),
    "too slow": (thinner, "sampled too slowly", "500"),
    "too short": (lambda log: log.between(0.0, 0.05), "fewer than 50 samples", ""),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_with_a_log_is_said_for_every_run(name: str) -> None:
    change, what, remedy = WRONG[name]
    with pytest.raises(InputError, match=what) as caught:
        run(changed(change))
    assert remedy in str(caught.value)
    assert {f.where.split(",")[0] for f in caught.value.findings} == {log.name for log in LOGS}


def test_a_bump_of_another_size_is_noticed() -> None:
    with pytest.raises(InputError, match="times as much as for a typical car"):
        run(how=spec(bump={"height": 0.007, "width": 0.48}))


def test_gravity_in_the_acceleration_is_taken_off() -> None:
    result = run(changed(scaled("vertical_acceleration", 1, GRAVITY)))
    assert any("at rest: gravity, which is subtracted" in f.what for f in result.findings)
    assert not missed(result)


def test_a_run_in_the_air_is_left_out_and_a_campaign_in_the_air_refused() -> None:
    log, crossing = LOGS[0], plant.runs(SEED)[0]
    late = log.time - (crossing.distance + VEHICLE.wheelbase) / crossing.speed
    hanging = log.with_channels(rear_load=np.where((late > 0.3) & (late < 0.85), 3.0, log["rear_load"]))
    result = run((hanging, *LOGS[1:]))
    assert len(result.fit.runs) == 3
    assert any("off the road" in f.what for f in result.findings)
    with pytest.raises(InputError, match="off the road"):
        run(logs(bump=Bump(0.4, 0.5)), spec(bump={"height": 0.4, "width": 0.5}))


def test_distances_that_contradict_the_wheelbase_are_refused() -> None:
    with pytest.raises(InputError, match="is not the wheelbase"):
        run(how=spec(runs={"distance_front": 3.0, "distance_rear": 5.0}))


def test_what_is_missing_or_contradicts_itself_is_said() -> None:
    with pytest.raises(InputError) as caught:
        STEP.estimate(SPEC, BumpData(LOGS), Parameters())
    for name in ("mass", "wheelbase", "cg_to_front", "pitch_inertia", "unsprung_mass_front", "unsprung_mass_rear"):
        assert name in str(caught.value)
    two = known().updated(stated({"mass": VEHICLE.mass + 100.0}))
    with pytest.raises(InputError, match="contradict each other"):
        run(given=two)
    with pytest.raises(InputError, match="no crossing"):
        run(())
    with pytest.raises(InputError, match="wheel_mass"):
        run(how=spec(load_sensor="hub"))


@pytest.mark.parametrize(
    ("bump", "says"),
    [
        ({}, "needs 'height' and 'width'"),
        ({"height": 0.07}, "needs 'height' and 'width'"),
        ({"profile": "x.csv"}, "belong together"),
        ({"shape": "profile", "height": 0.07, "width": 0.4}, "belong together"),
        ({"shape": "profile", "profile": "x.csv", "height": 0.07}, "its own size"),
        ({"shape": "profile", "profile": "nowhere.csv"}, "nowhere.csv"),
        ({"height": "70 kg", "width": 0.4}, "not a unit of length"),
        ({"height": 70, "width": 0.4}, "physical"),
    ],
)
def test_a_bump_that_cannot_be_is_refused(bump: dict[str, object], says: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        gather(STEP, described(tmp_path, bump=bump))
    assert says in str(caught.value)


def test_a_flat_profile_is_refused(tmp_path: Path) -> None:
    (tmp_path / "bump.csv").write_text("distance [m],height [m]\n0,0\n0.1,0\n0.2,0.0001\n", encoding="utf-8")
    with pytest.raises(InputError, match="not the profile of a bump"):
        gather(STEP, described(tmp_path, bump={"shape": "profile", "profile": "bump.csv"}))


def test_loads_that_a_rolling_circle_may_explain_are_doubted() -> None:
    path = rolling_path(SPEC, BumpData(LOGS), known())
    # On a slope u' a circle is about R u'^2 / 2 above the road under its center: at most 33 mm here, less as it bends.
    assert 0.020 < path.gap < 0.5 * 0.31 * (np.pi * 0.07 / 0.48) ** 2
    (doubt,) = path.doubts(stiffness=400e3, residual=333.0)
    assert doubt.doubt
    assert "a circle of 0.310 m (usual) is up to 26 mm" in doubt.got
    assert "state wheel_radius, or push the car slowly" in doubt.remedy
    assert not path.doubts(stiffness=400e3, residual=50.0)


def test_the_path_over_a_profile_is_that_over_the_bump_that_it_describes() -> None:
    along = np.linspace(0.0, 0.48, 241)
    profile = tuple(zip(along.tolist(), (0.07 * np.sin(np.pi * along / 0.48) ** 2).tolist(), strict=True))
    hump, lines = (rolling_path(SPEC, BumpData(LOGS, points), known()).shape for points in (None, profile))
    assert isinstance(hump, Hump)
    assert not isinstance(lines, Hump)
    for x, height in lines:
        assert 0.07 * hump(x / 0.48) == pytest.approx(height, abs=1e-4)
    assert max(height for _, height in lines) == pytest.approx(0.07, abs=1e-4)


def test_an_accelerometer_whose_place_is_not_stated_is_uncertain() -> None:
    column = {"vertical_acceleration": {"column": "az", "unit": "m/s^2"}}
    logged = BumpSpec.model_validate({"test": "bump", "bump": {"height": 0.07, "width": 0.48}, "channels": column})
    assert known_car(logged, known())[0].std["antenna_offset"] == BUMP_POLICY.bump_accelerometer
    assert "antenna_offset" not in known_car(SPEC, known())[0].std
