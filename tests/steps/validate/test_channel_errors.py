"""Errors of the channels of a mass on a road that the baseline contains as nuisance parameters."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.steps.validate.validate_cases import inputs, prepared, true_parameters
from vdyn_cli.steps.validate.car.channel_errors import with_channel_errors


def test_a_pitching_accelerometer_reads_more_by_a_share_of_the_rate_of_the_speed(root: Path, tmp_path: Path) -> None:
    problem = prepared(inputs(root, tmp_path, true_parameters(), model="road_load"))
    setup = with_channel_errors(problem.baseline, frozenset(), {})
    simulated, time = setup.first[0], setup.segments[0].time
    found = simulated.sensitivities["acceleration"][:, setup.vector.shared.index("body_pitch")]
    rate = np.gradient(simulated.values["speed"], time)
    assert np.ptp(rate) > 1.0
    assert np.sqrt(np.mean((found - rate) ** 2)) < 0.05 * np.std(rate)


def test_a_late_torque_is_not_noise_of_the_published_prediction(root: Path, tmp_path: Path) -> None:
    """Without its latency in the model, the torque's error looks like gusts and winds."""
    problem = prepared(inputs(root, tmp_path, true_parameters(), model="road_load"))
    late = tuple(
        log.with_channels(drive_torque=np.interp(log.time - 0.08, log.time, log["drive_torque"]))
        for log in problem.logs
    )
    on_time, delayed = (p.publish() for p in (problem, replace(problem, logs=late)))
    assert delayed.fit is not None
    assert on_time.fit is not None
    assert delayed.fit.noise_floor < 1.2 * on_time.fit.noise_floor
    assert not [w for w in delayed.fit.warnings if "the drives require" in w]
