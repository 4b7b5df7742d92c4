"""What a step is, and what it prepares once and is then asked many times: the contracts of the room ``steps``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol

from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.quantity import Quantity

if TYPE_CHECKING:
    from vdyn_cli.description.test_description import TestSpec
    from vdyn_cli.effects import Effect
    from vdyn_cli.engine.model import Model
    from vdyn_cli.inference import Regression, Unknown
    from vdyn_cli.quantities.log import Log
    from vdyn_cli.quantities.parameters import Parameters
    from vdyn_cli.quantities.result import Result
    from vdyn_cli.steps.manoeuvre import Manoeuvre

NO_VALUES: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True)
class Failure:
    """A fit or a result that cannot be published, as a value that can be handed on.

    ``findings`` say why; ``from_error`` keeps them, ``error`` raises them again at the edge of the program.
    """

    findings: tuple[Finding, ...]

    @classmethod
    def from_error(cls, error: ResultError | ArithmeticError) -> Failure:
        """The failure that an exception reports."""
        return cls(error.findings if isinstance(error, ResultError) else (Finding("fit", str(error)),))

    def error(self) -> ResultError:
        """The same findings as an exception, for the command that ends with it."""
        return ResultError(*self.findings)


class Problem(Protocol):
    """One test, prepared once from its description, its data and the known parameters. Frozen.

    Assumes that nothing it is asked for changes it: what is dear is made at most once and kept in the problem itself.
    """

    @property
    def model(self) -> Model:
        """The model that simulates the test, without candidate effects."""

    @property
    def profiles(self) -> tuple[Effect, ...]:
        """Free profiles over the coordinates of the model's laws (speed, time, position, deflection rate ...)."""

    @property
    def duration(self) -> float:
        """Length of the longest run, s."""

    def regression(
        self,
        effects: Sequence[Effect] = (),
        unknowns: Sequence[Unknown] = (),
        start: Mapping[str, float] = NO_VALUES,
    ) -> Regression:
        """The whitened regression with effects in the model.

        Parameters
        ----------
        unknowns : of the effects, placed behind the step's own shared unknowns.
        start : values of the step's own shared unknowns about which a linearized problem is linearized.
        """

    def publish(self, effects: Sequence[Effect] = (), unknowns: Sequence[Unknown] = ()) -> Result:
        """Fit, with accepted effects in the model, and describe the result.

        Raises
        ------
        ResultError : the result cannot be published. InputError : the data contradict the description.
        """

    def likely_size(self, effect: Effect, start: Callable[[float], tuple[Unknown, ...]]) -> tuple[float, float] | None:
        """The most likely size of a nondifferentiable effect alone in the model, and the gain in log likelihood.

        ``start(size)`` gives the effect's unknowns. None where the step does not look for such effects.
        """

    def plans(self, regression: Regression, values: Mapping[str, float]) -> tuple[Manoeuvre, ...]:
        """What could be driven next, the least effort first.

        Parameters
        ----------
        regression : with every candidate effect in it.
        values : of its shared unknowns at the baseline's fit.
        """


def published(problem: Problem, effects: Sequence[Effect] = (), unknowns: Sequence[Unknown] = ()) -> Result | Failure:
    """The problem's result, or why it cannot be published, as a value.

    Raises
    ------
    InputError : the data contradict the description.
    """
    try:
        return problem.publish(effects, unknowns)
    except ResultError as error:
        return Failure.from_error(error)


@dataclass(frozen=True)
class Diagnosable:
    """How a step's diagnosis differs from that of other steps.

    Parameters
    ----------
    metric : name and unit of the channel in which the gain is measured.
    run : what a run is called.
    fewest_runs : below which no cause can be told from chance.
    shortest : s, of the longest run, below which causes look alike.
    two_way : (spec) -> whether causes that turn with the direction of driving need runs both ways.
    carries : whether the effects that earlier steps accepted are in its model, and not to be looked for again.
    linearized : (spec) -> whether the model is so expensive to simulate that its regression is linearized once.
    """

    metric: tuple[str, str]
    run: str = "run"
    fewest_runs: int = 1
    shortest: float = 0.0
    two_way: Callable[[Any], bool] = lambda spec: False
    linearized: Callable[[Any], bool] = lambda spec: False
    carries: bool = False


@dataclass(frozen=True)
class Step:
    """One estimation step: its description's shape, the channels it reads, and how its problem is prepared.

    Parameters
    ----------
    name : the command's name.
    spec : the pydantic model of the YAML, derived from TestSpec.
    required, optional : channels of a run's log; an entry of ``required`` may offer alternatives as
        ``"front_load|front_left_load+front_right_load"``.
    needs : parameters that the step may read from other steps or the vehicle; they order the pipeline.
    gives : parameters that the step estimates.
    prepare : pure: (spec, data, known) -> Problem, where ``data`` is what ``load`` read.
    load : reads what is not a run's log (a picture, a pendulum recording): (spec, folder, logs) -> (data, paths read);
        None for steps that need the runs' logs alone, whose data is the tuple of Logs.
    diagnosable : how it is diagnosed; None where nothing is simulated.
    situations : tags of the effects to look for (``effects.SITUATIONS``, or the step's own); none: every effect whose
        laws its model calls.
    """

    name: str
    spec: type[TestSpec]
    required: tuple[str, ...]
    optional: tuple[str, ...]
    needs: tuple[str, ...]
    gives: tuple[str, ...]
    prepare: Callable[[Any, Any, Parameters], Problem]
    load: Callable[[Any, Path, tuple[Log, ...]], tuple[Any, tuple[Path, ...]]] | None = None
    extra_channels: tuple[Quantity, ...] = ()
    diagnosable: Diagnosable | None = None
    situations: frozenset[str] = frozenset()

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
        """Every channel that a log of this step may map, by name."""
        from vdyn_cli.quantities.vocabulary import CHANNELS

        own = {q.name: q for q in self.extra_channels}
        names = [n for entry in (*self.required, *self.optional) for way in entry.split("|") for n in way.split("+")]
        return {n: own.get(n) or CHANNELS[n] for n in dict.fromkeys(names)}


@dataclass(frozen=True)
class FunctionProblem:
    """A problem of functions of (spec, data, known), for steps that have not yet a problem of their own."""

    spec: Any
    data: Any
    known: Parameters
    functions: Mapping[str, Callable[..., Any]]

    def _call(self, name: str, *args: Any, **kwargs: Any) -> Any:
        return self.functions[name](self.spec, self.data, self.known, *args, **kwargs)

    @property
    def model(self) -> Any:
        return self._call("model")

    @property
    def profiles(self) -> Any:
        return self._call("profiles")

    @property
    def duration(self) -> float:
        logs = getattr(self.data, "runs", self.data)  # of a step that reads more than its runs' logs
        return max((log.duration for log in logs), default=0.0)

    def regression(
        self, effects: Sequence[Effect] = (), unknowns: Sequence[Unknown] = (), start: Mapping[str, float] = NO_VALUES
    ) -> Any:
        return self._call("regression", effects, unknowns, **({"begun": start} if start else {}))

    def publish(self, effects: Sequence[Effect] = (), unknowns: Sequence[Unknown] = ()) -> Any:
        return self._call("estimate", effects, unknowns) if effects or unknowns else self._call("estimate")

    def likely_size(self, effect: Effect, start: Callable[[float], tuple[Unknown, ...]]) -> Any:
        return self._call("likely", effect, start) if "likely" in self.functions else None

    def plans(self, regression: Regression, values: Mapping[str, float]) -> Any:
        return self._call("manoeuvres", regression, values) if "manoeuvres" in self.functions else ()


def from_functions(**functions: Callable[..., Any]) -> Callable[[Any, Any, Parameters], Problem]:
    """The ``prepare`` of a step that consists of functions."""
    return lambda spec, data, known: FunctionProblem(spec, data, known, functions)
