"""What a step is: the channels and parameters that it reads, how its problem is prepared, and how it is diagnosed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.scaled_channel import ScaledChannel

if TYPE_CHECKING:
    from vdyn_cli.description.description_model import Description
    from vdyn_cli.quantities.check_schema import CoastBalance
    from vdyn_cli.quantities.log import Log
    from vdyn_cli.steps.contract import Problem, SimulatedProblem
    from vdyn_cli.steps.planned_day import PlannedDay


@dataclass(frozen=True)
class TrackCheck:
    """A step's check of its runs at the track, before any estimate.

    Parameters
    ----------
    rejected : index of a run -> reason why the step does not use it.
    evaluated : index of a run -> first and last time that the step evaluates, s; the whole log where omitted.
    coasts : balance, order and wind of a coast-down campaign.
    left_out : index of a run: which parts of it the step does not use, and why.
    findings : contradictions of a run with the other runs, by the name of its log.
    contradicted : runs whose log contradicts the description, by the name of the log.
    """

    rejected: Mapping[int, str] = field(default_factory=dict)
    evaluated: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    coasts: CoastBalance | None = None
    left_out: Mapping[int, Sequence[str]] = field(default_factory=dict)
    findings: Sequence[Finding] = ()
    contradicted: Sequence[Finding] = ()


@dataclass(frozen=True)
class Diagnosable:
    """Properties of a step's diagnosis that differ between steps.

    Parameters
    ----------
    metric : name and unit of the channel in which the held-out gain is measured.
    metric_of : (problem) -> the same where it depends on the logged channels; None: ``metric``.
    run : noun for a run.
    fewest_runs : below which an effect cannot be separated from chance.
    too_short : (problem) -> why all runs are so short that effects are collinear; empty where one is long enough.
    two_way : (spec) -> whether effects that change sign with the direction of driving need runs in both directions.
    narrower : (problem) -> description and problem of a narrower question, which is answered where this one has no
        result; None if there is none.
    carries : whether the effects that earlier steps accepted are in its model, and are not candidates again.
    linearized : (spec) -> whether the model is so expensive to simulate that its regression is linearized once.
    """

    metric: tuple[str, str]
    run: str = "run"
    fewest_runs: int = 1
    too_short: Callable[[Any], str] = lambda problem: ""
    two_way: Callable[[Any], bool] = lambda spec: False
    linearized: Callable[[Any], bool] = lambda spec: False
    narrower: Callable[[Any], tuple[Description, SimulatedProblem] | None] = lambda problem: None
    carries: bool = False
    metric_of: Callable[[Any], tuple[str, str] | None] = lambda problem: None


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
    any_gain : factors by which channels may exceed their physical range, because the diagnosis finds their gain.
    fits_clocks : channels whose clocks' delay its fit estimates within the standard error (``Log.clock_std``), so that
        the intervals contain that already.
    longest_step : s, typical step of a log's clock above which it is refused; None: as for any log.
    rate : (spec) -> Hz, to which logs that are sampled at least twice as fast are averaged, because the model has no
        faster dynamics; None: as sampled.
    track_check : (spec, whole logs before cuts, data, known, run of each log in data) -> check of the runs at the
        track; None where only the quality of the logs is checked.
    manoeuvres : steps of the same name, spec and parameters that evaluate other manoeuvres, by the key ``manoeuvre`` of
        the description.
    planned : how a day is simulated before it is driven; None where that needs a log of the car.
    policy : its own thresholds, which ``vdyn explain policy`` prints; None where it has none.
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
    any_gain: Mapping[str, float] = field(default_factory=dict, compare=False)
    fits_clocks: tuple[str, ...] = ()
    longest_step: float | None = None
    rate: Callable[[Any], float | None] = lambda spec: None
    track_check: Callable[[Any, tuple[Log, ...], Any, Parameters, tuple[int, ...]], TrackCheck] | None = None
    manoeuvres: Mapping[str, Step] = field(default_factory=dict, compare=False)
    planned: PlannedDay | None = field(default=None, compare=False)
    policy: Any = None

    def of(self, spec: Any) -> Step:
        """The step of this name that evaluates the description's manoeuvre."""
        return self.manoeuvres.get(getattr(spec, "manoeuvre", ""), self)

    def estimate(self, spec: Any, data: Any, known: Parameters) -> Result:
        """Prepare and publish in one call, for scripts and tests."""
        return self.prepare(spec, data, known).publish()

    def channels(self) -> Mapping[str, Quantity]:
        """Every channel that a log of this step may contain, by name."""
        from vdyn_cli.quantities.vocabulary import CHANNELS

        own = {q.name: q for q in self.extra_channels}
        names = [n for entry in (*self.required, *self.optional) for n in named_channels(entry)]
        names += [one.source for one in self.scaled if one.target in names]
        return {n: own.get(n) or CHANNELS[n] for n in dict.fromkeys(names)}


def alternative_channels(entry: str) -> list[list[str]]:
    """The alternatives of an entry of ``Step.required``, each a list of channels: ``a|b+c`` -> [[a], [b, c]]."""
    return [way.split("+") for way in entry.split("|")]


def named_channels(entry: str) -> list[str]:
    """Every channel in an entry of ``Step.required``: ``a|b+c`` -> [a, b, c]."""
    return [channel for way in alternative_channels(entry) for channel in way]


def simulated_problem(step: Step, problem: Problem) -> SimulatedProblem | None:
    """The problem with the type that can be diagnosed; None for a step without a simulation."""
    return cast("SimulatedProblem", problem) if step.diagnosable is not None else None
