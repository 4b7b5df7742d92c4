"""Regressions of a step with other bounds and priors of the baseline, since a model error may drive it far."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import inf, isfinite

from vdyn_cli.inference import Regression, Unknown
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.contract import NO_VALUES

UNIFORM = 12**-0.5  # standard deviation of a uniform distribution of width one


def relaxed(regression: Callable[..., Regression]) -> Callable[..., Regression]:
    """A step's regression with relaxed bounds, since a model error often drives a baseline's unknown to its bound.

    Unknowns with a prior lose their bounds. The others may leave theirs by the width between them; ``physical`` keeps
    these, unless the step states a narrower range, and an answer with an unknown outside of it is not sufficient.
    """
    return _with_baseline(regression, _unbounded)


def with_wide_priors(regression: Callable[..., Regression]) -> Callable[..., Regression]:
    """The regression with priors as wide as the physical range, for a baseline that the data do not determine."""
    return _with_baseline(regression, _with_wide_prior)


def _with_baseline(
    regression: Callable[..., Regression], changed: Callable[[Unknown], Unknown]
) -> Callable[..., Regression]:
    """The regression with the unknowns of the baseline ``changed``."""

    def of(added: AddedEffects = NO_EFFECTS, start: Mapping[str, float] = NO_VALUES) -> Regression:
        full = regression(added, start=start)
        return full.changed(changed, {u.name for u in full.unknowns} - set(added.names))

    return of


def _unbounded(u: Unknown) -> Unknown:
    if u.prior is not None:
        return replace(u, lower=-inf, upper=inf)
    width = u.upper - u.lower
    if not isfinite(width):
        return u
    return replace(u, lower=u.lower - width, upper=u.upper + width, physical=u.physical or (u.lower, u.upper))


def _with_wide_prior(u: Unknown) -> Unknown:
    u = u if u.physical else _unbounded(u)
    if u.prior is not None or u.physical is None:
        return u
    return replace(u, prior=(u.start, UNIFORM * (u.physical[1] - u.physical[0])))
