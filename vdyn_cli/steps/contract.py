"""The contract between a step and the diagnosis: the problem that a step prepares once for many requests."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol

from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects

if TYPE_CHECKING:
    from vdyn_cli.effects import Effect
    from vdyn_cli.engine.model import Model
    from vdyn_cli.inference import Regression, Solution, Unknown
    from vdyn_cli.quantities.arrays import Array
    from vdyn_cli.steps.free_part import Part
    from vdyn_cli.steps.manoeuvre import Manoeuvre

NO_VALUES: Mapping[str, float] = MappingProxyType({})


class Problem(Protocol):
    """One test, prepared once from its description, its data and the known parameters. Frozen.

    No request changes it; expensive parts are computed at most once and are stored in the problem.
    """

    def publish(self, added: AddedEffects = NO_EFFECTS) -> Result:
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
    def with_free_form(self) -> SimulatedProblem | None:
        """The problem with a smooth departure of its main law, as nuisance parameters; None (default): no such form.

        It shows errors that are no departure of that law where the law's form is wrong, too.
        """
        return None

    def directions(self, stated: Sequence[str | None]) -> Sequence[str | None]:
        """The directions of the used runs, from those that the description states; all by default."""
        return stated

    @property
    def coarse_error(self) -> Callable[[AddedEffects], float] | None:
        """added effects -> rms error of the main channel at the unknowns' start values, with nothing fitted.

        Given where the baseline's error is so large that a linearization about it does not lead to the cause. A model
        error is then certain, and candidates are tried from a coarse grid of start values. None otherwise (default).
        """
        return None

    def regression(self, added: AddedEffects = NO_EFFECTS, start: Mapping[str, float] = NO_VALUES) -> Regression:
        """The whitened regression with effects in the model.

        Parameters
        ----------
        added : effects, whose unknowns are placed after the step's own shared unknowns.
        start : values of the step's own shared unknowns about which the problem is linearized.
        """

    def regression_like(self, known: Regression, added: AddedEffects, start: Mapping[str, float]) -> Regression:
        """The regression with other effects in the model and the noise of a ``known`` regression of this problem.

        Parameters
        ----------
        start : as in ``regression``. By default the noise is estimated again, if that is cheap.
        """
        return self.regression(added, start)

    def chord_regression(self, added: AddedEffects, start: Mapping[str, float]) -> Regression:
        """The regression for the first iterations of a fit, and for predictions.

        Its sensitivities to the step's own unknowns may be those without the effects; exact by default.
        """
        return self.regression(added, start)

    def likely_size(self, effect: Effect, start: Callable[[float], tuple[Unknown, ...]]) -> tuple[float, float] | None:
        """The most likely amplitude of a nondifferentiable effect alone in the model, and the gain in log likelihood.

        ``start(size)`` returns the effect's unknowns. None by default: the step does not test such effects.
        """
        return None

    def coordinate(self, part: Part, solution: Solution) -> Array | None:
        """Values (n,) of a part's coordinate in the runs at the baseline's solution; None (default): the whole span."""
        return None

    @property
    def has_further_numbers(self) -> bool:
        """Whether ``including`` changes intervals; False by default."""
        return False

    def including(self, result: Result, answers: Sequence[tuple[float | None, Result]]) -> Result:
        """The result with intervals of its further numbers that include those of all answers; unchanged by default.

        Further numbers are those in ``extra``, such as forces over speed, not the parameters.

        Parameters
        ----------
        answers : probability and result of each; None: included whatever its probability.
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
