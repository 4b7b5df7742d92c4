"""Nested regressions: an effect that is held at zero has no influence."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from vdyn_cli.inference import Regression, Rows, Unknown, approach, solve
from vdyn_cli.inference.restrict import restricted, without_priors

RUNS, ROWS = 3, 40


def full(b_prior: tuple[float, float] | None = None) -> Regression:
    """y = a + b x + c x^2 + start exp(-5 x), bent: the residual goes as the sum's sinh, so that steps must be taken."""
    rng = np.random.default_rng(1)
    x = np.linspace(0.0, 1.0, ROWS)
    columns = np.column_stack([np.ones(ROWS), x, x**2, np.exp(-5 * x)])
    data = [np.sinh(0.3 * columns @ [1.0, 2.0, -0.5, k - 1.0]) + 0.05 * rng.normal(size=ROWS) for k in range(RUNS)]

    def rows(run: int, theta: np.ndarray) -> Rows:
        inside = 0.3 * columns @ theta
        residual, jacobian = np.sinh(inside) - data[run], 0.3 * np.cosh(inside)[:, None] * columns
        return Rows(residual / 0.05, jacobian / 0.05, plain=(residual, jacobian))

    unknowns = (
        Unknown("a", 0.0, -9, 9),
        Unknown("b", 0.0, -9, 9, prior=b_prior),
        Unknown("c", 0.0, -9, 9),
        Unknown("start", 0.0, -9, 9, per_run=True),
    )
    return Regression(unknowns, ("one", "two", "three"), rows)


def test_what_is_held_keeps_its_value_and_has_no_column() -> None:
    held = restricted(full(), {"b": 2.0})
    assert [u.name for u in held.unknowns] == ["a", "c", "start"]
    theta = np.array([0.7, -0.2, 0.4])
    ours, whole = held.rows(1, theta), full().rows(1, np.array([0.7, 2.0, -0.2, 0.4]))
    np.testing.assert_array_equal(ours.residual, whole.residual)
    np.testing.assert_array_equal(ours.jacobian, whole.jacobian[:, [0, 2, 3]])
    assert ours.plain is not None
    assert whole.plain is not None
    np.testing.assert_array_equal(ours.plain[0], whole.plain[0])
    np.testing.assert_array_equal(ours.plain[1], whole.plain[1][:, [0, 2, 3]])


def test_a_fit_with_a_value_held_is_the_fit_of_a_model_without_it() -> None:
    fitted = solve(restricted(full(), {"b": 2.0}))
    assert fitted.names == ("a", "c")
    assert fitted.values["a"] == pytest.approx(1.0, abs=0.1)
    assert fitted.values["c"] == pytest.approx(-0.5, abs=0.2)
    known = solve(full((2.0, 1e-7)))  # the same by a prior that leaves no room
    for name in ("a", "c"):
        assert fitted.values[name] == pytest.approx(known.values[name], rel=1e-4)
    np.testing.assert_allclose(fitted.per_run["start"], known.per_run["start"], atol=1e-4)


def test_nothing_held_is_the_same_regression() -> None:
    free, whole = solve(restricted(full(), {})), solve(full())
    assert free.values == whole.values
    assert free.interval95 == whole.interval95


def test_a_fit_starts_where_another_ended_within_its_range() -> None:
    before = solve(full())
    started = restricted(full(), {"c": 0.0}, before)
    assert [u.start for u in started.shared] == [before.values["a"], before.values["b"]]
    np.testing.assert_array_equal(started.run_starts["start"], before.per_run["start"])
    from_there, from_nothing = solve(started), solve(restricted(full(), {"c": 0.0}))
    for name in ("a", "b"):
        assert from_there.values[name] == pytest.approx(from_nothing.values[name], rel=1e-6)


def test_priors_are_left_out_of_those_named_alone() -> None:
    regression = full((2.0, 1e-7))
    assert without_priors(regression, ["a"]).shared[1].prior == (2.0, 1e-7)
    free = without_priors(regression, ["b", "no such unknown"])
    assert free.shared[1].prior is None
    assert solve(free).values == solve(full()).values


def test_a_few_steps_come_near_without_a_judgment() -> None:
    shared, own = approach(full(), 8)
    fitted = solve(full())
    for name, value in fitted.values.items():
        assert shared[name] == pytest.approx(value, abs=fitted.classical_std[name])
    assert np.all(np.abs(own["start"] - fitted.per_run["start"]) < fitted.per_run_std["start"])


def test_unknowns_that_only_a_prior_determines_are_no_obstacle_to_an_approach() -> None:
    """Two unknowns with the same sensitivity and equal priors share the estimate."""
    x = np.linspace(0.0, 1.0, 30)
    twin = Regression(
        (Unknown("a", 0.0, prior=(0.0, 1.0)), Unknown("b", 0.0, prior=(0.0, 1.0))),
        ("one",),
        lambda k, theta: Rows((theta[0] + theta[1] - 0.8) * x / 0.01, np.column_stack([x, x]) / 0.01),
    )
    shared, own = approach(twin, 5)
    assert shared["a"] == pytest.approx(0.4, rel=1e-3)
    assert shared["b"] == pytest.approx(0.4, rel=1e-3)
    assert own == {}


def test_a_model_that_can_be_narrowed_is_asked_for_what_is_free_alone() -> None:
    asked: list[list[str]] = []

    def narrow(names: Sequence[str]) -> Callable[[int, np.ndarray], Rows]:
        asked.append(list(names))
        return restricted(full(), {u.name: u.start for u in full().shared if u.name not in names}).rows

    wide, theta = replace(full(), narrow=narrow), np.array([0.7, 0.4])
    one = restricted(wide, {"b": 0.0, "c": 0.0})
    assert asked == [["a"]]
    np.testing.assert_array_equal(
        one.rows(0, theta).jacobian, full().rows(0, np.array([0.7, 0, 0, 0.4])).jacobian[:, ::3]
    )
    restricted(wide, {"b": 1.0, "c": 0.0})
    assert len(asked) == 1  # held elsewhere than where it starts: the whole model has to do
