"""Results with wider intervals of their parameters, and with intervals limited to what is physically possible."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from vdyn_cli.quantities.number_text import decimals
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Restate, Result
from vdyn_cli.quantities.vocabulary import PARAMETERS

LISTED = 3  # intervals written out in the result's sentence


def with_wider_intervals(result: Result, parameters: Parameters, note: str = "") -> Result:
    """The result with wider intervals of its parameters, and its sentence with these intervals.

    Parameters
    ----------
    parameters : the same estimates with other intervals. note : a sentence on what the intervals contain, appended
        where one of them is wider, also to sentences with later intervals.
    """
    wide = {n: e for n, e in parameters.items() if e.interval95 != result.parameters[n].interval95}
    note = note if wide else ""
    if result.restate is None:
        sentence = " ".join(filter(None, (result.sentence, _listed(wide), note)))
        return replace(result, parameters=parameters, sentence=sentence)
    restate = partial(followed_by, note, result.restate) if note else result.restate
    return replace(result, parameters=parameters, sentence=restate(parameters, result.extra), restate=restate)


def followed_by(note: str, restate: Restate, estimates: Mapping[str, Estimate], extra: Mapping[str, Any]) -> str:
    """The sentence that ``restate`` writes, and a note if it is not part of it."""
    sentence = restate(estimates, extra)
    return sentence if note in sentence else f"{sentence} {note}"


def within_physical_range(result: Result) -> Result:
    """The result with intervals limited to the physical range of each parameter in the vocabulary.

    A value outside its range is withheld, such as a drag coefficient from a drag area that the data hardly determine:
    no other step could read it.
    """
    result = _without_impossible(result)
    cut = {}
    for name, one in result.parameters.items():
        known = PARAMETERS.get(name)
        if known is not None and known.lower <= one.value <= known.upper:
            low, high = one.interval95
            cut[name] = replace(one, interval95=(max(low, known.lower), min(high, known.upper)))
    if all(cut[n].interval95 == result.parameters[n].interval95 for n in cut):
        return result
    estimates = {**result.parameters.estimates, **cut}
    return with_wider_intervals(result, replace(result.parameters, estimates=estimates))


def _without_impossible(result: Result) -> Result:
    outside = {n: q for n in result.parameters if (q := PARAMETERS.get(n)) and not q.allows(result.parameters[n].value)}
    if not outside:
        return result
    withheld = dict(result.withheld)
    for name, q in outside.items():
        value = result.parameters[name].value
        withheld[name] = f"its estimate of {value:.3g} is outside the physical range, {q.range_text}"
    return replace(result, parameters=result.parameters.without(outside), withheld=withheld)


def _listed(wide: Mapping[str, Estimate]) -> str:
    texts = []
    for name, one in list(wide.items())[:LISTED]:
        places = decimals(one.half_width, 12)
        low, high = (f"{end:.{places}f}" for end in one.interval95)
        texts.append(f"{name.replace('_', ' ')} {low} to {high} {one.unit}".strip())
    rest = f" and {len(wide) - LISTED} more" if len(wide) > LISTED else ""
    return f"Wider intervals (95 %): {'; '.join(texts)}{rest}." if texts else ""
