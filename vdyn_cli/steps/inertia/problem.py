"""The problem of a wheel-inertia test: drives cut into windows, the pendulum's recording and its fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression, Solution, Unknown, solve
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.reader import Column, ReadOptions
from vdyn_cli.physics.models.pendulum import MODELS
from vdyn_cli.physics.models.wheel_spin import WHEEL_SPIN
from vdyn_cli.quantities.errors import Finding, InputError, ResultError, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import Result
from vdyn_cli.quantities.vocabulary import CHANNELS, PARAMETERS
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.contract import NO_VALUES, SimulatedProblem
from vdyn_cli.steps.failure import UnpublishedError, unpublished
from vdyn_cli.steps.free_part import Part
from vdyn_cli.steps.free_profiles import profile, span_of
from vdyn_cli.steps.inertia.drive_checks import contradicted_wheel_speed, radius_contradiction, sign_doubts, too_little
from vdyn_cli.steps.inertia.moment_balance import DriveWindows, MomentBalance, drive_windows
from vdyn_cli.steps.inertia.parts import wheel_parts
from vdyn_cli.steps.inertia.result import inertia_result
from vdyn_cli.steps.inertia.road_inertia import KNOWN, RoadInertia, road_inertia
from vdyn_cli.steps.inertia.slow_noise import long_enough, with_scatter, with_shared_noise, with_slow_acceleration
from vdyn_cli.steps.inertia.spec import InertiaSpec
from vdyn_cli.steps.inertia.wheel_inertia import PendulumInertia, pendulum_inertia
from vdyn_cli.steps.pendulum.pendulum_fit import FreeSwing, Recording, free_swing

FREE_TORQUE = 20.0  # N m, plausible amplitude of a free profile
ANY_TIRE = Given(0.010, 0.003)  # rolling resistance of car tires
# Share of noise in the speed that separates inertia from radius, torque's gain and mass. With an error of 5 % of a
# variance it biases the inertia beside one of them by 7.5 % in the diagnosis, about a standard error, and by
# 2.5 % in the published result.
DIAGNOSED_NOISE, PUBLISHED_NOISE = 0.6, 1 / 3


@dataclass(frozen=True)
class InertiaData:
    """The runs on the road, and the pendulum's recording if there is one."""

    runs: tuple[Log, ...]
    recording: Log | None = None


def load(spec: InertiaSpec, folder: Path, logs: tuple[Log, ...]) -> tuple[InertiaData, tuple[Path, ...]]:
    """Read the pendulum's recording, if there is one, and return it with the runs and the paths read.

    Raises
    ------
    InputError : the recording cannot be read.
    """
    rig = spec.pendulum
    if rig is None or rig.log is None:
        return InertiaData(logs), ()
    columns: dict[str, Column] = {
        name: Column(c.column, c.unit, CHANNELS[name].unit, c.sign, scale=c.scale, where=f"pendulum.channels.{name}")
        for name, c in rig.channels.items()
    }
    path = folder / rig.log
    recording = read_log(path, columns, ReadOptions(**rig.reading.model_dump()))
    return InertiaData(logs, replace(recording, name=rig.log)), (path,)


@dataclass(frozen=True)
class InertiaProblem(SimulatedProblem):
    """One wheel on the road, as a pendulum, or both.

    Parameters
    ----------
    known : wheel_mass (kg), wheel_radius (m), rolling_resistance; empty without runs.
    balance : of the runs, None without them.
    findings : about the runs' logs and the known parameters.
    contradicted : why the runs alone cannot give an inertia.
    """

    spec: InertiaSpec
    data: InertiaData
    known: Mapping[str, Given]
    balance: MomentBalance | None
    findings: tuple[Finding, ...]
    contradicted: tuple[Finding, ...] = ()

    @property
    def model(self) -> Model:
        """The wheel on the road; the pendulum where there are no runs."""
        return WHEEL_SPIN if self.spec.pendulum is None or self.data.runs else MODELS[self.spec.pendulum.kind]

    @property
    def profiles(self) -> tuple[Effect, ...]:
        """Free profiles of torque over the wheel's speed and over the torque; none for a pendulum alone."""
        if not self.data.runs:
            return ()
        turn = span_of([log["wheel_speed"] for log in self.data.runs], 1.0)
        torque = span_of([log["hub_torque"] for log in self.data.runs], 1.0)
        return (
            profile("torque_over_speed", "bearing", "wheel_speed", turn, FREE_TORQUE, "N m"),
            profile("torque_over_torque", "hub_torque", "value", torque, FREE_TORQUE, "N m"),
        )

    @property
    def parts(self) -> tuple[Part, ...]:
        """The bearing over the wheel's speed, readings over their value."""
        return wheel_parts(self.data.runs)

    @cached_property
    def swing(self) -> FreeSwing | None:
        """The recording prepared for its fit. Raises ResultError: no oscillation found, too short, or too wide."""
        rig, log = self.spec.pendulum, self.data.recording
        return None if rig is None or log is None else free_swing(Recording.of(log, rig.kind, rig.geometry()))

    @cached_property
    def pendulum(self) -> PendulumInertia | None:
        """The inertia of the suspended wheel. Raises ResultError: no free oscillation, or too short a period."""
        return None if self.spec.pendulum is None else pendulum_inertia(self.spec.pendulum, self.swing)

    @cached_property
    def _diagnosed(self) -> tuple[MomentBalance, float]:
        """The balance of the diagnosis, and its inertia without effects, kg m^2."""
        balance = self._balance_over(DIAGNOSED_NOISE)
        try:
            first = balance.regression(balance.first_inertia, AddedEffects((), self._uncertain))
            return balance, solve(first).values["wheel_inertia"]
        except ResultError:  # the diagnosis starts from here
            return balance, balance.first_inertia

    def _balance_over(self, most_noise: float, least: float = 0.0) -> MomentBalance:
        """The balance over the shortest windows with at most this share of noise, and at least ``least`` s long."""
        assert self.balance is not None
        wheel = self.balance.wheel
        window = max(long_enough(self.data.runs, self.balance.runs, wheel, most_noise), least)
        runs = _windows(self.data.runs, window, wheel)
        return _balance(runs, self.data.runs, wheel, self.balance.torque_zero)

    def regression(self, added: AddedEffects = NO_EFFECTS, start: Mapping[str, float] = NO_VALUES) -> Regression:
        """The regression over the runs on the road, else over the pendulum's recording, with effects in the model.

        Raises
        ------
        InputError : neither runs nor a recording. ResultError : no oscillation found.
        """
        if self.balance is not None:
            balance, inertia = self._diagnosed
            added = replace(added, unknowns=(*self._uncertain, *added.unknowns))
            return balance.regression(start.get("wheel_inertia", inertia), added)
        if self.swing is None:
            what = "a period alone is no time series to diagnose"
            raise InputError(Finding("inertia", what, "", "add 'runs' or a log"))
        return self.swing.regression(added)

    @property
    def _uncertain(self) -> tuple[Unknown, ...]:
        """Uncertain known parameters as unknowns with priors, so that no effect is found that they explain as well."""
        uncertain = {PARAMETERS[n]: (one.value, one.std) for n, one in self.known.items() if one.std > 0}
        return tuple(
            Unknown(q.name, prior[0], q.lower, q.upper, KNOWN[q.name], prior, nuisance=True)
            for q, prior in uncertain.items()
        )

    def publish(self, added: AddedEffects = NO_EFFECTS) -> Result:
        """The wheel's inertia from road, pendulum or both; effects enter the balance on the road.

        Raises
        ------
        ResultError : no method gives an inertia, the pendulum fails, or the interval contains zero.
        """
        pendulum, balance = self.pendulum, self.balance
        road: RoadInertia | None = None
        doubts: tuple[Finding, ...] = ()
        if balance is not None:
            if added.unknowns:
                balance = self._balance_over(PUBLISHED_NOISE, self.spec.settings.window.value)
            gain = self.spec.settings.gain_std
            road_at = partial(road_inertia, balance, self.known, gain.value if gain else 0.0, added)

            def shown(end: Solution) -> Result:
                return inertia_result(road_at(end), None, self.findings, added.unknowns)

            try:
                road = road_at(solve(balance.regression(balance.first_inertia, added)))
                doubts = balance.doubted_inertia(road.solution.values["wheel_inertia"])
            except ResultError as error:
                doubts = balance.negative_inertia() or error.findings
                if pendulum is None:
                    raise unpublished(error, shown, doubts) from None
        recording = self.data.recording
        of_pendulum = (*(recording.findings if recording else ()), *(pendulum.findings if pendulum else ()))
        result = inertia_result(road, pendulum, (*self.findings, *doubts, *of_pendulum), added.unknowns)
        if self.contradicted and pendulum is None:
            raise UnpublishedError(self.contradicted, result)
        return result


def prepare(spec: InertiaSpec, data: InertiaData, known: Parameters) -> InertiaProblem:
    """The problem of a wheel-inertia test.

    Parameters
    ----------
    known : wheel_mass (kg) and wheel_radius (m), where there are runs. Without rolling_resistance, which is nearly
        collinear with the torque's zero, the value of a typical car tire is assumed.

    Raises
    ------
    InputError : neither runs nor a pendulum; an unknown mass or radius; logs that cannot be used, or a wrong sign.
    """
    if not data.runs and spec.pendulum is None:
        raise InputError(Finding("runs", "neither a drive nor a pendulum is given", "", "add 'runs' or 'pendulum'"))
    if not data.runs:
        return InertiaProblem(spec, data, {}, None, ())
    known.require("wheel_mass", "wheel_radius", where="inertia")
    given = {"rolling_resistance": ANY_TIRE} | {n: Given(known[n].value, known[n].std) for n in KNOWN if n in known}
    raise_all(dict.fromkeys(f for log in data.runs for f in sign_doubts(log)))
    given["wheel_radius"], radius_findings = radius_contradiction(data.runs, given["wheel_radius"])
    settings = spec.settings
    zero = float(np.hypot(settings.torque_zero.value, given["wheel_radius"].value * settings.force_zero.value))
    values = {name: one.value for name, one in given.items()}
    runs = _windows(data.runs, settings.window.value, values)
    raise_all(f for run in runs for f in too_little(run))
    balance = _balance(runs, data.runs, values, zero)
    findings = [f for log in data.runs for f in log.findings]
    if "rolling_resistance" not in known:
        what = f"is not known: {ANY_TIRE.value} +- {ANY_TIRE.std} assumed (typical car tire)"
        findings.append(
            Finding("rolling_resistance", what, "", "add the coast-down's result, '--known coastdown.json'")
        )
    contradicted = contradicted_wheel_speed(data.runs, values["wheel_radius"])
    findings += [*radius_findings, *(replace(f, doubt=True) for f in contradicted)]
    return InertiaProblem(spec, data, given, balance, tuple(findings), contradicted)


def _windows(logs: Sequence[Log], window: float, wheel: Mapping[str, float]) -> tuple[DriveWindows, ...]:
    return with_shared_noise([drive_windows(log, window, wheel) for log in logs])


def _balance(
    runs: Sequence[DriveWindows], logs: Sequence[Log], wheel: Mapping[str, float], zero: float
) -> MomentBalance:
    return MomentBalance(with_slow_acceleration(with_scatter(runs, wheel), logs, wheel), wheel, zero)
