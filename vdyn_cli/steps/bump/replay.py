"""Crossings simulated at the solution: loads, suspension stroke, energy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.bump.half_car_fit import BumpFit
from vdyn_cli.steps.bump.known_car import ENDS

OFF_ROAD = 1e-3  # share of the load at rest below which a wheel is off the road: integration errors are smaller


@dataclass(frozen=True)
class Replay:
    """One run simulated at the solution.

    Parameters
    ----------
    measured, outputs : each channel (n,), SI, measured and simulated with the sensor's zero. zeros : of each channel.
    stroke, stroke_rate : of each axle (n,), m and m/s, extension positive.
    position : (n,) m along the road since the log's start.
    distance : m, of the bump from the log's start. wheelbase : m. pace : mean speed, m/s.
    """

    run: str
    time: Array
    measured: Mapping[str, Array]
    outputs: Mapping[str, Array]
    zeros: Mapping[str, float]
    stroke: Mapping[str, Array]
    stroke_rate: Mapping[str, Array]
    position: Array
    distance: float
    wheelbase: float
    pace: float

    def residual(self, channel: str) -> Array:
        """Measured minus simulated (n,), in the channel's unit."""
        return self.measured[channel] - self.outputs[channel]

    def off_road(self, end: str, static: float) -> float:
        """Time for which an axle carries less than ``OFF_ROAD`` of its load at rest, s.

        Parameters
        ----------
        end : "front" or "rear". static : load at rest, N.
        """
        load = self.outputs[f"{end}_load"] - self.zeros[f"{end}_load"]
        return float(np.sum(np.diff(self.time)[load[:-1] < OFF_ROAD * static]))

    def dissipated(self, end: str, damping: float) -> float:
        """Energy that an axle's dampers dissipate, J: the integral of C v^2, ``damping`` in N s/m."""
        return float(np.trapezoid(damping * self.stroke_rate[end] ** 2, self.time))


def replay(fit: BumpFit, solution: Solution, run: int) -> Replay:
    """Simulate one run at the solution, in SI units at the n samples of its crossing; ``run`` is its index."""
    crossing = fit.crossings[run]
    simulated = fit.simulate(run, solution.local((*fit.shared, *fit.own), run), states=True)
    zeros = {n: float(solution.per_run[f"{n}_zero"][run]) for n in fit.channels}
    s, arms = simulated.states, fit.arms(solution.values)
    return Replay(
        run=crossing.run,
        time=crossing.time,
        measured={n: crossing.channels[n] for n in fit.channels},
        outputs={n: simulated.outputs[n] + zeros[n] for n in fit.channels},
        zeros=zeros,
        stroke={e: s["heave"] + arms[e] * s["pitch"] - s[f"wheel_{e}"] for e in ENDS},
        stroke_rate={e: s["heave_rate"] + arms[e] * s["pitch_rate"] - s[f"wheel_rate_{e}"] for e in ENDS},
        position=s["position"],
        distance=float(solution.per_run["distance_front"][run]),
        wheelbase=arms["front"] - arms["rear"],
        pace=crossing.pace,
    )
