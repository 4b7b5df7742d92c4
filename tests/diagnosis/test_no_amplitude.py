"""A cause that may as well be of no size is named by nobody."""

from __future__ import annotations

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
    diagnosed,
    estimate,
    offer,
    size,
    unsure_sizes,
)
from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.case import Case
from vdyn_cli.diagnosis.sizes import sizes_of
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Result


@pytest.fixture(autouse=True)
def catalogue(monkeypatch: pytest.MonkeyPatch) -> None:
    offer(monkeypatch, SLOPE, WIND, WAVE)


def test_a_cause_that_may_be_of_no_size_is_not_named() -> None:
    """What the extended model publishes must stand by itself, whatever the diagnosis had of it."""

    def unsure(spec: Any, data: Campaign, known: Parameters, **more: Any) -> Result:
        result = estimate(spec, data, known, **more)
        sizes = {n: {**e, "interval95": [-0.1, 1.3]} for n, e in result.extra.get("effects", {}).items()}
        return replace(result, extra={**result.extra, "effects": sizes})

    base, result = diagnosed(HIDDEN_SLOPE, replace(STEP, estimate=unsure))
    told = result.diagnosis
    assert told is not None
    assert told["verdict"] == "unknown"
    assert "may as well be of no size" in told["sentence"]
    assert (told["causes"], told["extended"]) == ([], [])
    assert result.parameters == base.parameters
    asked = diagnosed(HIDDEN_SLOPE, replace(STEP, estimate=unsure), extend=["slope"])[1].diagnosis
    assert asked is not None
    assert (asked["verdict"], asked["extended"]) == ("unknown", ["slope"])


@pytest.mark.parametrize(("twins", "who"), [(True, "it, like what it cannot be told from,"), (False, "it")])
def test_nor_is_one_that_is_not_taken_into_the_model(monkeypatch: pytest.MonkeyPatch, twins: bool, who: str) -> None:
    size(monkeypatch, unsure_sizes)
    offer(monkeypatch, SLOPE, WIND, *([cause("wind_twin")] if twins else []))
    _, result = diagnosed(HIDDEN_WIND, extend="never")
    told = result.diagnosis
    assert told is not None
    assert told["verdict"] == "unknown"
    assert f"{who} may as well be of no size" in told["sentence"]


def test_a_cause_that_may_be_of_no_size_is_not_named_beside_another_that_was_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The model that is extended by something else does not vouch for what the diagnosis found."""
    size(monkeypatch, unsure_sizes)
    told = diagnosed(HIDDEN_WIND, extend=["slope"])[1].diagnosis
    assert told is not None
    assert (told["verdict"], told["extended"]) == ("unknown", ["slope"])
    assert "a wind comes closest, but it may as well be of no size" in told["sentence"]
    vouched = diagnosed(HIDDEN_WIND, extend=["wind"])[1].diagnosis
    assert vouched is not None
    assert (vouched["verdict"], vouched["extended"]) == ("named", ["wind"])


@pytest.mark.parametrize("asked", ["named", "never", ["wind"]])
def test_of_two_causes_neither_may_be_of_no_size_whoever_is_asked_for(
    monkeypatch: pytest.MonkeyPatch, asked: Any
) -> None:
    def unsure(answer: Any, case: Case) -> dict[str, Estimate]:
        return {n: replace(e, interval95=(-0.1, 1.3)) if n == "slope" else e for n, e in sizes_of(answer, case).items()}

    def estimated(*args: Any, **more: Any) -> Result:
        result = estimate(*args, **more)
        sizes = dict(result.extra.get("effects", {}))
        if "slope" in sizes:
            sizes["slope"] = {**sizes["slope"], "interval95": [-0.1, 1.3]}
        return replace(result, extra={**result.extra, "effects": sizes})

    size(monkeypatch, unsure)
    both = Campaign(1, hidden={"wind": 2.0, "slope": 0.8})
    told = diagnosed(both, replace(STEP, estimate=estimated), extend=asked)[1].diagnosis
    assert told is not None
    assert told["verdict"] == "unknown"
    assert "slope may as well be of no size" in told["sentence"]
