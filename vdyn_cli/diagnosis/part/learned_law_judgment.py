"""Names a learned law where no law of the catalog suffices."""

from __future__ import annotations

from dataclasses import replace

from vdyn_cli.diagnosis.detect.detection import detect
from vdyn_cli.diagnosis.gain.held_out_gain import Selection, held_out_gain
from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel, candidate_model
from vdyn_cli.diagnosis.part.learned_law import Learned, fitted_forms, learned
from vdyn_cli.diagnosis.part.part_finding import PartFinding
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.quantities.errors import ResultError


def with_learned_law(
    strategy: Strategy, judgment: Judgment, finding: PartFinding, label: str
) -> tuple[Strategy, Judgment, Learned] | None:
    """The strategy with the learned law as a further candidate, and the judgment that names it.

    A formula is tried first if one is as good as the free curve; then the table.

    Returns
    -------
    None if every fit fails, leaves much of the misfit, or does not predict held-out runs better.
    """
    forms = fitted_forms(finding)
    good = [f.form for f in forms if f.as_good]
    for form in (forms[0], None) if good else (None,):
        law = learned(finding, form, good, label)
        named = _named(strategy, judgment, law)
        if named is not None:
            return (*named, law if form is None else replace(law, free=learned(finding, None, good, label).effect))
    return None


def _named(strategy: Strategy, judgment: Judgment, law: Learned) -> tuple[Strategy, Judgment] | None:
    setup = strategy.model.setup
    try:
        extended = open_strategy(replace(setup, effects=(*setup.effects, law.effect), learned=frozenset({law.name})))
        base = extended.base
    except (ResultError, ArithmeticError):
        return None
    answer: CandidateModel | None = candidate_model(extended, (law.name,))
    if answer is None or not answer.explains_most:
        return None
    found = detect(extended, base)
    gain = held_out_gain(extended, base, answer.fitted, Selection((law.name,), base))
    if gain is None or not gain.positive:
        return None
    detection = replace(judgment.detection, scores=found.scores, testable=found.testable)
    named = replace(judgment, base=base, detection=detection, tried=(*judgment.tried, answer))
    return extended, named.naming(answer, gain)
