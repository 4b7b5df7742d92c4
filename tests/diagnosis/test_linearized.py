"""About which effect a linearization is repeated, where large ones make it inexact."""

from __future__ import annotations

from types import SimpleNamespace as Made
from typing import Any

import pytest

from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.detection import detect
from vdyn_cli.diagnosis.linearized import strongest_relinearized
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategy_choice import open_strategy


class Fits:
    """A strategy that knows the cost of each effect on its own linearization, and keeps what was requested of it."""

    def __init__(self, costs: dict[str, float]) -> None:
        self.costs, self.requested = costs, list[str]()

    def fitted(self, effects: tuple[str, ...]) -> Any:
        return Made(effects=effects) if effects[0] in self.costs else None

    def relinearized(self, fitted: Any) -> Any:
        self.requested.append(fitted.effects[0])
        return Made(solution=Made(cost=self.costs[fitted.effects[0]]))


def found(evidence: dict[str, float]) -> Any:
    def strongest(among: Any) -> str | None:
        return max(among, key=lambda n: evidence[n], default=None)

    return Made(testable=tuple(evidence), scores=Made(evidence=evidence, strongest=strongest))


def strongest(fits: Fits, evidence: dict[str, float]) -> str | None:
    return strongest_relinearized(fits, found(evidence))  # type: ignore[arg-type]


def test_an_effect_of_less_evidence_may_explain_most_on_its_own_linearization() -> None:
    fits = Fits({"damping": 3880.0, "motors": 2579.0, "wheels": 4041.0})
    assert strongest(fits, {"damping": 58.7, "motors": 14.3, "wheels": 11.4}) == "motors"


def test_small_effects_are_not_relinearized() -> None:
    fits = Fits({"damping": 1.0, "motors": 2.0, "wheels": 0.0})
    assert strongest(fits, {"damping": 8.0, "motors": 7.0, "wheels": 5.9}) == "damping"
    assert fits.requested == ["damping", "motors"]


def test_nothing_is_relinearized_where_nothing_is_large() -> None:
    fits = Fits({"a": 1.0, "b": 0.0})
    assert strongest(fits, {"a": 2.0, "b": 1.0}) == "a"
    assert not fits.requested


def test_refits_need_no_relinearization() -> None:
    strategy = open_strategy(Campaign(1, hidden={"slope": 20.0, "wave": 20.0}).setup(cause("slope"), cause("wave")))
    base = strategy.fitted(())
    assert base is not None
    seen = detect(strategy, base)
    assert min(seen.scores.evidence[n] for n in ("slope", "wave")) > POLICY.large_t
    assert strategy.focused(seen) == (strategy, seen)


def test_the_strongest_of_many_are_compared_and_those_that_cannot_be_fitted_are_not() -> None:
    most = POLICY.most_relinearized
    evidence = {f"c{k}": 50.0 - k for k in range(most + 2)}
    fits = Fits({n: 10.0 - k for k, n in enumerate(evidence) if k != 1})
    assert strongest(fits, evidence) == f"c{most - 1}"
    assert fits.requested == [f"c{k}" for k in range(most) if k != 1]


@pytest.mark.parametrize(("evidence", "name"), [({"a": 50.0, "b": 60.0}, "b"), ({}, None)])
def test_where_nothing_can_be_fitted_it_is_what_shows_most(evidence: dict[str, float], name: str | None) -> None:
    assert strongest(Fits({}), evidence) == name
