"""Intervals include the open answers, and the bias by an unexplained residual."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.detect.unexplained import half_widths, unexplained_biases, unexplained_size, walk
from vdyn_cli.diagnosis.extend.interval_union import OpenAnswer, biases, widened
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.quantities.parameters import Estimate, Parameters


def one(value: float, half: float, source: str = "coastdown") -> Estimate:
    return Estimate(value, half / 2, (value - half, value + half), "", "", source, value)


def test_an_interval_holds_those_of_all_answers():
    answers = [OpenAnswer("headwind", {"a": one(3.0, 0.5)}), OpenAnswer("road_grade", {"a": one(0.0, 0.2)})]
    found = widened(Parameters({"a": one(1.0, 0.4), "given": one(2.0, 0.1, "given")}), answers)
    assert found["a"].value == 1.0
    assert found["a"].interval95 == pytest.approx((-0.2, 3.5))
    assert found["a"].spans == ("headwind", "road_grade")
    assert found["a"].std == pytest.approx(0.2 * 2.5 / 0.4)
    assert found["given"].spans == ()


def test_an_answer_with_a_probability_counts_by_it():
    published = Parameters({"a": one(1.0, 0.4)})
    rare = widened(published, [OpenAnswer("brake", {"a": one(3.0, 0.5)}, probability=0.01)])["a"]
    likely = widened(published, [OpenAnswer("brake", {"a": one(3.0, 0.5)}, probability=0.3)])["a"]
    assert rare.interval95 == pytest.approx((0.6, 1.4), abs=0.05)
    assert likely.interval95[0] == pytest.approx(0.6)
    assert 3.0 < likely.interval95[1] < 3.5
    assert likely.spans == ("brake",)


def test_a_coefficient_that_only_the_published_model_fixes_is_widened():
    fixed = Parameters({n: one(0.0, 0.0, "given") for n in ("zero", "stated")})
    other = {"zero": one(0.5, 0.2), "stated": one(0.0, 0.0, "given")}
    found = widened(fixed, [OpenAnswer("baseline", dict(fixed)), OpenAnswer("rolling", other)])
    assert found["zero"].interval95 == pytest.approx((0.0, 0.7))
    assert (found["zero"].source, found["zero"].spans) == ("coastdown", ("rolling",))
    assert found["stated"] == fixed["stated"]
    likely = widened(fixed, [OpenAnswer("rolling", other, probability=0.3)])["zero"]
    assert 0.5 < likely.interval95[1] < 0.7


def test_a_bias_by_the_unexplained_adds_in_squares():
    found = widened(Parameters({"a": one(1.0, 0.3)}), [OpenAnswer("baseline", {"a": one(1.0, 0.3)}, {"a": 0.4})])
    assert found["a"].interval95 == pytest.approx((0.5, 1.5))
    assert found["a"].spans == ("unexplained",)


def test_derived_parameters_follow_and_others_grow_in_proportion():
    published = {"a": one(1.0, 0.1), "twice": one(2.0, 0.1), "other": one(5.0, 0.3)}
    bias = {"a": np.array([0.3, 0.4])}
    found = biases({"a": 1.0}, [bias], published, lambda values: {"twice": 2 * values["a"]})
    assert found == pytest.approx({"a": 0.5, "twice": 1.0, "other": 3.0})
    assert biases({"a": 1.0}, [], published, lambda values: {}) == {}


def test_the_size_of_the_unexplained_is_found():
    rng = np.random.default_rng(5)
    sizes = []
    for _ in range(200):
        left = rng.normal(size=(60, 6))
        sizes.append(unexplained_size(left, left, left @ (0.8 * rng.normal(size=6)) + rng.normal(size=60))[0])
    assert np.sqrt(np.mean(np.square(sizes))) == pytest.approx(0.8, rel=0.1)
    quiet = [unexplained_size(left, left, rng.normal(size=60))[0] for left in rng.normal(size=(200, 60, 6))]
    assert np.median(quiet) < 0.05


def test_a_direction_that_the_parameters_absorb_tells_no_size():
    """Its remainder is the difference between a law and straight lines, where any misfit would imply a huge force."""
    rng = np.random.default_rng(6)
    whole = rng.normal(size=(60, 3))
    left = whole * np.array([1.0, 1.0, 0.01])
    size, visible = unexplained_size(whole, left, 500.0 * left[:, 2] + rng.normal(size=60))
    assert visible == 2
    assert size < 2.0


@pytest.mark.parametrize("seed", range(4))
def test_a_shape_that_no_effect_explains_is_in_the_interval(seed: int):
    """The parameters absorb half of such a shape, which the fit's own interval does not include."""
    size = 20.0
    strategy = open_strategy(Campaign(60 + seed, hidden={"bump": size}).setup(cause("slope"), cause("wave")))
    base = strategy.fitted(())
    assert base is not None
    every = unexplained_biases(strategy.model, base)
    (element, *_), *_ = (family.on for family in strategy.model.setup.free_profiles.values())
    assert len(unexplained_biases(strategy.model, base, (element,))) <= len(every)
    assert len(unexplained_biases(strategy.model, base, ("another",))) == len(every)
    halves = half_widths(every)
    assert halves["level"] > 5 * base.solution.std["level"]
    assert abs(base.values["level"] - 3.0) < halves["level"]
    assert abs(base.values["bend"] + 2.0) < halves["bend"]


def test_an_unexplained_part_is_continuous():
    covariance = walk(8) @ walk(8).T
    apart = covariance / np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    assert np.all(np.diag(covariance) >= 1.0)
    assert np.all(np.diag(covariance) <= 2.0 + 1e-9)
    assert apart[0, 1] > 0.85 > apart[0, 7]
