"""Bearing friction torque from a wheel that spins down.

J om' = -T0, with the inertia J of the wheel and a constant friction torque T0. Assumes a wheel off the ground that
turns in one direction throughout.

Source: Newton's second law of rotation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Annotated

import numpy as np
from pydantic import Field

from vdyn_cli.description.description_model import Description
from vdyn_cli.description.quantity_field import Si, Strict
from vdyn_cli.effects import Effect
from vdyn_cli.engine.drive import Drive
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import ModelBuilder, Number, Signals
from vdyn_cli.engine.simulate import Simulator
from vdyn_cli.inference import Regression, Rows, Solution, Unknown, solve, white_level
from vdyn_cli.quantities.errors import Finding, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import Comparison, FitSummary, Result
from vdyn_cli.steps import NO_EFFECTS, AddedEffects, Diagnosable, SimulatedProblem, Step
from vdyn_cli.steps.effect_estimates import effect_amplitudes
from vdyn_cli.steps.free_profiles import profile, span_of

NO_VALUES: Mapping[str, float] = MappingProxyType({})
START = "start.wheel_speed"


class SpinDownSettings(Strict):
    """How the recordings are cut."""

    minimum_speed: Annotated[Given, Si("rad/s", 0.0)] = Field(
        Given(0.5), description="samples below this angular speed are not used, rad/s"
    )


class SpinDownSpec(Description):
    """A spin-down test."""

    settings: SpinDownSettings = Field(SpinDownSettings(), description="how the recordings are cut")


def spin_friction(s: Signals) -> Number:
    """Constant friction torque, N m."""
    return s.torque


def _assemble(e: ModelBuilder, u: Signals) -> None:
    speed = e.state("wheel_speed")
    rate = -e(spin_friction, wheel_speed=speed, torque=e.p.spin_torque) / e.p.wheel_inertia
    e.integrate(wheel_speed=rate)
    e.sensor("wheel_speed", speed, rate)


SPIN_DOWN = Model("spin down", _assemble, ("spin_torque", "wheel_inertia"), ())


@dataclass(frozen=True)
class SpinDownProblem(SimulatedProblem):
    """Recordings of one wheel that spins down, and its inertia."""

    spec: SpinDownSpec
    logs: tuple[Log, ...]
    inertia: float

    @property
    def model(self) -> Model:
        """The model that simulates the test."""
        return SPIN_DOWN

    @cached_property
    def profiles(self) -> tuple[Effect, ...]:
        """A torque that is free over the angular speed."""
        span = span_of([log["wheel_speed"] for log in self.logs], 1.0)
        return (profile("torque_over_speed", "spin_friction", "wheel_speed", span, 1.0, "N m"),)

    def regression(self, added: AddedEffects = NO_EFFECTS, start: Mapping[str, float] = NO_VALUES) -> Regression:
        """Angular speeds over their white noise."""
        own = Unknown(START, 0.0, 0.0, 500.0, "rad/s", per_run=True, nuisance=True)
        every = (Unknown("spin_torque", start.get("spin_torque", 0.1), 0.0, 10.0, "N m"), *added.unknowns, own)
        values = {"spin_torque": 0.1, "wheel_inertia": self.inertia}
        simulator = Simulator(SPIN_DOWN, values, [u.name for u in every], added.effects)
        drives = [Drive(log.time, {}) for log in self.logs]
        noise = [white_level(log["wheel_speed"], log.time) for log in self.logs]

        def rows(run: int, theta: np.ndarray) -> Rows:
            found = simulator(drives[run], theta)
            residual = found.outputs["wheel_speed"] - self.logs[run]["wheel_speed"]
            jacobian = found.sensitivities["wheel_speed"]
            return Rows(
                residual / noise[run], jacobian / noise[run], time=self.logs[run].time, plain=(residual, jacobian)
            )

        starts = np.array([log["wheel_speed"][0] for log in self.logs])
        return Regression(every, tuple(log.name for log in self.logs), rows, {START: starts})

    def publish(self, added: AddedEffects = NO_EFFECTS) -> Result:
        """Fit and describe the friction torque."""
        regression = self.regression(added)
        solution = solve(regression)
        value, std = solution.values["spin_torque"], solution.std["spin_torque"]
        interval = solution.interval95["spin_torque"]
        meaning = "constant friction torque of the wheel bearing"
        torque = Estimate(value, std, interval, "N m", meaning, "spindown", value)
        return Result(
            "spindown",
            f"The bearing drags with {value:.3f} N m (95 %: {interval[0]:.3f} to {interval[1]:.3f}).",
            Parameters({"spin_torque": torque}),
            self._summary(solution),
            "Least squares over the white noise of the angular speed.",
            self._comparisons(regression, solution),
            findings=tuple(f for log in self.logs for f in log.findings),
            amplitudes=effect_amplitudes(solution, added.unknowns),
        )

    def _comparisons(self, regression: Regression, solution: Solution) -> tuple[Comparison, ...]:
        shared = [solution.values[u.name] for u in regression.shared]
        found = []
        for run, log in enumerate(self.logs):
            plain = regression.rows(run, np.array([*shared, solution.per_run[START][run]])).plain
            assert plain is not None
            measured = log["wheel_speed"]
            found.append(
                Comparison(log.name, "wheel_speed", "rad/s", log.time, "time in s", measured, measured + plain[0])
            )
        return tuple(found)

    def _summary(self, solution: Solution) -> FitSummary:
        noise = [white_level(log["wheel_speed"], log.time) for log in self.logs]
        off = [np.asarray(r) * n for r, n in zip(solution.residuals, noise, strict=True)]
        rms = float(np.sqrt(np.mean(np.concatenate(off) ** 2)))
        names = tuple(log.name for log in self.logs)
        return FitSummary(names, rms, float(np.mean(noise)), "rad/s", solution.names, solution.unit, solution.n_units)


def prepare(spec: SpinDownSpec, data: tuple[Log, ...], known: Parameters) -> SpinDownProblem:
    """The recordings while the wheel turns.

    Raises
    ------
    InputError : no recording, no known inertia, or a wheel that hardly turns.
    """
    known.require("wheel_inertia", where="spindown")
    logs, problems = [], [] if data else [Finding("runs", "no recording of a wheel that spins down")]
    for log in data:
        turning = np.flatnonzero(log["wheel_speed"] > spec.settings.minimum_speed.value)
        if turning.size < 20:
            problems.append(Finding(log.name, "the wheel hardly turns", remedy="spin it faster"))
        else:
            logs.append(log.between(log.time[turning[0]], log.time[turning[-1]]))
    raise_all(problems)
    return SpinDownProblem(spec, tuple(logs), known["wheel_inertia"].value)


STEP = Step(
    name="spindown",
    spec=SpinDownSpec,
    required=("time", "wheel_speed"),
    optional=(),
    needs=("wheel_inertia",),
    gives=("spin_torque",),
    prepare=prepare,
    diagnosable=Diagnosable(metric=("wheel speed", "rad/s"), run="spin-down"),
    situations=frozenset({"free_spin"}),
)
