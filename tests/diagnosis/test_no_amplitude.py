"""An effect that is not significantly different from zero is not named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from tests.diagnosis.line_step import (
    HIDDEN_SLOPE,
    HIDDEN_WIND,
    SLOPE,
    STEP,
    WAVE,
    WIND,
    LineProblem,
    diagnosed,
    estimate,
    offer,
    publishing,
    size,
    unsure_sizes,
)
from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.extend.amplitudes import fitted_amplitudes
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects

UNSURE = (-0.1, 1.3)


@pytest.fixture(autouse=True)
def catalog(monkeypatch: pytest.MonkeyPatch) -> None:
    offer(monkeypatch, SLOPE, WIND, WAVE)


def test_an_effect_that_may_be_zero_is_not_named() -> None:
    """The amplitude of the extended model decides, whatever the amplitude in the diagnosis."""

    unsure = without_amplitude("slope", "wind", "wave")
    base, result = diagnosed(HIDDEN_SLOPE, publishing(unsure))
    told = result.diagnosis
    assert told is not None
    assert told.verdict == "unknown"
    assert "is not significantly different from zero" in told.sentence
    assert (told.causes, told.extended) == ((), ())
    for name, one in base.parameters.items():  # the baseline's values, in intervals that hold what is left open
        assert result.parameters[name].value == one.value
        low, high = result.parameters[name].interval95
        assert low <= one.interval95[0]
        assert high >= one.interval95[1]
    asked = diagnosed(HIDDEN_SLOPE, publishing(unsure), extend=["slope"])[1].diagnosis
    assert asked is not None
    assert (asked.verdict, asked.extended) == ("unknown", ("slope",))


def without_amplitude(*names: str) -> Callable[[Campaign, AddedEffects], Result]:
    """An estimate of the step by which these amplitudes are not significantly different from zero."""

    def unsure(data: Campaign, added: AddedEffects = NO_EFFECTS) -> Result:
        result = estimate(data, added)
        amplitudes = {n: replace(e, interval95=UNSURE) if n in names else e for n, e in result.amplitudes.items()}
        return replace(result, amplitudes=amplitudes)

    return unsure


@pytest.mark.parametrize(
    ("zero", "verdict", "causes"),
    [((), "ambiguous", []), (("wind",), "named", ["wind_twin"]), (("wind", "wind_twin"), "unknown", [])],
)
def test_an_effect_without_amplitude_is_none_of_several_answers(
    monkeypatch: pytest.MonkeyPatch, zero: tuple[str, ...], verdict: str, causes: list[str]
) -> None:
    offer(monkeypatch, SLOPE, WIND, cause("wind_twin"))
    told = diagnosed(HIDDEN_WIND, publishing(without_amplitude(*zero)))[1].diagnosis
    assert told is not None
    assert told.verdict == verdict
    assert [c.effect for c in told.causes] == causes
    assert (told.gain is not None) == bool(causes)
    assert ("the amplitude of each confounded effect" in told.sentence) == (len(zero) == 2)


class WithFreeForm(LineProblem):
    """A problem whose curve may be free; nothing is wrong then."""

    @property
    def with_free_form(self) -> LineProblem:
        return LineProblem(Campaign(1))


@pytest.mark.parametrize(("zero", "verdict"), [((), "named"), (("wind",), "adequate")])
def test_an_effect_without_amplitude_stood_for_the_form_that_is_free(zero: tuple[str, ...], verdict: str) -> None:
    """The published fit takes the free form by itself, and leaves nothing to the effect."""
    step = replace(STEP, prepare=lambda spec, data, known: WithFreeForm(data, without_amplitude(*zero)))
    told = diagnosed(HIDDEN_WIND, step)[1].diagnosis
    assert told is not None
    assert told.verdict == verdict


@pytest.mark.parametrize(
    ("twins", "who"), [(True, "the amplitude of each confounded effect"), (False, "the amplitude")]
)
def test_nor_is_one_that_is_not_taken_into_the_model(monkeypatch: pytest.MonkeyPatch, twins: bool, who: str) -> None:
    size(monkeypatch, unsure_sizes)
    offer(monkeypatch, SLOPE, WIND, *([cause("wind_twin")] if twins else []))
    _, result = diagnosed(HIDDEN_WIND, extend="never")
    told = result.diagnosis
    assert told is not None
    assert told.verdict == "unknown"
    assert f"{who} is not significantly different from zero" in told.sentence


def test_an_effect_that_may_be_zero_is_not_named_beside_a_requested_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A model extended by another effect does not confirm the named one."""
    size(monkeypatch, unsure_sizes)
    told = diagnosed(HIDDEN_WIND, extend=["slope"])[1].diagnosis
    assert told is not None
    assert (told.verdict, told.extended) == ("unknown", ("slope",))
    assert "A wind comes closest, but the amplitude is not significantly different from zero" in told.sentence
    vouched = diagnosed(HIDDEN_WIND, extend=["wind"])[1].diagnosis
    assert vouched is not None
    assert (vouched.verdict, vouched.extended) == ("named", ("wind",))


@pytest.mark.parametrize("asked", ["named", "never", ["wind"]])
def test_of_two_effects_neither_may_be_zero_whichever_is_requested(monkeypatch: pytest.MonkeyPatch, asked: Any) -> None:
    def unsure(answer: Any, case: DiagnosisSetup) -> dict[str, Estimate]:
        return {
            n: replace(e, interval95=UNSURE) if n == "slope" else e for n, e in fitted_amplitudes(answer, case).items()
        }

    size(monkeypatch, unsure)
    both = Campaign(1, hidden={"wind": 2.0, "slope": 0.8})
    told = diagnosed(both, publishing(without_amplitude("slope")), extend=asked)[1].diagnosis
    assert told is not None
    assert told.verdict == "unknown"
    assert "slope is not significantly different from zero" in told.sentence
