"""A position channel places a run on the road where it can be one, and not where it is something else."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.steps.coastdown.road.road_position import contradicting_position, first_place, road_ends

TIME = np.linspace(0.0, 60.0, 601)
SPEED = 20.0 - TIME / 6.0
ALONG = 20.0 * TIME - TIME**2 / 12.0


@pytest.mark.parametrize("heading", [1.0, -1.0])
def test_noise_and_gaps_average_out(heading):
    position = 500.0 + heading * ALONG + 0.3 * np.random.default_rng(1).standard_normal(TIME.size)
    position[::3] = np.nan
    assert first_place(TIME, SPEED, position, heading) == pytest.approx(500.0, abs=0.1)


@pytest.mark.parametrize(
    ("position", "heading"),
    [(500.0 + ALONG, -1.0), (500.0 + ALONG, 0.0), (np.full(TIME.size, np.nan), 1.0), (0.0 * TIME, 1.0)],
    ids=["trip meter on the way back", "no direction", "empty", "constant"],
)
def test_a_channel_that_is_not_a_road_coordinate_gives_no_place(position, heading):
    assert first_place(TIME, SPEED, position, heading) is None


def test_a_car_at_rest_has_no_place():
    assert first_place(TIME, 0.0 * TIME, 0.0 * TIME, 1.0) is None


def test_the_road_is_as_long_as_its_runs_together():
    assert road_ends([(10.0, 1.0, 900.0), (950.0, -1.0, 960.0)]) == (-10.0, 950.0)


def test_a_direction_that_the_position_contradicts_is_found() -> None:
    assert contradicting_position([900.0, -900.0, 880.0, -870.0], [1, -1, 1, -1]) == ()
    assert contradicting_position([-900.0, 900.0, -880.0, 870.0], [1, -1, 1, -1]) == ()  # the road is counted backwards
    assert contradicting_position([900.0, -900.0, 880.0, -870.0], [-1, -1, 1, -1]) == (0,)
    assert contradicting_position([900.0, -900.0, 880.0, -870.0], [1, 1, 1, 1]) == (1, 3)
    assert contradicting_position([900.0, 910.0, 880.0, 870.0], [1, -1, 1, -1]) == ()  # a trip meter
    assert contradicting_position([900.0, -900.0], [0, 0]) == ()
