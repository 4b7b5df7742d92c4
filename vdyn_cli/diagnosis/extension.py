"""The model with causes taken in: the estimate made again, their sizes, and what the parameters were off by before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from vdyn_cli.diagnosis.case import Case, begun_at, shapes_of, unknowns_of
from vdyn_cli.diagnosis.sizes import estimate_of, sizes_of
from vdyn_cli.diagnosis.verdict import Verdict
from vdyn_cli.diagnosis.workbench import Workbench
from vdyn_cli.effects import Effect
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import Failure, Problem, published

NOTHING: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True)
class Extension:
    """What was taken into the model.

    Parameters
    ----------
    causes : their names; none where nothing was wanted, or it failed.
    result : the step's, of the extended model.
    sizes : of the causes' unknowns, as that model's fit gives them.
    biased : without less with each cause, by published parameter.
    failed : why the model could not be extended.
    """

    causes: tuple[str, ...] = ()
    result: Result | None = None
    sizes: Mapping[str, Estimate] = field(default_factory=dict)
    biased: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    failed: tuple[Finding, ...] = ()


def extension(
    bench: Workbench, verdict: Verdict, extend: str | list[str], problem: Problem, base: Result
) -> tuple[Verdict, Extension]:
    """The extension that a verdict and a description ask for, and the verdict, refuted where its cause has no size.

    Parameters
    ----------
    extend : the description's: never, named, or the causes to take in.
    problem : publishes the result with causes in its model.
    base : the baseline's result.
    """
    case = bench.case
    wanted = _wanted(extend, case, verdict)
    begun = bench.near(verdict.answer.fitted).values if verdict.answer else NOTHING
    result, failed = _extended(problem, [case.causes[c] for c in wanted], begun)
    if isinstance(extend, list):  # who asked for a cause has to know that the model is without it
        failed = tuple(replace(f, doubt=True) for f in failed)
    if nothing := _of_no_size(verdict, case, wanted, result):
        verdict = verdict.refuted(f"{nothing} may as well be of no size")
        if extend == "named":
            result = None
    if result is None:
        return verdict, Extension(failed=failed)
    sizes = _sizes(result, [case.causes[c] for c in wanted])
    return verdict, Extension(wanted, result, sizes, _biased(problem, base, result, wanted, case), failed)


def _wanted(extend: str | list[str], case: Case, verdict: Verdict) -> tuple[str, ...]:
    """The causes to extend the model with: those asked for, or the one that was named."""
    if isinstance(extend, list):
        return tuple(n for n in case.causes if n in extend)
    if extend == "named" and verdict.answer is not None:
        return verdict.answer.causes
    return ()


def _extended(
    problem: Problem, causes: Sequence[Effect], begun: Mapping[str, float] = NOTHING
) -> tuple[Result | None, tuple[Finding, ...]]:
    """The step's estimate with causes in its model, or why there is none; what shapes them is free where data allow it.

    ``begun``: where to begin, for steps to which that matters.
    """
    if not causes:
        return None, ()
    failed: tuple[Finding, ...] = ()
    extra = [begun_at(u, begun) for e in causes for u in unknowns_of(e)]
    shapes = {n for e in causes for n in shapes_of(e)}
    for free in (extra, [u for u in extra if u.name not in shapes]) if shapes else (extra,):
        result = published(problem, tuple(causes), tuple(free))
        if not isinstance(result, Failure):
            return result, ()
        failed = _not_extended(causes, result.findings[0])
    return None, failed


def _not_extended(causes: Sequence[Effect], why: Finding) -> tuple[Finding, ...]:
    where = "" if why.where == "fit" else f"{why.where}: "
    what = f"the model could not be extended by {', '.join(e.name for e in causes)}: {where}{why.what}"
    return (Finding("diagnosis", what, why.got, why.remedy),)


def _of_no_size(verdict: Verdict, case: Case, causes: Sequence[str], extended: Result | None) -> str:
    """What the verdict names and what may as well be of no size, in words; nothing where it stands.

    The sizes are those of the model that is extended by what the verdict names and nothing else, else the diagnosis's.
    """
    if not verdict.answers:
        return ""
    if verdict.answer is None:
        each = (len(a.causes) == 1 and _may_be_nothing(sizes_of(a, case), case, a.causes) for a in verdict.answers)
        return "it, like what it cannot be told from," if all(each) else ""
    named = verdict.answer.causes
    if extended is not None and set(causes) == set(named):
        return _may_be_nothing(_sizes(extended, [case.causes[c] for c in named]), case, named)
    return _may_be_nothing(sizes_of(verdict.answer, case), case, named)


def _may_be_nothing(sizes: Mapping[str, Estimate], case: Case, causes: Sequence[str]) -> str:
    """The cause of one unknown whose interval holds zero; nothing where there is none."""
    for effect in (case.causes[c] for c in causes):
        (first, *others) = effect.unknowns
        if not others and first in sizes and _holds_zero(sizes[first]):
            return effect.label if len(causes) > 1 else "it"
    return ""


def _holds_zero(size: Estimate) -> bool:
    return size.interval95[0] <= 0.0 <= size.interval95[1]


def _sizes(extended: Result, causes: Sequence[Effect]) -> dict[str, Estimate]:
    """As the extended model's fit gives them."""
    entries: Mapping[str, Any] = extended.extra.get("effects", {})
    return {
        n: estimate_of(effect, n, entries[n]["value"], entries[n]["std"], entries[n]["interval95"])
        for effect in causes
        for n in effect.unknowns
        if n in entries
    }


def _biased(
    problem: Problem,
    base: Result,
    extended: Result,
    accepted: Sequence[str],
    case: Case,
) -> dict[str, dict[str, float]]:
    """By how much the parameters would be off for want of each cause, the others in the model."""
    found = {}
    for cause in accepted:
        others = [case.causes[c] for c in accepted if c != cause]
        without = _extended(problem, others)[0] if others and extended.parameters else base
        found[cause] = {} if without is None else _moved(without, extended)
    return found


def _moved(before: Result, after: Result) -> dict[str, float]:
    return {
        n: before.parameters[n].value - e.value
        for n, e in after.parameters.items()
        if n in before.parameters and before.parameters[n].value != e.value
    }
