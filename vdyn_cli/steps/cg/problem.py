"""A load-transfer test, prepared once: its runs cut into windows, the balance, and the fit without effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression, Solution, Unknown, solve
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.cg.gps_zero import gps_zero
from vdyn_cli.steps.cg.input_checks import ready_runs, weight_doubts
from vdyn_cli.steps.cg.known_vehicle import KnownVehicle, known_vehicle
from vdyn_cli.steps.cg.load_fit import LoadFit
from vdyn_cli.steps.cg.load_windows import cut_windows
from vdyn_cli.steps.cg.result import cg_result
from vdyn_cli.steps.cg.spec import CgSpec
from vdyn_cli.steps.contract import NO_VALUES, SimulatedProblem
from vdyn_cli.steps.effect_estimates import unbounded
from vdyn_cli.steps.free_profiles import profile, span_of

FREE_MOMENT = 500.0  # N m, plausible size of a free profile: a tenth of the moment of braking at 6 m/s^2
ROUNDS = 2  # of the fit with all effects, for noise and true channels: they only serve the linearization there
TOLERANCE = 1e-2  # of one residual's variance that a further step of that fit may still gain
HEADING = {"out": 1.0, "back": -1.0, None: 0.0}


@dataclass(frozen=True)
class CgProblem(SimulatedProblem):
    """Accelerate-and-brake runs of one car.

    Parameters
    ----------
    logs : of the runs, as read. fit : without effects.
    findings : about the description and the logs.
    """

    logs: tuple[Log, ...]
    vehicle: KnownVehicle
    fit: LoadFit
    findings: tuple[Finding, ...]

    @property
    def model(self) -> Model:
        """The moment balance that these logs allow."""
        return self.fit.model

    @property
    def profiles(self) -> tuple[Effect, ...]:
        """Moments that are free over the acceleration and over the pitch rate."""
        push = span_of([log["acceleration"] for log in self.logs], 1.0)
        rates = [log["pitch_rate"] for log in self.logs if "pitch_rate" in log] or [np.array([-0.1, 0.1])]
        return (
            profile("moment_over_acceleration", "motion_moment", "acceleration", push, FREE_MOMENT, "N m"),
            profile("moment_over_pitch_rate", "motion_moment", "pitch_rate", span_of(rates, 0.02), FREE_MOMENT, "N m"),
        )

    @property
    def duration(self) -> float:
        """Length of the longest run, s."""
        return max(log.duration for log in self.logs)

    @cached_property
    def baseline(self) -> Solution:
        """The fit without effects; raises ResultError as ``publish``."""
        return self.fit.solve()

    def fit_with(self, effects: Sequence[Effect], unknowns: Sequence[Unknown]) -> LoadFit:
        """The fit with effects in the balance, and their unknowns, shared by all runs."""
        return replace(self.fit, effects=tuple(effects), effect_unknowns=tuple(unknowns))

    def regression(
        self,
        effects: Sequence[Effect] = (),
        unknowns: Sequence[Unknown] = (),
        start: Mapping[str, float] = NO_VALUES,
    ) -> Regression:
        """All windows of all runs, with effects in the balance.

        Noise and true channels are as the fit with all effects leaves them, where the runs determine that (with priors
        on ``unknowns`` they always do), else as at the start.

        Raises
        ------
        ResultError : the runs do not determine the unknowns without effects.
        """
        if not unknowns:
            return self.fit.regression(self.fit.place(self.baseline), self.fit.place(self.baseline, start))
        fit, whole = (self.fit_with(effects, x) for x in (unknowns, unbounded(unknowns)))
        at = first = fit.place(self.fit.first_solution)
        try:
            for _ in range(ROUNDS):
                at = whole.place(solve(whole.regression(at), tolerance=TOLERANCE))
        except ResultError:
            at = first
        return fit.regression(at, fit.place(self.fit.first_solution, start))

    def publish(self, effects: Sequence[Effect] = (), unknowns: Sequence[Unknown] = ()) -> Result:
        """Fit height, position and pitch inertia to all runs at once, with accepted effects in the balance.

        Raises
        ------
        ResultError : the runs do not determine the unknowns, or the balance does not settle.
        """
        if not unknowns:
            return cg_result(self.fit, self.baseline, self.vehicle, self.findings)
        fit = self.fit_with(effects, unknowns)
        return cg_result(fit, fit.solve(), self.vehicle, self.findings)


def prepare(spec: CgSpec, logs: Sequence[Log], known: Parameters) -> CgProblem:
    """The problem of a load-transfer test.

    Parameters
    ----------
    known : mass, wheelbase and antenna_height at least, SI.

    Raises
    ------
    InputError : known numbers or logs that cannot be used, with every reason.
    """
    vehicle = known_vehicle(spec, known)
    load_zero = spec.settings.load_zero.value
    headings = [HEADING[run.direction] for run in spec.runs] or [0.0] * len(logs)
    runs = tuple(cut_windows(log, way) for log, way in zip(ready_runs(spec, logs), headings, strict=True))
    findings = [*vehicle.findings, *weight_doubts(logs, vehicle, load_zero)]
    findings += gps_zero(logs) if spec.settings.accelerometer == "gps" else []
    findings += [f for log in logs for f in log.findings]
    return CgProblem(tuple(logs), vehicle, LoadFit(runs, vehicle.values, load_zero), tuple(findings))
