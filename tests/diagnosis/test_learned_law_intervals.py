"""A learned law and the parameters of the law that it extends may absorb each other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from tests.plant.other_classes import HEAVY_EV, write_day
from vdyn_cli.diagnosis.part import learned_law
from vdyn_cli.project.execute import execute


@pytest.mark.thorough
@pytest.mark.slow  # a diagnosis of 5 s
def test_a_car_that_sheds_drag_at_speed_keeps_its_parameters_within_their_intervals(tmp_path: Path) -> None:
    """Grille shutters reduce the drag by a quarter above 80 km/h, so that one drag area fits the coast badly."""
    car = replace(HEAVY_EV, shed=0.25)
    result = execute("coastdown", write_day(tmp_path, car, 0.0, 2, pairs=3)).result
    assert result.diagnosis.verdict in ("named", "unknown")
    assert result.diagnosis.part.element == "road_load"
    for name, truth in (("rolling_resistance", car.rolling), ("drag_area", car.drag_area)):
        low, high = result.parameters[name].interval95
        assert low < truth < high


@pytest.mark.parametrize(
    ("odd", "order"),
    [(False, ["even_power", "power", "saturation", "knee"]), (True, ["power", "saturation", "even_power", "knee"])],
)
def test_of_equally_good_formulas_the_one_that_the_own_law_follows_least_is_used(
    monkeypatch: pytest.MonkeyPatch, odd: bool, order: list[str]
) -> None:
    """A wide saturation is nearly a line: a stiffness of 8 200 N m/rad became 29 000 [5 000, 49 000].

    A part that is alike in both directions has an odd law: a shaft with a cubic term turned one way had an even power.
    """
    found = {"saturation": (1.0, 0.03), "power": (2.0, 0.3), "even_power": (2.0, 0.4), "knee": (1e9, 0.9)}

    def fit(curve: object, form: str, finding: object) -> tuple[object, ...] | None:
        return ((1.0, 1.0), found[form][0], np.zeros(2), found[form][1]) if form in found else None

    monkeypatch.setattr(learned_law, "_fit", fit)
    monkeypatch.setattr(learned_law, "share_of_curve", lambda curves, values: 0.0)
    monkeypatch.setattr(learned_law, "_deviation", lambda curve, finding: 0.0)
    fitted = SimpleNamespace(freedom=8.0, solution=SimpleNamespace(values={}))
    finding = SimpleNamespace(fitted=fitted, curves=[None], parts=[SimpleNamespace(odd=odd)])
    assert [f.form for f in learned_law.fitted_forms(cast(Any, finding))] == order
