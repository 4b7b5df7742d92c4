"""The registry of steps: one folder each, found by name; importing this imports no step.

A step's folder holds ``step.py``, which defines ``STEP = Step(...)``; the first docstring line of its ``__init__.py``
is the command's help. Nothing else has to be touched to add one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vdyn_cli.quantities.quantity import Quantity

if TYPE_CHECKING:
    from vdyn_cli.description.test_description import TestSpec
    from vdyn_cli.effects import Effect
    from vdyn_cli.engine.model import Model
    from vdyn_cli.inference import Regression
    from vdyn_cli.quantities.log import Log
    from vdyn_cli.quantities.parameters import Parameters
    from vdyn_cli.quantities.result import Result
    from vdyn_cli.steps.manoeuvre import Manoeuvre


@dataclass(frozen=True)
class Diagnosable:
    """How a step lends its regression to the diagnosis of what the simulation gets wrong.

    Parameters
    ----------
    regression : (spec, data, known, effects, extra) -> Regression, the step's own with effects in its model and their
        unknowns (``extra``) behind its shared ones, starting at zero; its noise freed of their traces.
    model : (spec, data, known) -> Model, to ask which effects it can take.
    profiles : (spec, data, known) -> free profiles, over whatever the step's laws live on.
    metric : name and unit of the channel in which the gain is measured.
    run : what a run is called.
    fewest_runs : below which no cause can be told from chance.
    shortest : s, of the longest run, below which causes look alike.
    two_way : (spec) -> whether causes that turn with the direction of driving need runs both ways.
    carries : whether the causes that earlier steps accepted are in its model, and not to be looked for again.
    straight : (spec) -> whether the model is so dear to simulate that one pass over the logs has to do. Its regression
        also takes ``begun``, values of its own shared unknowns about which that pass is made.
    likely : (spec, data, known, effect, begun) -> where one pass has to do, the size of an effect without a slope at
        nothing about which it is made, and by how much the log likelihood rises with it; ``begun(size)`` are the
        effect's unknowns. None: such effects are not found.
    manoeuvres : (spec, data, known, regression, values) -> what could be driven next, the least effort first, from the
        regression with every cause in and the values of its shared unknowns at the baseline's fit.
    """

    regression: Callable[..., Regression]
    model: Callable[[Any, Any, Parameters], Model]
    profiles: Callable[[Any, Any, Parameters], tuple[Effect, ...]]
    metric: tuple[str, str]
    run: str = "run"
    fewest_runs: int = 1
    shortest: float = 0.0
    two_way: Callable[[Any], bool] = lambda spec: False
    straight: Callable[[Any], bool] = lambda spec: False
    likely: Callable[..., tuple[float, float]] | None = None
    carries: bool = False
    manoeuvres: Callable[[Any, Any, Parameters, Regression, Mapping[str, float]], tuple[Manoeuvre, ...]] = (
        lambda spec, data, known, regression, values: ()
    )


@dataclass(frozen=True)
class Step:
    """One estimation step: its description's shape, the channels it reads, and the estimate itself.

    Parameters
    ----------
    name : the command's name.
    spec : the pydantic model of the YAML, derived from TestSpec.
    required, optional : channels of a run's log; an entry of ``required`` may offer alternatives as
        ``"front_load|front_left_load+front_right_load"``.
    needs : parameters that the step may read from other steps or the vehicle; they order the pipeline.
    gives : parameters that the step estimates.
    estimate : pure: (spec, data, known) -> Result, where ``data`` is what ``load`` read; a diagnosable step's also
        takes ``effects`` and ``extra``, the causes that extend its model and their unknowns.
    load : reads what is not a run's log (a picture, a pendulum recording): (spec, folder) -> (data, paths read);
        None for steps that need the runs' logs alone, whose data is the tuple of Logs.
    """

    name: str
    spec: type[TestSpec]
    required: tuple[str, ...]
    optional: tuple[str, ...]
    needs: tuple[str, ...]
    gives: tuple[str, ...]
    estimate: Callable[..., Result]
    load: Callable[[Any, Path, tuple[Log, ...]], tuple[Any, tuple[Path, ...]]] | None = None
    extra_channels: tuple[Quantity, ...] = ()
    diagnosable: Diagnosable | None = None

    def channels(self) -> Mapping[str, Quantity]:
        """Every channel that a log of this step may map."""
        from vdyn_cli.quantities.vocabulary import CHANNELS

        own = {q.name: q for q in self.extra_channels}
        names = [n for entry in (*self.required, *self.optional) for way in entry.split("|") for n in way.split("+")]
        return {n: own.get(n) or CHANNELS[n] for n in dict.fromkeys(names)}


def names() -> tuple[str, ...]:
    """The names of all steps, without importing them."""
    return tuple(sorted(p.parent.name for p in Path(__file__).parent.glob("*/step.py")))


def summary(name: str) -> str:
    """The first line of the step's docstring, read as text so that help stays instant."""
    with (Path(__file__).parent / name / "__init__.py").open(encoding="utf-8") as file:
        return file.readline().strip().strip('"').rstrip(".")


def load_step(name: str) -> Step:
    """Import one step."""
    step = import_module(f"vdyn_cli.steps.{name}.step").STEP
    assert isinstance(step, Step)
    return step


def explanation(name: str) -> str:
    """The step's documentation: the docstring of its folder."""
    return import_module(f"vdyn_cli.steps.{name}").__doc__ or ""
