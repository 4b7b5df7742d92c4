"""The problem of a half-shaft test: readings, drawings and pendulum bars of both sides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression
from vdyn_cli.inference.uncertainty_budget import propagate
from vdyn_cli.physics.laws.twist_friction import shows_reversals
from vdyn_cli.physics.models.half_shaft import HALF_SHAFT, NOISY_HALF_SHAFT
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.contract import NO_VALUES, SimulatedProblem
from vdyn_cli.steps.free_part import Part
from vdyn_cli.steps.free_profiles import KNOTS, profile
from vdyn_cli.steps.pendulum.pendulum_inertia import UNITS, rod_stiffness
from vdyn_cli.steps.shaft.changed_run import ChangedRun, changed_run
from vdyn_cli.steps.shaft.combined_regression import combined_regression
from vdyn_cli.steps.shaft.encoder_clock import with_aligned_ends
from vdyn_cli.steps.shaft.encoder_eccentricity import with_centered_encoder
from vdyn_cli.steps.shaft.parts import shaft_parts, symmetric_span
from vdyn_cli.steps.shaft.result import shaft_result
from vdyn_cli.steps.shaft.sections import drawing_budget
from vdyn_cli.steps.shaft.shaft_readings import readings_of
from vdyn_cli.steps.shaft.shaft_side import ShaftSide
from vdyn_cli.steps.shaft.spec import SIDES, ShaftSpec
from vdyn_cli.steps.shaft.stiffness_comparison import compared_stiffness
from vdyn_cli.steps.shaft.torque_clock import UNKNOWN, assumed_delay, torque_delay
from vdyn_cli.steps.shaft.torque_filter import torque_filter
from vdyn_cli.steps.wider_intervals import with_wider_intervals

FREE_TORQUE = 50.0  # N m, plausible amplitude of a free profile
TWIST, TWIST_RATE = 0.05, 1.0  # rad, rad/s: twist of a half-shaft in a tip-in, and its rate
RESOLVED = 3.0  # standard deviations of a reading per knot interval: 13 % of the readings are in a wrong one
STEEL = Given(79.3e9, 0.8e9)  # Pa, shear modulus of the steels of half-shafts

HOLD_RUNS = "The interval includes the stiffness of each run."


@dataclass(frozen=True)
class ShaftProblem(SimulatedProblem):
    """Half-shafts of a car with a drawing, a pendulum test, logs, or several of them.

    Parameters
    ----------
    sides : those with any data.
    findings : about the shear modulus. log_findings : about the logs.
    """

    sides: tuple[ShaftSide, ...]
    findings: tuple[Finding, ...]
    log_findings: tuple[Finding, ...]

    @property
    def model(self) -> Model:
        """The half-shaft as a torsional spring and damper; with friction where every twist shows its reversals."""
        noises = [run.noise[1] for side in self.sides for run in side.runs]
        return HALF_SHAFT if all(map(shows_reversals, noises)) else NOISY_HALF_SHAFT

    @property
    def profiles(self) -> tuple[Effect, ...]:
        """Free profiles of torque over the twist, and over its rate where the logs resolve that."""
        over_twist = profile("torque_over_twist", "shaft", "twist", (-TWIST, TWIST), FREE_TORQUE, "N m")
        if not self._resolves_rate:
            return (over_twist,)
        rate = (-TWIST_RATE, TWIST_RATE)
        return over_twist, profile("torque_over_twist_rate", "shaft", "twist_rate", rate, FREE_TORQUE, "N m")

    @property
    def parts(self) -> tuple[Part, ...]:
        """Torque over twist, and over its rate where the logs resolve that."""
        logged = [side for side in self.sides if side.runs]
        if not logged:
            return ()
        runs = [run for side in logged for run in side.runs]
        twist, rate = symmetric_span([r.twist for r in runs]), symmetric_span([r.rate for r in runs])
        found = shaft_parts([side.name for side in logged], twist, rate)
        return found if self._resolves_rate else found[:1]

    @cached_property
    def _resolves_rate(self) -> bool:
        """Whether the noise of the rate is well below the knot distance of a free law over it.

        With more noise, the noise decides to which knot a reading belongs, and a free law fits the noise.
        """
        knot = 2 * TWIST_RATE / (KNOTS - 1)
        return all(RESOLVED * noise < knot for side in self.sides if side.runs for noise in side.rate_noise)

    def regression(self, added: AddedEffects = NO_EFFECTS, start: Mapping[str, float] = NO_VALUES) -> Regression:
        """The regression over the logs of both sides, with effects in the shafts' law; drawings are priors of the bars.

        Raises
        ------
        InputError : no log.
        """
        logged = [side for side in self.sides if side.runs]
        if not logged:
            raise InputError(Finding("shaft", "without a log there is no measurement to compare", "", "add 'runs'"))
        return combined_regression({side.name: side.regression(added) for side in logged})

    def publish(self, added: AddedEffects = NO_EFFECTS) -> Result:
        """Stiffness of each side with a drawing or a test, and damping where it was logged.

        Each side is fitted separately, also with effects in the law. If an effect is in series with the bar, the
        stiffness of both together is published, which is that of the car.

        Raises
        ------
        ResultError : a log does not determine a stiffness.
        """
        sides = []
        changed: dict[str, ChangedRun] = {}
        for side in self.sides:
            logged = side.logged(added) if side.runs else None
            sides.append(compared_stiffness(side, logged))
            one = changed_run(side.runs, side.linear) if side.runs and not added.effects else None
            changed |= {f"shaft_stiffness_{side.name}": one} if one else {}
        of_sides = (f for side in sides for f in side.findings)
        said = [one.finding for one in changed.values()]
        result = shaft_result(sides, (*self.findings, *of_sides, *self.log_findings), said)
        wide = {n: _spanning(result.parameters[n], one.span) for n, one in changed.items()}
        estimates = {**result.parameters.estimates, **wide}
        return with_wider_intervals(result, replace(result.parameters, estimates=estimates), HOLD_RUNS)


def _spanning(one: Estimate, span: tuple[float, float]) -> Estimate:
    """The estimate with an interval that also includes ``span``, and a standard deviation of its longer side."""
    low, high = min(one.interval95[0], span[0]), max(one.interval95[1], span[1])
    std = max(one.std, max(high - one.value, one.value - low) / NORMAL95)
    return replace(one, interval95=(low, high), std=std)


def prepare(spec: ShaftSpec, logs: Sequence[Log], known: Parameters) -> ShaftProblem:
    """The problem of a half-shaft test.

    Parameters
    ----------
    logs : shaft_torque (N m), and twist (rad) or motor_speed and wheel_speed (rad/s), one for each run.
    known : shear_modulus (Pa), where the description has none.

    Raises
    ------
    InputError : neither drawing, bar nor log is given; or as :func:`readings_of`.
    """
    aligned, late_end, apart = with_aligned_ends(logs, spec.settings.gear_ratio.value)
    centered = [with_centered_encoder(log, spec.settings.gear_ratio.value) for log in aligned]
    eccentric = [finding for _, findings in centered for finding in findings]
    logs = [log for log, _ in centered]
    read = cache(lambda seconds: readings_of(spec, logs, seconds))
    stated = spec.settings.torque_delay
    delay, clocks = torque_delay(read, assumed_delay(logs, late_end) if stated is None else stated)
    # Damping is confounded with the filter's time constant as with a delay.
    lag, lag_std, filters = torque_filter(read(delay.value))
    delay = Given(delay.value, float(np.hypot(delay.std, lag_std)))
    # A physical damping bounds the delay, however uncertain the stated one is.
    within = min(delay.std, UNKNOWN)
    taken = [read(delay.value + d) for d in ((0.0, -within, within) if within else (0.0,))]
    readings, *near = taken if lag is None else [lag.through(one) for one in taken]
    modulus, findings = _shear_modulus(spec, known)
    sides = []
    for name in SIDES:
        sections = tuple(spec.sections.get(name, ()))
        drawing = drawing_budget(sections, modulus) if sections else None
        bar = propagate(rod_stiffness, spec.pendulum[name].measured(), UNITS) if name in spec.pendulum else None
        if readings[name] or drawing or bar:
            gain = spec.settings.torque_gain.value
            shifted = tuple(one[name] for one in near) if readings[name] else ()
            relaxation = lag.relaxation if lag else 0.0
            of_log = shifted, stated is None, relaxation
            sides.append(ShaftSide(name, readings[name], sections, drawing, bar, gain, delay, *of_log))
    if not sides:
        remedy = "add 'sections' with a drawing, or 'runs' with a tip-in log"
        raise InputError(Finding("shaft", "neither a drawing nor a log is given", "", remedy))
    log_findings = (*apart, *eccentric, *clocks, *filters, *(f for log in logs for f in log.findings))
    return ShaftProblem(tuple(sides), findings, log_findings)


def _shear_modulus(spec: ShaftSpec, known: Parameters) -> tuple[Given, tuple[Finding, ...]]:
    """Shear modulus, Pa, from the description, the vehicle, or that of steel; with a finding where it is assumed."""
    if spec.shear_modulus is not None:
        return spec.shear_modulus, ()
    if "shear_modulus" in known:
        return Given(known["shear_modulus"].value, known["shear_modulus"].std), ()
    if not spec.sections:
        return STEEL, ()
    what = f"is not given: {STEEL.value / 1e9:g} +- {STEEL.std / 1e9:g} GPa assumed (steel)"
    return STEEL, (Finding("shear_modulus", what, "", "add 'shear_modulus: 79.3 +- 0.5 GPa'"),)
