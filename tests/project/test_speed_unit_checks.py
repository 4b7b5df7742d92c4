"""Units that other channels of the same motion contradict in every run."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.project.checks.speed_unit_checks import contradicted_speed
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters

TIME = np.arange(0.0, 60.0, 0.1)
RADIUS = 0.31
CAR = Parameters({"wheel_radius": Estimate(RADIUS, 0.0, (RADIUS, RADIUS), "m", "", "given")})
UNITS = {"speed": "km/h", "position": "m", "acceleration": "m/s^2", "wheel_speed": "rad/s"}
MAPPED = {name: (f"a.yaml:{k}", unit) for k, (name, unit) in enumerate(UNITS.items())}
LIVELY = 20.0 + 10.0 * np.sin(0.3 * TIME)
COASTING = 20.0 * np.exp(-TIME / 90.0)


def runs(motion: np.ndarray, slope: float = 0.0, **scales: float) -> list[Log]:
    """Runs out and back; ``slope``: specific force per deceleration of a road that steepens, out."""
    logs = []
    for way in (1.0, -1.0):
        true = {
            "speed": motion,
            "position": np.cumsum(motion) * 0.1,
            "acceleration": np.gradient(motion, TIME) * (1.0 + way * slope),
            "wheel_speed": motion / RADIUS,
        }
        logs.append(Log(f"{way}.csv", TIME, {n: v * scales[n] for n, v in true.items() if n in scales}))
    return logs


@pytest.mark.parametrize("reference", ["position", "acceleration", "wheel_speed"])
def test_a_speed_of_another_unit_is_contradicted_by_each_channel(reference: str) -> None:
    logs = runs(LIVELY, **{"speed": 1.609344, reference: 1.0})
    mapped = {**MAPPED, "speed": ("a.yaml:0", "mph")}
    (found,) = contradicted_speed(logs, ["out", "back"], CAR, mapped)
    assert found.where == "a.yaml:0"
    assert f"{reference}'" in found.what
    assert "0.621 times" in found.what
    assert found.remedy.startswith("write 'unit: km/h' instead of 'mph'")
    assert not list(contradicted_speed(runs(LIVELY, **{"speed": 1.0, reference: 1.0}), ["out", "back"], CAR, MAPPED))


def test_a_wheel_speed_of_another_unit_is_named_where_the_position_confirms_the_speed() -> None:
    logs = runs(LIVELY, speed=1.0, position=1.0, wheel_speed=60.0 / (2.0 * np.pi))
    (found,) = contradicted_speed(logs, ["out", "back"], CAR, MAPPED)
    assert found.where == "a.yaml:3"
    assert found.remedy == "write 'unit: rpm' instead of 'rad/s'"


def test_twice_the_pulses_of_a_wheel_are_not_called_knots() -> None:
    (found,) = contradicted_speed(runs(LIVELY, speed=1.0, wheel_speed=1.998), ["out", "back"], CAR, MAPPED)
    assert found.where == "a.yaml:3"
    assert "half the pulses per turn" in found.what
    (found,) = contradicted_speed(runs(LIVELY, speed=1.0, wheel_speed=1.852), ["out", "back"], CAR, MAPPED)
    assert found.remedy.startswith("write 'unit: kn' instead of 'km/h'")


def test_a_slope_that_resembles_a_factor_in_one_direction_contradicts_no_speed() -> None:
    logs = runs(COASTING, slope=-0.38, speed=1.0, acceleration=1.0)
    mapped = {**MAPPED, "speed": ("a.yaml:0", "mph")}
    assert not list(contradicted_speed(logs[:1] * 2, ["out", "out"], CAR, mapped))
    assert not list(contradicted_speed(logs, ["out", "back"], CAR, mapped))
    (found,) = contradicted_speed(
        runs(1.609344 * COASTING, speed=1.0, acceleration=1 / 1.609344), ["out", "back"], CAR, mapped
    )
    assert "'acceleration'" in found.what


def test_a_constant_channel_shows_no_unit() -> None:
    assert not list(contradicted_speed(runs(LIVELY, speed=1.0, position=0.0), ["out", "back"], CAR, MAPPED))
