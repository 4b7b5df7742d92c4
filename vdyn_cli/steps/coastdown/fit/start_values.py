"""Start values of a road load fit: linear least squares on decelerations of a few seconds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vdyn_cli.inference import Unknown
from vdyn_cli.inference.bins import Bins
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.steps.coastdown.fit.campaign import Campaign
from vdyn_cli.steps.coastdown.fit.road_run import RoadRun

STRIDE = 2  # bins over which a deceleration is computed: one bin would double the noise
INSIDE = 0.01  # share of the physical range that a start keeps from its bounds


def with_start_values(campaign: Campaign) -> tuple[Unknown, ...]:
    """The campaign's unknowns, with a least-squares fit of the decelerations as start of those of the road load.

    (M + mr) V' = F - frr M g - frr1 M g V - 1/2 rho Cd A (V + w)|V + w|

    Far from the solution the simulated car may stop, and a standing car is not sensitive to the road load.

    Assumes that the mean of a bin represents its samples. Returns ``campaign.unknowns`` with too few bins.
    """
    at = campaign.values
    parts = [_decelerations(campaign, run, bins) for run, bins in zip(campaign.runs, campaign.bins, strict=True)]
    speed, wind, force = (np.concatenate(column) for column in zip(*parts, strict=True))
    flow = speed + wind
    columns = {
        "rolling_resistance": np.full(speed.size, at["mass"] * GRAVITY),
        "rolling_speed": speed * at["mass"] * GRAVITY,
        "drag_area": 0.5 * at["air_density"] * flow * np.abs(flow),
    }
    estimated = [u.name for u in campaign.unknowns if u.name in columns]
    if not estimated or speed.size < 2 * len(estimated):
        return campaign.unknowns
    for name in set(columns) - set(estimated):
        force = force - at[name] * columns[name]
    line = np.linalg.lstsq(np.column_stack([columns[n] for n in estimated]), force, rcond=None)[0]
    found = dict(zip(estimated, line.tolist(), strict=True))
    return tuple(_moved(u, found[u.name]) if u.name in found else u for u in campaign.unknowns)


def _moved(unknown: Unknown, start: float) -> Unknown:
    margin = INSIDE * (unknown.upper - unknown.lower)
    return replace(unknown, start=float(np.clip(start, unknown.lower + margin, unknown.upper - margin)))


def _decelerations(campaign: Campaign, run: RoadRun, bins: Bins) -> tuple[Array, Array, Array]:
    """Speed, headwind and decelerating force between bins, (k,) m/s, m/s, N."""
    at, zeros = campaign.values, np.zeros(run.time.size)
    if "drive_torque" in run.inputs:
        drive = run.inputs["drive_torque"] * (at["driveline_efficiency"] * at["gear_ratio"] / at["wheel_radius"])
    else:
        drive = run.inputs.get("drive_force", 0.0)
    pushed = zeros + drive - at["mass"] * GRAVITY * run.inputs["grade"]
    means = bins.mean(np.column_stack([run.speed, zeros + run.inputs["wind_speed"], pushed]))
    part = run.part[bins.first]
    within = part[STRIDE:] == part[:-STRIDE]
    rate = (means[STRIDE:, 0] - means[:-STRIDE, 0]) / (bins.time[STRIDE:] - bins.time[:-STRIDE])
    middle = 0.5 * (means[STRIDE:] + means[:-STRIDE])
    force = middle[:, 2] - (at["mass"] + at["rotating_mass"]) * rate
    return middle[within, 0], middle[within, 1], force[within]
