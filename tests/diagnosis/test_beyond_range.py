"""Effects beyond their plausible range: with other answers the verdict is ambiguous, alone they come closest."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.diagnosis.line_step import diagnosed, estimate, offer, publishing
from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.judgment import BEYOND_RANGE, Judgment
from vdyn_cli.diagnosis.name.candidate_judgment import judge
from vdyn_cli.diagnosis.strategies.effect_unknowns import unknowns_of
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.diagnosis.verdict_text import amplitude_text
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects

WIND, WAVE = cause("wind"), cause("wave")
HIDDEN = 4.0


def judged(twin_reach: float, wind: bool = True) -> Judgment:
    """A wind of 4 m, whose twin may plausibly have ``twin_reach`` m."""
    twin = cause("wind_twin", reach=twin_reach)
    candidates = (WIND, twin, WAVE) if wind else (twin, WAVE)
    return judge(open_strategy(Campaign(31, hidden={"wind": HIDDEN}).setup(*candidates)))


def test_a_rival_beyond_its_range_keeps_the_verdict_open() -> None:
    found = judged(HIDDEN / 2.0)
    assert found.verdict == "ambiguous"
    assert {a.effects for a in found.answers} == {("wind",), ("wind_twin",)}


def test_a_rival_far_beyond_its_range_does_not() -> None:
    found = judged(HIDDEN / 6.0)
    assert found.verdict == "named"
    assert found.answer is not None
    assert found.answer.effects == ("wind",)


def test_alone_it_comes_closest_and_the_reason_is_said() -> None:
    found = judged(HIDDEN / 2.0, wind=False)
    assert found.verdict == "unknown"
    assert found.refutation == BEYOND_RANGE
    assert found.beyond_range is not None
    size = found.beyond_range.fitted.values["wind_twin"]
    assert size == pytest.approx(HIDDEN, rel=0.2)
    twin = cause("wind_twin", reach=HIDDEN / 2.0)
    estimate = Estimate(size, 0.1, (size - 0.2, size + 0.2), "m", "twin", "test")
    assert "beyond the plausible range" in amplitude_text(twin, {"wind_twin": estimate})
    assert "beyond" not in amplitude_text(cause("wind_twin"), {"wind_twin": estimate})


def test_a_fit_may_hold_an_amplitude_beyond_its_range() -> None:
    twin = cause("wind_twin", reach=2.0)
    uppers = [unknowns_of(twin, holding=holding)[0].upper for holding in ({}, {"wind_twin": 1.0}, {"wind_twin": 4.0})]
    assert uppers == [3.0, 3.0, 6.0]


@pytest.mark.parametrize("left", [0, 1])
def test_it_replaces_a_contradicted_baseline_only_where_it_removes_a_doubt(
    monkeypatch: pytest.MonkeyPatch, left: int
) -> None:
    """An impossible amplitude may imitate another law, and then removes no doubt."""

    def doubted(data: Campaign, added: AddedEffects) -> Result:
        result = estimate(data, added)
        warnings = ("a doubt",) * (left if added else 1)
        return replace(result, contradicted=not added, fit=replace(result.fit, warnings=warnings))

    offer(monkeypatch, cause("wind_twin", reach=HIDDEN / 2.0), WAVE)
    base, result = diagnosed(Campaign(31, hidden={"wind": HIDDEN}), publishing(doubted))
    assert result.diagnosis is not None
    assert result.diagnosis.verdict == "unknown"
    assert result.diagnosis.extended == (("wind_twin",) if not left else ())
    if left:
        assert {n: e.value for n, e in result.parameters.items()} == {n: e.value for n, e in base.parameters.items()}
        assert "wind_twin" not in result.diagnosis.sentence


@pytest.mark.parametrize(("fitted", "with_prior"), [(4.0, False), (25.0, True)])
def test_an_amplitude_beyond_its_range_is_estimated_with_a_prior(
    fitted: float, with_prior: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a line of nearly equal fits, the data alone do not determine it."""

    def published(data: Campaign, added: AddedEffects = NO_EFFECTS) -> Result:
        result = estimate(data, added)
        free = any(u.name == "wind" and u.prior is None for u in added.unknowns)
        shown = {n: replace(e, value=fitted, interval95=(1.0, 50.0)) for n, e in result.amplitudes.items()}
        return replace(result, amplitudes=shown if free else result.amplitudes)

    offer(monkeypatch, WIND, WAVE)
    diagnosis = diagnosed(Campaign(31, hidden={"wind": HIDDEN}), publishing(published))[1].diagnosis
    assert diagnosis is not None
    (found,) = diagnosis.causes
    assert (found.unknowns["wind"].interval95 != (1.0, 50.0)) == with_prior
