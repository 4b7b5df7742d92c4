"""The problem of a bump test: the crossings cut from the logs, and the half car on its bump."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression, Solution
from vdyn_cli.physics.laws.road import Hump, half_sine, haversine
from vdyn_cli.physics.models.half_car import half_car_on_profile, half_car_over
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.bump import text
from vdyn_cli.steps.bump.crossing import CHANNELS
from vdyn_cli.steps.bump.half_car_fit import BumpFit, on_its_road, with_soft_hubs
from vdyn_cli.steps.bump.known_car import known_car
from vdyn_cli.steps.bump.measured_profile import BumpData
from vdyn_cli.steps.bump.noise import ChannelWeights
from vdyn_cli.steps.bump.parts import bump_parts, coordinate_of
from vdyn_cli.steps.bump.result import bump_result
from vdyn_cli.steps.bump.rolling_path import RollingPath, rolling_path
from vdyn_cli.steps.bump.selection import select_crossings
from vdyn_cli.steps.bump.spec import BumpSpec
from vdyn_cli.steps.contract import NO_VALUES, SimulatedProblem
from vdyn_cli.steps.failure import unpublished
from vdyn_cli.steps.free_part import Part
from vdyn_cli.steps.free_profiles import profile

FREE_FORCE = 500.0  # N, plausible amplitude of a free profile: some 6 % of an axle's load
STROKE, STROKE_RATE = 0.05, 0.8  # m, m/s: deflections of springs, tires and dampers on a bump


@dataclass(frozen=True)
class BumpProblem(SimulatedProblem):
    """Crossings of one bump by one car.

    Parameters
    ----------
    fit : without effects. bump_length : m.
    findings : about the description, the bump's profile and the logs. path : of a rolling wheel.
    """

    fit: BumpFit
    bump_length: float
    findings: tuple[Finding, ...]
    path: RollingPath

    @property
    def model(self) -> Model:
        """The half car on the bump that was crossed."""
        return self.fit.model

    @property
    def profiles(self) -> tuple[Effect, ...]:
        """Free profiles of force over stroke rate (dampers), stroke (springs) and compression (tires)."""
        return (
            profile("damper_over_rate", "damper", "stroke_rate", (-STROKE_RATE, STROKE_RATE), FREE_FORCE, "N"),
            profile("spring_over_stroke", "spring", "stroke", (-STROKE, STROKE), FREE_FORCE, "N"),
            profile("tire_over_compression", "tire_vertical", "compression", (-STROKE, STROKE), FREE_FORCE, "N"),
        )

    @property
    def parts(self) -> tuple[Part, ...]:
        """Dampers, springs, tires, the bump and sensors."""
        return bump_parts(self.fit.channels, self.bump_length)

    def coordinate(self, part: Part, solution: Solution) -> Array | None:
        """Values (n,) of a part's coordinate: simulated by the baseline, or measured for the part of a sensor."""
        return coordinate_of(part, self.fit, solution)

    def regression(self, added: AddedEffects = NO_EFFECTS, start: Mapping[str, float] = NO_VALUES) -> Regression:
        """The channels of all crossings, whitened by their noise, with effects in the half car."""
        return replace(self.fit, added=added).regression(start=start)

    def publish(self, added: AddedEffects = NO_EFFECTS) -> Result:
        """Fit springs, dampers and tires to all crossings at once, with accepted effects in the half car.

        Raises
        ------
        ResultError : the crossings do not determine the unknowns.
        """
        fit = replace(self.fit, added=added)
        try:
            weighted, solution = fit.solve()
        except ResultError as error:
            why = (*error.findings, text.NOT_DETERMINED)
            raise unpublished(error, lambda end: bump_result(fit, end, self.findings), why) from None
        result = bump_result(weighted, solution, self.findings)
        doubts = self.path.doubts(self.fit.start[text.TIRE], result.fit.rms)
        return replace(result, findings=(*doubts, *result.findings))


def prepare(spec: BumpSpec, data: BumpData, known: Parameters) -> BumpProblem:
    """The problem of a bump test.

    Parameters
    ----------
    known : the car's masses, lengths and pitch inertia, SI.

    Raises
    ------
    InputError : known numbers or logs that cannot be used, with every reason.
    """
    car, doubtful_car = known_car(spec, known)
    path = rolling_path(spec, data, known)
    model, rolling, width = _models_on_bump(spec, data, path)
    stated = [(run.distance_front, run.distance_rear) for run in spec.runs] or [(None, None)] * len(data.runs)
    crossings, doubtful_runs = select_crossings(data.runs, stated, car, model, width, path.ground)
    channels = [n for n in CHANNELS if all(n in c.channels for c in crossings)]
    rear_weight = spec.settings.rear_weight
    weights = ChannelWeights(dict.fromkeys(channels, 1.0), rear_weight.value if rear_weight else None)
    of_logs = (f for log in data.runs for f in log.findings)
    fit = with_soft_hubs(on_its_road(BumpFit(crossings, model, car, weights)), rolling)
    of_speed = text.changing_speed(fit, path.ground)
    findings = (*doubtful_car, *data.findings, *doubtful_runs, *of_logs, *of_speed, *text.uneven_road(fit))
    return BumpProblem(fit, width, findings, path)


def _models_on_bump(spec: BumpSpec, data: BumpData, path: RollingPath) -> tuple[Model, Model, float]:
    """The half car on the described bump, that on the path of a wheel that rolls over it, and the bump's width, m."""
    if data.profile is not None and not isinstance(path.shape, Hump):
        length = data.profile[-1][0] - data.profile[0][0]
        return half_car_on_profile(data.profile, path.shape), half_car_on_profile(path.shape), length
    assert isinstance(path.shape, Hump)
    assert spec.obstacle.width is not None
    described = half_sine if spec.obstacle.shape == "half_sine" else haversine
    return half_car_over(described, path.shape), half_car_over(path.shape), spec.obstacle.width.value
