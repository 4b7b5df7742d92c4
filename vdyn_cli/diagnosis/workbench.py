"""The fits and linearisations that a diagnosis asks for, each made once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from vdyn_cli.diagnosis.case import Case, scanned, unknowns_of
from vdyn_cli.diagnosis.scores import Scores, scores
from vdyn_cli.diagnosis.sheet import Linear, Sheet, linearise, sheet
from vdyn_cli.errors import ResultError
from vdyn_cli.fit import Regression, Solution, solve
from vdyn_cli.fit.restrict import restricted, without_priors
from vdyn_cli.fit.straight import frozen

LEAST_STEP = 1e-2  # of one residual's variance that a further step may still promise


@dataclass(frozen=True)
class Fitted:
    """The baseline with some causes in, fitted, and the full set of traces there.

    Parameters
    ----------
    causes : accepted here.
    values : of every shared unknown.
    """

    causes: tuple[str, ...]
    solution: Solution
    linear: Linear
    sheet: Sheet

    @property
    def values(self) -> Mapping[str, float]:
        return self.solution.values


@dataclass
class Workbench:
    """A case's full regression, its noise taken from the residual that no cause is left in.

    Parameters
    ----------
    full : baseline, all causes and all profiles; priors on causes left out again.
    base : names of the baseline's shared unknowns.
    """

    case: Case
    full: Regression
    base: tuple[str, ...]
    _fits: dict[tuple[str, ...], Fitted | None] = field(default_factory=dict)

    def unknowns(self, cause: str) -> tuple[str, ...]:
        """What the scan frees of a cause or a profile."""
        effect = self.case.causes.get(cause) or self.case.families[cause]
        return scanned(effect)

    @property
    def nuisances(self) -> frozenset[str]:
        """Shared unknowns of the baseline that nobody asks for."""
        return frozenset(u.name for u in self.full.shared if u.nuisance)

    def held(self, causes: Sequence[str]) -> dict[str, float]:
        free = {n for c in causes for n in self.unknowns(c)} | set(self.base)
        return {u.name: 0.0 for u in self.full.shared if u.name not in free}

    def fitted(self, causes: Sequence[str] = ()) -> Fitted | None:
        """The fit with these causes in; None where the data do not allow it, or it needs more than is plausible."""
        key = tuple(sorted(causes))
        if key not in self._fits:
            self._fits[key] = self._fit(key)
        return self._fits[key]

    def _fit(self, causes: tuple[str, ...]) -> Fitted | None:
        before = self._fits.get(()) if causes else None
        regression = restricted(self.full, self.held(causes), before.solution if before else None)
        try:
            solution = solve(regression, units="run", tolerance=LEAST_STEP)
            linear = linearise(self.full, solution.values, solution.per_run)
        except (ResultError, ArithmeticError):
            if not causes:
                raise
            return None
        return Fitted(causes, solution, linear, sheet(linear))

    def scores(self, at: Fitted, names: Sequence[str], runs: bool = False) -> Scores:
        """Scores of causes and profiles beside the baseline and the causes that are in."""
        fitted = [*self.base, *(n for c in at.causes for n in self.unknowns(c))]
        candidates = {n: self.unknowns(n) for n in names if n not in at.causes}
        return scores(at.sheet.by_run() if runs else at.sheet, fitted, candidates)


def open_workbench(case: Case) -> Workbench:
    """Build the regression with everything in it; its noise is what is left when all causes have taken their part.

    Raises
    ------
    ResultError : the baseline itself cannot be fitted.
    """
    every = (*case.effects, *case.profiles)
    extra = [u for e in every for u in unknowns_of(e, prior=True)]
    full = case.regression(every, extra)
    causes = {u.name for u in extra}
    base = tuple(u.name for u in full.shared if u.name not in causes)
    if case.straight:
        full = frozen(full)
    full = without_priors(full, causes)
    full = replace(full, unknowns=tuple(replace(u, start=0.0) if u.name in causes else u for u in full.unknowns))
    return Workbench(case, _ordered(full, base), base)


def _ordered(full: Regression, base: Sequence[str]) -> Regression:
    """The baseline's shared unknowns come first: every step builds it so, and the tests rely on it."""
    if tuple(u.name for u in full.shared[: len(base)]) != tuple(base):
        raise ValueError("a step's regression must put the baseline's unknowns before those of effects")
    return full
