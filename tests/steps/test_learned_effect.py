"""A learned law is rebuilt from its definition wherever a model has the element."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from vdyn_cli.engine.applicable import applicable
from vdyn_cli.engine.model_builder import Signals
from vdyn_cli.export.exported_vehicle import accepted_effects
from vdyn_cli.export.parameter_file import AcceptedEffect
from vdyn_cli.physics.laws.suspension import damper
from vdyn_cli.physics.models.half_car import half_car
from vdyn_cli.physics.models.vehicle import vehicle
from vdyn_cli.quantities.law_definition import CurveDefinition, LawDefinition
from vdyn_cli.quantities.parameter_json import read_document
from vdyn_cli.quantities.parameters import FORMAT, Estimate, Parameters, to_document
from vdyn_cli.steps.free_part import Part
from vdyn_cli.steps.learned_effect import learned_effect, learned_effects

NAME = "learned_damper_rear"


def known(form: str) -> Parameters:
    """A learned law of the rear dampers, of this form."""
    names = (f"{NAME}_size", f"{NAME}_width") if form == "saturation" else (f"{NAME}_1",)
    curve = CurveDefinition(
        place="rear", coordinate="stroke_rate", coordinate_unit="m/s", unit="N", factor="", span=(-2.0, 2.0),
        scale=0.005, anchored=True, form=form, unknowns=names,  # type: ignore[arg-type]
        basis=() if form == "saturation" else tuple((float(k == 0),) for k in range(20)),
    )  # fmt: skip
    law = LawDefinition(element="damper", label="the learned law of the rear damper's force", tags=(), curves=(curve,))
    values = {n: Estimate(v, 1.0, (v - 2, v + 2), "N", "", "bump") for n, v in zip(names, (290.0, 0.005), strict=False)}
    return Parameters(extensions={NAME: values}, laws={NAME: law})


@pytest.mark.parametrize("form", ["saturation", "table"])
def test_it_survives_the_json_and_enters_both_models_of_the_dampers(tmp_path: Path, form: str) -> None:
    before = known(form)
    path = tmp_path / "bump.json"
    path.write_text(json.dumps({"format": FORMAT, "step": "bump", **to_document(before)}))
    after = read_document(path).parameters
    assert after.laws == before.laws
    (effect,) = learned_effects(after)
    assert effect.lasts
    assert applicable(half_car(), (effect,)) == applicable(vehicle("front"), (effect,)) == (effect,)
    values = {n: e.value for n, e in after.extensions[NAME].items()}
    included, notes = accepted_effects(vehicle("front"), (AcceptedEffect(NAME, values),), (effect,))
    assert [one.effect for one in included] == [NAME], notes


def test_it_corrects_its_own_axle_and_takes_its_share_of_one_wheel() -> None:
    (effect,) = learned_effects(known("saturation"))
    q = Signals(**{f"{NAME}_size": 290.0, f"{NAME}_width": 0.005})

    def force(place: str, share: float) -> float:
        s = Signals(damping=1000.0, stroke_rate=0.1, place=place, share=share)
        return float(effect.law(damper, s, q))

    assert np.isclose(force("_rear", 1.0), 100.0 + 290.0 * np.tanh(20.0))
    assert np.isclose(force("_rl", 0.5), 100.0 + 145.0 * np.tanh(20.0))
    assert force("_front", 1.0) == 100.0


def test_it_is_nothing_at_zero() -> None:
    for form in ("saturation", "table"):
        (effect,) = learned_effects(known(form))
        q = Signals(**{n: 0.005 if n.endswith("width") else 0.0 for n in effect.unknowns})
        s = Signals(damping=1000.0, stroke_rate=0.1, place="_rear", share=1.0)
        assert float(effect.law(damper, s, q)) == 100.0


@pytest.mark.parametrize(("order", "anchored"), [(5, True), (4, False)])
def test_a_table_of_few_cosines_is_the_addition_of_its_part(order: int, anchored: bool) -> None:
    """Where the data are few points, such as split times, a part has fewer cosines."""
    part = Part("damper", "rear", "stroke_rate", (-2.0, 2.0), 100.0, "N", "m/s", "", "", 0.005, anchored, order=order)
    count = len(part.unknowns)
    curve = CurveDefinition(
        place="rear", coordinate="stroke_rate", coordinate_unit="m/s", unit="N", factor="", span=(-2.0, 2.0),
        scale=0.005, anchored=anchored, form="table", unknowns=tuple(f"c{k}" for k in range(count)),
        basis=tuple(tuple(float(i == k) for i in range(count)) for k in range(count)),
    )  # fmt: skip
    law = LawDefinition(element="damper", label="", tags=(), curves=(curve,))
    values = dict(zip(curve.unknowns, np.linspace(30.0, 80.0, count).tolist(), strict=True))
    made = learned_effect(NAME, law, {n: (v, -100.0, 100.0) for n, v in values.items()})
    s = Signals(damping=1000.0, stroke_rate=0.1, place="_rear", share=1.0)
    expected = float((part.basis(np.array([0.1])) @ np.array(list(values.values())))[0])
    assert np.isclose(float(made.law(damper, s, Signals(**values))), 100.0 + expected)
