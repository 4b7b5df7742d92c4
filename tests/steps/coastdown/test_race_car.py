"""Coasts of a light race car whose resistance has a term that the baseline lacks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from vdyn_cli.diagnosis.diagnose import diagnosed
from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps import Failure, published
from vdyn_cli.steps.coastdown.doubts.agreement import LocalForces
from vdyn_cli.steps.coastdown.spec import CoastdownSpec
from vdyn_cli.steps.coastdown.step import STEP

MASS, ROTATING, DENSITY = 640.0, 15.0, 1.2


def coasts(
    force: Callable[[float], float], drag_area: float, start: float, seed: int, effects: tuple[str, ...] = ()
) -> Result:
    """Eight coasts from a speed in m/s, simulated by Euler's method in steps of 10 ms, logged at 10 Hz."""
    rng = np.random.default_rng(seed)
    logs = []
    for k in range(8):
        wind, speed, trace = rng.normal(0.0, 0.1), start, []
        gust = 0.0
        while speed > 1.2:
            gust += 0.01 / 5.0 * -gust + 0.2 * np.sqrt(2 * 0.01 / 5.0) * rng.normal()
            flow = speed + wind + gust
            drag = 0.5 * DENSITY * drag_area * (flow * abs(flow) - speed**2)
            trace.append(speed)
            speed -= 0.01 * (force(speed) + drag) / (MASS + ROTATING)
        read = np.array(trace)[::10]
        logs.append(Log(f"run_{k}.csv", 0.1 * np.arange(read.size), {"speed": read + rng.normal(0, 0.02, read.size)}))
    runs = [{"log": log.name, "direction": ("out", "back")[k % 2]} for k, log in enumerate(logs)]
    window = {"speed_window": [start - 0.3, 1.4]}
    asked = {"effects": list(effects)} if effects else {}
    described = {"test": "coastdown", "runs": runs, "settings": window, "diagnose": asked}
    spec = CoastdownSpec.model_validate(described)
    stated = {"mass": MASS, "rotating_mass": ROTATING, "air_density": DENSITY}
    known = Parameters({n: Estimate.given(PARAMETERS[n], v) for n, v in stated.items()})
    ready = PreparedStep(STEP, spec, known, STEP.prepare(spec, tuple(logs), known))
    base = published(ready.problem)
    return diagnosed(ready, base.refused(STEP.name) if isinstance(base, Failure) else base)


def covered(result: Result, force: Callable[[float], float], speeds: tuple[float, ...]) -> None:
    """The road load's intervals hold the truth, and are no wider than a fifth of it."""
    rows = {round(row["speed_kmh"]): row for row in result.extra["road_load"]["force"]}
    for speed in speeds:
        low, high = rows[round(speed)]["interval95"]
        true = force(speed / 3.6)
        assert low <= true <= high
        assert high - low < 0.2 * true


@pytest.mark.slow
def test_friction_at_low_speed_is_in_the_published_road_load() -> None:
    def force(v: float) -> float:
        return float(105.0 + 60.0 * np.exp(-v / 2.5) + 0.66 * v**2)

    result = coasts(force, 1.1, 10.0, 3)
    assert result.diagnosis is not None
    assert result.diagnosis.verdict in ("named", "ambiguous", "unknown")
    covered(result, force, (20.0,))


@pytest.mark.slow
@pytest.mark.thorough
def test_a_linear_term_beyond_its_range_is_no_fading_brake() -> None:
    def force(v: float) -> float:
        return 100.0 + 9.0 * v + 0.4 * v**2

    result = coasts(force, 2 / 3, 25.0, 4)
    assert result.diagnosis is not None
    assert "brake_drag_fading" not in {c.effect for c in result.diagnosis.causes}
    assert "olling resistance that increases with speed" in result.diagnosis.sentence
    covered(result, force, (40.0, 60.0, 80.0))


@pytest.mark.slow  # a diagnosis of 1 s
def test_a_law_beyond_its_range_replaces_a_baseline_that_the_logs_contradict() -> None:
    def force(v: float) -> float:
        return 100.0 + 9.0 * v + 0.4 * v**2

    some = ("headwind", "road_grade", "speed_dependent_rolling", "tire_warmup")
    result = coasts(force, 2 / 3, 25.0, 5, some)
    assert result.diagnosis is not None
    assert result.diagnosis.verdict == "unknown"
    assert "beyond the plausible range) would explain it" in result.diagnosis.sentence
    covered(result, force, (20.0, 40.0, 60.0, 80.0))


def test_the_interval_of_a_force_holds_the_logs_where_they_disagree() -> None:
    speed = np.array([5.0, 10.0, 15.0])
    local = LocalForces(speed, np.array([120.0, 150.0, 200.0]), np.array([120.0, 130.0, 200.0]), np.full(3, 3.0))
    assert local.disagreeing(5.0) is None
    assert local.disagreeing(10.0) == pytest.approx((20.0, 3.0))
    assert local.disagreeing(30.0) is None
