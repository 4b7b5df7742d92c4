"""A named answer's intervals hold what a further effect that the data do not exclude would change."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.candidate_models import candidate_model
from vdyn_cli.diagnosis.probable_answers import bayes_factor, probable_answers
from vdyn_cli.diagnosis.strategy_choice import open_strategy


def test_the_bayes_factor_is_the_ratio_of_densities():
    rng = np.random.default_rng(1)
    drawn = rng.normal(0.0, 3.0, 400_000)
    with_effect = np.mean(np.exp(-0.5 * (2.0 - drawn) ** 2))
    assert bayes_factor(2.0, 1.0, 3.0) == pytest.approx(with_effect / np.exp(-0.5 * 2.0**2), rel=0.01)
    assert bayes_factor(0.0, 1.0, 1e-6) == pytest.approx(1.0)
    assert np.isfinite(bayes_factor(1e3, 1.0, 1.0))


@pytest.mark.parametrize("slope", [0.0, 4.0])
def test_an_effect_that_shows_is_probable_and_one_that_does_not_is_not(slope: float):
    strategy = open_strategy(Campaign(11, hidden={"wave": 5.0, "slope": slope}).setup(cause("slope"), cause("wave")))
    answer = candidate_model(strategy, ("wave",))
    assert answer is not None
    found = probable_answers(strategy, answer.fitted)
    assert [one.effects for one, _ in found] == ([("wave", "slope")] if slope else [])
