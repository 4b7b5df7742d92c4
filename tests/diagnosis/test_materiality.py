"""A significant finding may not matter; findings have a size; a description can state limits."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.diagnosis.line_step import HIDDEN_SLOPE, SLOPE, WIND, diagnosed, estimate, offer, publishing
from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.name import candidate_judgment
from vdyn_cli.diagnosis.name.candidate_judgment import _is_significant, _with_idle_remainder, judge
from vdyn_cli.diagnosis.name.candidate_models import candidate_model
from vdyn_cli.diagnosis.size.finding_size import Limits, _exceeds_stated_rate, explained_share, finding_size
from vdyn_cli.diagnosis.size.materiality import limits_of
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.diagnosis.verdict_text import verdict_sentence
from vdyn_cli.quantities.diagnosis import Size
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects

CATALOG = (cause("slope"), cause("wind"), cause("wave"), cause("step"))
SMALL = Campaign(31, rows=20000, hidden={"slope": 0.03}, plain=True)  # t = 12, 3 % of the noise


def test_a_significant_effect_of_trivial_size_leaves_the_model_adequate():
    case = SMALL.setup(*CATALOG)
    verdict = judge(open_strategy(case), limits=Limits(output=0.1, noise=1.0))
    assert verdict.detection.p_value < 0.01
    assert (verdict.verdict, verdict.material, verdict.answers) == ("adequate", False, ())
    assert verdict.immaterial is not None
    assert verdict.immaterial.effects == ("slope",)
    assert verdict_sentence(verdict, case.candidates, {}).startswith("No model error that matters")


def test_an_amplitude_that_chance_explains_has_no_size():
    """With predictions at prior values, such an amplitude alone would change the output by any amount."""
    strategy = open_strategy(SMALL.setup(*CATALOG))
    counted = {e: _is_significant(strategy, strategy.base, candidate_model(strategy, (e,))) for e in ("slope", "step")}
    assert counted == {"slope": True, "step": False}


@pytest.mark.parametrize(("most", "kept"), [(True, ("loss",)), (False, ("tilt", "loss"))], ids=["little", "much"])
def test_an_effect_on_another_channel_stays_if_the_others_leave_much(
    most: bool, kept: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The tilt of an accelerometer changes no simulated speed, and is certain."""

    def fitted(strategy: object, effects: tuple[str, ...]) -> SimpleNamespace:
        return SimpleNamespace(effects=effects, fitted=effects, explains_most=most)

    def size(strategy: object, less: tuple[str, ...], more: tuple[str, ...]) -> SimpleNamespace:
        return SimpleNamespace(plain=True, change=0.0 if "loss" in less else 1.0, before=1.0, after=1.0)

    monkeypatch.setattr(candidate_judgment, "candidate_model", fitted)
    monkeypatch.setattr(candidate_judgment, "finding_size", size)
    strategy: Any = SimpleNamespace(prior_values={"mass": 1.0})
    both: Any = fitted(strategy, ("tilt", "loss"))
    limits = Limits(output=0.1, noise=1.0)
    (answer,) = candidate_judgment._without_idle_effects(strategy, strategy, (both,), limits)
    assert answer.effects == kept


@pytest.mark.parametrize(("std", "verdict", "extended"), [(0.2, "adequate", ()), (0.05, "named", ("slope",))])
def test_an_effect_matters_that_changes_the_published_fit_or_is_certain_in_it(
    std: float, verdict: str, extended: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The step's baseline already contains what explains the residual, as a road that all runs share."""

    def published(data: Campaign, added: AddedEffects = NO_EFFECTS) -> Result:
        shown: dict[str, Any] = {"std": std, "interval95": (0.6 - 2 * std, 0.6 + 2 * std)}
        amplitudes = {n: replace(e, **shown) for n, e in estimate(data, added).amplitudes.items()}
        base = estimate(data)
        return replace(base, amplitudes=amplitudes, fit=replace(base.fit, noise_floor=1.0))

    offer(monkeypatch, SLOPE, WIND)
    _, result = diagnosed(HIDDEN_SLOPE, publishing(published))
    assert result.diagnosis is not None
    assert (result.diagnosis.verdict, result.diagnosis.extended) == (verdict, extended)
    assert (result.diagnosis.material is False) == (not extended)


@pytest.mark.parametrize(("std", "matters"), [(0.01, True), (10.0, False)])
def test_a_local_force_matters_where_the_stated_parameters_do_not_allow_it(std: float, matters: bool) -> None:
    """``hat``, of amplitude 1.4 and slope 1.4 / 0.14, beside an uncertain curve of slope 2 x std."""
    campaign = replace(SMALL, rows=1000, hidden={"hat": 1.4}, priors={"bend": (-2.0, std)})
    real = open_strategy(campaign.setup(cause("slope"), profiles=(cause("hat"),)))
    strategy: Any = SimpleNamespace(model=real.model, fitted=real.fitted, prior_values={"bend": -2.0})
    assert _exceeds_stated_rate(strategy, real.base) == matters


@pytest.mark.parametrize(
    ("hidden", "noise", "named"),
    [
        ({"bump": 0.14}, 1.0, True),
        ({"bump": 0.14}, 0.05, False),
        ({"bump": 0.4}, 1.0, False),
        ({"step": 0.1}, 1.0, False),
    ],
)
def test_an_effect_is_named_if_no_profile_of_what_it_leaves_matters(
    hidden: dict[str, float], noise: float, named: bool
) -> None:
    """Not if it matters at a lower noise floor, if it is certain, or if a candidate is strongest in it."""
    effects, profiles = (cause("slope"), cause("step")), (cause("hat"),)
    hidden = {"slope": 0.5, **{k: 1.4 * v for k, v in hidden.items()}}
    campaign = replace(SMALL, rows=1000, hidden=hidden, priors={"bend": (-2.0, 10.0)})
    real = open_strategy(campaign.setup(*effects, profiles=profiles))
    strategy: Any = SimpleNamespace(model=real.model, base=real.base, fitted=real.fitted, prior_values={"bend": -2.0})
    tried = candidate_model(real, ("slope",))
    assert tried is not None
    assert tried.residual_p < 0.02
    answers = _with_idle_remainder(strategy, [tried], Limits(output=0.1 * noise, noise=noise))
    assert [(a.effects, a.residual_immaterial) for a in answers] == ([(("slope",), True)] if named else [])


def test_without_limits_everything_significant_matters():
    verdict = judge(open_strategy(SMALL.setup(*CATALOG)))
    assert (verdict.verdict, verdict.material) == ("named", True)


def test_what_the_user_states_decides():
    strategy = open_strategy(SMALL.setup(*CATALOG))
    assert judge(strategy, limits=Limits(output=0.01, noise=1.0, stated=True)).verdict == "named"
    assert judge(strategy, limits=Limits(output=0.05, noise=1.0, stated=True)).verdict == "adequate"


@pytest.mark.slow
def test_an_unexplained_remainder_of_trivial_size_leaves_the_model_adequate():
    campaign = replace(SMALL, hidden={"bump": 0.1})
    strategy = open_strategy(campaign.setup(*CATALOG))
    assert judge(strategy).verdict == "unknown"
    loose = Limits(output=0.1, noise=1.0, parameters={"level": 0.5, "bend": 0.5})
    assert judge(strategy, limits=loose).verdict == "adequate"
    strict = Limits(output=0.1, noise=1.0, parameters={"level": 0.001, "bend": 0.001})
    assert judge(strategy, limits=strict).verdict == "unknown"


def test_a_deviation_that_no_candidate_comes_close_to_is_judged_by_its_size():
    """No candidate is strong enough to be tried: the free profile alone decides whether the deviation matters."""
    campaign = replace(SMALL, hidden={"bump": 0.1})
    case = campaign.setup(cause("nothing"))
    strategy = open_strategy(case)
    loose = Limits(output=0.1, noise=1.0, parameters={"level": 0.5, "bend": 0.5})
    verdict = judge(strategy, limits=loose)
    assert verdict.detection.p_value < 0.01
    assert (verdict.verdict, verdict.material, verdict.immaterial, verdict.tried) == ("adequate", False, None, ())
    assert verdict_sentence(verdict, case.candidates, {}).startswith("No model error that matters")
    strict = replace(loose, parameters={"level": 0.001, "bend": 0.001})
    assert judge(strategy, limits=strict).verdict == "unknown"


def test_an_unknown_error_states_the_size_of_what_comes_closest():
    case = replace(SMALL, hidden={"bump": 1.0}).setup(*CATALOG)
    verdict = judge(open_strategy(case))
    assert verdict.verdict == "unknown"
    assert verdict.closest is not None
    size = Size(output="speed", unit="m/s", change=0.5, noise_floor=0.2, points=(), shifts_in_std={}, share_of_rms=1.0)
    said = verdict_sentence(verdict, case.candidates, {}, size=size)
    assert said.endswith("Effect of the closest candidate on the speed: 0.5 m/s rms (noise floor 0.2 m/s).")


def test_an_answer_without_a_certain_gain_states_its_size():
    case = Campaign(3, hidden={"wind": 2.0}).setup(*CATALOG)
    verdict = replace(judge(open_strategy(case)), gain=None)
    size = Size(output="speed", unit="m/s", change=0.5, noise_floor=0.2, points=(), shifts_in_std={}, share_of_rms=1.0)
    said = verdict_sentence(verdict, case.candidates, {}, size=size)
    assert verdict.answer is not None
    assert said.endswith("part of the rms error. Effect on the speed: 0.5 m/s rms (noise floor 0.2 m/s).")


def test_a_size_is_the_change_of_output_and_parameters():
    campaign = Campaign(3, hidden={"wind": 2.0}, plain=True)
    strategy = open_strategy(campaign.setup(*CATALOG))
    base, found = strategy.fitted(()), strategy.fitted(("wind",))
    assert base is not None
    assert found is not None
    size = finding_size(strategy, base, found)
    left = np.concatenate([a.residual - b.residual for a, b in zip(base.runs.rows, found.runs.rows, strict=True)])
    assert size.change == pytest.approx(float(np.sqrt(np.mean(left**2))), rel=1e-6)
    assert size.before > size.after == pytest.approx(1.0, abs=0.1)
    assert size.shifts["bend"] == pytest.approx(found.values["bend"] - base.values["bend"])


@pytest.mark.parametrize(
    ("before", "after", "floor", "share"),
    [(2.29, 0.22, 0.2, 0.990), (1.1, 1.0, 1.0, 1.0), (1.1, 1.0, 1.2, 1.0), (2.0, 1.5, 1.0, 0.5), (1.0, 1.2, 0.5, 0.0)],
)
def test_a_share_is_one_of_rms(before: float, after: float, floor: float, share: float):
    assert explained_share(before, after, floor) == pytest.approx(share, abs=1e-3)


def test_limits_are_read_in_units_or_as_a_share_of_a_parameter():
    result = estimate(Campaign(1))
    level = result.parameters["level"]
    found = limits_of(result, "m", {"height": "5 mm", "level": "1 %"})
    assert found.stated
    assert found.output == pytest.approx(0.005)
    assert found.parameters["level"] == pytest.approx(0.01 * abs(level.value))
    low, high = result.parameters["bend"].interval95
    assert found.parameters["bend"] == pytest.approx(0.05 * (high - low))


@pytest.mark.parametrize("stated", [{"heigth": "5 mm"}, {"height": "5 kg"}, {"level": "1 kg"}])
def test_a_limit_of_another_unit_or_name_is_refused(stated: dict[str, str]):
    with pytest.raises(InputError):
        limits_of(estimate(Campaign(1)), "m", stated)
