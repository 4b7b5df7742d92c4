"""Results that cannot be published: as a value, as an error with the simulation, and from one to the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import nan
from typing import TYPE_CHECKING

from vdyn_cli.quantities.errors import Finding, InputError, ResultError
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.result import FitSummary, Result
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects

if TYPE_CHECKING:
    from vdyn_cli.inference import Solution
    from vdyn_cli.steps.contract import Problem


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
        return replace(
            shown,
            sentence=f"No result: {first.what if first.where == step else first.reason}.",
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


def published(problem: Problem, added: AddedEffects = NO_EFFECTS) -> Result | Failure:
    """The problem's result, or the failure to publish it, as a value.

    Raises
    ------
    InputError : the data contradict the description.
    """
    try:
        return problem.publish(added)
    except ResultError as error:
        return Failure.from_error(error)


def no_runs(step: str) -> InputError:
    """The error for a description without runs."""
    remedy = f"list the logs under runs and their columns under channels; 'vdyn init {step} LOG' writes both"
    return InputError(Finding("runs", "no run is given", remedy=remedy))
