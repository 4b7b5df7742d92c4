"""Crossings on an uneven road: its intensity is found before the bump, and its noise is no model error."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant.rough_road import SLOPE, road_motion
from tests.steps.bump.test_bump import LOGS, SPEC, VEHICLE, known
from vdyn_cli.diagnosis.diagnose import diagnosed
from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.bump.measured_profile import BumpData
from vdyn_cli.steps.bump.problem import prepare
from vdyn_cli.steps.bump.road_noise import ISO_8608, RoadNoise, road_noise
from vdyn_cli.steps.bump.step import STEP

# Gd(0.1 cycles/m) by the plant's one-sided density of the slope; its contact patch removes some of it.
ROUGHNESS = ISO_8608 * SLOPE / 2


def uneven(log: Log, seed: int) -> Log:
    road = road_motion(VEHICLE, log.time, log["speed"], np.random.default_rng(seed))
    added = {
        "front_load": road.front,
        "rear_load": road.rear,
        "vertical_acceleration": (road.front + road.rear) / VEHICLE.mass,
        "pitch_rate": road.pitch_rate,
    }
    return log.with_channels(**{n: log[n] + x for n, x in added.items()})


ROUGH = tuple(uneven(log, k) for k, log in enumerate(LOGS))


def test_only_an_uneven_road_is_part_of_the_noise() -> None:
    fit = prepare(SPEC, BumpData(LOGS), known()).fit
    values = {**fit.known.values, **fit.start}
    assert fit.road is None
    crossing, deviation = fit.crossings[0], {n: fit.crossings[0].noise[n] for n in fit.channels}
    errors = np.random.default_rng(1).standard_normal((40, len(deviation), 2))
    white = RoadNoise(values, 0.0).whitened(crossing, errors, deviation)
    np.testing.assert_allclose(white, errors / np.array(list(deviation.values()))[:, None])


@pytest.mark.slow
@pytest.mark.thorough  # a diagnosis of half a minute
def test_its_intensity_is_found_and_nothing_is_named() -> None:
    given = known()
    problem = prepare(SPEC, BumpData(ROUGH), given)
    road = road_noise(problem.fit.crossings, {**problem.fit.known.values, **problem.fit.start})
    assert road is not None
    assert 0.3 < road.roughness / ROUGHNESS < 3.0
    found = diagnosed(PreparedStep(STEP, SPEC, given, problem), problem.publish())
    assert found.diagnosis is not None
    assert found.diagnosis.verdict == "adequate", found.diagnosis.sentence
    assert any("uneven" in f.what for f in found.findings)
    for name, estimate in found.parameters.items():
        assert abs(estimate.value - getattr(VEHICLE, name)) < 4 * estimate.std, name
