"""Fields of the published Diagnosis: evidence, causes, held-out gain and ranking, from judgment and extension."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from vdyn_cli.diagnosis.detect.detection import Detection
from vdyn_cli.diagnosis.extend.amplitudes import fitted_amplitudes
from vdyn_cli.diagnosis.extend.extension import Extension
from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel
from vdyn_cli.diagnosis.strategies.full_model import FullModel
from vdyn_cli.quantities.diagnosis import Amplitude, Cause, Evidence, Gain, Ranked, Size
from vdyn_cli.quantities.parameters import Estimate

RANKED = 8  # candidates in the ranking; it chooses what is shown, no verdict


def evidence(found: Detection) -> Evidence:
    """The number and kind of independent units of the test."""
    system, least = found.system, found.scores.smallest_p()
    return Evidence(
        unit=system.kind, units=system.units, stated=system.prior_units, worth=system.effective_units, smallest_p=least
    )


def causes(
    model: FullModel,
    judgment: Judgment,
    extension: Extension,
    amplitudes: Mapping[str, Estimate],
    sizes: Mapping[str, Size],
) -> tuple[Cause, ...]:
    """The named effects, and those by which the model was extended unless they are one of several answers.

    Parameters
    ----------
    amplitudes : of the effects, by unknown. sizes : of the finding that each effect is, by effect.
    """
    named = judgment.answer.effects if judgment.answer else ()
    found = []
    for name in dict.fromkeys([*named, *(() if extension.open else extension.effects)]):
        effect = model.setup.candidates[name]
        found.append(
            Cause(
                effect=name,
                label=effect.label,
                unknowns=_amplitudes({n: amplitudes[n] for n in effect.unknowns if n in amplitudes}),
                p_value=judgment.detection.p_value if name in named else None,
                visibility=judgment.detection.scores.visibility[name],
                sensor=effect.sensor,
                lasts=effect.lasts,
                biased=dict(extension.biased.get(name, {})),
                size=sizes.get(name),
            )
        )
    return tuple(found)


def ambiguous(judgment: Judgment) -> tuple[tuple[str, ...], ...]:
    """Sets of interchangeable effects: one out of each makes an answer. Empty unless the verdict is ambiguous."""
    if judgment.verdict != "ambiguous":
        return ()
    return interchangeable(judgment.answers) or (tuple("+".join(t.effects) for t in judgment.answers),)


def interchangeable(answers: Sequence[CandidateModel]) -> tuple[tuple[str, ...], ...]:
    """For each effect of the first answer, that effect and those that replace it in other answers.

    Empty where an answer has another number of effects, or several other effects that do not each replace one alone.
    """
    first = answers[0].effects
    sets = {e: [e] for e in first}
    changes = [({*first} - {*o.effects}, {*o.effects} - {*first}) for o in answers[1:]]
    for gone, new in changes:
        if len(gone) == len(new) == 1:
            sets[min(gone)].append(min(new))
    for gone, new in changes:
        each = [new & {*sets[e]} for e in gone]
        if len(gone) != len(new) or not all(each) or set().union(*each) != new:
            return ()
    return tuple(map(tuple, sets.values()))


def gain(judgment: Judgment, metric: tuple[str, str]) -> Gain | None:
    """The held-out gain; ``metric`` is the name and unit of the channel in which it is measured."""
    found = judgment.gain
    if found is None:
        return None
    name, unit = metric if found.plain else ("error over its noise", "")
    return Gain(
        metric=f"{name} rms" + (" of refitted models" if found.refitted else ""),
        unit=unit,
        before=found.before,
        after=found.after,
        interval95=found.interval,
        share_of_explainable=found.share,
        noise_floor=found.floor or math.nan,
        refitted=found.refitted,
        certain=found.interval[0] > 0.0,
        held_out=True,
        folds=found.folds,
    )


def ranking(model: FullModel, judgment: Judgment) -> tuple[Ranked, ...]:
    """The strongest candidates by their score test alone, with the residual test of their fits."""
    scores = judgment.detection.scores
    tried = {t.effects[0]: t for t in judgment.tried if len(t.effects) == 1}
    names = sorted(judgment.detection.testable, key=lambda n: -scores.evidence[n])[:RANKED]
    return tuple(
        Ranked(
            effect=n,
            explains_t=max(scores.evidence[n], 0.0),
            visibility=scores.visibility[n],
            left_p=tried[n].residual_p if n in tried else None,
            left_mostly=tried[n].residual_like if n in tried else None,
            unknowns=_amplitudes(fitted_amplitudes(tried[n], model.setup)) if n in tried else {},
        )
        for n in names
    )


def _amplitudes(estimates: Mapping[str, Estimate]) -> dict[str, Amplitude]:
    return {n: Amplitude(value=e.value, std=e.std, interval95=e.interval95, unit=e.unit) for n, e in estimates.items()}
