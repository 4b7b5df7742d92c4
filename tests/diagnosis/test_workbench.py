"""Lines that are laid anew through the fit that they gave, for causes about which every line bends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.workbench import Workbench, _between, open_workbench
from vdyn_cli.fit import Regression, Rows, Unknown

SIZE = 2.1
PROBES = (0.2, 0.5, 1.0, 2.0, 4.0)


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


def bench(knocks: bool) -> Workbench:
    play = replace(cause("step"), probes=PROBES if knocks else ())
    campaign = Knocking(3, runs=8)
    return open_workbench(replace(campaign.case(play), straight=True))


def test_lines_are_laid_until_they_lead_to_themselves() -> None:
    opened = bench(knocks=True)
    fitted = opened.fitted(("step",))
    assert fitted is not None
    near = opened.near(fitted)
    assert abs(near.values["step"] - SIZE) < 3 * near.solution.std["step"]
    assert abs(fitted.values["step"] - SIZE) > 30 * near.solution.std["step"]


def test_what_does_not_knock_has_lines_laid_once() -> None:
    opened = bench(knocks=False)
    fitted = opened.fitted(("step",))
    assert fitted is not None
    once, settled = opened.near(fitted), bench(knocks=True).near(fitted)
    assert once.solution.cost > settled.solution.cost + 1.0


def test_of_many_sizes_the_best_is_found() -> None:
    opened = bench(knocks=True)
    found = opened._probed_lines(opened.case.causes["step"], PROBES)
    assert found is not None
    assert found.values["step"] == pytest.approx(SIZE, abs=0.1)


def test_every_size_is_tried_that_lies_about_the_nearest() -> None:
    probes = tuple(float(k) for k in range(1, 19))  # of which every third is tried first
    assert _between(probes, 7.2) == (5, 6, 8, 9)
    assert _between(probes, 0.2) == (2, 3)
    assert _between(probes, 40.0) == (14, 15, 17, 18)
