"""The contracts of the package ``steps``: the step, and the problem that it prepares once for many requests."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import nan
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol, cast

from vdyn_cli.quantities.errors import Finding, InputError, ResultError
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.quantities.result import FitSummary, Result
from vdyn_cli.steps.scaled_channel import ScaledChannel

if TYPE_CHECKING:
    from vdyn_cli.description.description_model import Description
    from vdyn_cli.effects import Effect
    from vdyn_cli.engine.model import Model
    from vdyn_cli.inference import Regression, Solution, Unknown
    from vdyn_cli.quantities.arrays import Array
    from vdyn_cli.quantities.check_schema import CoastBalance
    from vdyn_cli.quantities.log import Log
    from vdyn_cli.steps.free_part import Part
    from vdyn_cli.steps.manoeuvre import Manoeuvre
    from vdyn_cli.steps.planned_day import PlannedDay

NO_VALUES: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True)
class Failure:
    """A fit or a result that cannot be published, as a value instead of an exception.

    ``findings`` state the reasons; ``shown`` is the unpublished result, with which a page can show where the simulation
    fails; None where no simulation exists.
    """

    findings: tuple[Finding, ...]
    shown: Result | None = None

    @classmethod
    def from_error(cls, error: ResultError | ArithmeticError) -> Failure:
        """The failure that corresponds to an exception."""
        findings = error.findings if isinstance(error, ResultError) else (Finding("fit", str(error)),)
        return cls(findings, error.shown if isinstance(error, UnpublishedError) else None)

    def refused(self, step: str) -> Result:
        """The refused result: the simulation and the reasons, without parameters.

        Parameters
        ----------
        step : name of the step.
        """
        shown = self.shown or Result(step, "", Parameters(), FitSummary((), nan, nan, "", ()), "")
        first = self.findings[0]
        place = "" if first.where in ("fit", step) else f"{first.where}: "
        return replace(
            shown,
            sentence=f"No result: {place}{first.what}.",
            parameters=Parameters(),
            amplitudes={},
            extra={},
            refused=self.findings,
        )


class UnpublishedError(ResultError):
    """A result that cannot be published, with its simulation.

    Parameters
    ----------
    findings : the reasons. shown : the unpublished result; its parameters are not used.
    """

    def __init__(self, findings: Sequence[Finding], shown: Result) -> None:
        super().__init__(*findings)
        self.shown = shown


class Problem(Protocol):
    """One test, prepared once from its description, its data and the known parameters. Frozen.

    No request changes it; expensive parts are computed at most once and are stored in the problem.
    """

    def publish(self, effects: Sequence[Effect] = (), unknowns: Sequence[Unknown] = ()) -> Result:
        """Fit, with accepted effects in the model, and describe the result.

        Raises
        ------
        ResultError : the result cannot be published; an UnpublishedError where a simulation exists that can be shown.
        InputError : the data contradict the description.
        """


class SimulatedProblem(Problem, Protocol):
    """A problem with a model that simulates its runs, so that it can be diagnosed. Steps derive their own from it."""

    @property
    def model(self) -> Model:
        """The model that simulates the test, without candidate effects."""

    @property
    def profiles(self) -> tuple[Effect, ...]:
        """Free profiles over the coordinates of the model's laws (speed, time, position, deflection rate ...)."""

    @property
    def parts(self) -> tuple[Part, ...]:
        """The model's elements and sensors, each free over one coordinate; empty by default."""
        return ()

    @property
    def duration(self) -> float:
        """Length of the longest run, s."""

    def directions(self, stated: Sequence[str | None]) -> Sequence[str | None]:
        """The directions of the used runs, from those that the description states; all by default."""
        return stated

    @property
    def coarse_error(self) -> Callable[[Sequence[Effect], Sequence[Unknown]], float] | None:
        """(effects, unknowns) -> rms error of the main channel at the unknowns' start values, with nothing fitted.

        Given where the baseline's error is so large that a linearization about it does not lead to the cause. A model
        error is then certain, and candidates are tried from a coarse grid of start values. None otherwise (default).
        """
        return None

    def regression(
        self,
        effects: Sequence[Effect] = (),
        unknowns: Sequence[Unknown] = (),
        start: Mapping[str, float] = NO_VALUES,
    ) -> Regression:
        """The whitened regression with effects in the model.

        Parameters
        ----------
        unknowns : of the effects, placed after the step's own shared unknowns.
        start : values of the step's own shared unknowns about which the problem is linearized.
        """

    def regression_like(
        self, known: Regression, effects: Sequence[Effect], unknowns: Sequence[Unknown], start: Mapping[str, float]
    ) -> Regression:
        """The regression with other effects in the model and the noise of a ``known`` regression of this problem.

        Parameters
        ----------
        start : as in ``regression``. By default the noise is estimated again, if that is cheap.
        """
        return self.regression(effects, unknowns, start)

    def chord_regression(
        self, effects: Sequence[Effect], unknowns: Sequence[Unknown], start: Mapping[str, float]
    ) -> Regression:
        """The regression for the first iterations of a fit, and for predictions.

        Its sensitivities to the step's own unknowns may be those without the effects; exact by default.
        """
        return self.regression(effects, unknowns, start)

    def likely_size(self, effect: Effect, start: Callable[[float], tuple[Unknown, ...]]) -> tuple[float, float] | None:
        """The most likely amplitude of a nondifferentiable effect alone in the model, and the gain in log likelihood.

        ``start(size)`` returns the effect's unknowns. None by default: the step does not test such effects.
        """
        return None

    def coordinate(self, part: Part, solution: Solution) -> Array | None:
        """Values (n,) of a part's coordinate in the runs at the baseline's solution; None (default): the whole span."""
        return None

    def spanning(self, result: Result, answers: Sequence[Result]) -> Result:
        """The result with intervals of its further numbers that span those of all answers; unchanged by default.

        Further numbers are those in ``extra``, such as forces over speed, not the parameters.
        """
        return result

    def averaged(self, result: Result, answers: Sequence[tuple[float, Result]]) -> Result:
        """The result with intervals of its further numbers from its mixture with other answers; unchanged by default.

        Parameters
        ----------
        answers : probability and result of each.
        """
        return result

    def derived(self, values: Mapping[str, float]) -> Mapping[str, float]:
        """Published parameters that follow from fitted ones, by name; empty by default.

        Parameters
        ----------
        values : of the fitted shared unknowns, SI; omitted ones have their known value.
        """
        return {}

    def plans(self, regression: Regression, values: Mapping[str, float]) -> tuple[Manoeuvre, ...]:
        """Manoeuvres that could be driven next, the least effort first; empty by default.

        Parameters
        ----------
        regression : with every candidate effect.
        values : of its shared unknowns at the baseline's fit.
        """
        return ()


def simulated(step: Step, problem: Problem) -> SimulatedProblem | None:
    """The problem with the type that can be diagnosed; None for a step without a simulation."""
    return cast(SimulatedProblem, problem) if step.diagnosable is not None else None


def unpublished(
    error: ResultError, shown: Callable[[Solution], Result], why: Sequence[Finding] | None = None
) -> ResultError:
    """The error of a refused fit as an UnpublishedError, if possible; else a ResultError.

    Parameters
    ----------
    shown : solution -> result, called with the solution at which the fit ended, if there is one.
    why : the reasons, in place of those of the error.
    """
    from vdyn_cli.inference import RefusedFitError

    reasons = error.findings if why is None else why
    solution = error.solution() if isinstance(error, RefusedFitError) else None
    try:
        if solution is not None:
            return UnpublishedError(reasons, shown(solution))
    except UnpublishedError as further:  # the result is also refused for another reason
        return UnpublishedError(reasons, further.shown)
    except (ResultError, ArithmeticError, ValueError):
        pass
    return error if why is None else ResultError(*why)


def no_runs(step: str) -> InputError:
    """The error for a description without runs."""
    remedy = f"list the logs under runs and their columns under channels; 'vdyn init {step} LOG' writes both"
    return InputError(Finding("runs", "no run is given", remedy=remedy))


def published(problem: Problem, effects: Sequence[Effect] = (), unknowns: Sequence[Unknown] = ()) -> Result | Failure:
    """The problem's result, or the failure to publish it, as a value.

    Raises
    ------
    InputError : the data contradict the description.
    """
    try:
        return problem.publish(effects, unknowns)
    except ResultError as error:
        return Failure.from_error(error)


def alternatives(entry: str) -> list[list[str]]:
    """The alternatives of an entry of ``Step.required``, each a list of channels: ``a|b+c`` -> [[a], [b, c]]."""
    return [way.split("+") for way in entry.split("|")]


def named_channels(entry: str) -> list[str]:
    """Every channel in an entry of ``Step.required``: ``a|b+c`` -> [a, b, c]."""
    return [channel for way in alternatives(entry) for channel in way]


@dataclass(frozen=True)
class TrackCheck:
    """A step's check of its runs at the track, before any estimate.

    Parameters
    ----------
    rejected : index of a run -> reason why the step does not use it.
    evaluated : index of a run -> first and last time that the step evaluates, s; the whole log where omitted.
    coasts : balance, order and wind of a coast-down campaign.
    left_out : index of a run: which parts of it the step does not use, and why.
    """

    rejected: Mapping[int, str] = field(default_factory=dict)
    evaluated: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    coasts: CoastBalance | None = None
    left_out: Mapping[int, Sequence[str]] = field(default_factory=dict)


@dataclass(frozen=True)
class Diagnosable:
    """Properties of a step's diagnosis that differ between steps.

    Parameters
    ----------
    metric : name and unit of the channel in which the held-out gain is measured.
    run : noun for a run.
    fewest_runs : below which an effect cannot be separated from chance.
    shortest : s, duration of the longest run below which effects are collinear.
    two_way : (spec) -> whether effects that change sign with the direction of driving need runs in both directions.
    narrower : (problem) -> description and problem of a narrower question, which is answered where this one has no
        result; None if there is none.
    carries : whether the effects that earlier steps accepted are in its model, and are not candidates again.
    linearized : (spec) -> whether the model is so expensive to simulate that its regression is linearized once.
    """

    metric: tuple[str, str]
    run: str = "run"
    fewest_runs: int = 1
    shortest: float = 0.0
    two_way: Callable[[Any], bool] = lambda spec: False
    linearized: Callable[[Any], bool] = lambda spec: False
    narrower: Callable[[Any], tuple[Description, SimulatedProblem] | None] = lambda problem: None
    carries: bool = False


@dataclass(frozen=True)
class Step:
    """One estimation step: the model of its description, the channels it reads, and how its problem is prepared.

    Parameters
    ----------
    name : the command's name.
    spec : the pydantic model of the YAML, derived from Description.
    required, optional : channels of a run's log; an entry of ``required`` may offer alternatives as
        ``"front_load|front_left_load+front_right_load"``.
    needs : parameters that the step may read from other steps or the vehicle; they order the pipeline.
    gives : parameters that the step estimates.
    prepare : pure: (spec, data, known) -> Problem, where ``data`` is what ``load`` read.
    load : reads data other than the runs' logs (a picture, a pendulum recording): (spec, folder, logs) -> (data, paths
        read); None for steps that need only the runs' logs, whose data is the tuple of Logs.
    extra_channels : channels beyond those of the vocabulary.
    diagnosable : properties of its diagnosis; None where nothing is simulated.
    complete : channels that must have a value in every row: short cuts are interpolated linearly, and the run is split
        at long ones. All other cut samples reach the step as missing values (NaN), which it leaves out.
    unbroken : further channels at whose long cuts the run is split.
    fewest_rows : samples of a part of a split run, with fewer of which it is left out.
    situations : tags of the candidate effects (``effects.SITUATIONS``, or the step's own); empty: every effect whose
        laws its model calls.
    reads : keys of the vehicle and the air that the step reads in addition to ``needs``; None: any of them.
    run_keys : which of a run's direction, start, temperature and wind it reads; None: any of them.
    scaled : channels that may be computed from another one, times constants of the vehicle.
    rate : (spec) -> Hz, to which logs that are sampled at least twice as fast are averaged, because the model has no
        faster dynamics; None: as sampled.
    track_check : (spec, whole logs before cuts, data, known, run of each log in data) -> check of the runs at the
        track; None where only the quality of the logs is checked.
    manoeuvres : steps of the same name, spec and parameters that evaluate other manoeuvres, by the key ``manoeuvre`` of
        the description.
    planned : how a day is simulated before it is driven; None where that needs a log of the car.
    """

    name: str
    spec: type[Description]
    required: tuple[str, ...]
    optional: tuple[str, ...]
    needs: tuple[str, ...]
    gives: tuple[str, ...]
    prepare: Callable[[Any, Any, Parameters], Problem]
    load: Callable[[Any, Path, tuple[Log, ...]], tuple[Any, tuple[Path, ...]]] | None = None
    extra_channels: tuple[Quantity, ...] = ()
    diagnosable: Diagnosable | None = None
    complete: tuple[str, ...] = ()
    unbroken: tuple[str, ...] = ()
    fewest_rows: int = 2
    situations: frozenset[str] = frozenset()
    reads: tuple[str, ...] | None = None
    run_keys: tuple[str, ...] | None = None
    scaled: tuple[ScaledChannel, ...] = ()
    rate: Callable[[Any], float | None] = lambda spec: None
    track_check: Callable[[Any, tuple[Log, ...], Any, Parameters, tuple[int, ...]], TrackCheck] | None = None
    manoeuvres: Mapping[str, Step] = field(default_factory=dict, compare=False)
    planned: PlannedDay | None = field(default=None, compare=False)

    def of(self, spec: Any) -> Step:
        """The step of this name that evaluates the description's manoeuvre."""
        return self.manoeuvres.get(getattr(spec, "manoeuvre", ""), self)

    def estimate(
        self,
        spec: Any,
        data: Any,
        known: Parameters,
        effects: Sequence[Effect] = (),
        unknowns: Sequence[Unknown] = (),
    ) -> Result:
        """Prepare and publish in one call, for scripts and tests."""
        return self.prepare(spec, data, known).publish(effects, unknowns)

    def channels(self) -> Mapping[str, Quantity]:
        """Every channel that a log of this step may contain, by name."""
        from vdyn_cli.quantities.vocabulary import CHANNELS

        own = {q.name: q for q in self.extra_channels}
        names = [n for entry in (*self.required, *self.optional) for n in named_channels(entry)]
        names += [one.source for one in self.scaled if one.target in names]
        return {n: own.get(n) or CHANNELS[n] for n in dict.fromkeys(names)}
