"""From the tests of causes to one of six verdicts.

adequate      nothing is wrong that these data could show
named         one cause (or one pair) suffices
ambiguous     several suffice: these data cannot tell them apart
unknown       something is wrong that no cause of the catalogue explains
not_testable  too little was driven to say
data_fault    the cause is a sensor's, or a sensor did not measure
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from vdyn_cli.diagnosis.choice import nearly, not_outdone, nothing, simplest, unlisted
from vdyn_cli.diagnosis.detect import FEWEST_UNITS, FEWEST_WORTH, VISIBLE, Detection, detect
from vdyn_cli.diagnosis.gain import Gain, gain
from vdyn_cli.diagnosis.invisible import Invisible, invisible
from vdyn_cli.diagnosis.naming import REST, Trial, as_good, one_after_another, pairs, singles
from vdyn_cli.diagnosis.nearer import nearer
from vdyn_cli.diagnosis.workbench import Fitted, Workbench
from vdyn_cli.quantities.errors import Finding

Name = Literal["adequate", "named", "ambiguous", "unknown", "not_testable", "data_fault"]

HIDING = 2  # causes that may hide each other; of more, one after another, nobody believes it
WORSE = "with it in, what it has not seen is predicted worse"


@dataclass(frozen=True)
class Verdict:
    """The outcome of a diagnosis.

    Parameters
    ----------
    why : for not_testable, what is missing; for a data fault that the reader found, which; for unknown, why not the
        cause that comes ``closest``, where it would suffice.
    answers : the sets of causes that suffice: one if named, several if ambiguous.
    tried : all that was tried as the answer.
    closest : for unknown, what explains most of it.
    gain : of the answer, on data held out.
    """

    name: Name
    why: str
    base: Fitted
    detection: Detection
    answers: tuple[Trial, ...]
    tried: tuple[Trial, ...]
    invisible: tuple[Invisible, ...]
    gain: Gain | None
    closest: Trial | None = None

    @property
    def answer(self) -> Trial | None:
        """The one answer, where there is one."""
        return self.answers[0] if len(self.answers) == 1 else None

    def refuted(self, why: str) -> Verdict:
        """Something is wrong, and ``why`` no answer is what it is."""
        most = min(self.answers, key=lambda t: t.fitted.solution.cost, default=None)
        return replace(self, name="unknown", why=why, answers=(), gain=None, closest=most)


def judge(bench: Workbench, faults: Sequence[Finding] = ()) -> Verdict:
    """Is something wrong, and what? The chance of a false alarm is the case's ``level``.

    Parameters
    ----------
    faults : sensors that did not measure: nothing else is blamed beside them, nor is anything found to be right. Too
        few or too short runs tell nothing all the same.

    Raises
    ------
    ResultError : the baseline cannot be fitted.
    """
    base = bench.fitted(())
    assert base is not None
    found = detect(bench, base)
    unseen_causes = invisible(bench, base, found)
    why = _missing(bench, found)

    first = bench

    def verdict(name: Name, answers: tuple[Trial, ...] = (), tried: tuple[Trial, ...] = ()) -> Verdict:
        gained = None
        if answers and (len(answers) == 1 or len(answers[0].causes) > 1):  # causes that all answers share gain too
            gained = gain(first, base, answers[0].fitted, found.testable, bench.fitted(()) or base)
        return Verdict(name, why, base, found, answers, tried, unseen_causes, gained)

    def unknown(closest: Trial | None, why: str = "") -> Verdict:
        return Verdict("unknown", why, base, found, (), tried, unseen_causes, None, closest)

    if why:
        return verdict("not_testable")
    if not found.testable and found.p_value > bench.case.level:
        return verdict("not_testable")
    if faults:
        why = f"{faults[0].where} {faults[0].what}"
        return verdict("data_fault")
    if found.p_value > bench.case.level:
        return verdict("adequate")
    bench, seen = nearer(bench, found)
    tried = singles(bench, seen)
    answers = simplest(bench, not_outdone(bench, tried), tried)
    if not answers and not _one_shape(bench):
        two = pairs(bench, tried, seen)
        answers = simplest(bench, not_outdone(bench, (*tried, *two)), two) or nearly(tried) or nearly((*tried, *two))
        chain = None if answers else one_after_another(bench, seen)
        answers = answers if chain is None else (chain, *as_good(bench, chain, seen))
    if not answers:
        return unknown(min(tried, key=lambda t: t.fitted.solution.cost, default=None))
    if any(unlisted(bench, trial, seen) for trial in answers):
        return unknown(answers[0], "a free force of fewer unknowns does as well")
    if len(answers) > 1:
        several = verdict("ambiguous", answers, tried)
        if several.gain is not None and len(answers[0].causes) > HIDING and several.gain.interval[1] < 0:
            return unknown(answers[0], WORSE)
        return several
    fault = all(bench.case.causes[c].sensor for c in answers[0].causes)
    if nothing(bench, first.near(answers[0].fitted)):
        return unknown(answers[0], "its size differs so much between pieces of the data that it may as well be nothing")
    named = verdict("data_fault" if fault else "named", answers, tried)
    gained = named.gain
    # With parameters as believed they may get worse and the cause be true: two errors that hid each other are one left.
    hiding = bench.believed and len(answers[0].causes) <= HIDING
    if gained is None or not (gained.worse or (not hiding and gained.interval[1] < 0)):
        return named
    # What makes predictions worse for sure is not the cause, however much of the fitted runs it explains.
    return unknown(answers[0], WORSE)


def _missing(bench: Workbench, found: Detection) -> str:
    """What these data lack to be diagnosed; empty where they will do."""
    runs, level, pieces = len(bench.full.runs), bench.case.level, found.units - found.stated
    if runs < bench.case.fewest_runs:
        return f"{runs} {bench.case.repeated}{'s' if runs > 1 else ''} cannot tell a cause from chance"
    if bench.case.too_short:
        return f"{bench.case.too_short}, and in so little time causes look alike"
    if bench.case.one_way:
        return f"{bench.case.one_way}: wind, slope and resistance look alike"
    if pieces < FEWEST_UNITS or found.worth < FEWEST_WORTH:
        return (
            f"there are {pieces} independent pieces of evidence, worth {found.worth:.0f} equal ones: too few to "
            "certify anything"
        )
    if found.smallest * 3 > level:
        return f"{pieces} pieces of evidence cannot reach the level of {level:.2g}"
    return ""


def _one_shape(bench: Workbench) -> bool:
    """Does a single free profile explain everything? Then it is one cause that the catalogue lacks."""
    for family in bench.case.families:
        fitted = bench.fitted((family,))
        if fitted is None:
            continue
        left = bench.scores(fitted, list(bench.case.causes))
        visible = [n for n in left.names if left.rank[n] and left.visibility[n] > VISIBLE]
        if left.p_value(visible) > REST:
            return True
    return False
