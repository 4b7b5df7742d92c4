"""The noise model of a coast-down's binned residuals: the disturbances of each run and the car's response to them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vdyn_cli.inference import gust_covariance
from vdyn_cli.inference.gust_covariance import RunNoise, Surroundings
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.steps.coastdown.fit.campaign import Campaign
from vdyn_cli.steps.coastdown.fit.road_run import RoadRun

LARGEST_GUST = 1.5  # m/s: turbulence of 0.3 in the largest mean wind that SAE J1263 and WLTP allow (5 m/s)


def noise_of(campaign: Campaign, run: int, at: Mapping[str, float]) -> RunNoise:
    """The covariance model of a run's rows.

    Parameters
    ----------
    run : index of the run. at : the model's parameters in SI, which determine the response to gusts and slopes.
    """
    surroundings = _surroundings(campaign, run, at)
    if campaign.white:
        return gust_covariance.white_noise(surroundings, campaign.channels)
    law = {
        "none": gust_covariance.speed_noise,
        "with_speed": gust_covariance.speed_and_force_noise,
        "alone": gust_covariance.force_noise,
    }[campaign.accelerometer]
    found = law(surroundings)
    error = campaign.runs[run].slope_error
    if error is None:
        return found
    response = slope_response(campaign, run, at) @ campaign.bins[run].mean(error)
    return replace(found, known=found.known + response @ response.T)


def road_response(campaign: Campaign, run: int, at: Mapping[str, float]) -> Array:
    """Response of a run's rows to the road that all runs share, (b, m), m/s per unit of each of the road's unknowns.

    The unknowns are independent with the standard deviation of the road's slope; (b, 0) where no road is shared.
    """
    if campaign.layout is None:
        return np.zeros((campaign.bins[run].time.size, 0))
    return slope_response(campaign, run, at) @ binned_slopes(campaign, run)


def binned_slopes(campaign: Campaign, run: int) -> Array:
    """Mean slope along a run in each of its bins per unit of each unknown of the shared road, (b, m), dimensionless.

    Parameters
    ----------
    run : index of the run in the campaign, which must have a road layout.
    """
    layout, bins = campaign.layout, campaign.bins[run]
    assert layout is not None
    weights = layout.weights_until_next(run) if bins.sparse else layout.mean_weights(run, bins)
    return np.asarray(weights @ layout.factor)


def slope_response(campaign: Campaign, run: int, at: Mapping[str, float]) -> Array:
    """Response of a run's rows to an uphill slope in each of its bins, (m, b): m/s, then m/s^2 where fitted.

    Parameters
    ----------
    run : index of the run. at : the model's parameters in SI.
    """
    s = _surroundings(campaign, run, at)
    both = campaign.accelerometer == "with_speed"
    return gust_covariance.slope_response_of_both(s) if both else gust_covariance.slope_response(s)


def force_response(campaign: Campaign, run: int, at: Mapping[str, float]) -> Array:
    """Response of a run's rows to a force against the motion in each of its bins, (m, b), in units of the weight.

    It changes the speed as a slope does, and the specific force by itself.
    """
    s = _surroundings(campaign, run, at)
    by_slope = gust_covariance.slope_response(s)
    here = -GRAVITY * s.slope_share * np.eye(s.bins.time.size)
    return np.vstack([by_slope, here]) if campaign.accelerometer == "with_speed" else by_slope


def _surroundings(campaign: Campaign, run: int, at: Mapping[str, float]) -> Surroundings:
    one, bins = campaign.runs[run], campaign.bins[run]
    inertia = at["mass"] + at["rotating_mass"]
    density = one.air_density if one.air_density is not None else at["air_density"]
    wind = one.inputs["wind_speed"]
    flow = np.maximum(bins.mean(one.speed) + (bins.mean(wind) if isinstance(wind, np.ndarray) else float(wind)), 0.0)
    drag_slope = density * at["drag_area"] * flow / inertia
    levels = campaign.levels[0 if campaign.white else run]  # in plain least squares the level only scales the cost
    return Surroundings(
        bins=bins,
        drag_slope=drag_slope,
        fade=drag_slope if campaign.accelerometer == "none" else np.zeros_like(drag_slope),
        slope_share=at["mass"] / inertia,
        speed_level=levels["speed"],
        jolt=_drive_noise(one, levels, at) / inertia,
        acceleration_level=levels.get("acceleration", 0.0),
        zero=one.zero_std,
        driven=not campaign.coasting,
        filtered=campaign.filtered,
    )


def wind_variance(sizes: Mapping[str, float]) -> float:
    """Variance of the wind along the track, within and between runs, m^2/s^2: gust^2 + run_wind^2.

    Parameters
    ----------
    sizes : of the noise sources; gust and run_wind in m/s.
    """
    return sizes.get("gust", 0.0) ** 2 + sizes.get("run_wind", 0.0) ** 2


def _drive_noise(run: RoadRun, levels: Mapping[str, float], at: Mapping[str, float]) -> float:
    """White noise of the drive force, N per root hertz."""
    level = levels.get("drive_force", 0.0)
    if "drive_torque" in levels:
        level = levels["drive_torque"] * at["driveline_efficiency"] * at["gear_ratio"] / at["wheel_radius"]
    return level * float(np.sqrt(np.median(np.diff(run.time))))
