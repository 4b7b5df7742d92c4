"""The input of a diagnosis: a prepared step and the candidate effects that its description allows."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from vdyn_cli.description.description_model import Description, Diagnose
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.relaxed_regression import relaxed
from vdyn_cli.effects import Effect, candidates, enlarged
from vdyn_cli.engine.applicable import applicable, missing_signals
from vdyn_cli.inference import Regression, Unknown
from vdyn_cli.quantities.errors import Finding, raise_all
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps import Problem, SimulatedProblem, Step, simulated_problem
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.manoeuvre import Manoeuvre


@dataclass(frozen=True)
class PreparedStep:
    """A step with its description, the known parameters and the problem prepared from them."""

    step: Step
    spec: Description
    known: Parameters
    problem: Problem

    @property
    def simulated_problem(self) -> SimulatedProblem:
        """The problem of a diagnosable step, which simulates its runs."""
        problem = simulated_problem(self.step, self.problem)
        assert problem is not None
        return problem


@dataclass(frozen=True)
class DiagnosisSetup:
    """A step's data and model, and the candidate effects.

    Parameters
    ----------
    regression : (added effects, start) -> the step's regression with effects in the model; ``start`` are values of the
        step's own unknowns about which a linearized problem is linearized.
    chord_regression : the same, but sensitivities to the step's own unknowns may be those without the effects.
    effects : the candidates applicable to model and data.
    lacking : by name, the other effects of the catalog that one more channel would make testable, and that channel
        with what the logs lack.
    profiles : free profiles, each over one coordinate (speed, time, position ...).
    directions : of each fitted run, out or back; empty where nothing depends on them.
    run : what a run is called (a coast, a drive, a crossing).
    fewest_runs : least number of runs for a diagnosis.
    too_short : why runs this short cannot discriminate between effects.
    level : false-alarm probability, 0 to 1.
    linearized : whether the model is so expensive that linearizations are fitted. Its parameters then have priors, and
        the step simulates at their means, so that moving them in a fit is no gain.
    nondifferentiable : whether an effect without a slope at zero is in the baseline, which is then relinearized until
        it settles.
    coarse_error : added effects -> rms error of the main channel at the unknowns' starts, nothing fitted, if the
        baseline is far off: candidates are then tried from coarse starts, and an error is certain. None otherwise.
    likely_size : (effect, start) -> the most likely amplitude of a nondifferentiable effect alone in the model and its
        gain in log likelihood; ``start(amplitude)`` are its unknowns. None if such effects are not searched.
    stated : by unknown of an effect, the stated standard deviation of the quantity that it corrects.
    learned : names of the effects that were learned from these data.
    manoeuvres : (regression with every candidate, its shared unknowns at the baseline's fit) -> manoeuvres that could
        be driven next, the least effort first.
    """

    regression: Callable[..., Regression]
    chord_regression: Callable[..., Regression]
    effects: tuple[Effect, ...]
    profiles: tuple[Effect, ...]
    lacking: Mapping[str, str] = field(default_factory=dict)
    directions: tuple[str | None, ...] = ()
    run: str = "run"
    fewest_runs: int = 1
    too_short: str = ""
    level: float = POLICY.level
    linearized: bool = False
    nondifferentiable: bool = False
    coarse_error: Callable[[AddedEffects], float] | None = None
    likely_size: Callable[[Effect, Callable[[float], tuple[Unknown, ...]]], tuple[float, float] | None] | None = None
    stated: Mapping[str, float] = field(default_factory=dict)
    learned: frozenset[str] = frozenset()
    manoeuvres: Callable[[Regression, Mapping[str, float]], tuple[Manoeuvre, ...]] = lambda regression, values: ()

    @property
    def one_way(self) -> str:
        """Why effects that change sign with the heading are confounded with others; empty where they are not."""
        if len(set(self.directions)) != 1:
            return ""
        return "all runs used have the same direction" if any(self.directions) else "no run states its direction"

    @property
    def mixed_directions(self) -> str:
        """Why the directions cannot be used; empty where they can."""
        some = None in self.directions and any(self.directions)
        return "some runs do not state their direction" if some else ""

    @property
    def far_off(self) -> bool:
        """Whether the baseline's error is so large that no linearization about it reaches the true effect."""
        return self.coarse_error is not None

    @cached_property
    def candidates(self) -> Mapping[str, Effect]:
        """The candidate effects by name."""
        return {e.name: e for e in self.effects}

    @cached_property
    def free_profiles(self) -> Mapping[str, Effect]:
        """The free profiles by name."""
        return {e.name: e for e in self.profiles}


def setup_of(prepared: PreparedStep, level: float = POLICY.level) -> DiagnosisSetup:
    """The setup of a diagnosable step, ``level`` its false-alarm probability, 0 to 1.

    Raises
    ------
    InputError : the description names an effect that is not applicable to this model.
    """
    diagnosable, spec, problem = prepared.step.diagnosable, prepared.spec, prepared.simulated_problem
    assert diagnosable is not None
    effects, carried = _applicable(prepared)
    lacking = _lacking(prepared)
    _refuse_others(spec.diagnose, effects, carried, lacking)
    if isinstance(spec.diagnose.effects, list):
        effects, lacking = tuple(e for e in effects if e.name in spec.diagnose.effects), {}
    linearized = diagnosable.linearized(spec)
    directions = tuple(problem.directions([r.direction for r in spec.runs])) if diagnosable.two_way(spec) else ()
    return DiagnosisSetup(
        regression=relaxed(problem.regression),
        chord_regression=relaxed(problem.chord_regression),
        effects=effects,
        profiles=problem.profiles,
        lacking=lacking,
        directions=directions,
        run=diagnosable.run,
        fewest_runs=diagnosable.fewest_runs,
        too_short=diagnosable.too_short(problem),
        level=level,
        linearized=linearized,
        nondifferentiable=any(e.probes for e in carried),
        coarse_error=problem.coarse_error if linearized else None,
        likely_size=problem.likely_size if linearized else None,
        stated=stated_errors(effects, prepared.known),
        manoeuvres=problem.plans,
    )


def stated_errors(effects: Sequence[Effect], known: Parameters) -> dict[str, float]:
    """Stated standard deviations of the quantities that effects correct, in the units of their first unknowns."""
    found = {}
    for effect in effects:
        one = known.estimates.get(effect.corrects)
        if one is not None and one.std > 0.0 and one.value:
            name, quantity = next(iter(effect.unknowns.items()))
            found[name] = one.std if quantity.unit else one.std / abs(one.value)
    return found


def refuse_unknown(prepared: PreparedStep) -> None:
    """Refuse, before anything is estimated, a description that names effects that are not applicable to this model.

    Raises
    ------
    InputError : with a finding for each such effect.
    """
    if prepared.step.diagnosable is not None and any(_requested(prepared.spec.diagnose)):
        _refuse_others(prepared.spec.diagnose, *_applicable(prepared), _lacking(prepared))


def already_included(prepared: PreparedStep, setup: DiagnosisSetup) -> Iterator[Finding]:
    """A note on each requested effect that is already in the model from an earlier step."""
    for key, name in _requested(prepared.spec.diagnose):
        if name in prepared.known.extensions and name not in setup.candidates:
            yield Finding(f"diagnose.{key}", f"{name} is already in the model, from an earlier step", minor=True)


def _applicable(prepared: PreparedStep) -> tuple[tuple[Effect, ...], tuple[Effect, ...]]:
    """The effects applicable to the step's model, and those already in it because an earlier step found them."""
    diagnosable = prepared.step.diagnosable
    assert diagnosable is not None
    every = applicable(prepared.simulated_problem.model, candidates(prepared.step.situations))
    carried = tuple(e for e in every if diagnosable.carries and e.name in prepared.known.extensions)
    factors = _size_factors(prepared.known, prepared.step.situations)
    return tuple(enlarged(e, factors) for e in every if e not in carried), carried


def _size_factors(known: Parameters, situations: Collection[str]) -> Mapping[str, float]:
    """Factors of the plausible ranges by tag, for vehicles (or wheels) heavier or lighter than cars.

    The factor of lighter vehicles applies to coasting only, where the driveline is part of the resistance.
    """
    if "mass" in known:
        mass = known["mass"].value
        lighter = POLICY.common_car / mass if "coasting" in situations else 1.0
        return {"of_a_car": max(1.0, mass / POLICY.heaviest_car), "over_weight": max(1.0, lighter)}
    heavier = known["wheel_mass"].value / POLICY.heaviest_wheel if "wheel_mass" in known else 1.0
    return {"of_a_car": max(1.0, heavier)}


def _lacking(prepared: PreparedStep) -> dict[str, str]:
    """By effect, what it needs to be tested: a channel that a log of the step may have, or runs that vary a signal."""
    model = prepared.simulated_problem.model
    missing, unvaried = missing_signals(model, candidates(prepared.step.situations)), dict(model.unvaried)
    channels = prepared.step.channels() if missing else {}
    channel = {e: _lacked(signal, prepared.spec) for e, signal in missing.items() if signal in channels}
    return channel | {e: unvaried[signal] for e, signal in missing.items() if signal in unvaried}


def _lacked(signal: str, spec: Description) -> str:
    """The channel that the model lacks, or what the step lacks to use it."""
    if signal not in spec.mapped:
        return f"channel '{signal}', which is not logged"
    if signal == "position" and any(run.direction is None for run in spec.runs):
        return "the direction of every run, to which 'position' is related"
    return f"channel '{signal}' in every run, consistent with the other channels"


def _refuse_others(
    diagnose: Diagnose, effects: Sequence[Effect], carried: Sequence[Effect], lacking: Mapping[str, str]
) -> None:
    """Refuse requested effects that are not applicable to the model.

    Effects already in the model from earlier steps pass, so that a description stays valid whether they were found or
    not.
    """
    names = [e.name for e in effects]
    known = {*names, *(e.name for e in carried)}

    def refused(key: str, name: str) -> Finding:
        if name in lacking:
            what = f"cannot be tested: it needs {lacking[name]}"
            return Finding(f"diagnose.{key}", what, name, "add it to channels or runs, or remove the effect")
        remedy = f"candidates are: {', '.join(names)}"
        return Finding(f"diagnose.{key}", "is not a candidate effect for this model", name, remedy)

    raise_all(refused(key, name) for key, name in _requested(diagnose) if name not in known)


def _requested(diagnose: Diagnose) -> Iterator[tuple[str, str]]:
    """Each effect that the description names, with its key (``effects`` or ``extend``)."""
    for key in ("effects", "extend"):
        named = getattr(diagnose, key)
        yield from ((key, name) for name in (named if isinstance(named, list) else ()))
