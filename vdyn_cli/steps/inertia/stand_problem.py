"""The problem of a wheel on a stand: its runs cut into windows, and the balance of its hub torque."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression, Solution, Unknown, exceeds_noise, solve
from vdyn_cli.physics.models.free_wheel import DRAG, FREE_WHEEL
from vdyn_cli.quantities.errors import Finding, InputError, ResultError, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.contract import NO_VALUES, SimulatedProblem
from vdyn_cli.steps.failure import no_runs, unpublished
from vdyn_cli.steps.free_part import Part
from vdyn_cli.steps.free_profiles import profile, span_of
from vdyn_cli.steps.inertia.drive_checks import empty_channels, too_little
from vdyn_cli.steps.inertia.moment_balance import DriveWindows, MomentBalance, drive_windows
from vdyn_cli.steps.inertia.parts import bearing_part
from vdyn_cli.steps.inertia.slow_noise import with_scatter
from vdyn_cli.steps.inertia.spec import InertiaSpec
from vdyn_cli.steps.inertia.stand_result import stand_result
from vdyn_cli.steps.sign_conventions import cosine, wrong_sign
from vdyn_cli.steps.step_policy import STEP_POLICY

FREE_TORQUE = 5.0  # N m, plausible amplitude of a free profile: several times the drag of a wheel bearing


@dataclass(frozen=True)
class StandProblem(SimulatedProblem):
    """A free wheel, spun up and down by a torque at its hub.

    Parameters
    ----------
    balance : of the runs. findings : of their logs.
    """

    spec: InertiaSpec
    logs: tuple[Log, ...]
    balance: MomentBalance
    findings: tuple[Finding, ...]

    @property
    def model(self) -> Model:
        """The free wheel."""
        return FREE_WHEEL

    @property
    def profiles(self) -> tuple[Effect, ...]:
        """A free profile of torque over the wheel's speed.

        There is none over the torque itself, because a test has few levels of torque, so that noise would distort it.
        """
        turn = span_of([log["wheel_speed"] for log in self.logs], 1.0)
        return (profile("torque_over_speed", "bearing", "wheel_speed", turn, FREE_TORQUE, "N m"),)

    @property
    def parts(self) -> tuple[Part, ...]:
        """The bearing over the wheel's speed.

        Not the torque reading over its value: an error of -1 times the torque leaves a wheel without inertia and drag,
        which fulfills the balance without residual.
        """
        return bearing_part(self.logs)

    @cached_property
    def first_inertia(self) -> float:
        """The inertia without effects, kg m^2; a start value where it cannot be fitted."""
        try:
            return solve(self.balance.regression(self.balance.first_inertia)).values["wheel_inertia"]
        except ResultError:  # the diagnosis starts from here
            return self.balance.first_inertia

    def regression(self, added: AddedEffects = NO_EFFECTS, start: Mapping[str, float] = NO_VALUES) -> Regression:
        """The regression over the runs, with effects in the wheel's balance."""
        return self._balance(start).regression(start.get("wheel_inertia", self.first_inertia), added)

    def _balance(self, start: Mapping[str, float]) -> MomentBalance:
        drag = tuple(replace(u, start=start.get(u.name, u.start)) for u in self.balance.drag)
        return replace(self.balance, drag=drag)

    def publish(self, added: AddedEffects = NO_EFFECTS) -> Result:
        """Fit inertia and bearing drag, with accepted effects in the balance.

        Raises
        ------
        ResultError : the runs do not determine an inertia.
        """

        def shown(solution: Solution) -> Result:
            return stand_result(self.balance, solution, self.spec.settings, self.findings, added.unknowns)

        try:
            solution = solve(self.balance.regression(self.balance.first_inertia, added))
        except ResultError as error:
            raise unpublished(error, shown) from None
        return shown(solution)


def prepare_stand(spec: InertiaSpec, logs: Sequence[Log], known: Parameters) -> StandProblem:
    """The problem of a wheel on a stand.

    Parameters
    ----------
    logs : hub_torque (N m) and wheel_speed (rad/s), one for each run.
    known : not read.

    Raises
    ------
    InputError : no run, a pendulum in the description, a wrong sign, a run that is too short or of constant torque.
    """
    if spec.pendulum is not None:
        what = "a wheel on a stand and a pendulum are two tests"
        raise InputError(Finding("pendulum", what, "", "write a separate description for each"))
    if not logs:
        raise no_runs("inertia")
    raise_all(dict.fromkeys(f for log in logs for f in _sign_doubts(log)))
    windows = tuple(drive_windows(log, spec.settings.window.value, {}, FREE_WHEEL) for log in logs)
    raise_all(f for run in windows for f in (too_little(run) or _steady_torque(run)))
    drag = tuple(Unknown(n, 0.0, PARAMETERS[n].lower, PARAMETERS[n].upper, PARAMETERS[n].unit) for n in DRAG)
    balance = MomentBalance(with_scatter(windows, {}), {}, spec.settings.torque_zero.value, FREE_WHEEL, drag)
    return StandProblem(spec, tuple(logs), balance, tuple(f for log in logs for f in log.findings))


def _sign_doubts(log: Log) -> list[Finding]:
    """Findings on empty channels, and on a torque whose sign contradicts the wheel's acceleration."""
    if empty := empty_channels(log, FREE_WHEEL.inputs):
        return empty
    speed = log["wheel_speed"]
    good = np.isfinite(speed)
    edges = np.arange(log.time[0], log.time[-1], 0.25)
    gained = np.diff(np.interp(edges, log.time[good], speed[good]))
    torque = log["hub_torque"] - np.nanmean(log["hub_torque"])
    there = np.isfinite(torque)
    mean = np.interp(edges[1:] - 0.125, log.time[there], torque[there])
    alike = cosine(gained - gained.mean(), mean) if gained.size > 2 else 0.0
    if alike < -STEP_POLICY.sign_correlation:
        what = "the wheel slows down while the torque is high"
        return [wrong_sign(log.name, "hub_torque", what, f"correlation {alike:.2f}")]
    return []


def _steady_torque(run: DriveWindows) -> list[Finding]:
    """A finding where the torque is constant, which determines only the ratio of drag to inertia."""
    mean = np.array([run.log["hub_torque"][a:b].mean() for a, b in zip(run.first, run.last, strict=True)])
    noise = run.noise.torque * float(np.sqrt(np.mean(1.0 / np.maximum(run.last - run.first, 1))))
    if exceeds_noise(float(np.std(mean)), noise, mean.size):
        return []
    remedy = "spin the wheel up with a torque and let it run down, several times"
    return [Finding(run.log.name, "the hub torque is constant within its noise", "", remedy)]
