"""Steps select effects by tags: the table of candidates, and no name of one outside its room."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from vdyn_cli import steps
from vdyn_cli.effects import PROPERTIES, SITUATIONS, candidates, catalog
from vdyn_cli.quantities.vocabulary import CHANNELS, PARAMETERS
from vdyn_cli.steps import Step

PACKAGE = Path(__file__).resolve().parents[2] / "vdyn_cli"

CANDIDATES = {
    "bump": """
        asymmetric_damping bump_height_error bump_stop bump_trapezoid bump_width_error clock_offset degressive_damping
        front_load_gain logger_filter pitch_inertia_error progressive_spring rear_load_delay rear_load_gain
        rear_tire_stiffness speed_error suspension_friction tire_damping tire_enveloping unsprung_mass_front_error
        unsprung_mass_rear_error wheel_circle
    """,
    "cg": """
        acceleration_delay acceleration_lag accelerometer_gain accelerometer_offset accelerometer_tilt aero_lift
        clock_offset load_crosstalk pitch_rate_gain road_grade unsprung_mass wheel_force_gain
    """,
    "coastdown": """
        accelerometer_gain accelerometer_offset accelerometer_tilt brake_drag brake_drag_fading changed_car
        driveline_drag extra_drag_area grade_profile headwind mass_error road_grade rotating_mass
        speed_delay speed_dependent_rolling speed_scale temperature_rolling tire_warmup torque_delay
        torque_gain torque_lag torque_offset wheel_radius
    """,
    "inertia": """
        bearing_drag bearing_warmup brake_drag brake_drag_fading clock_offset hub_torque_crosstalk hub_torque_delay
        hub_torque_gain hub_torque_lag hub_torque_offset torque_zero_drift wheel_mass wheel_radius wheel_windage
    """,
    "shaft": """
        backlash inertia_before_shaft series_compliance shaft_friction torque_zero_drift
    """,
    "tire": """
        braking_friction force_offset friction_drift friction_fade ground_speed_delay load_offset load_sensitivity
        rolling_force rolling_radius_growth slip_lag slip_offset tire_relaxation tread_wear vertical_crosstalk
    """,
    "validate": """
        acceleration_delay accelerometer_offset accelerometer_slope accelerometer_tilt backlash brake_drag
        brake_drag_fading changed_load driveline_drag driveline_dry_loss driveline_loss driveline_viscous
        driven_wheel_slip engine_inertia extra_drag_area grade_offset grade_profile headwind mass_error
        motor_inertia overrun_gain payload road_grade rolling_error rotating_mass run_warmup shaft_damping
        shaft_stiffness shaft_torque_delay slip_stiffness speed_delay speed_dependent_rolling speed_filter
        speed_scale temperature_rolling tire_relaxation tire_warmup torque_delay torque_drift torque_gain torque_lag
        torque_offset wheel_inertia wheel_radius wheel_speed_delay
    """,
}
NAMES = {effect.name for effect in catalog()}
# Names that parameters, channels, and constants or inputs of models have, too: a literal of these names those.
MODELS = {"accelerometer_slope", "shaft_damping", "shaft_stiffness", "speed_scale", "torque_gain"}
COLUMNS = {"headwind"}  # words that headers of logs have for a channel (project/drafting/channel_guess.py)
ALSO = set(PARAMETERS) | set(CHANNELS) | MODELS | COLUMNS


def strings(path: Path) -> Iterator[str]:
    """The string literals of a file but for its docstrings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    prose = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in prose:
            yield node.value


@pytest.mark.parametrize("step", CANDIDATES)
def test_each_step_selects_these_candidates(step: str) -> None:
    assert [e.name for e in candidates(steps.load_step(step).situations)] == CANDIDATES[step].split()


def _with_manoeuvres(name: str) -> list[Step]:
    step = steps.load_step(name)
    return [step, *step.manoeuvres.values()]


def test_every_situation_is_that_of_a_step_and_has_a_meaning() -> None:
    every = [one for name in CANDIDATES for one in _with_manoeuvres(name)]
    used = {tag for step in every for tag in step.situations}
    assert used == set(SITUATIONS)
    assert not PROPERTIES.keys() & SITUATIONS.keys()


def test_a_step_without_situations_takes_every_effect() -> None:
    assert candidates() == catalog()


def test_properties_are_tags() -> None:
    effects = {e.name: e for e in catalog()}
    assert {e.name for e in catalog() if "turns_with_heading" in e.tags} == {"headwind", "road_grade"}
    assert {e.name for e in catalog() if e.every_day} == {"headwind"}
    assert all(e.sensor and not e.faulty for e in catalog() if "latency" in e.tags)
    assert (effects["headwind"].lasts, effects["headwind"].sensor) == (False, False)
    assert (effects["torque_gain"].lasts, effects["torque_gain"].sensor) == (False, True)
    assert (effects["mass_error"].lasts, effects["mass_error"].kind) == (True, "within_run")
    assert effects["temperature_rolling"].kind == "between_run"


@pytest.mark.parametrize("room", ["steps", "diagnosis", "project", "report"])
def test_no_effect_is_named_outside_effects(room: str) -> None:
    found = {
        (str(path.relative_to(PACKAGE)), text)
        for path in (PACKAGE / room).rglob("*.py")
        for text in strings(path)
        if text in NAMES - ALSO
    }
    assert not found


def test_no_step_is_named_in_effects() -> None:
    named = {
        (path.name, text)
        for path in (PACKAGE / "effects").glob("*.py")
        for text in strings(path)
        if text in steps.names()
    }
    laws = {(f"{name}.py", "shaft") for name in ("backlash", "series_compliance", "shaft_friction")}
    assert named <= laws | {("braking_friction.py", "tire")}, "but for the laws of a shaft and a tire"
