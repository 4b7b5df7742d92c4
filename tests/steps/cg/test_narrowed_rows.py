"""A fit with some of the effects costs less, and has the rows of the fit with all of them."""

from dataclasses import replace

import numpy as np
import pytest

from tests.effects.recovered import added, effect, given
from tests.plant import cg as plant
from tests.plant.vehicle import random_vehicle
from tests.steps.cg.test_cg import SPEC, logs
from vdyn_cli.inference.restrict import restricted
from vdyn_cli.steps.cg.problem import prepare


def test_rows_without_an_effect_are_those_with_its_unknown_at_zero() -> None:
    vehicle, held = random_vehicle(5), {"unsprung_mass", "pitch_axis"}
    fit = prepare(SPEC, logs(vehicle, 5)[:1], given(plant.known(vehicle))).fit
    fit = replace(fit, added=added(effect("acceleration_delay"), effect("unsprung_mass")))
    at = np.array([0.0 if u.name in held else u.start for u in fit.unknowns])
    whole = fit.regression(at)
    assert whole.narrow is not None
    part = restricted(whole, dict.fromkeys(held, 0.0))
    kept = [i for i, u in enumerate(fit.unknowns) if u.name not in held]
    theta = at[kept] + 1e-3
    moved = at.copy()
    moved[kept] = theta
    rows, expected = part.rows(0, theta), whole.rows(0, moved)
    assert rows.residual == pytest.approx(expected.residual, abs=1e-9)
    assert rows.jacobian == pytest.approx(expected.jacobian[:, kept], rel=1e-9, abs=1e-6)
