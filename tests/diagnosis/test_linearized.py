"""Through which cause straight lines are laid, where large ones bend them."""

from __future__ import annotations

from types import SimpleNamespace as Made
from typing import Any

import pytest

from vdyn_cli.diagnosis.nearer import NEARER, _likeliest


class Bench:
    """A workbench that knows what each cause costs on its own lines, and keeps what was asked of it."""

    def __init__(self, costs: dict[str, float], straight: bool = True) -> None:
        self.case = Made(straight=straight)
        self.costs, self.asked = costs, list[str]()

    def fitted(self, causes: tuple[str, ...]) -> Any:
        return Made(causes=causes) if causes[0] in self.costs else None

    def near(self, fitted: Any) -> Any:
        self.asked.append(fitted.causes[0])
        return Made(solution=Made(cost=self.costs[fitted.causes[0]]))


def found(evidence: dict[str, float]) -> Any:
    def strongest(among: Any) -> str | None:
        return max(among, key=lambda n: evidence[n], default=None)

    return Made(testable=tuple(evidence), scores=Made(evidence=evidence, strongest=strongest))


def likeliest(bench: Bench, evidence: dict[str, float]) -> str | None:
    return _likeliest(bench, found(evidence))  # type: ignore[arg-type]


def test_what_shows_several_times_less_from_afar_may_explain_most_on_its_own_lines() -> None:
    bench = Bench({"damping": 3880.0, "motors": 2579.0, "wheels": 4041.0})
    assert likeliest(bench, {"damping": 58.7, "motors": 14.3, "wheels": 11.4}) == "motors"


def test_small_causes_do_not_bend_lines() -> None:
    bench = Bench({"damping": 1.0, "motors": 2.0, "wheels": 0.0})
    assert likeliest(bench, {"damping": 8.0, "motors": 7.0, "wheels": 5.9}) == "damping"
    assert bench.asked == ["damping", "motors"]


@pytest.mark.parametrize(("straight", "evidence"), [(False, 50.0), (True, 1.0)])
def test_nothing_is_laid_anew_where_fits_simulate_or_nothing_is_large(straight: bool, evidence: float) -> None:
    bench = Bench({"a": 1.0, "b": 0.0}, straight)
    assert likeliest(bench, {"a": 2 * evidence, "b": evidence}) == "a"
    assert not bench.asked


def test_the_strongest_of_many_are_looked_at_and_those_that_cannot_be_fitted_are_not() -> None:
    evidence = {f"c{k}": 50.0 - k for k in range(NEARER + 2)}
    bench = Bench({n: 10.0 - k for k, n in enumerate(evidence) if k != 1})
    assert likeliest(bench, evidence) == f"c{NEARER - 1}"
    assert bench.asked == [f"c{k}" for k in range(NEARER) if k != 1]


def test_where_nothing_can_be_fitted_it_is_what_shows_most() -> None:
    assert likeliest(Bench({}), {"a": 50.0, "b": 60.0}) == "b"
    assert likeliest(Bench({}), {}) is None
