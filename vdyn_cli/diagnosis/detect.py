"""Whether anything is wrong, with the chance of a false alarm held over all that is looked at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, log2
from typing import Literal

from vdyn_cli.diagnosis.scores import Scores
from vdyn_cli.diagnosis.workbench import Fitted, Workbench

WITHIN, BETWEEN, OMNIBUS = 0.4, 0.4, 0.2  # of the error budget
FEWEST_RUNS = 8  # at least, for causes that differ between runs: fewer patterns of signs cannot certify anything
FEWEST_UNITS, FEWEST_WORTH = 12, 6.0
VISIBLE = 0.02  # share of a trace that the baseline must leave
STATED = 0.5  # of what is left: then it rests on what is known beforehand
ENOUGH = 3.0  # standard errors that the largest plausible size must reach, or these data can't show the cause

Unseen = Literal["runs", "imitated", "noise"]


@dataclass(frozen=True)
class Detection:
    """What was looked at beside the baseline, and the chance of seeing as much by accident.

    Parameters
    ----------
    scores : of causes and profiles at the baseline's fit.
    testable : causes that these data could show.
    p_value : adjusted over the three families: compare with the level.
    smallest : the smallest p that the units could have given.
    stated : how many of the units are values known beforehand.
    """

    scores: Scores
    testable: tuple[str, ...]
    p_value: float
    smallest: float
    units: int
    worth: float
    unit: str
    stated: int


def detect(bench: Workbench, at: Fitted) -> Detection:
    """Look for anything at all beside the causes that are in."""
    causes = [n for n in bench.case.causes if n not in at.causes]
    found = bench.scores(at, [*causes, *bench.case.families])
    testable = tuple(n for n in causes if is_testable(bench, found, n))
    worth = at.sheet.evidence()
    p = chance(bench, at, found, testable, evened=True)
    return Detection(found, testable, p, found.smallest_p(), at.sheet.units, worth, at.sheet.kind, at.sheet.stated)


def chance(bench: Workbench, at: Fitted, found: Scores, causes: Sequence[str], evened: bool = False) -> float:
    """Chance that causes and profiles would show as much by accident, over the three families together.

    Causes that differ between runs are tested with whole runs as units, the others and the free profiles with the
    sheet's own; ``evened``: see ``Scores.p_value``.
    """
    kind = {n: bench.case.causes[n].kind for n in causes}
    within = [n for n in causes if kind[n] == "within_run"]
    between = [n for n in causes if kind[n] == "between_run" and _many(bench)]
    profiles = [n for n in bench.case.families if found.rank[n]]
    shares = {"within": WITHIN if within else 0.0, "between": BETWEEN if between else 0.0}
    shares["profiles"] = OMNIBUS if profiles else 0.0
    total = sum(shares.values())
    parts = []
    if within:
        parts.append(found.p_value(within, evened=evened) / shares["within"])
    if between:
        parts.append(bench.scores(at, between, runs=True).p_value() / shares["between"])
    if profiles:
        parts.append(found.p_value(profiles, evened=evened) / shares["profiles"])
    return min(1.0, total * min(parts)) if parts else 1.0


def is_testable(bench: Workbench, found: Scores, name: str) -> bool:
    """Could these data show the cause at a plausible size?"""
    return unseen(bench, found, name) is None


def unseen(bench: Workbench, found: Scores, name: str) -> Unseen | None:
    """Why these data could not show the cause at a plausible size, None where they could.

    A trace that the baseline imitates all but exactly is not believed for the little that is left of it, unless that
    stands against what is known beforehand: a zero that drifts reads as a force, yet is larger than its data sheet.
    What differs from run to run needs runs enough to tell it from how runs differ anyway.
    """
    if found.rank[name] == 0 or not (found.visibility[name] > VISIBLE or found.stated[name] > STATED):
        return "imitated"
    if bench.case.causes[name].kind == "between_run" and not _many(bench):
        return "runs"
    return None if reachable(bench, found, name) > ENOUGH else "noise"


def fewest_runs(level: float) -> int:
    """Runs from which a cause that differs between them can be certified, all their patterns of signs tried."""
    return max(FEWEST_RUNS, 1 + ceil(log2(1 / (BETWEEN * level))))


def _many(bench: Workbench) -> bool:
    return len(bench.full.runs) >= fewest_runs(bench.case.level)


def reachable(bench: Workbench, found: Scores, name: str) -> float:
    """Standard errors that the cause would stand out by at the edge of its plausible range."""
    effect = bench.case.causes[name]
    unknowns = bench.unknowns(name)
    reach = [max(abs(effect.unknowns[n].lower), abs(effect.unknowns[n].upper)) for n in unknowns]
    spread: Sequence[float] = found.spread[name].tolist()
    return max((r / s for r, s in zip(reach, spread, strict=True) if s > 0), default=0.0)
