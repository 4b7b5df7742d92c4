"""Relinearization about likely amplitudes of nondifferentiable effects, and about the fitted ones of others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
import pytest

from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.linearized import LinearizedStrategy, open_linearized
from vdyn_cli.diagnosis.strategies.refit import spread_over
from vdyn_cli.diagnosis.strategies.relinearization import _is_stuck
from vdyn_cli.inference import Regression, Rows, Unknown
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects

SIZE = 2.1
LIKELY, RISE = 2.0, 1e5  # of which a step says that it fits best, and by so much


@dataclass(frozen=True)
class Knocking(Campaign):
    """A wave that comes later the larger the play."""

    def late(self, size: float) -> np.ndarray:
        return np.asarray(6.0 * (np.sin(7 * self.x() - size) - np.sin(7 * self.x())))

    def measured(self, run: int) -> np.ndarray:
        return np.asarray(super().measured(run) + self.late(SIZE))

    def regression(self, extra: Sequence[Unknown] = ()) -> Regression:
        straight = super().regression(extra)
        names = [u.name for u in straight.shared]
        if "step" not in names:
            return straight
        at = names.index("step")

        def rows(run: int, theta: np.ndarray) -> Rows:
            given = straight.rows(run, theta)
            jacobian = given.jacobian.copy()
            residual = given.residual - theta[at] * jacobian[:, at] + self.late(theta[at])
            jacobian[:, at] = -6.0 * np.cos(7 * self.x() - theta[at])
            return replace(given, residual=residual, jacobian=jacobian)

        return replace(straight, rows=rows)


def bench(knocks: bool) -> LinearizedStrategy:
    play = replace(cause("step"), probes=(0.5, 1.0) if knocks else (), alike=("wave",))
    campaign = Knocking(3, runs=8)
    case = campaign.setup(play, cause("wave"), cause("hat"))
    return open_linearized(
        replace(case, linearized=True, likely_size=lambda effect, start: (start(LIKELY)[0].start, RISE))
    )


def test_lines_through_a_likely_size_find_the_true_one() -> None:
    opened = bench(knocks=True)
    fitted = opened.fitted(("step",))
    assert fitted is not None
    near = opened.relinearized(fitted)
    assert abs(near.values["step"] - SIZE) < 3 * near.solution.std["step"]
    assert abs(fitted.values["step"] - SIZE) > 30 * near.solution.std["step"]


def test_a_differentiable_effect_is_relinearized_until_it_settles() -> None:
    """A gain of 2 or 3.6 is out of reach of one linearization, or of two."""
    opened = bench(knocks=False)
    fitted = opened.fitted(("step",))
    assert fitted is not None
    assert opened.relinearized(fitted).values["step"] == pytest.approx(SIZE, abs=0.1)


@pytest.mark.parametrize(("bent", "passes"), [(False, 1), (True, 3)])
def test_a_nondifferentiable_model_is_linearized_until_it_settles(bent: bool, passes: int) -> None:
    case = replace(Knocking(3, runs=8).setup(cause("wave")), linearized=True, nondifferentiable=bent)
    laid: list[dict[str, float]] = []

    def regression(added: AddedEffects = NO_EFFECTS, start: Mapping[str, float] = MappingProxyType({})) -> Regression:
        """A linearization that is far off at first and exact when repeated at its result."""
        found = case.regression(added)
        if added:
            return found
        laid.append(dict(start))
        off = 0.0 if start else 5.0

        def rows(run: int, theta: np.ndarray) -> Rows:
            given = found.rows(run, theta)
            return replace(given, residual=given.residual + off * given.jacobian[:, 0])

        return replace(found, rows=rows)

    open_linearized(replace(case, regression=regression))
    assert len(laid) == passes
    assert not laid[0]
    assert all(laid[1:])


def test_the_linearization_is_about_the_likely_amplitude_where_it_explains_more() -> None:
    opened = bench(knocks=True)
    there = opened.about_likely("wave", opened)
    assert there is not opened
    fitted = there.fitted(("step",))
    assert fitted is not None
    assert fitted.values["step"] == pytest.approx(SIZE, abs=0.1)
    assert there.relinearized(fitted) is opened.relinearized(fitted)


def test_effects_that_are_not_alike_are_not_tried() -> None:
    opened = bench(knocks=True)
    assert opened.about_likely("hat", opened) is opened


def test_probes_are_spread_over_their_list_and_no_more_than_the_policy_says():
    probes = tuple(0.1 * k for k in range(1, 19))
    some = spread_over(probes, POLICY.most_probes)
    assert len(some) == POLICY.most_probes
    assert (some[0], some[-1]) == (probes[0], probes[-1])
    assert spread_over((0.5, 1.0), POLICY.most_probes) == [0.5, 1.0]
    assert spread_over((0.5,), POLICY.most_probes) == [0.5]


def test_a_fit_that_is_beyond_its_bound_at_the_bound_ends() -> None:
    assert _is_stuck(-0.6, -0.84, (-0.6, 2.0))
    assert not _is_stuck(-0.6, -0.2, (-0.6, 2.0))
    assert not _is_stuck(0.4, -5.4, (-0.6, 2.0))
    assert not _is_stuck(None, -5.4, (-0.6, 2.0))


def test_an_unsettled_fit_is_returned_where_it_is_stopped_and_not_kept() -> None:
    opened = bench(knocks=False)
    relinearization = opened.relinearization
    stopped = relinearization.from_values(("step",), {"step": 0.5}, lambda fit, before: True)
    settled = relinearization.from_values(("step",), {"step": 0.5})
    assert stopped is not None
    assert settled is not None
    assert relinearization.from_values(("step",), {"step": 0.5}, lambda fit, before: True) is settled
    assert stopped is not settled
