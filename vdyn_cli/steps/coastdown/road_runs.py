"""The runs of a road load campaign as a fit sees them, and the noise that each of them carries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.model import Model
from vdyn_cli.engine.simulate import Drive
from vdyn_cli.inference import Unknown, white_level
from vdyn_cli.inference import gust_covariance as gust_noise
from vdyn_cli.inference.bins import Bins, Nodes, cut, nodes
from vdyn_cli.inference.gust_covariance import RunNoise, Surroundings
from vdyn_cli.physics.models.road_load import Driven, road_load
from vdyn_cli.steps.coastdown.place import stretch_of_road

Array = NDArray[np.float64]
Use = Literal["none", "beside", "alone"]

WIDTH = 2.0  # s of a bin: a quarter of the usual gust; on an open road torque and force are not sampled together either
LEAST_LEVEL = 1e-4  # in SI, of the white noise in a channel: a simulated log has none
FEWEST_BINS, MOST_BINS = 8, 200  # of a run: the covariance stays small


@dataclass(frozen=True)
class RoadRun:
    """One run as the fit sees it.

    Parameters
    ----------
    time, speed : (n,) s, m/s; finite.
    inputs : grade, wind_speed, and the drive's torque or force: (n,) each, or one number.
    acceleration : (n,) m/s^2 specific force, NaN where missing; its zero already taken off where ``zero_std`` says how
        well that is known.
    part : (n,), label of the window of each row.
    heading : +1 out, -1 back, 0 unknown. start : s since the first run began. temperature : K.
    air_density : kg/m^3 of this run, None for the campaign's.
    since : s of the log that go before the first row.
    place : m, road coordinate at the first row; None where nothing tells it.
    """

    name: str
    time: Array
    speed: Array
    inputs: Mapping[str, Array | float]
    part: NDArray[np.int64]
    acceleration: Array | None = None
    zero_std: float = 0.0
    heading: float = 0.0
    start: float = 0.0
    temperature: float = 293.15
    air_density: float | None = None
    since: float = 0.0
    place: float | None = None

    @property
    def along(self) -> Array:
        """Distance driven at each row, m."""
        return np.asarray(np.r_[0.0, np.cumsum(np.diff(self.time) * (self.speed[1:] + self.speed[:-1]) / 2)])

    @property
    def driven(self) -> float:
        """Distance, m."""
        return float(self.along[-1])

    def channel(self, name: str) -> Array:
        """A fitted channel: speed or acceleration."""
        values = self.speed if name == "speed" else self.acceleration
        assert values is not None
        return values


@dataclass(frozen=True)
class Campaign:
    """Runs with what is known and what is sought.

    Parameters
    ----------
    values : the model's parameters in SI.
    unknowns : shared unknowns, named as the model's parameters; those known with an uncertainty carry a prior.
    accelerometer : "none", "beside" the speed, or "alone".
    white : plain least squares, as if the sensors' noise were all there is.
    """

    runs: tuple[RoadRun, ...]
    driven: Driven
    values: Mapping[str, float]
    unknowns: tuple[Unknown, ...]
    accelerometer: Use = "none"
    white: bool = False

    @cached_property
    def bins(self) -> tuple[Bins, ...]:
        lengths = [_covered(r) for r in self.runs]
        widths = [max(min(WIDTH, t / FEWEST_BINS), t / MOST_BINS) for t in lengths]
        return tuple(cut(r.time, width, r.part) for r, width in zip(self.runs, widths, strict=True))

    @cached_property
    def nodes(self) -> tuple[Nodes, ...] | None:
        """Where runs that nothing but their own motion drives need to be simulated; None: at every sample."""
        smooth = self.driven == "coasting" and self.accelerometer == "none"
        if not smooth or any(isinstance(v, np.ndarray) for r in self.runs for v in r.inputs.values()):
            return None
        return tuple(nodes(r.time, b) for r, b in zip(self.runs, self.bins, strict=True))

    @cached_property
    def road(self) -> tuple[float, float] | None:
        """Where the road begins and ends, m; None unless every run is known to lie on it."""
        places = [(r.place, r.heading, r.driven) for r in self.runs if r.place is not None]
        return stretch_of_road(places) if len(places) == len(self.runs) else None

    @cached_property
    def model(self) -> Model:
        """The road load as these runs are driven and measured."""
        return road_load(self.driven, self.accelerometer != "none", self.road is not None)

    @cached_property
    def drives(self) -> tuple[Drive, ...]:
        """Every run at its samples."""
        return tuple(self._drive(r, r.time) for r in self.runs)

    @cached_property
    def fit_drives(self) -> tuple[Drive, ...]:
        """Every run where the fit simulates it."""
        if self.nodes is None:
            return self.drives
        return tuple(self._drive(r, n.time) for r, n in zip(self.runs, self.nodes, strict=True))

    def _drive(self, run: RoadRun, time: Array) -> Drive:
        inputs: dict[str, Array | float] = {**run.inputs, "elapsed": run.start + run.since + time - run.time[0]}
        if self.accelerometer != "none":
            inputs["speed"] = run.speed
        own = {} if run.air_density is None else {"air_density": run.air_density}
        context = {"heading": run.heading, "temperature": run.temperature}
        start = {"run_time": run.since}
        if self.road is not None and run.place is not None:
            inputs["position"] = run.heading * run.place + np.interp(time, run.time, run.along)
            context |= {"road_begin": self.road[0], "road_end": self.road[1]}
        return Drive(time, inputs, start, own, context)

    def mean(self, run: int, simulated: Array) -> Array:
        """Mean over the samples of every bin, of a trace (or columns) along ``fit_drives``."""
        return self.bins[run].mean(simulated) if self.nodes is None else self.nodes[run].mean(simulated)

    @cached_property
    def levels(self) -> tuple[Mapping[str, float], ...]:
        """White noise in the samples of each run's channels."""
        return tuple(_levels(r) for r in self.runs)

    @cached_property
    def common_levels(self) -> Mapping[str, float]:
        """Those of the first run: in plain least squares they only scale the cost."""
        return _levels(self.runs[0])

    @property
    def channels(self) -> tuple[str, ...]:
        """What is fitted, in the order of the rows."""
        return {"none": ("speed",), "beside": ("speed", "acceleration"), "alone": ("acceleration",)}[self.accelerometer]

    @property
    def speed_fitted(self) -> bool:
        return "speed" in self.channels


def _covered(run: RoadRun) -> float:
    same = run.part[1:] == run.part[:-1]
    return float(np.sum(np.diff(run.time)[same]))


def _levels(run: RoadRun) -> dict[str, float]:
    channels = {"speed": run.speed, "acceleration": run.acceleration, **run.inputs}
    names = ("speed", "acceleration", "drive_torque", "drive_force")
    found = {n: channels.get(n) for n in names}
    return {n: max(white_level(c, run.time), LEAST_LEVEL) for n, c in found.items() if isinstance(c, np.ndarray)}


def noise_of(campaign: Campaign, run: int, at: Mapping[str, float]) -> RunNoise:
    """The covariance of a run's rows with the model's parameters at ``at``."""
    one, bins = campaign.runs[run], campaign.bins[run]
    inertia = at["mass"] + at["rotating_mass"]
    density = one.air_density if one.air_density is not None else at["air_density"]
    flow = np.maximum(bins.mean(one.speed) + _binned_input(one, bins, "wind_speed"), 0.0)
    pull = density * at["drag_area"] * flow / inertia
    levels = campaign.common_levels if campaign.white else campaign.levels[run]
    surroundings = Surroundings(
        bins=bins,
        pull=pull,
        fade=pull if campaign.accelerometer == "none" else np.zeros_like(pull),
        slope_share=at["mass"] / inertia,
        speed_level=levels["speed"],
        jolt=_jolt(one, levels, at) / inertia,
        acceleration_level=levels.get("acceleration", 0.0),
        zero=one.zero_std,
        driven=campaign.driven != "coasting",
    )
    if campaign.white:
        return gust_noise.white_noise(surroundings, campaign.channels)
    law = {
        "none": gust_noise.speed_noise,
        "beside": gust_noise.speed_and_force_noise,
        "alone": gust_noise.force_noise,
    }[campaign.accelerometer]
    return law(surroundings)


def _binned_input(run: RoadRun, bins: Bins, name: str) -> Array | float:
    value = run.inputs[name]
    return bins.mean(value) if isinstance(value, np.ndarray) else float(value)


def _jolt(run: RoadRun, levels: Mapping[str, float], at: Mapping[str, float]) -> float:
    """White noise of the drive force, N per root hertz."""
    level = levels.get("drive_force", 0.0)
    if "drive_torque" in levels:
        level = levels["drive_torque"] * at["driveline_efficiency"] * at["gear_ratio"] / at["wheel_radius"]
    return level * float(np.sqrt(np.median(np.diff(run.time))))
