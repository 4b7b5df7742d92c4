"""Output-error fit of drops: springs, dampers and tires from the heights of body and wheels of all runs at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vdyn_cli.engine.model import Model
from vdyn_cli.engine.simulate import Simulated, Simulator
from vdyn_cli.inference import Regression, Rows, Solution, Unknown, solve
from vdyn_cli.physics.models.dropped_car import dropped_car, given, motions, sought
from vdyn_cli.physics.models.half_car import BODY_OF, sprung_body
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.bump.drop_run import DropRun
from vdyn_cli.steps.bump.known_car import carried_masses
from vdyn_cli.steps.bump.measured_channels import MeasuredChannels
from vdyn_cli.steps.contract import NO_VALUES

LARGEST_STEP = 1.1e-3  # s, of the integration
TOLERANCE = 1e-3  # of a residual's variance
FIRST_DAMPING = 0.1  # of critical, start value
TIRE_OVER_SPRING = (4.0, 50.0)  # ratio of stiffnesses, range of the start value


@dataclass(frozen=True)
class DropFit:
    """Drops of one rig, and the unknowns estimated from them.

    Shared unknowns are stiffness and damping of each axle on the rig, the tires' stiffness, uncertain masses and
    lengths, and those of the effects. Unknowns of each run are heights and rates at the start and the sensors' zeros.

    Parameters
    ----------
    axles : on the rig. known : masses and lengths, SI; std : of those that are uncertain.
    """

    runs: tuple[DropRun, ...]
    axles: tuple[str, ...]
    known: Mapping[str, float]
    std: Mapping[str, float]
    added: AddedEffects = NO_EFFECTS

    @property
    def model(self) -> Model:
        """The car that is dropped."""
        return dropped_car(self.axles)

    @property
    def channels(self) -> tuple[str, ...]:
        """The heights that are fitted."""
        return tuple(self.runs[0].heights)

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the coordinates whose start values are unknown, each followed by its rate: m, rad, m/s, rad/s."""
        return tuple(f"{n}{rate}" for n in motions(self.axles) for rate in ("", "_rate"))

    @cached_property
    def sprung(self) -> Mapping[str, float]:
        """The mass that the springs of each axle carry, kg."""
        if len(self.axles) == 1:
            return {self.axles[0]: self.known["sprung_mass"]}
        return carried_masses(self.known)

    @cached_property
    def start(self) -> Mapping[str, float]:
        """Start values: springs from the oscillation's frequency, tires from the ratio of wheel to body motion."""
        found, tires = {}, []
        for end in self.axles:
            body, wheel = f"body_height_{end}", f"wheel_height_{end}"
            turns = 2 * np.pi * float(np.median(np.array([run.frequency(body) for run in self.runs])))
            whole = self.sprung[end] * turns**2  # spring and tires in series
            follow = float(np.median([_wheel_over_body(run, body, wheel) for run in self.runs]))
            ratio = float(np.clip(1 / max(follow, 1e-3) - 1, *TIRE_OVER_SPRING))
            stiffness = whole * (1 + 1 / ratio)
            found[f"suspension_stiffness_{end}"] = stiffness
            found[f"suspension_damping_{end}"] = 2 * FIRST_DAMPING * float(np.sqrt(stiffness * self.sprung[end]))
            tires.append(ratio * stiffness)
        found["tire_vertical_stiffness"] = sum(tires) / len(tires)
        return {n: float(np.clip(v, 1.01 * PARAMETERS[n].lower, 0.99 * PARAMETERS[n].upper)) for n, v in found.items()}

    @cached_property
    def shared(self) -> tuple[Unknown, ...]:
        """The unknowns that all drops share."""
        quantities = [PARAMETERS[n] for n in sought(self.axles)]
        uncertain = [n for n in given(self.axles) if self.std.get(n, 0.0) > 0]
        return (
            *(Unknown(q.name, self.start[q.name], q.lower, q.upper, q.unit) for q in quantities),
            *(Unknown(n, self.known[n], prior=(self.known[n], self.std[n]), nuisance=True) for n in uncertain),
            *self.added.unknowns,
        )

    @cached_property
    def own(self) -> tuple[Unknown, ...]:
        """The unknowns of each drop, without priors: motion at the start (``states``), then the sensors' zeros, m."""
        units = {f"start.{n}": _unit(n) for n in self.states} | {f"{n}_zero": "m" for n in self.channels}
        return tuple(Unknown(n, 0.0, unit=unit, per_run=True, nuisance=True) for n, unit in units.items())

    def _first_own(self) -> dict[str, Array]:
        """Start values of each drop's own unknowns, from the measured heights."""
        found: dict[str, list[float]] = {u.name: [] for u in self.own}
        for run in self.runs:
            bodies = [run.first(f"body_height_{end}") for end in self.axles]
            wheels = [run.first(f"wheel_height_{end}") for end in self.axles]
            motion = dict(zip((f"wheel_{end}" for end in self.axles), wheels, strict=True))
            if len(self.axles) == 1:
                motion["heave"] = bodies[0]
            else:
                (front, rear), base = bodies, self.known["wheelbase"]
                pitch = ((front[0] - rear[0]) / base, (front[1] - rear[1]) / base)
                arm = sprung_body(*(self.known[n] for n in BODY_OF))[1]
                motion |= {"pitch": pitch, "heave": (front[0] - arm * pitch[0], front[1] - arm * pitch[1])}
            for name, (value, rate) in motion.items():
                found[f"start.{name}"].append(value)
                found[f"start.{name}_rate"].append(rate)
            for name in self.channels:
                found[f"{name}_zero"].append(run.rest[name])
        return {n: np.array(v) for n, v in found.items()}

    @cached_property
    def simulator(self) -> Simulator:
        """The model with all unknowns except the sensors' zeros."""
        names = [u.name for u in (*self.shared, *self.own[: len(self.states)])]
        step = max(float(np.median(np.diff(run.time))) for run in self.runs)
        values = {**self.known, **self.start, **{u.name: u.start for u in self.shared}}
        substeps = int(np.ceil(step / LARGEST_STEP))
        return Simulator(self.model, values, names, self.added.effects, substeps=substeps)

    def regression(self, start: Mapping[str, float] = NO_VALUES) -> Regression:
        """The whitened regression over all drops; ``start`` replaces start values of shared unknowns."""
        shared = tuple(replace(u, start=start.get(u.name, u.start)) for u in self.shared)
        return Regression((*shared, *self.own), tuple(run.run for run in self.runs), self.rows, self._first_own())

    def _values_without_effects(self) -> Mapping[str, float]:
        """Shared unknowns of the fit without effects, where there are any; none where it fails.

        A law that softens a damper makes a car with the low damping of the first start values unstable.
        """
        if not self.added.unknowns:
            return NO_VALUES
        try:
            plain = replace(self, added=NO_EFFECTS)
            return solve(plain.regression(), tolerance=TOLERANCE).values
        except ResultError:
            return NO_VALUES

    def solve(self) -> Solution:
        """Fit.

        Raises
        ------
        ResultError : the unknowns are not determined.
        """
        return solve(self.regression(self._values_without_effects()), tolerance=TOLERANCE)

    def simulate(self, run: int, theta: Array) -> Simulated:
        """One drop simulated at its local unknowns ``theta`` (k,): shared, then its own."""
        return self.simulator(self.runs[run].drive, theta[: len(self.simulator.unknowns)])

    def rows(self, run: int, theta: Array) -> Rows:
        """Whitened residuals (n,) and Jacobian (n, k) of one drop, channel by channel; without missing readings."""
        drop, simulated = self.runs[run], self.simulate(run, theta)
        first = len(self.simulator.unknowns)
        measured = MeasuredChannels(drop.time, {n: drop.heights[n] for n in self.channels}, drop.noise)
        return measured.rows(simulated, theta[first:], np.ones(first))


def _unit(coordinate: str) -> str:
    """The unit of a coordinate of ``DropFit.states``."""
    return ("rad" if coordinate.startswith("pitch") else "m") + ("/s" if coordinate.endswith("_rate") else "")


def _wheel_over_body(run: DropRun, body: str, wheel: str) -> float:
    """Ratio of the wheel's to the body's motion: the regression slope of their heights."""
    x, y = run.heights[body] - run.rest[body], run.heights[wheel] - run.rest[wheel]
    good = np.isfinite(x) & np.isfinite(y)
    return float(x[good] @ y[good]) / max(float(x[good] @ x[good]), 1e-12)
