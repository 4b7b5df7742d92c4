"""What a description asks of the diagnosis: a step's data and model, open to the causes that it allows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from vdyn_cli.description.test_description import Diagnose, TestSpec
from vdyn_cli.diagnosis.case import Case
from vdyn_cli.diagnosis.level import LEVEL
from vdyn_cli.effects import Effect, candidates
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.quantities.errors import Finding, raise_all
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps import Diagnosable, Problem, Step


def case_of(step: Step, spec: TestSpec, known: Parameters, problem: Problem, level: float = LEVEL) -> Case:
    """A diagnosable step's problem, open to the causes that its description allows.

    Raises
    ------
    InputError : the description names an effect that this model does not have.
    """
    lent = step.diagnosable
    assert lent is not None
    effects, carried = _offered(step, problem, known)
    _refuse_others(spec.diagnose, effects, carried)
    if isinstance(spec.diagnose.effects, list):
        effects = tuple(e for e in effects if e.name in spec.diagnose.effects)
    return Case(
        step=step.name,
        regression=problem.regression,
        effects=effects,
        profiles=problem.profiles,
        one_way=_one_way(spec) if lent.two_way(spec) else "",
        repeated=lent.run,
        fewest_runs=lent.fewest_runs,
        too_short=_too_short(lent, problem),
        level=level,
        straight=lent.linearized(spec),
        bent=any(e.probes for e in carried),
        likely=problem.likely_size if lent.linearized(spec) else None,
        manoeuvres=problem.plans,
    )


def refuse_unknown(step: Step, spec: TestSpec, problem: Problem, known: Parameters) -> None:
    """Refuse, before anything is estimated, a description that names an effect that this model does not have.

    Raises
    ------
    InputError : all of them.
    """
    if step.diagnosable is not None and any(_listed(spec.diagnose)):
        _refuse_others(spec.diagnose, *_offered(step, problem, known))


def _offered(step: Step, problem: Problem, known: Parameters) -> tuple[tuple[Effect, ...], tuple[Effect, ...]]:
    """The causes that the step's model can take, and those that an earlier step has found, which are in it."""
    lent = step.diagnosable
    assert lent is not None
    every = applicable(problem.model, candidates(step.situations))
    carried = tuple(e for e in every if lent.carries and e.name in known.extensions)
    return tuple(e for e in every if e not in carried), carried


def _too_short(lent: Diagnosable, problem: Problem) -> str:
    """Why no run of the logs is long enough; empty where one is."""
    if not lent.shortest or problem.duration >= lent.shortest:
        return ""
    return f"no {lent.run} lasts longer than {problem.duration:.2g} s"


def _one_way(spec: TestSpec) -> str:
    """Why the runs are not there and back; empty where they are."""
    ways = {r.direction for r in spec.runs}
    if {"out", "back"} <= ways:
        return ""
    if None in ways:
        return "no run says which way it went" if ways == {None} else "some runs do not say which way they went"
    return "all runs went the same way"


def _refuse_others(asked: Diagnose, effects: Sequence[Effect], carried: Sequence[Effect]) -> None:
    """Refuse to look for, or to take in, what the model cannot take.

    What an earlier step found is in the model: whether it did must not decide whether a description is right.
    """
    names = [e.name for e in effects]
    why, remedy = "is no effect that this model can take", f"there are: {', '.join(names)}"
    raise_all(
        Finding(f"diagnose.{key}", why, name, remedy)
        for key, name in _listed(asked)
        if name not in names and name not in [e.name for e in carried]
    )


def _listed(asked: Diagnose) -> Iterator[tuple[str, str]]:
    """Each effect that is named, with the key under which it is."""
    for key in ("effects", "extend"):
        named = getattr(asked, key)
        yield from ((key, name) for name in (named if isinstance(named, list) else ()))


def present(spec: TestSpec, known: Parameters, case: Case) -> Iterator[Finding]:
    """What was asked for and is in the model already."""
    for key, name in _listed(spec.diagnose):
        if name in known.extensions and name not in case.causes:
            yield Finding(f"diagnose.{key}", f"{name} is in the model already, from an earlier step", minor=True)
