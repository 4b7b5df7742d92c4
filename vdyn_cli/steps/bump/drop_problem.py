"""The problem of a drop test: the drops cut from the logs, and the model of the released car."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression
from vdyn_cli.physics.models.dropped_car import AXLES, given
from vdyn_cli.quantities.errors import Finding, ResultError, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.bump.drop_fit import DropFit
from vdyn_cli.steps.bump.drop_result import drop_result
from vdyn_cli.steps.bump.drop_run import DropRun, drop_run, wrong_drop
from vdyn_cli.steps.bump.known_car import car_numbers
from vdyn_cli.steps.bump.parts import suspension_parts
from vdyn_cli.steps.bump.spec import BumpSpec
from vdyn_cli.steps.contract import NO_VALUES, SimulatedProblem
from vdyn_cli.steps.failure import no_runs, unpublished
from vdyn_cli.steps.free_part import Part
from vdyn_cli.steps.free_profiles import profile

FREE_FORCE = 200.0  # N, plausible amplitude of a free profile: dry friction of the struts of an axle
STROKE, STROKE_RATE = 0.05, 0.5  # m, m/s: deflections of springs and dampers in a drop


@dataclass(frozen=True)
class DropProblem(SimulatedProblem):
    """Drops of one rig.

    Parameters
    ----------
    fit : without effects. wheels : number of an axle's wheels on the rig.
    findings : about the description and the logs.
    """

    fit: DropFit
    wheels: int
    findings: tuple[Finding, ...]

    @property
    def model(self) -> Model:
        """The car that is dropped."""
        return self.fit.model

    @property
    def profiles(self) -> tuple[Effect, ...]:
        """Free profiles of force over stroke rate (dampers) and stroke (springs)."""
        return (
            profile("damper_over_rate", "damper", "stroke_rate", (-STROKE_RATE, STROKE_RATE), FREE_FORCE, "N"),
            profile("spring_over_stroke", "spring", "stroke", (-STROKE, STROKE), FREE_FORCE, "N"),
        )

    @property
    def parts(self) -> tuple[Part, ...]:
        """Dampers, springs and tires of the axles on the rig."""
        return suspension_parts(self.fit.axles)

    def regression(self, added: AddedEffects = NO_EFFECTS, start: Mapping[str, float] = NO_VALUES) -> Regression:
        """The heights of all drops, whitened by their noise, with effects in the model."""
        return replace(self.fit, added=added).regression(start)

    def publish(self, added: AddedEffects = NO_EFFECTS) -> Result:
        """Fit springs, dampers and tires to all drops at once, with accepted effects in the model.

        Raises
        ------
        ResultError : the drops do not determine the unknowns.
        """
        fit = replace(self.fit, added=added)
        shown = partial(drop_result, fit, self.wheels, self.findings)
        try:
            solution = fit.solve()
        except ResultError as error:
            raise unpublished(error, shown, (*error.findings, _not_determined(fit.runs))) from None
        return shown(solution)


def _not_determined(runs: Sequence[DropRun]) -> Finding:
    """The finding of a failed fit, with the times taken as the release, before which the car must be held."""
    begins = ", ".join(f"{run.run} {run.time[0]:.4g} s" for run in runs)
    what = f"the drops do not determine springs, dampers and tires; time of the release: {begins}"
    remedy = "if a car is held longer, write the correct 'release' at its run; else drop it from a greater height"
    return Finding("bump", what, "", remedy)


def prepare_drop(spec: BumpSpec, logs: Sequence[Log], known: Parameters) -> DropProblem:
    """The problem of a drop test.

    Parameters
    ----------
    logs : heights of body and wheel (m) over each axle on the rig, one drop each.
    known : masses of the rig, kg; of a half car also lengths and pitch inertia.

    Raises
    ------
    InputError : no drop, a missing mass or height, a drop that is too short or without motion.
    """
    if not logs:
        raise no_runs("bump")
    axles = AXLES if spec.drop.rig == "half_car" else (spec.drop.axle,)
    channels = tuple(f"{what}_height_{end}" for what in ("body", "wheel") for end in axles)
    missing = sorted({n for log in logs for n in channels if n not in log})
    raise_all(
        Finding("channels", f"channel {n} is needed", "", f"add '{n}: {{column: '<header>', unit: m}}'")
        for n in missing
    )
    numbers, findings = _masses(axles, known)
    releases = [run.release.value if run.release else None for run in spec.runs] or [None] * len(logs)
    runs = tuple(drop_run(log, channels, when) for log, when in zip(logs, releases, strict=True))
    raise_all(f for run in runs for f in wrong_drop(run))
    values = {n: g.value for n, g in numbers.items()}
    fit = DropFit(runs, axles, values, {n: g.std for n, g in numbers.items() if g.std > 0})
    return DropProblem(fit, spec.drop.wheels, (*findings, *(f for log in logs for f in log.findings)))


def _masses(axles: tuple[str, ...], known: Parameters) -> tuple[dict[str, Given], tuple[Finding, ...]]:
    """Masses and lengths of the rig, SI, and findings about them."""
    if len(axles) == 2:
        found, findings = car_numbers(known)
        return {n: found[n] for n in given(axles)}, findings
    known.require(*given(axles), where="bump")
    return {n: Given(known[n].value, known[n].std) for n in given(axles)}, ()
