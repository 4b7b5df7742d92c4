"""How strongly logs can show what is hidden: equivalences come out as zero, priors and noise as they should."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.bench.hidden_cases import CASES, Cell
from tests.bench.hidden_logs import make
from tests.plant import coast_information, drive_information, puzzle
from tests.plant.coast import DAY, WIDE
from tests.plant.hidden import VARIANTS, Evidence, Scenario
from tests.plant.information import prior, total
from tests.plant.vehicle import REFERENCE, random_vehicle

pytestmark = pytest.mark.slow  # whole diagnoses or recoveries


def test_every_row_is_about_a_variant_and_its_effects_are_known_to_the_plant() -> None:
    assert len({cell.name for cell in CASES}) == len(CASES)
    for cell in CASES:
        assert (cell.step, cell.variant) in VARIANTS
    # Coast-downs have their own tests.
    assert {cell.step for cell in CASES if cell.fast} >= {"cg", "bump", "inertia", "tire", "shaft"}


@pytest.mark.parametrize("step", ["coastdown", "cg", "bump", "inertia", "tire", "shaft", "validate"])
def test_every_step_has_its_controls(step: str) -> None:
    expected = {cell.expect for cell in CASES if cell.step == step}
    assert {"named", "unknown", "nothing", "fault"} <= expected
    assert expected & {"not_testable", "class", "both"}


@pytest.fixture(scope="module")
def free() -> Evidence:
    """Eight wide coasts, drag and rolling resistance both unknown, nothing hidden."""
    return Scenario("coastdown", {}, 1, "eight").evidence()


def test_what_scales_all_forces_looks_like_nothing_where_drag_is_estimated(free: Evidence) -> None:
    for effect in ("extra_drag_area", "mass_error", "rotating_mass", "speed_scale"):
        assert free.alone(effect) < 0.05
    assert free.alone("brake_drag") < 0.05  # it is rolling resistance
    assert free.alone("headwind") > 6


def test_what_scales_all_forces_looks_alike_where_drag_is_fixed() -> None:
    scenario = Scenario("coastdown", {"extra_drag_area": 0.05}, 1, "short")
    fixed = scenario.evidence()
    assert fixed.t()["extra_drag_area"] > 2
    assert fixed.rivals()["extra_drag_area"]["mass_error"] < 0.5
    own = coast_information.information(scenario.vehicle, 1, DAY, scenario.effects, tuple(scenario.effects))
    bound = own.known(["drag_area"]).bound()["extra_drag_area"]
    assert fixed.t()["extra_drag_area"] == pytest.approx(0.05 / bound, rel=1e-2)


def test_all_runs_one_way_hide_a_slope(free: Evidence) -> None:
    vehicle, day = random_vehicle(1), WIDE.but(one_way=True)
    one_way = coast_information.information(vehicle, 1, day, {}, ("road_grade",))
    guessed = 0.02
    assert total([one_way, prior({"road_grade": guessed})]).bound()["road_grade"] == pytest.approx(guessed, rel=1e-2)
    assert free.alone("road_grade") > 10


def test_a_torque_gain_is_a_wheel_radius_and_a_torque_zero_a_brake() -> None:
    powered = Scenario("coastdown", {}, 2, "powered").evidence()
    assert powered.alone("torque_gain") > 6
    assert powered.alone("torque_gain", ["wheel_radius"]) < 1.0
    assert powered.alone("torque_offset") < 0.5


def test_equivalences_at_the_wheel_and_in_the_loads() -> None:
    wheel = Scenario("inertia", {}, 1).evidence()
    assert wheel.alone("hub_torque_gain") > 10 > 1 > wheel.alone("hub_torque_gain", ["wheel_radius"])
    assert wheel.alone("brake_drag", ["hub_torque_offset"]) < 0.5
    loads = Scenario("cg", {}, 1).evidence()
    assert loads.alone("wheel_force_gain") < 1.0
    assert loads.alone("accelerometer_tilt", ["accelerometer_offset"]) < 0.2
    assert loads.alone("road_grade") > 2


def test_a_drawing_makes_compliance_visible() -> None:
    alone = Scenario("shaft", {}, 1).evidence().alone("series_compliance")
    drawn = Scenario("shaft", {}, 1, "drawn").evidence().alone("series_compliance")
    assert alone < 0.2
    assert drawn > 3


def test_a_prior_bounds_what_drives_tell_of_a_parameters_error() -> None:
    """The tester knows the mass to 0.3 %: an error of 3 % is at most ten standard deviations of that."""
    plans = puzzle.pedals(REFERENCE, levels=(2.6,))
    spread = {name: drive_information.SPREAD[name] for name in ("mass", "rolling_resistance")}
    info = drive_information.information(REFERENCE, 1, ("mass_error", "torque_gain"), spread, plans)
    assert np.all(np.linalg.eigvalsh(info.matrix / np.sqrt(np.outer(*[np.diag(info.matrix)] * 2))) > -1e-9)
    t = 0.03 / info.known(["torque_gain"]).bound()["mass_error"]
    assert 3 < t <= 10.0


def test_logs_of_a_scenario_come_again_and_a_fresh_day_is_another_one(tmp_path: Path) -> None:
    scenario = Scenario("tire", {"load_sensitivity": 2e-5}, 4)
    texts = []
    for k, one in enumerate((scenario, scenario, scenario.fresh())):
        folder = tmp_path / str(k)
        folder.mkdir()
        made = make(one, folder)
        assert made.truth == {"load_sensitivity": 2e-5}
        texts.append((folder / "tire_0.csv").read_bytes())
    assert texts[0] == texts[1] != texts[2]
    assert scenario.fresh().vehicle == scenario.vehicle


def test_a_stuck_sensor_holds_its_value(tmp_path: Path) -> None:
    make(Scenario("tire", {}, 4, fault="stuck"), tmp_path)
    force = [line.split(",")[3] for line in (tmp_path / "tire_0.csv").read_text().splitlines()[1:]]
    assert len(set(force[len(force) // 2 - 20 : len(force) // 2 + 20])) == 1


def test_cells_are_reported_by_name() -> None:
    assert Cell("tire", "", {"slip_offset": 0.01}, "named").name == "tire: slip_offset 0.01"
    assert Cell("coastdown", "wide", {}, "nothing").name == "coastdown (wide): nothing"
