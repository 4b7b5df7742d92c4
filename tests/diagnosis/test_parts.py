"""The part of the model at fault is found, whatever its law, and the band of its curve covers the truth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.bench.hidden_logs import make
from tests.bench.other_laws import crossings
from tests.plant import bump, other_laws
from tests.plant.hidden import Scenario
from tests.plant.vehicle import random_vehicle
from vdyn_cli.inference.function_prior import best_evidence, spectrum
from vdyn_cli.project.execute import execute
from vdyn_cli.steps.free_part import Part, matches

SEED = 3


def damper(**changed: Any) -> Part:
    plain: dict[str, Any] = {
        "element": "damper", "place": "rear", "coordinate": "stroke_rate", "span": (-2.0, 2.0), "size": 500.0,
        "unit": "N", "coordinate_unit": "m/s", "what": "the rear damper's force", "over": "rate", "scale": 0.005,
    }  # fmt: skip
    return Part(**{**plain, **changed})


def test_an_addition_is_zero_at_rest_and_constant_beyond_its_span() -> None:
    basis = damper().basis(np.array([0.0, 2.0, 3.0]))
    assert np.allclose(basis[0], 0.0, atol=1e-12)
    assert np.array_equal(basis[1], basis[2])


def test_compressed_cosines_follow_dry_friction() -> None:
    part = damper()
    v = part.points(401)
    friction = np.tanh(v / 0.005)
    basis = part.basis(v)
    left = friction - basis @ np.linalg.lstsq(basis, friction, rcond=None)[0]
    assert np.sqrt(np.mean(left**2)) < 0.01


@pytest.mark.parametrize(("place", "at", "expected"), [
    ("", "_front", True), ("front", "_front", True), ("front", "_fl", True), ("rear", "_fl", False),
    ("left", "_rl", True), ("rear", "", False),
])  # fmt: skip
def test_a_place_holds_for_axles_and_corners(place: str, at: str, expected: bool) -> None:
    assert matches(place, at) == expected


def test_evidence_prefers_the_function_that_is_there_over_none() -> None:
    rng = np.random.default_rng(7)
    u, orders = np.linspace(0.0, 1.0, 400), np.arange(1.0, 15.0)
    basis = np.cos(np.pi * u[:, None] * orders)
    noise = rng.standard_normal(u.size)
    information = basis.T @ basis
    there = best_evidence(information, basis.T @ (noise + 2.0 * np.sin(5 * u)), orders, 1.0)
    absent = best_evidence(information, basis.T @ noise, orders, 1.0)
    assert there.gain > 50.0 > 4.5 > absent.gain
    assert np.isclose(spectrum(orders, 0.3).sum(), 1.0)


@pytest.mark.slow  # most of a minute of diagnosis
@pytest.mark.thorough
def test_a_force_over_speed_that_no_law_has_is_found_as_the_resistance(tmp_path: Path) -> None:
    logs = make(Scenario("coastdown", {"drag_bump": 60.0}, SEED, "wide"), tmp_path)
    diagnosis = execute("coastdown", logs.description).document["diagnosis"]
    part = diagnosis["part"]
    assert (part["element"], part["coordinate"], part["explains"]) == ("road_load", "speed", True)
    at = np.array([p["at"] for p in part["curve"]])
    added = np.array([p["value"] for p in part["curve"]]) - np.array(part["baseline"])
    assert 13.0 < at[np.argmax(added)] < 17.0
    assert "resistance to motion" in diagnosis["sentence"]


@pytest.mark.slow  # more than a minute of diagnosis each
@pytest.mark.thorough
@pytest.mark.parametrize("axles", [("rear",), ("front", "rear")])
def test_dry_friction_of_another_shape_is_found_in_its_damper(tmp_path: Path, axles: tuple[str, ...]) -> None:
    law = other_laws.friction_tanh(290.0)
    hidden = other_laws.Hidden({("damper", axle): law for axle in axles})
    vehicle = random_vehicle(SEED)
    document = execute("bump", crossings(vehicle, SEED, hidden, tmp_path)).document
    part = document["diagnosis"]["part"]
    assert part["element"] == ("damper" if len(axles) == 2 else "damper_rear")
    for axle in axles:
        points = [p for p in part["curve"] if p["place"] == axle]
        rate = np.array([p["at"] for p in points])
        true = getattr(vehicle, f"suspension_damping_{axle}") * rate + law(rate)
        low, high = np.array([p["interval95"] for p in points]).T
        assert np.mean((low <= true) & (true <= high)) >= 0.9
    if len(axles) == 2:
        assert document["diagnosis"]["verdict"] == "named"
        (cause,) = document["diagnosis"]["causes"]
        assert cause["effect"] == "suspension_friction"
        found = {**document["parameters"], "suspension_friction": cause["unknowns"]["suspension_friction"]}
        for name, truth in {**bump.truth(vehicle), "suspension_friction": 290.0}.items():
            low, high = found[name]["interval95"]
            assert low <= truth <= high
            assert found[name]["value"] == pytest.approx(truth, rel=0.01)


@pytest.mark.slow  # half a minute of diagnosis
@pytest.mark.thorough
def test_asymmetric_dampers_are_named_where_front_and_rear_differ(tmp_path: Path) -> None:
    """The same 600 N s/m more in rebound at both axles, whose dampers differ by two thirds."""
    law = other_laws.asymmetry(600.0)
    hidden = other_laws.Hidden({("damper", axle): law for axle in ("front", "rear")})
    diagnosis = execute("bump", crossings(random_vehicle(34), 34, hidden, tmp_path)).document["diagnosis"]
    assert (diagnosis["verdict"], diagnosis["part"]["element"]) == ("named", "damper")
    assert [c["effect"] for c in diagnosis["causes"]] == ["asymmetric_damping"]


@pytest.mark.slow  # half a minute of diagnosis
@pytest.mark.thorough
def test_struts_of_different_friction_are_one_effect_and_leave_the_springs_known(tmp_path: Path) -> None:
    laws = {("damper", "front"): other_laws.friction_tanh(160.0), ("damper", "rear"): other_laws.friction_tanh(90.0)}
    vehicle = random_vehicle(SEED)
    document = execute("bump", crossings(vehicle, SEED, other_laws.Hidden(laws), tmp_path)).document
    (cause,) = document["diagnosis"]["causes"]
    assert cause["effect"] == "suspension_friction"
    assert cause["unknowns"]["suspension_friction"]["value"] == pytest.approx(125.0, rel=0.03)
    assert cause["unknowns"]["suspension_friction_balance"]["value"] == pytest.approx(0.28, abs=0.03)
    for name, truth in bump.truth(vehicle).items():
        assert document["parameters"][name]["value"] == pytest.approx(truth, rel=0.02)
        low, high = document["parameters"][name]["interval95"]
        assert low <= truth <= high < 1.15 * truth


@pytest.mark.slow
@pytest.mark.thorough
def test_two_laws_of_the_dampers_are_named_where_neither_suffices(tmp_path: Path) -> None:
    """Dampers of other rates in rebound and compression, which fall beyond a knee."""

    def law(v: np.ndarray) -> np.ndarray:
        return np.asarray(other_laws.asymmetry(900.0)(v) + other_laws.knee(0.25, -1500.0)(v))

    vehicle = random_vehicle(SEED)
    hidden = other_laws.Hidden({("damper", axle): law for axle in ("front", "rear")})
    document = execute("bump", crossings(vehicle, SEED, hidden, tmp_path)).document
    assert document["diagnosis"]["verdict"] == "named"
    assert {c["effect"] for c in document["diagnosis"]["causes"]} == {"asymmetric_damping", "degressive_damping"}
    for name in ("suspension_stiffness_front", "suspension_stiffness_rear", "tire_vertical_stiffness"):
        assert document["parameters"][name]["value"] == pytest.approx(bump.truth(vehicle)[name], rel=0.05)
