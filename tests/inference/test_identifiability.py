"""Messages about unknowns that are not identifiable."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.inference import Regression, Rows, Unknown, solve
from vdyn_cli.inference.identifiability import find_unidentifiable, phrase
from vdyn_cli.quantities.errors import ResultError


def refusal(design: np.ndarray, unknowns: tuple[Unknown, ...], runs: int = 3, noise: float = 0.01) -> str:
    rng = np.random.default_rng(0)
    truth = np.arange(1.0, design.shape[1] + 1)
    data = [design @ truth + noise * rng.standard_normal(len(design)) for _ in range(runs)]
    names = tuple(f"run {k}" for k in range(runs))
    with pytest.raises(ResultError) as caught:
        solve(Regression(unknowns, names, lambda k, x: Rows((design @ x - data[k]) / noise, design / noise)))
    return str(caught.value)


def unknowns(*names: str) -> tuple[Unknown, ...]:
    return tuple(Unknown(n, 0.0) for n in names)


def test_two_that_act_alike() -> None:
    x = np.linspace(0, 1, 40)
    text = refusal(np.column_stack([x, 0.8 * x, x**2]), unknowns("rolling", "wind", "drag"))
    assert "only rolling + 0.8 x wind = " in text
    assert float(text.split(" = ")[1].split(",")[0]) == pytest.approx(2.6, abs=0.03)
    assert ", not rolling and wind separately" in text
    assert "drag" not in text


def test_the_value_of_the_combination_is_that_of_the_truth() -> None:
    x = np.linspace(0, 1, 4000)
    text = refusal(np.column_stack([x, -2 * x]), unknowns("a", "b"))
    value = float(text.split(" = ")[1].split(",")[0])
    assert value == pytest.approx(1.0 - 2 * 2.0, abs=0.1)
    assert "only a - 2 x b" in text


def test_three_in_one_combination() -> None:
    x = np.linspace(0, 1, 40)
    text = refusal(np.column_stack([x, 2 * x, 3 * x]), unknowns("a", "b", "c"))
    assert "a + 2 x b" not in text or "c" in text
    assert "separately" in text
    assert text.count("the data determine only") == 1


def test_three_tied_by_one_direction_leave_two_combinations() -> None:
    x = np.linspace(0, 1, 40)
    text = refusal(np.column_stack([x, x**2, x + x**2]), unknowns("a", "b", "c"))
    assert ", not a, b and c separately" in text
    assert "a + c" in text
    assert "b + c" in text


def test_no_effect_at_all() -> None:
    x = np.linspace(0, 1, 40)
    assert "the data do not determine b" in refusal(np.column_stack([x, 0 * x]), unknowns("a", "b"))


def test_badly_scaled_but_determined_is_not_refused() -> None:
    x = np.linspace(0, 1, 400)
    design = np.column_stack([1e9 * x, 1e-9 * x**2])
    data = design @ [1e-9, 1e9]
    solution = solve(Regression(unknowns("a", "b"), ("run",), lambda k, p: Rows(design @ p - data, design)))
    assert list(solution.values.values()) == pytest.approx([1e-9, 1e9])


def test_wider_than_physics_allows() -> None:
    """Two nearly parallel effects whose standard deviations exceed their ranges."""
    x = np.linspace(0, 1e-3, 40)
    bounded = (Unknown("rolling", 1.0, -10, 10), Unknown("drag", 1.0, -10, 10))
    text = refusal(np.column_stack([x, x + 1e-3 * x**2]), bounded)
    assert "only " in text
    assert ", not rolling and drag separately" in text


def test_wide_but_unbounded_is_reported_not_refused() -> None:
    x = np.linspace(0, 1, 40)
    design = np.column_stack([x, x + 1e-3 * x**2])
    data = design @ [1.0, 2.0] + np.random.default_rng(0).standard_normal(40)
    solution = solve(Regression(unknowns("a", "b"), ("run",), lambda k, p: Rows(design @ p - data, design)))
    assert solution.std["a"] > 100


def test_what_a_run_s_own_unknown_could_also_be() -> None:
    x = np.ones(30)
    own = (Unknown("rolling", 0.0), Unknown("grade", 0.0, per_run=True))
    text = refusal(np.column_stack([x, x]), own)
    assert "a change of rolling is canceled by a change of grade in each run" in text
    assert "state rolling or grade" in text


def test_a_start_speed_is_not_blamed() -> None:
    x = np.linspace(0, 1, 30)
    shared = (*unknowns("a", "b"), Unknown("start", 0.0, per_run=True))
    text = refusal(np.column_stack([x, x, np.ones(30)]), shared)
    assert "only a + b" in text
    assert "start" not in text


def test_a_run_that_does_not_tell_its_own_is_named() -> None:
    x = np.linspace(0, 1, 30)
    shared = (Unknown("a", 0.0), Unknown("offset", 0.0, per_run=True))

    def rows(run: int, p: np.ndarray) -> Rows:
        design = np.column_stack([x, np.ones(30) * (run != 1)])
        return Rows(design @ p - x, design)

    with pytest.raises(ResultError) as caught:
        solve(Regression(shared, ("first.csv", "second.csv", "third.csv"), rows))
    (finding,) = caught.value.findings
    assert finding.where == "second.csv"
    assert "do not determine offset" in finding.what


def test_a_prior_determines() -> None:
    x = np.linspace(0, 1, 40)
    data = 3 * x
    known = (Unknown("a", 0.0), Unknown("b", 0.0, prior=(2.0, 0.1)))
    rows = Rows
    solution = solve(Regression(known, ("run",), lambda k, p: rows(x * (p[0] + p[1]) - data, np.column_stack([x, x]))))
    assert list(solution.values.values()) == pytest.approx([1.0, 2.0])


def test_what_is_given_is_determined_however_much_the_data_scatter() -> None:
    """Stated to a sixteenth of its range, like a mass, with residuals a hundred times the noise."""
    x = np.linspace(0, 1, 40)
    data = 3 * x + 100.0 * np.random.default_rng(1).standard_normal(x.size)
    known = (Unknown("a", 0.0), Unknown("b", 2.0, 1.2, 2.8, prior=(2.0, 0.1)))

    def rows(run: int, p: np.ndarray) -> Rows:
        return Rows(x * (p[0] + p[1]) - data, np.column_stack([x, x]))

    solution = solve(Regression(known, ("run",), rows))
    assert solution.values["b"] == pytest.approx(2.0, abs=0.01)
    assert solution.std["b"] < 0.8


def test_every_combination_is_untouched_by_every_open_direction() -> None:
    rng = np.random.default_rng(1)
    design = rng.standard_normal((50, 3)) @ rng.standard_normal((3, 5))
    found = find_unidentifiable(np.linalg.qr(design, mode="r"), np.full(5, np.inf), np.linalg.norm(design, axis=0))
    assert found is not None
    rows = np.array(found.combinations())
    assert rows.shape == (3, 5)
    assert rows @ found.directions == pytest.approx(np.zeros((3, 2)), abs=1e-9)
    assert design @ found.directions == pytest.approx(np.zeros((50, 2)), abs=1e-9)


@pytest.mark.parametrize(
    ("row", "text"),
    [
        ([1.0, 0.8], "a + 0.8 x b"),
        ([0.8, 1.0], "b + 0.8 x a"),
        ([1.0, -0.01234], "a - 0.012 x b"),
        ([1.0, -1.0], "a - b"),
        ([1.0, 0.0], "a"),
    ],
)
def test_phrases(row: list[float], text: str) -> None:
    assert phrase(["a", "b"], np.array(row)) == text
