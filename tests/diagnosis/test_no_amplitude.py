"""An effect that is not significantly different from zero is not named."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from tests.diagnosis.line_step import (
    HIDDEN_SLOPE,
    HIDDEN_WIND,
    SLOPE,
    WAVE,
    WIND,
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

UNSURE = (-0.1, 1.3)


@pytest.fixture(autouse=True)
def catalog(monkeypatch: pytest.MonkeyPatch) -> None:
    offer(monkeypatch, SLOPE, WIND, WAVE)


def test_an_effect_that_may_be_zero_is_not_named() -> None:
    """The amplitude of the extended model decides, whatever the amplitude in the diagnosis."""

    def unsure(*args: Any) -> Result:
        result = estimate(*args)
        return replace(result, amplitudes={n: replace(e, interval95=UNSURE) for n, e in result.amplitudes.items()})

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

    def estimated(*args: Any) -> Result:
        result = estimate(*args)
        found = result.amplitudes
        return replace(
            result, amplitudes={n: replace(e, interval95=UNSURE) if n == "slope" else e for n, e in found.items()}
        )

    size(monkeypatch, unsure)
    both = Campaign(1, hidden={"wind": 2.0, "slope": 0.8})
    told = diagnosed(both, publishing(estimated), extend=asked)[1].diagnosis
    assert told is not None
    assert told.verdict == "unknown"
    assert "slope is not significantly different from zero" in told.sentence
