"""The verdict in the words of an engineer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import floor, log10

from vdyn_cli.diagnosis.gain import Gain
from vdyn_cli.diagnosis.naming import Trial
from vdyn_cli.diagnosis.verdict import Verdict
from vdyn_cli.effects import Effect
from vdyn_cli.quantities.parameters import Estimate

SHOWN = 4  # causes named in one sentence
CLAUSE = ("that", "another")  # a label with one of them ends in what is no quantity
WORTH_A_WORD = 1.05  # by how much predictions must be worse


def sentence(
    verdict: Verdict, causes: Mapping[str, Effect], sizes: Mapping[str, Estimate], narrowed: bool = False
) -> str:
    """One closing sentence.

    Parameters
    ----------
    sizes : of the unknowns of the causes that were named or taken into the model.
    narrowed : whether only ``causes`` were looked for, and not the whole catalogue.
    """
    text = _said(verdict, causes, sizes, narrowed)
    if narrowed and causes:
        looked = ", ".join(causes)
        text = f"{text[:-1]}. Only {looked} {'was' if len(causes) == 1 else 'were'} looked for."
    return text


def _said(verdict: Verdict, causes: Mapping[str, Effect], sizes: Mapping[str, Estimate], narrowed: bool) -> str:
    p = chance(verdict.detection.p_value)
    if verdict.name == "adequate":
        if narrowed:
            return f"No cause that was looked for shows ({p})."
        return f"The simulation misses nothing that these data could show ({p})."
    if verdict.name == "not_testable":
        why = verdict.why or f"no cause {'that was looked for' if narrowed else 'of the catalogue'} would show in them"
        return f"These data can't tell what the simulation gets wrong: {why}."
    if verdict.name == "unknown":
        labels = " with ".join(causes[c].label for c in verdict.closest.causes) if verdict.closest else ""
        closest = f" {labels} comes closest, but {verdict.why or 'leaves something'};" if labels else ""
        which = "that was looked for" if narrowed else "of the catalogue"
        return f"Something is wrong ({p}) that no cause {which} explains;{closest} see where it is largest."
    if verdict.name == "ambiguous":
        return _undecided(verdict, causes, sizes)
    if verdict.answer is None:
        return f"The data are at fault: {verdict.why}. Leave that part out, then look again."
    answer = verdict.answer
    cause = " and ".join(f"{causes[c].label}{size_of(causes[c], sizes)}" for c in answer.causes)
    share = _share(verdict.gain)
    explain = "explain" if len(answer.causes) > 1 or _plural(causes[answer.causes[0]].label) else "explains"
    hidden = _hidden(verdict.gain)
    if verdict.name == "data_fault":
        return f"The data are at fault: {cause} {explain} {share}what the simulation got wrong.{hidden}"
    rest = "" if answer.sufficient else "; what little is left is more than noise"
    return f"{cause[0].upper()}{cause[1:]} {explain} {share}what the simulation got wrong{rest}.{hidden}"


def _undecided(verdict: Verdict, causes: Mapping[str, Effect], sizes: Mapping[str, Estimate]) -> str:
    """What all answers share is said to be wrong; what they differ in is left open."""
    sets = interchangeable(verdict.answers)
    if len(verdict.answers[0].causes) == 1 or not sets:
        p = chance(verdict.detection.p_value)
        every = [
            " with ".join(f"{causes[c].label}{size_of(causes[c], sizes)}" for c in t.causes) for t in verdict.answers
        ]
        return f"Something is wrong ({p}): {either(every)} would explain it, and these data can't tell which."
    parts = [either([f"{causes[c].label}{size_of(causes[c], sizes)}" for c in one]) for one in sets]
    told = f"{', and '.join(parts)}, explain {_share(verdict.gain)}what the simulation got wrong"
    return f"{told[0].upper()}{told[1:]}; where it says 'or', these data can't tell which."


def interchangeable(answers: Sequence[Trial]) -> list[list[str]]:
    """For each cause of the first answer, it and those that other answers have in its place; nothing where answers
    differ in more than one cause."""
    first = answers[0].causes
    sets = {c: [c] for c in first}
    for other in answers[1:]:
        gone, new = [c for c in first if c not in other.causes], [c for c in other.causes if c not in first]
        if len(gone) != 1 or len(new) != 1:
            return []
        sets[gone[0]].append(new[0])
    return list(sets.values())


def either(named: Sequence[str]) -> str:
    shown = list(named[:SHOWN])
    if len(named) > SHOWN:
        shown.append(f"{len(named) - SHOWN} more")
    return " or ".join([", ".join(shown[:-1]), shown[-1]] if len(shown) > 1 else shown)


def chance(p: float) -> str:
    return f"p = {p:.2g}" if p >= 1e-3 else f"p = {p:.1g}"


def _share(gain: Gain | None) -> str:
    if gain is None or not gain.better:
        return "some of "
    return f"{100 * gain.share:.0f} % of "


def _plural(label: str) -> bool:
    """Is a label such as "brakes that drag" or "wheel loads with a wrong gain" about several?"""
    return any(word.endswith("s") for word in label.split()[:2])


def _hidden(gain: Gain | None) -> str:
    """Two errors that hid each other are one no longer: parameters that are off as stated then show."""
    if gain is None or gain.interval[1] >= 0 or gain.after < WORTH_A_WORD * gain.before:
        return ""
    return " With it in, the parameters as stated predict worse: one of them is off, which this had hidden."


def size_of(effect: Effect, sizes: Mapping[str, Estimate]) -> str:
    """What a sentence says of the size behind the label; nothing where it has several."""
    name = next(iter(effect.unknowns))
    if name not in sizes or len([n for n in effect.unknowns if n not in effect.nominal]) > 1:
        return ""
    e = sizes[name]
    share = 100.0 if not e.unit and effect.unknowns[name].meaning.startswith("share") else 1.0
    half = share * 0.5 * (e.interval95[1] - e.interval95[0])
    places = max(0, _digits(half))
    unit = f" {e.unit}" if e.unit else " %" if share > 1.0 else ""
    sense = f" {effect.sense}" if effect.sense else ""
    size = f"{share * e.value:.{places}f} +- {half:.{places}f}{unit}{sense}"
    behind = any(word in effect.label.split() for word in CLAUSE) and "(" not in size
    return f" ({size})" if behind else f" of {size}"


def _digits(spread: float) -> int:
    """Decimals that show two digits of a spread."""
    return 1 - floor(log10(spread)) if spread > 0 else 3
