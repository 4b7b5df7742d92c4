"""``vdyn plan``: its expected accuracy is that of simulated days, and it reports what it cannot plan."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from tests.bench import cases
from tests.conftest import ROOT
from tests.plant import cg, wheel
from tests.plant.vehicle import random_vehicle
from vdyn_cli.commands.run_plan import plan_lines
from vdyn_cli.project.execute import execute
from vdyn_cli.project.planned.day_plan import plan
from vdyn_cli.project.planned.planned_inputs import planned_test
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.plan_schema import PlanDocument
from vdyn_cli.steps import load_step, names, published
from vdyn_cli.steps.failure import Failure

DAYS = 12  # of the plant: the mean of their squared standard errors is known to a tenth
CAR: dict[str, Any] = {"mass": 1430, "rotating_mass": 60, "air_density": 1.2, "frontal_area": 2.1}
DESCRIPTIONS: dict[str, dict[str, Any]] = {
    "coastdown": {"vehicle": CAR},
    "cg": {"vehicle": {"mass": 1430, "wheelbase": 2.6, "antenna_height": 1.45}},
    "bump": {
        "vehicle": {
            **{"sprung_mass": 1280, "unsprung_mass_front": 80, "unsprung_mass_rear": 70, "wheelbase": 2.6},
            **{"cg_to_front": 1.2, "sprung_pitch_inertia": 1900},
        },
        "bump": {"height": "6 cm", "width": "45 cm"},
    },
    "inertia": {"vehicle": {"wheel_mass": 18, "wheel_radius": 0.31}},
    "tire": {"vehicle": {"wheel_radius": 0.31}},
    "shaft": {},
}


def _described(folder: Path, step: str, **more: Any) -> Path:
    path = folder / f"{step}.yaml"
    path.write_text(yaml.safe_dump({"test": step, **DESCRIPTIONS.get(step, {}), **more}), encoding="utf-8")
    return path


def _std(document: PlanDocument) -> dict[str, float]:
    return {p.name: p.std for p in document.parameters if p.std is not None}


def test_every_step_with_a_planned_day_has_a_description_here() -> None:
    assert {n for n in names() if load_step(n).planned is not None} == set(DESCRIPTIONS)


@pytest.mark.parametrize(
    "step", [pytest.param(n, marks=[pytest.mark.slow] if n in ("bump", "shaft") else []) for n in DESCRIPTIONS]
)
def test_a_planned_day_is_evaluated_as_a_measured_one(step: str, tmp_path: Path) -> None:
    planned = planned_test(load_step(step), _described(tmp_path, step), (), None)
    day, again = planned.day(1), planned.day(1)
    assert all(np.array_equal(a[n], b[n]) for a, b in zip(day.logs, again.logs, strict=True) for n in a.channels)
    result = published(day.step.prepare(day.spec, day.data, day.known))
    assert not isinstance(result, Failure)
    for name, estimate in result.parameters.items():
        if name in planned.at:
            assert abs(estimate.value - planned.at[name]) < 6 * estimate.std


@pytest.mark.slow
@pytest.mark.thorough
def test_the_expected_standard_error_is_that_of_days_of_the_plant(tmp_path: Path) -> None:
    """For a vehicle whose mass and radius are given, and whose inertia is a default of the plan."""
    vehicle = random_vehicle(8123)
    stated = []
    for seed in range(8300, 8300 + DAYS):
        folder = tmp_path / str(seed)
        folder.mkdir()
        made = cases.wheel_drives(vehicle, seed, folder)
        stated.append(execute("inertia", made, level=None).document["parameters"]["wheel_inertia"]["std"])
    (tmp_path / "planned").mkdir()
    load = vehicle.front_load / 2
    settings = {"torque_zero": wheel.WHEEL_TORQUE.zero, "force_zero": wheel.WHEEL_FORCE.zero}
    day = {"wheel_load": load, "carried_mass": wheel.SHARE * vehicle.mass}
    path = _described(tmp_path / "planned", "inertia", vehicle=wheel.known(vehicle), settings=settings, plan=day)
    achieved = float(np.sqrt(np.mean(np.square(stated))))
    assert _std(plan(path))["wheel_inertia"] == pytest.approx(achieved, rel=0.25)


@pytest.mark.slow
@pytest.mark.thorough  # 7 s
def test_more_runs_of_the_kind_that_is_logged_are_more_accurate(tmp_path: Path) -> None:
    """The effect of the scatter between runs decreases with the square root of their number."""
    path = cases.launches(random_vehicle(8124), 8124, tmp_path)
    now, later = plan(path), plan(path, runs=16)
    assert (now.basis, now.runs, later.runs) == ("logs", 4, 16)
    assert _std(later)["pitch_inertia"] == pytest.approx(_std(now)["pitch_inertia"] / 2, rel=0.01)
    assert set(_std(now)) >= set(cg.truth(random_vehicle(8124)))
    smallest, then = ({d.effect: d.amplitude for d in one.detectable} for one in (now, later))
    assert then["clock_offset"] == pytest.approx(smallest["clock_offset"] / 2, rel=0.1)


@pytest.mark.slow
def test_one_of_several_logged_coasts_detects_nothing(tmp_path: Path) -> None:
    one = plan(ROOT / "configs" / "coastdown.yaml", runs=1)
    assert one.detectable == []
    assert any("1 coast-down is too few for a diagnosis" in n.because for n in one.not_testable)
    assert any("1 of 8 runs are planned" in f.what for f in one.findings)


@pytest.mark.slow
def test_a_torque_by_motor_current_holds_the_error_of_its_constant(tmp_path: Path) -> None:
    """One percent of a torque that mostly drives the car is as large as most of the torque that spins up its wheel."""
    names = ("hub_torque", "wheel_speed", "hub_force_x", "hub_force_z", "acceleration")
    logged = {n: {"column": n, "unit": u} for n, u in zip(names, ("N m", "rad/s", "N", "N", "m/s^2"), strict=True)}
    logged = {"time": {"column": "t", "unit": "s"}, **logged}
    by_current = {n: c for n, c in logged.items() if n != "hub_torque"}
    by_current["motor_current"] = {"column": "I", "unit": "A"}
    vehicle = {"wheel_mass": 18, "wheel_radius": 0.31, "torque_constant": "0.6 +- 0.006 N m/A", "gear_ratio": 9}
    std = [
        _std(plan(_described(tmp_path, "inertia", vehicle=vehicle, channels=channels)))["wheel_inertia"]
        for channels in (logged, by_current)
    ]
    assert std[1] > 10 * std[0]


def test_a_mapped_channel_that_no_day_has_is_named(tmp_path: Path) -> None:
    channels = {n: {"column": n, "unit": u} for n, u in (("time", "s"), ("speed", "m/s"), ("wind_speed", "m/s"))}
    test = planned_test(load_step("coastdown"), _described(tmp_path, "coastdown", channels=channels), (), 2)
    (note,) = test.day(0).findings
    assert note.where == "channel 'wind_speed'"
    assert {n for log in test.day(0).logs for n in log.channels} == {"speed"}


def test_planned_coasts_out_and_back_share_an_uneven_road(tmp_path: Path) -> None:
    channels = {"position": "m", "speed": "m/s", "grade": "1", "time": "s"}
    mapped = {n: {"column": n, "unit": u} for n, u in channels.items()}
    exact = {"position_noise": 0.0}
    path = _described(tmp_path, "coastdown", channels=mapped, plan=exact)
    out, back = planned_test(load_step("coastdown"), path, (), 2).day(0).logs
    assert np.std(out["grade"]) == pytest.approx(1e-3, rel=0.6)
    there = np.linspace(600.0, 900.0, 20)
    seen = np.interp(there, back["position"][::-1], back["grade"][::-1])
    assert np.allclose(np.interp(there, out["position"], out["grade"]), -seen, atol=1e-4)
    level = _described(tmp_path, "coastdown", channels=mapped, settings={"road": {"roughness": 0}})
    assert not np.any(planned_test(load_step("coastdown"), level, (), 2).day(0).logs[0]["grade"])


@pytest.mark.slow
@pytest.mark.thorough
def test_a_plan_of_coasts_says_what_to_add(tmp_path: Path) -> None:
    document = plan(_described(tmp_path, "coastdown", plan={"start_speed": "60 km/h", "end_speed": "30 km/h"}))
    wider = next(one for one in document.added if "to 7 km/h" in one.manoeuvre)
    assert wider.std["drag_area"] < 0.8 * _std(document)["drag_area"]
    assert {n.effect for n in document.not_testable} >= {"brake_drag", "extra_drag_area"}
    assert {a.name for a in document.assumed if a.stated} == {"start_speed", "end_speed"}
    text = "\n".join(plan_lines(document))
    assert all(part in text for part in ("Runs to add", "The plan assumes"))


@pytest.mark.parametrize(
    ("step", "more", "message"),
    [
        ("coastdown", {"plan": {"speed_nois": 1}}, "unknown key 'speed_nois' under plan"),
        ("coastdown", {"plan": {"rate": "10 kg"}}, "'plan.rate'"),
        ("coastdown", {"plan": {"gust": "50 m/s"}}, "lies outside 0 to 5 m/s"),
        ("coastdown", {"vehicle": {"mass": 1400}}, "air_density"),
        ("validate", {}, "cannot be planned without a log"),
        ("bump", {"manoeuvre": "drop", "bump": None}, "cannot be planned without a log"),
    ],
)
def test_what_cannot_be_planned_is_refused_with_the_reason(
    step: str, more: dict[str, Any], message: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError) as error:
        plan(_described(tmp_path, step, **more))
    assert any(message in str(f) and f.remedy for f in error.value.findings)


def test_logs_of_which_some_are_missing_are_named(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,v\n0,1\n", encoding="utf-8")
    runs = [{"log": "a.csv"}, {"log": "b.csv"}]
    with pytest.raises(InputError) as error:
        plan(_described(tmp_path, "coastdown", runs=runs))
    assert "1 of 2 logs do not exist: b.csv" in error.value.findings[0].what


@pytest.mark.parametrize("step", DESCRIPTIONS)
def test_the_smallest_setting_gives_a_day_or_says_why_not(step: str, tmp_path: Path) -> None:
    """A rate, duration or speed of zero caused a crash in four of six steps."""
    planned = load_step(step).planned
    assert planned is not None
    for quantity in (one.quantity for one in planned.settings if np.isfinite(one.quantity.lower)):
        path = _described(tmp_path, step, plan={quantity.name: float(quantity.lower)})
        with contextlib.suppress(InputError):
            logs = planned_test(load_step(step), path, (), 1).day(0).logs
            assert all(np.isfinite(v).all() for log in logs for v in log.channels.values())


def test_all_that_is_wrong_in_a_plan_comes_in_one_round(tmp_path: Path) -> None:
    wrong = {"drag_aera": 0.6, "start_speed": "100 kg", "end_speed": float("nan"), "rate": "fast"}
    with pytest.raises(InputError) as refused:
        planned_test(load_step("coastdown"), _described(tmp_path, "coastdown", plan=wrong), (), None)
    said = [str(f) for f in refused.value.findings]
    assert len(said) == len(wrong)
    for part in ("did you mean drag_area", "not a unit of speed (m/s)", "finite number", "'plan.rate'"):
        assert sum(part in one for one in said) == 1, said


def test_a_coast_that_ends_faster_than_it_begins_is_refused(tmp_path: Path) -> None:
    path = _described(tmp_path, "coastdown", plan={"start_speed": "20 km/h", "end_speed": "100 km/h"})
    with pytest.raises(InputError, match="end_speed below the start_speed"):
        planned_test(load_step("coastdown"), path, (), None).day(0)
