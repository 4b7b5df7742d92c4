"""What both axles carry tells lift from all that acts at the road, and how the axles share it."""

from __future__ import annotations

import pytest

from tests.effects.recovered import added
from tests.plant import cg as plant
from tests.plant.vehicle import random_vehicle
from tests.steps.cg.test_cg import SPEC, known, logs
from vdyn_cli.effects import catalog
from vdyn_cli.steps.cg.problem import prepare

LIFT = tuple(e for e in catalog() if e.name == "aero_lift")
CROSSTALK = tuple(e for e in catalog() if e.name == "load_crosstalk")


@pytest.mark.slow
@pytest.mark.parametrize(("front", "rear"), [(0.3, 0.1), (0.05, 0.4), (-1.1, -1.5)])
def test_lift_has_its_sign_and_its_share_at_either_axle(front: float, rear: float) -> None:
    vehicle = random_vehicle(2)
    lifted = logs(vehicle, 2, effects={"aero_lift_front": front, "aero_lift_rear": rear})
    result = prepare(SPEC, lifted, known(vehicle)).publish(added(*LIFT))
    area, share = result.amplitudes["aero_lift"], result.amplitudes["aero_lift_front"]
    assert abs(area.value - (front + rear)) < 3 * area.std
    assert abs(share.value - front / (front + rear)) < 3 * share.std
    for name, truth in plant.truth(vehicle).items():
        assert abs(result.parameters[name].value - truth) < 3.5 * result.parameters[name].std, name


def test_lift_is_no_gain_of_the_loads() -> None:
    """A car pressed down by a tenth of its weight at 20 m/s, which never drives slowly."""
    vehicle = random_vehicle(2)
    pressed = logs(vehicle, 2, effects={"aero_lift_front": -2.0, "aero_lift_rear": -2.5})
    assert not any("mass x g" in f.what for f in prepare(SPEC, pressed, known(vehicle)).findings)


@pytest.mark.slow
@pytest.mark.parametrize(("effect", "size"), [("load_crosstalk", 0.04), ("wheel_force_gain_front", 0.015)])
def test_a_gain_of_one_axle_is_no_crosstalk(effect: str, size: float) -> None:
    vehicle = random_vehicle(2)
    result = prepare(SPEC, logs(vehicle, 2, effects={effect: size}), known(vehicle)).publish(added(*CROSSTALK))
    found, height = result.amplitudes["load_crosstalk"], result.parameters["cg_height"]
    assert abs(found.value - size * (effect == "load_crosstalk")) < 2.5 * found.std
    assert abs(height.value - vehicle.cg_height) < 2.5 * height.std


@pytest.mark.slow
def test_crosstalk_of_the_front_cells_is_not_at_the_rear() -> None:
    vehicle = random_vehicle(2)
    crossed = logs(vehicle, 2, effects={"load_crosstalk_front": 0.04})
    result = prepare(SPEC, crossed, known(vehicle)).publish(added(*CROSSTALK))
    share, balance = result.amplitudes["load_crosstalk"], result.amplitudes["load_crosstalk_balance"]
    assert abs(share.value - 0.02) < 3 * share.std
    assert abs(balance.value - 1.0) < 3 * balance.std
    for name, truth in plant.truth(vehicle).items():
        assert abs(result.parameters[name].value - truth) < 3.5 * result.parameters[name].std, name
