"""A validation, prepared once from its description, its logs and the known parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression, Solution, Unknown
from vdyn_cli.physics.laws.grade_resistance import GradeSource
from vdyn_cli.physics.models.road_load import ENGINE_TURNS, road_load
from vdyn_cli.physics.models.vehicle import vehicle
from vdyn_cli.quantities.arrays import Array, filled
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.contract import NO_VALUES, SimulatedProblem
from vdyn_cli.steps.effect_estimates import effect_amplitudes
from vdyn_cli.steps.elevation_grade import ElevationGrade
from vdyn_cli.steps.failure import UnpublishedError
from vdyn_cli.steps.free_part import Part
from vdyn_cli.steps.free_profiles import profile, span_of
from vdyn_cli.steps.run_starts import run_starts, start_findings
from vdyn_cli.steps.scaled_channel import SPEED_OF_WHEEL
from vdyn_cli.steps.validate.car.channel_errors import with_channel_errors
from vdyn_cli.steps.validate.car.integration_step import with_accurate_step
from vdyn_cli.steps.validate.car.prior import (
    ParameterPrior,
    carried_effects,
    dropped_effects,
    parameter_prior,
    resistances,
    with_accepted_effects,
)
from vdyn_cli.steps.validate.car.sensors import Sensors, compared_sensors, has_two_motors
from vdyn_cli.steps.validate.car.simulation import Car, SimulationSetup
from vdyn_cli.steps.validate.car.start_speeds import rms_speed_error
from vdyn_cli.steps.validate.drives.input_torque import DriveInputs
from vdyn_cli.steps.validate.drives.segments import (
    RUN_START,
    SLOWEST,
    DriveSegment,
    RunConditions,
    Segmentation,
    drive_segments,
)
from vdyn_cli.steps.validate.drives.stated_motion import stated_motion
from vdyn_cli.steps.validate.fit.drive_regression import BetweenDriveSpread, drive_regression
from vdyn_cli.steps.validate.fit.effect_fit import fit_effects, fitted, size_beside_parameters
from vdyn_cli.steps.validate.fit.nondifferentiable import (
    DifferentiableReference,
    differentiable_reference,
    likely_cost,
    likely_secants,
    likely_size,
    tried_from_zero,
    with_best_zeros,
)
from vdyn_cli.steps.validate.fit.posterior import posterior
from vdyn_cli.steps.validate.fit.whitening import WhitenedDrives, whiten_drives
from vdyn_cli.steps.validate.fit.whole_drives import is_cut, whole_drives
from vdyn_cli.steps.validate.input_checks import LONGEST_STEP, beyond_band, missed_drives, refuse_coarse
from vdyn_cli.steps.validate.parts import coordinate_values, drive_parts, torque_gain_profile
from vdyn_cli.steps.validate.policy import VALIDATE_POLICY
from vdyn_cli.steps.validate.prediction_band import band_tests, bands
from vdyn_cli.steps.validate.result import result
from vdyn_cli.steps.validate.road.open_road import road_findings
from vdyn_cli.steps.validate.road.road_slope import DriveRoads, sensed_roads
from vdyn_cli.steps.validate.road.slope_evidence import shown_slope
from vdyn_cli.steps.validate.spec import ValidateSpec
from vdyn_cli.steps.validate.validation import Validation

ROAD_LOAD_STEP = 0.05  # s: a mass on a road has no faster dynamics
ROOM_TEMPERATURE = 293.15  # K, where no temperature is given
FREE_FORCE = 100.0  # N, prior standard deviation of a free profile
STARTS = 4  # linearization points of the baseline whose simulations are kept


@dataclass(frozen=True, eq=False)
class ValidateProblem(SimulatedProblem):
    """Drives against a model (contract: ``steps.contract.Problem``).

    Parameters
    ----------
    spec : the description. logs : of its runs, in their order. known : parameters from other steps and the vehicle.
    given_roads : in place of those that accelerometers show.
    grades : of the logs, computed from a logged elevation; empty without.
    missed : rms error of the speed over the whole drives that the windows replace, m/s; 0 if they replace none.
    findings : about the logs as they were read.

    Notes
    -----
    Everything is computed when it is first needed, and at most once. The properties and methods raise InputError
    (missing or unphysical parameters; inputs with gaps or on another clock than the speed) and ResultError (the
    simulation is not finite even with the shortest steps).
    """

    spec: ValidateSpec
    logs: tuple[Log, ...]
    known: Parameters
    given_roads: DriveRoads | None = None
    grades: tuple[ElevationGrade, ...] = ()
    missed: float = 0.0
    findings: tuple[Finding, ...] = ()
    _begun: dict[tuple[tuple[str, float], ...], SimulationSetup] = field(default_factory=dict, init=False, repr=False)
    _likely: dict[str, tuple[float, float]] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def roads(self) -> DriveRoads:
        """The roads from accelerometers; empty where they are not used.

        They are used for powered windows, and for whole drives that the simulation on the stated road misses (most
        often because of hills) if these roads explain part of the error beside errors of load and torque. Not beside
        the grade of a logged elevation: what is left of the slope is then mostly a wrong gain or delay of the speed.
        """
        s = self.spec.settings
        if self.given_roads is not None or s.model != "road_load" or self.grades:
            return self.given_roads or DriveRoads()
        if s.windows:
            return sensed_roads(self.logs) if s.windows.powered else DriveRoads()
        found = sensed_roads(self.logs, scatter=s.zeros.acceleration.value)
        stated = replace(self, given_roads=DriveRoads())
        if not found.inputs or not missed_drives(stated.baseline, VALIDATE_POLICY.hills_error):
            return DriveRoads()
        share, reduction = shown_slope(stated.baseline, self.logs, found.slopes)
        return found if share > 0.0 and reduction > VALIDATE_POLICY.hills_gain else DriveRoads()

    @cached_property
    def segmented(self) -> tuple[tuple[DriveSegment, ...], tuple[Finding, ...]]:
        """The segments that are simulated, and findings about the logs."""
        s = self.spec.settings
        if s.step:
            refuse_coarse(s.model, s.step.value)
        w = s.windows
        rule = Segmentation(s.model, motion=stated_motion(self.known))
        if w:
            rule = replace(rule, length=w.length.value, powered=w.powered, slowest=max(w.slowest.value, SLOWEST))
        day = _day_temperature(self)
        conditions = [
            RunConditions(r.direction, r.temperature.value if r.temperature else day, start)
            for r, start in zip(self.spec.runs, run_starts(self.spec.runs, self.logs), strict=True)
        ]
        logs = self.logs
        if has_two_motors(self.spec, self.logs):  # the sum of both is at the half-shafts, not at the driveline's input
            logs = tuple(
                replace(g, channels={n: v for n, v in g.channels.items() if n != "drive_torque"}) for g in logs
            )
        segments, findings = drive_segments(self.roads.channels(logs), conditions, rule)
        if self.grades:
            segments = [replace(s, slope_error=self.grades[s.run].error_at(s.time)) for s in segments]
        return tuple(segments), (*self.findings, *start_findings(self.spec.runs), *findings)

    @cached_property
    def model(self) -> Model:
        """The model that simulates the drives; its laws can read the start time of the run."""
        s = self.spec.settings
        if s.model == "road_load":
            compared = "acceleration" in _sensors(self).channels
            return _timed(
                road_load(
                    "torque",
                    sensed=bool(self.roads.inputs),
                    specific_force=compared,
                    resistances=resistances(self.known),
                    rolled=_by_wheel(self.spec),
                    changed=any(segment.changed is not None for segment in self.segmented[0]),
                    graded=_graded(self),
                    geared=all(ENGINE_TURNS in log for log in self.logs),
                )
            )
        if has_two_motors(self.spec, self.logs) and s.differential == "locked":
            what = "does not apply to drive_torque_left and drive_torque_right: a motor on each side, no differential"
            raise InputError(Finding("settings.differential", what, repr(s.differential), "leave it out"))
        if _by_wheel(self.spec):
            what = "needs a speed of the car, because the wheels of this model slip"
            remedy = "map 'speed', and this one as wheel_speed_fl, _fr, _rl or _rr; or write 'model: road_load'"
            raise InputError(Finding("settings.model", what, "vehicle", remedy))
        two = has_two_motors(self.spec, self.logs)
        graded = _graded(self)
        return _timed(vehicle(s.driven, "sides" if two else "axle", differential=s.differential, graded=graded))

    @cached_property
    def prior(self) -> ParameterPrior:
        """The prior of the model's parameters and of the amplitudes of effects from earlier steps."""
        sizes = {
            n: e for one in carried_effects(self.model, self.known) for n, e in self.known.extensions[one.name].items()
        }
        return with_accepted_effects(parameter_prior(self.known, self.model.parameters), sizes)

    @cached_property
    def baseline(self) -> SimulationSetup:
        """The simulation without candidate effects, at the prior."""
        segments, findings = self.segmented
        prior, sensors, s = self.prior, _sensors(self), self.spec.settings
        if not segments:
            what = "no segment of any run can be simulated"
            raise InputError(*findings, Finding("runs", what, remedy="check the channels and settings.windows"))
        own_air = on_open_road(self) and "temperature" in self.known and "air_density" not in prior.names
        inputs = DriveInputs(
            segments,
            self.model,
            sensors.zeros.get("drive_torque", 0.0),
            prior.values["air_density"] if own_air else None,
            _day_temperature(self),
            self.known.value("wheel_radius", 1.0) if _by_wheel(self.spec) else 0.0,
        )
        is_vehicle = s.model == "vehicle"
        step = s.step.value if s.step else LONGEST_STEP if is_vehicle else ROAD_LOAD_STEP
        car = Car(inputs, self.model, prior, sensors, step, carried_effects(self.model, self.known))
        return (with_accurate_step(car) if is_vehicle and not s.step else car).at_prior

    @cached_property
    def reference(self) -> DifferentiableReference:
        """The car without nondifferentiable effects (free play), with which their amplitudes are compared."""
        return differentiable_reference(self.baseline.point.car)

    @property
    def profiles(self) -> tuple[Effect, ...]:
        """Two free forces: over the speed, and over the time of a drive; for a mass also a torque gain over speed."""
        speed = span_of([log["speed"] for log in self.logs], 1.0)
        day = span_of([log.time - log.time[0] for log in self.logs], 1.0)
        forces = (
            profile("force_over_speed", "driveline", "speed", speed, FREE_FORCE, "N"),
            profile("force_over_drive", "driveline", "elapsed", day, FREE_FORCE, "N"),
        )
        return forces if self.model.name == "vehicle" else (*forces, torque_gain_profile(speed))

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """For a mass on a road, the driveline over torque, and the resistance over speed, time and direction.

        Empty where the slope comes from a sensor, whose errors a free force would absorb, and for the full vehicle,
        where each part costs minutes.
        """
        simple = self.model.name != "vehicle" and not self.roads.inputs
        return drive_parts(self.segmented[0], self.prior) if simple else ()

    def coordinate(self, part: Part, solution: Solution) -> Array | None:
        """The values (n,) of a part's coordinate in all segments, as measured."""
        return coordinate_values(part, self.segmented[0])

    @cached_property
    def coarse_error(self) -> Callable[[AddedEffects], float] | None:
        """added effects -> rms error of the speed, m/s, if the baseline is far off; else None.

        Far off: the simulation misses whole drives by far more than the parameters' uncertainty explains.
        """
        whitened = None if self.spec.settings.windows else whiten_drives(self.baseline)
        if whitened is None or not (missed_drives(whitened.setup) and beyond_band(bands(whitened))):
            return None
        return lambda added: rms_speed_error(self.baseline.with_effects(added))

    def regression(self, added: AddedEffects = NO_EFFECTS, start: Mapping[str, float] = NO_VALUES) -> Regression:
        """The whitened regression of all outputs; its noise is estimated with the effects in the model.

        The shared unknowns are all parameters with a standard deviation, which is their prior. For a vehicle, ``start``
        moves the point of linearization: about shafts with a wrong natural frequency, a linearized fit would give too
        much damping.
        """
        base = _started(self, start if self.model.name == "vehicle" else NO_VALUES)
        extended = base.with_effects(added)
        if not tried_from_zero(added):
            return _whitened(self, extended, start=start)
        full = DifferentiableReference(extended)
        if not full.misfit:  # the effects explain the drives without play
            return full.whitened.regression
        secants = likely_secants(added, self.likely_size)
        return _whitened(self, replace(full.whitened.setup, secants=secants))

    def chord_regression(self, added: AddedEffects, start: Mapping[str, float]) -> Regression:
        """The regression with the bare car's sensitivities to its parameters; exact ones for a mass on a road."""
        if self.model.name != "vehicle":
            return self.regression(added, start)
        extended = _started(self, start).with_effects(added)
        return _whitened(self, replace(extended, chord=True))

    def publish(self, added: AddedEffects = NO_EFFECTS) -> Result:
        """Simulate the drives with the model, extended by these effects, and describe how well it predicts them.

        Raises
        ------
        UnpublishedError : the simulation misses whole drives; the error contains the result with its figures.
        """
        setup = self.baseline.with_effects(added)
        findings, amplitudes, fit, road = [*dropped_effects(self.model, self.known), *self.segmented[1]], {}, None, None
        if added.unknowns:
            fit = fit_effects(setup, partial(_whitened, self, covered=added.covered), self.reference)
            setup = fit.setup
            amplitudes = effect_amplitudes(fit.solution, added.unknowns, fit.spreads)
            findings += fit.doubts
        whitened = shown = _predicted(self, setup, added.covered)
        if fit is not None and on_open_road(self):
            shown = whiten_drives(fitted(setup, fit.solution))
            road = road_findings(fit, self.logs, self.roads.sensed)
        found = bands(shown)
        tests, chance = band_tests(shown, found)
        # The bands are shown without fitted zeros of the drive torque, since the baseline has none.
        zeroed = with_best_zeros(setup, self.reference)
        after = posterior(whitened if zeroed is setup else _predicted(self, zeroed, added.covered))
        validation = Validation(whitened, shown, found, tests, chance, after, road, self.missed)
        missed = () if self.spec.settings.windows else missed_drives(whitened.setup)
        if missed and beyond_band(found):
            raise UnpublishedError(missed, result(self.spec, self.logs, validation, amplitudes, findings))
        return result(self.spec, self.logs, validation, amplitudes, [*findings, *missed])

    def likely_size(self, effect: Effect, start: Callable[[float], tuple[Unknown, ...]]) -> tuple[float, float]:
        """The most likely amplitude, SI, of a nondifferentiable effect alone in the model, and its log likelihood gain.

        The gain, at least 0, is in natural logarithm. It is computed once for each effect.
        """

        def setup(size: float) -> SimulationSetup:
            return self.baseline.with_effects(AddedEffects((effect,), start(size)))

        if effect.name not in self._likely:
            least, *_, most = effect.probes
            size, gain = likely_size(setup, self.reference, least, most)
            if gain > VALIDATE_POLICY.certain_play:
                best = size_beside_parameters(setup, partial(_whitened, self), self.reference, size)
                without = likely_cost(self.reference, setup(0.0))
                size, gain = (best[0], without - best[1]) if best and without - best[1] > gain else (size, gain)
            self._likely[effect.name] = size, gain
        return self._likely[effect.name]


def _by_wheel(spec: ValidateSpec) -> bool:
    """Whether the speed is computed from that of a wheel: the stated radius is then also its gain."""
    return "speed" not in spec.mapped and SPEED_OF_WHEEL.source in spec.mapped


def _graded(problem: ValidateProblem) -> GradeSource:
    """The source of the grade; a constant one of a mapped channel is stated."""
    if problem.grades:
        return "elevation"
    logged = [(log, log["grade"]) for log in problem.logs if "grade" in log and "grade" in problem.spec.mapped]
    return "sensor" if any(float(np.ptp(filled(log.time, g))) > 0.0 for log, g in logged) else "stated"


def _timed(model: Model) -> Model:
    return replace(model, context=(*model.context, RUN_START))


def on_open_road(problem: ValidateProblem) -> bool:
    """Whether drives with unknown mean slope and load are cut into windows; each drive is then one unit."""
    s = problem.spec.settings
    return s.model == "road_load" and s.windows is not None and s.windows.powered and bool(problem.roads.sensed)


def _started(problem: ValidateProblem, start: Mapping[str, float]) -> SimulationSetup:
    """The baseline started at these values; the last few are cached, since the diagnosis repeats them."""
    key, begun = tuple(start.items()), problem._begun
    if key not in begun:
        made = problem.baseline.begun_at(start) if start else problem.baseline
        if len(begun) == STARTS:
            del begun[next(iter(begun))]
        begun[key] = with_best_zeros(made, problem.reference)
    return begun[key]


def _whitened(
    problem: ValidateProblem,
    setup: SimulationSetup,
    start: Mapping[str, float] = NO_VALUES,
    covered: frozenset[str] = frozenset(),
) -> Regression:
    """The regression of drives, or of windows grouped by drive where an accelerometer shows the slope.

    ``covered``: nuisance parameters that effects in the model replace. ``start``: values of the others.
    """
    if not on_open_road(problem):
        made = with_channel_errors(with_best_zeros(setup, problem.reference), covered, start)
        return whole_drives(made) if is_cut(made) else whiten_drives(made, averaged=True).regression
    s = problem.spec.settings
    zeros = tuple(road.zero for road in problem.roads.sensed)
    spread = BetweenDriveSpread(s.drives.slope.value, s.drives.load.value, s.zeros.acceleration.value, zeros)
    return drive_regression(setup, spread)


def _predicted(problem: ValidateProblem, setup: SimulationSetup, covered: frozenset[str]) -> WhitenedDrives:
    """The drives with the parameters of their prior, and noise without the errors of channels that a fit contains."""
    return whiten_drives(setup if on_open_road(problem) else with_channel_errors(setup, covered, NO_VALUES))


def _sensors(problem: ValidateProblem) -> Sensors:
    return compared_sensors(problem.spec, problem.logs, problem.segmented[0], bool(problem.roads.sensed))


def _day_temperature(problem: ValidateProblem) -> float:
    return problem.known.value("temperature", ROOM_TEMPERATURE)
