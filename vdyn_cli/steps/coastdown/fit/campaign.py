"""The runs of a coast-down campaign, with what is known and estimated, as the fit uses them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from vdyn_cli.engine.model import Model
from vdyn_cli.engine.simulate import Drive
from vdyn_cli.inference import Unknown
from vdyn_cli.inference.bins import Bins, Nodes, cut, nodes
from vdyn_cli.physics.models.road_load import DriveSignal, road_load
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.coastdown.fit.road_run import RoadRun
from vdyn_cli.steps.coastdown.road.road_position import road_ends
from vdyn_cli.steps.coastdown.road.shared_road import RoadLayout, road_layout

AccelerometerUse = Literal["none", "with_speed", "alone"]

BIN_WIDTH = 2.0  # s: a quarter of the usual gust; averages out that torque and force are not sampled simultaneously
FEWEST_BINS, MOST_BINS = 8, 200  # of a run: the covariance stays small


@dataclass(frozen=True)
class Campaign:
    """Runs with what is known and what is estimated.

    Parameters
    ----------
    drive : which signal of the drive is measured.
    values : the model's parameters in SI.
    unknowns : shared unknowns, named as the model's parameters; those known with an uncertainty have a prior.
    accelerometer : "none", or fitted "with_speed" or "alone".
    white : plain least squares, with sensor noise only.
    levels : white noise in the samples of each run's channels, in the channel's unit.
    road : first and last road coordinate, m; None unless every run's position on the road is known.
    air_share : relative standard deviation of the air density where runs have individual densities.
    roughness : stated lower bound of the standard deviation of the road's slope; None where nothing is stated.
    shown_roughness : standard deviation of the slope that changes sign with the heading (road_search.located).
    turn : m, between the starts of both directions over the same road, if found (shared_road.road_layout).
    turns : where not found, such distances that are possible, m, each with its probability.
    spectrum : index of the road's spectrum in road_spectrum.SPECTRA.
    shifts : m, by which each run began farther along than assumed, where position is not logged.
    zero_mean_slope : the shared road has a mean slope of zero, because an effect describes the mean slope.
    filtered : the error of the speed has a part that lasts for seconds (road_search.located).
    flat_road : an effect describes the road, or a roughness of 0 is stated: the noise contains no random road.
    """

    runs: tuple[RoadRun, ...]
    drive: DriveSignal
    values: Mapping[str, float]
    unknowns: tuple[Unknown, ...]
    accelerometer: AccelerometerUse
    white: bool
    levels: tuple[Mapping[str, float], ...]
    road: tuple[float, float] | None
    air_share: float = 0.0
    roughness: float | None = None
    zero_mean_slope: bool = False
    shown_roughness: float | None = None
    turn: float | None = None
    turns: tuple[tuple[float, float], ...] = ()
    spectrum: int = 0
    shifts: tuple[float, ...] = ()
    flat_road: bool = False
    filtered: bool = False

    @cached_property
    def layout(self) -> RoadLayout | None:
        """Positions of the runs on the road that they share; None where the noise contains no shared road.

        Plain least squares has no such noise, a specific force alone does not contain the slope, a logged grade is the
        road, and driven runs without a logged position need not begin at one place.
        """
        placed = self.road is not None
        if self.white or self.flat_road or not self.speed_fitted or not (placed or self.coasting):
            return None
        if all(isinstance(r.inputs["grade"], np.ndarray) for r in self.runs):
            return None
        layout = road_layout(self.runs, self.turn, self.spectrum)
        layout = replace(layout, level=self.zero_mean_slope, turns=self.turns)
        for run, shift in enumerate(self.shifts):
            layout = layout.moved(run, shift)
        return layout

    @cached_property
    def bins(self) -> tuple[Bins, ...]:
        """For each run, the groups of samples over which residuals are averaged."""
        lengths = [float(np.sum(np.diff(r.time)[r.part[1:] == r.part[:-1]])) for r in self.runs]
        widths = [max(min(BIN_WIDTH, t / FEWEST_BINS), t / MOST_BINS) for t in lengths]
        return tuple(cut(r.time, width, r.part) for r, width in zip(self.runs, widths, strict=True))

    @cached_property
    def nodes(self) -> tuple[Nodes, ...] | None:
        """Sparse instants at which coasting runs are simulated; None where varying inputs require every sample."""
        smooth = self.coasting and self.accelerometer == "none"
        if not smooth or any(isinstance(v, np.ndarray) for r in self.runs for v in r.inputs.values()):
            return None
        return tuple(nodes(r.time, b) for r, b in zip(self.runs, self.bins, strict=True))

    @cached_property
    def intervals(self) -> int | None:
        """Number of intervals between the speed levels of split times, which limits a free law of speed; else None."""
        if not all(r.split for r in self.runs):
            return None
        return max(np.unique(np.concatenate([r.speed for r in self.runs])).size - 1, 2)

    @property
    def model(self) -> Model:
        """The road load as these runs are driven and measured."""
        changed = self.runs[0].changed is not None
        return road_load(self.drive, self.accelerometer != "none", self.road is not None, changed=changed)

    @cached_property
    def drives(self) -> tuple[Drive, ...]:
        """Every run at its samples."""
        return tuple(self._drive(r, r.time) for r in self.runs)

    @cached_property
    def fit_drives(self) -> tuple[Drive, ...]:
        """Every run at the instants at which the fit simulates it."""
        if self.nodes is None:
            return self.drives
        return tuple(self._drive(r, n.time) for r, n in zip(self.runs, self.nodes, strict=True))

    @property
    def channels(self) -> tuple[str, ...]:
        """The fitted channels, in the order of the rows."""
        return {"none": ("speed",), "with_speed": ("speed", "acceleration"), "alone": ("acceleration",)}[
            self.accelerometer
        ]

    @property
    def coasting(self) -> bool:
        """Whether the drive is idle or not measured."""
        return self.drive == "coasting"

    @property
    def headings(self) -> Array:
        """Heading (runs,) of each run: +1 out, -1 back, 0 unknown."""
        return np.array([r.heading for r in self.runs])

    @property
    def both_ways(self) -> bool:
        """Whether there are runs out and back."""
        return {1.0, -1.0} <= set(self.headings.tolist())

    @property
    def speed_fitted(self) -> bool:
        """Whether the speed is fitted; every run's start speed is then an unknown."""
        return "speed" in self.channels

    @cached_property
    def binned(self) -> tuple[tuple[Array, ...], ...]:
        """Measured channels of each run, averaged over its bins, (b,) each."""
        return tuple(
            tuple(b.mean(r.channel(n)) for n in self.channels) for r, b in zip(self.runs, self.bins, strict=True)
        )

    def mean(self, run: int, simulated: Array) -> Array:
        """Bin means (b,) of a signal, or (b, k) of columns, simulated at the instants of ``fit_drives``."""
        return self.bins[run].mean(simulated) if self.nodes is None else self.nodes[run].mean(simulated)

    def _drive(self, run: RoadRun, time: Array) -> Drive:
        inputs: dict[str, Array | float] = {**run.inputs, "elapsed": run.start + run.since + time - run.time[0]}
        if self.accelerometer != "none":
            inputs["speed"] = run.speed
        own = {} if run.air_density is None else {"air_density": run.air_density}
        context = {"heading": run.heading, "temperature": run.temperature}
        if self.road is not None and run.place is not None:
            inputs["position"] = run.heading * run.place + np.interp(time, run.time, run.distance)
            context |= {"road_begin": self.road[0], "road_end": self.road[1]}
        if run.changed is not None:
            context["changed"] = float(run.changed)
        return Drive(time, inputs, {"run_time": run.since}, own, context)


def road_of(runs: tuple[RoadRun, ...]) -> tuple[float, float] | None:
    """First and last road coordinate of runs, m; None unless every run's position is known."""
    places = [(r.place, r.heading, float(r.distance[-1])) for r in runs if r.place is not None]
    return road_ends(places) if len(places) == len(runs) else None
