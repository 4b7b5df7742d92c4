"""The effect about which a model with large effects is relinearized."""

from __future__ import annotations

from types import SimpleNamespace as Made
from typing import Any

import numpy as np
import pytest

from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.detect.detection import detect
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies import fits_alone
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy


class Fits:
    """A strategy with a given cost of each effect on its own linearization, which records what is requested.

    ``far``: effects that the common linearization cannot fit, as one that lies beyond its range there.
    """

    def __init__(self, costs: dict[str, float], far: tuple[str, ...] = (), missed: dict[str, float] | None = None):
        self.costs, self.far, self.missed, self.requested = costs, far, missed or {}, list[str]()
        self.relinearization = self
        self.model = Made(amplitudes=lambda name: (f"{name}_size",), setup=Made(far_off=False))

    def fitted(self, effects: tuple[str, ...]) -> Any:
        return None if effects[0] in self.far else Made(effects=effects, values={})

    def nondifferentiable(self, effects: tuple[str, ...]) -> bool:
        return False

    def from_values(self, effects: tuple[str, ...], values: dict[str, float], stop: object = None) -> Any:
        (name,) = effects
        self.requested.append(name)
        assert (values == {f"{name}_size": 7.0}) == (name in self.far)
        runs = Made(regression=Made(log_noise=0.0), error=self.missed.get(name, 1.0))
        made = Made(solution=Made(cost=self.costs.get(name)), runs=runs)
        return made if name in self.costs else None


def found(evidence: dict[str, float]) -> Any:
    estimate = {n: np.array([7.0]) for n in evidence}
    return Made(testable=tuple(evidence), scores=Made(evidence=evidence, estimate=estimate))


@pytest.fixture(autouse=True)
def given_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fits_alone, "rms_of", lambda runs: runs.error)
    monkeypatch.setattr(fits_alone, "noise_of", lambda runs: 2.0)


def strongest(fits: Fits, evidence: dict[str, float]) -> str | None:
    return fits_alone.best_of(fits_alone.fits_alone(fits, found(evidence)))  # type: ignore[arg-type]


def test_an_effect_of_less_evidence_may_explain_most_on_its_own_linearization() -> None:
    fits = Fits({"damping": 3880.0, "motors": 2579.0, "wheels": 4041.0})
    assert strongest(fits, {"damping": 58.7, "motors": 14.3, "wheels": 11.4}) == "motors"


def test_small_effects_are_not_relinearized() -> None:
    fits = Fits({"damping": 1.0, "motors": 2.0, "wheels": 0.0})
    assert strongest(fits, {"damping": 8.0, "motors": 7.0, "wheels": 5.9}) == "damping"
    assert fits.requested == ["damping", "motors"]


def test_nothing_is_relinearized_where_nothing_is_large() -> None:
    fits = Fits({"a": 1.0, "b": 0.0})
    assert strongest(fits, {"a": 2.0, "b": 1.0}) is None
    assert not fits.requested


def test_an_effect_beyond_its_range_on_the_common_linearization_is_tried_from_one_step_of_its_score() -> None:
    fits = Fits({"gain": 1.0, "mass": 2.0}, far=("gain",))
    assert strongest(fits, {"mass": 80.0, "gain": 70.0}) == "gain"


def test_an_effect_that_leaves_a_large_error_is_not_the_best_however_likely_it_makes_it() -> None:
    """Its noise estimate contains its residual."""
    fits = Fits({"scale": 1709.0, "gain": 233.0}, missed={"scale": 1.8, "gain": 29.0})
    assert strongest(fits, {"gain": 995.0, "scale": 900.0}) == "scale"


def test_an_effect_on_another_channel_is_the_best_though_it_leaves_the_main_one_within_its_noise() -> None:
    fits = Fits({"late_speed": 1709.0, "late_torque": 233.0}, missed={"late_speed": 0.6, "late_torque": 1.9})
    assert strongest(fits, {"late_torque": 995.0, "late_speed": 900.0}) == "late_torque"


def test_refits_need_no_relinearization() -> None:
    strategy = open_strategy(Campaign(1, hidden={"slope": 20.0, "wave": 20.0}).setup(cause("slope"), cause("wave")))
    base = strategy.fitted(())
    assert base is not None
    seen = detect(strategy, base)
    assert min(seen.scores.evidence[n] for n in ("slope", "wave")) > POLICY.large_t
    assert strategy.about_largest_effect(seen) == (strategy, seen)


def test_the_strongest_of_many_are_compared_and_those_that_cannot_be_fitted_are_not() -> None:
    most = POLICY.most_relinearized
    evidence = {f"c{k}": 50.0 - k for k in range(most + 2)}
    fits = Fits({n: 10.0 - k for k, n in enumerate(evidence) if k != 1})
    assert strongest(fits, evidence) == f"c{most - 1}"
    assert fits.requested == [f"c{k}" for k in range(most)]


@pytest.mark.parametrize("evidence", [{"a": 50.0, "b": 60.0}, {}])
def test_where_nothing_can_be_fitted_there_is_no_best(evidence: dict[str, float]) -> None:
    assert strongest(Fits({}), evidence) is None
