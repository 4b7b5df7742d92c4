"""Binned and whitened residuals of coasts with their derivatives, for the fit of the road load."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference import Rows, whiten
from vdyn_cli.inference.restricted_likelihood import NoisyRun, RandomUnknowns
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.coastdown.fit.campaign import Campaign
from vdyn_cli.steps.coastdown.fit.simulated_runs import SimulatedRuns
from vdyn_cli.steps.coastdown.noise import noise_of, road_response
from vdyn_cli.steps.coastdown.road.shared_road import slope_factor

SUBSTEPS = 1  # between the nodes of a coast, a second apart: halving it moves no estimate by 1e-6 of its interval
START = "start.speed"
ROUGHNESS = "roughness"


@dataclass(frozen=True)
class RowNoise:
    """The noise of all runs.

    Parameters
    ----------
    at : parameters of the model at which it was computed, SI.
    sizes : its amplitudes, by source (gust_covariance.SOURCES).
    factors : of each run's covariance, lower triangular (m, m), or (m,) where it is diagonal.
    slopes : for each run (b, k), response of its rows to the shared road's unknowns for a roughness of one.
    """

    at: Mapping[str, float]
    sizes: Mapping[str, float]
    factors: tuple[Array, ...] = ()
    slopes: tuple[Array, ...] = ()


@dataclass(frozen=True)
class RoadLoadRows:
    """Binned residuals and derivatives of all runs, whitened with the factors of their covariances.

    Parameters
    ----------
    runs : the simulation of the runs. shared : names of the shared unknowns. noise : of the rows.
    road : names of the shared road's unknowns, which enter linearly and have independent priors of one.
    center : (k,) the road's unknowns times the roughness at which the runs are simulated and linearized.
    hills : names of the unknowns of an effect that describes the road: slopes at equidistant knots along it.
    """

    runs: SimulatedRuns
    shared: tuple[str, ...]
    noise: RowNoise
    road: tuple[str, ...] = ()
    center: Array | None = None
    hills: tuple[str, ...] = ()

    @property
    def campaign(self) -> Campaign:
        """The runs as measured."""
        return self.runs.campaign

    @cached_property
    def road_columns(self) -> NDArray[np.intp]:
        """Indices of the road's unknowns among the shared ones."""
        return np.array([self.shared.index(n) for n in self.road], dtype=np.intp)

    @cached_property
    def simulated_columns(self) -> NDArray[np.intp]:
        """Indices of the other shared unknowns."""
        return np.delete(np.arange(len(self.shared)), self.road_columns)

    def binned(self, run: int, theta: Array) -> tuple[Array, Array]:
        """Residuals (m,), simulated minus measured, and derivatives (m, s + own) of one run, not whitened.

        Parameters
        ----------
        theta : (s + own,), the shared unknowns, then the run's own.
        """
        shared = theta[: len(self.shared)]
        inside = np.concatenate([self.simulated_columns, np.arange(shared.size, theta.size)])
        simulated, columns = self.runs.binned(run, theta[inside], self.noise.at["wind_variance"])
        residual = simulated - np.concatenate(self.campaign.binned[run])
        jacobian = np.zeros((residual.size, theta.size))
        jacobian[:, inside] = columns
        if self.road:
            jacobian[:, self.road_columns] = self.noise.sizes[ROUGHNESS] * self.noise.slopes[run]
            simulated_at = 0.0 if self.campaign.bins[run].sparse else self.reference
            residual = residual + jacobian[:, self.road_columns] @ (shared[self.road_columns] - simulated_at)
        return residual, jacobian

    def __call__(self, run: int, theta: Array) -> Rows:
        residual, jacobian = self.binned(run, theta)
        main = self.campaign.bins[run].time.size
        plain = residual[:main], jacobian[:main]
        residual, jacobian = whiten(residual, jacobian, cholesky=self.noise.factors[run])
        time = np.tile(self.campaign.bins[run].time, len(self.campaign.channels))
        return Rows(residual, jacobian, time=time, plain=plain, apart=self.campaign.runs[run].split)

    @property
    def reference(self) -> Array:
        """The road's unknowns at which the runs are simulated, (k,)."""
        assert self.center is not None
        return self.center / self.noise.sizes[ROUGHNESS]

    def sensitive_to(self, names: Collection[str]) -> RoadLoadRows:
        """See ``SelectiveRows``."""
        return replace(self, runs=self.runs.sensitive_to({*names, START}))

    def on_road(self, shared: Mapping[str, float]) -> RoadLoadRows:
        """The rows simulated on another road: its unknowns, among the ``shared`` ones, in units of its roughness.

        Runs with sparse rows are simulated on a level road: their road acts by its linear response alone, because the
        slope at the rows does not determine the slope between them.
        """
        layout = self.campaign.layout
        if layout is None or not self.road:
            return self
        center = self.noise.sizes[ROUGHNESS] * np.array([shared[n] for n in self.road])
        profile = layout.factor @ center
        drives = []
        for k, drive in enumerate(self.campaign.fit_drives):
            if self.campaign.bins[k].sparse:
                drives.append(drive)
                continue
            slope = np.interp(drive.time, self.campaign.runs[k].time, layout.weights(k) @ profile)
            drives.append(replace(drive, inputs={**drive.inputs, "grade": np.asarray(drive.inputs["grade"]) + slope}))
        return replace(self, center=center, runs=replace(self.runs, drives=tuple(drives)))

    def weighted(self, sizes: Mapping[str, float], at: Mapping[str, float]) -> RoadLoadRows:
        """The rows whitened with other noise amplitudes and model parameters."""
        runs = range(len(self.campaign.runs))
        factors = tuple(noise_of(self.campaign, k, at).factor(sizes) for k in runs)
        slopes = (
            tuple(_of_width(road_response(self.campaign, k, at), len(self.road)) for k in runs) if self.road else ()
        )
        return replace(self, noise=RowNoise(dict(at), dict(sizes), factors, slopes))

    @cached_property
    def hill_factor(self) -> Array:
        """Lower triangular factor (k, k) of the correlation of the slopes that an effect describes."""
        assert self.campaign.road is not None
        return slope_factor(np.linspace(*self.campaign.road, len(self.hills)), self.campaign.spectrum)

    def random(self) -> RandomUnknowns | None:
        """The slopes of the road as random unknowns of the noise model; None where no road is estimated."""
        least = self.campaign.roughness or 0.0
        if self.hills:
            return RandomUnknowns(ROUGHNESS, np.array([self.shared.index(n) for n in self.hills], dtype=np.intp), least)
        return RandomUnknowns(ROUGHNESS, self.road_columns, least) if self.road else None

    def noisy(self, run: int, theta: Array, at: Mapping[str, float]) -> NoisyRun:
        """The run for the noise model; its random unknowns are independent, with derivatives per unit of roughness.

        Parameters
        ----------
        theta : (s + own,), the shared unknowns, then the run's own. at : the model's parameters in SI.
        """
        residual, jacobian = self.binned(run, theta)
        s = len(self.shared)
        shared = jacobian[:, :s].copy()
        random = self.random()
        if random is not None:
            columns = random.columns
            residual = residual - shared[:, columns] @ theta[columns]
            shared[:, columns] = shared[:, columns] @ self.hill_factor if self.hills else self.noise.slopes[run]
        return NoisyRun(residual, shared, jacobian[:, s:], noise_of(self.campaign, run, at))


def _of_width(columns: Array, width: int) -> Array:
    """The first ``width`` columns, padded with zeros: planned runs on another road keep the number of its unknowns."""
    missing = max(width - columns.shape[1], 0)
    return np.pad(columns, ((0, 0), (0, missing)))[:, :width]
