"""Intervals of a named answer include the change by a further effect that the data do not exclude."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.diagnosis_setup import stated_errors
from vdyn_cli.diagnosis.name.candidate_models import candidate_model
from vdyn_cli.diagnosis.name.probable_answers import bayes_factor, probable_answers
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.effects.headwind import headwind
from vdyn_cli.effects.wheel_mass import wheel_mass
from vdyn_cli.effects.wheel_radius import wheel_radius
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.vocabulary import PARAMETERS


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
    assert probable_answers(strategy, answer.fitted, {"slope"}) == found
    assert probable_answers(strategy, answer.fitted, {"wave"}) == []


@pytest.mark.parametrize(("stated", "probable"), [(None, True), (10.0, True), (0.01, False)])
def test_what_the_description_knows_better_than_the_data_is_no_answer(stated: float | None, probable: bool):
    """Beside a wave of 5, a slope of 4 is probable, unless it corrects a quantity that is stated to a hundredth."""
    setup = Campaign(11, hidden={"wave": 5.0, "slope": 4.0}).setup(cause("slope"), cause("wave"))
    strategy = open_strategy(replace(setup, stated={} if stated is None else {"slope": stated}))
    answer = candidate_model(strategy, ("wave",))
    assert answer is not None
    assert bool(probable_answers(strategy, answer.fitted)) == probable


def test_what_every_day_has_is_probable_unless_the_data_exclude_it():
    """Wind blows on every day: intervals include it, unless the data exclude its usual size."""
    setups = [
        Campaign(11, hidden={"wave": 5.0}).setup(replace(cause("slope"), every_day=size), cause("wave"))
        for size in (0.0, 0.5, 500.0)
    ]
    strategies = [open_strategy(setup) for setup in setups]
    answers = [candidate_model(strategy, ("wave",)) for strategy in strategies]
    found = [probable_answers(s, a.fitted) for s, a in zip(strategies, answers, strict=True) if a is not None]
    assert [[one.effects for one, _ in more] for more in found] == [[], [("wave", "slope")], []]


def test_an_answer_with_an_impossible_parameter_is_not_probable(monkeypatch: pytest.MonkeyPatch):
    strategy = open_strategy(Campaign(11, hidden={"wave": 5.0, "slope": 4.0}).setup(cause("slope"), cause("wave")))
    answer = candidate_model(strategy, ("wave",))
    more = candidate_model(strategy, ("wave", "slope"))
    assert answer is not None
    assert more is not None
    impossible = replace(more, unphysical="wheel_inertia")
    monkeypatch.setattr("vdyn_cli.diagnosis.name.probable_answers.candidate_model", lambda *_: impossible)
    assert probable_answers(strategy, answer.fitted) == []


def test_a_stated_standard_deviation_is_in_the_unit_of_the_effect():
    known = Parameters({n: Estimate.given(PARAMETERS[n], 20.0, 0.1) for n in ("wheel_mass", "wheel_radius")})
    assert stated_errors((wheel_mass, wheel_radius, headwind), known) == pytest.approx(
        {"wheel_mass_error": 0.1, "wheel_radius_error": 0.005}
    )


def test_each_form_of_a_law_has_half_the_prior_of_its_effect():
    """One effect, as likely as none before the data: its odds halve where its law has another form."""
    plain = cause("slope")
    campaign = Campaign(11, hidden={"wave": 5.0, "slope": 0.2})
    odds = []
    for effect in (plain, replace(plain, other_law=plain.law)):
        strategy = open_strategy(campaign.setup(effect, cause("wave")))
        answer = candidate_model(strategy, ("wave",))
        assert answer is not None
        ((_, probability),) = probable_answers(strategy, answer.fitted)
        odds.append(probability / (1.0 - probability))
    assert odds[1] == pytest.approx(odds[0] / 2.0)
