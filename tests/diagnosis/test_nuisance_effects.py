"""Sensor errors that the baseline contains, beside an answer."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.detect.detection import detect
from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.name import nuisance_effects
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel
from vdyn_cli.diagnosis.name.nuisance_effects import _changes_main_channel, _usual, with_nuisance_effects
from vdyn_cli.diagnosis.size.finding_size import FindingSize, Limits, finding_size
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.inference import Unknown


@pytest.mark.parametrize(
    ("value", "better", "stated", "most"),
    [
        *((value, False, False, 0.098) for value in (0.08, -0.08, 0.12)),  # three standard errors are 0.03
        *((0.08, True, False, 0.0), (0.08, False, True, 0.0), (0.14, False, False, 0.0)),
    ],
)
def test_a_latency_within_its_prior_is_usual_unless_held_out_runs_show_it(
    monkeypatch: pytest.MonkeyPatch, value: float, better: bool, stated: bool, most: float
) -> None:
    late = Unknown("latency", 0.0, prior=(0.0, 0.05), nuisance=True)
    model: Any = SimpleNamespace(
        by_name={"delay": SimpleNamespace(covers=("latency",))}, regression=SimpleNamespace(shared=(late,))
    )
    without: Any = SimpleNamespace(solution=SimpleNamespace(values={"latency": value}, std={"latency": 0.01}))
    one: Any = SimpleNamespace(effects=("delay",), fitted=None)
    monkeypatch.setattr(nuisance_effects, "held_out_gain", lambda *_: SimpleNamespace(better=better))
    found = _usual(cast(Any, SimpleNamespace(model=model)), one, without, Limits(stated=stated))
    assert found == pytest.approx(most, abs=1e-3)


def test_a_delay_of_another_channel_leaves_the_main_channel_as_it_is() -> None:
    """Columns of the main channel's derivatives: speed delay, acceleration delay."""
    names = ("speed_delay", "acceleration_delay")
    row = SimpleNamespace(plain=(np.zeros(2), np.array([[1.0, 0.0], [2.0, 0.0]])))
    regression = SimpleNamespace(shared=[SimpleNamespace(name=n) for n in names])
    fitted: Any = SimpleNamespace(runs=SimpleNamespace(regression=regression, rows=[row]))
    model: Any = SimpleNamespace(amplitudes=lambda name: (name,))
    assert [_changes_main_channel(model, fitted, n) for n in names] == [True, False]


@pytest.mark.parametrize(("beside", "named"), [(0.001, "wave"), (2.0, "slope")])
def test_an_answer_that_only_stood_for_a_latency_is_replaced_by_it(
    monkeypatch: pytest.MonkeyPatch, beside: float, named: str
) -> None:
    """``slope`` changes the output by ``beside`` once ``wave``, the sensor error, is in the model."""
    real = open_strategy(Campaign(5, hidden={"slope": 4.0, "wave": 3.0}).setup(cause("slope"), cause("wave")))

    def model(_: Any, effects: tuple[str, ...]) -> CandidateModel:
        fitted = real.fitted(effects)
        assert fitted is not None
        return CandidateModel(effects, fitted, 0.5, None, 0.0)

    def size(_: Any, without: Any, found: Any) -> FindingSize:
        last = without.effects == ("wave",)
        return replace(finding_size(real, without, found), plain=True, change=beside if last else 1.0, every=beside)

    def covering(_: Any, fitted: Any) -> list[CandidateModel]:
        return [model(None, (*fitted.effects, "wave"))]

    for name, what in (("candidate_model", model), ("finding_size", size), ("_covering", covering)):
        monkeypatch.setattr(nuisance_effects, name, what)
    strategy: Any = SimpleNamespace(
        model=real.model, base=real.base, relinearized=lambda f: f, prior_values={"mass": 1}
    )
    judgment = Judgment(real.base, detect(real, real.base), accepted=(model(None, ("slope",)),), material=True)
    monkeypatch.setattr(nuisance_effects, "held_out_gain", lambda *_: None)
    found = with_nuisance_effects(strategy, judgment, Limits(output=0.1, noise=1.0))
    assert found.answer is not None
    assert found.answer.effects == (("wave",) if named == "wave" else ("slope", "wave"))


@pytest.mark.parametrize(("late", "named"), [(3.0, True), (0.0, False)])
def test_a_latency_beside_each_of_several_answers_is_part_of_them_all(
    monkeypatch: pytest.MonkeyPatch, late: float, named: bool
) -> None:
    """``slope`` and ``wind`` cannot be discriminated; ``wave``, the sensor error, is significant beside both."""
    real = open_strategy(
        Campaign(5, hidden={"slope": 4.0, "wave": late}, plain=True).setup(cause("slope"), cause("wind"), cause("wave"))
    )

    def model(_: Any, effects: tuple[str, ...]) -> CandidateModel:
        fitted = real.fitted(effects)
        assert fitted is not None
        return CandidateModel(effects, fitted, 0.5, None, 0.0)

    monkeypatch.setattr(nuisance_effects, "candidate_model", model)
    monkeypatch.setattr(nuisance_effects, "_covering", lambda _, fitted: [model(None, (*fitted.effects, "wave"))])
    answers = model(None, ("slope",)), model(None, ("wind",))
    size = finding_size(real, real.base, answers[0].fitted)
    judgment = Judgment(real.base, detect(real, real.base), accepted=answers, material=True, size=size)
    strategy: Any = SimpleNamespace(
        model=real.model, base=real.base, relinearized=lambda f: f, prior_values={"mass": 1}, predicted=lambda *_: None
    )
    found = with_nuisance_effects(strategy, judgment, Limits(output=0.2, noise=1.0))
    assert [a.effects for a in found.answers] == [(*a.effects, "wave") if named else a.effects for a in answers]


def test_channels_that_seem_early_show_one_that_is_late() -> None:
    """``slope`` alone seems early; with ``step`` (which covers both latencies) late, ``slope`` is late, too."""
    amplitudes = {("slope",): (-1.0,), ("step",): (1.0,), ("slope", "step"): (0.4, 1.4)}
    covers = {"slope": ("a",), "step": ("a", "b")}
    by_name = {n: SimpleNamespace(name=n, sensor=True, covers=c) for n, c in covers.items()}

    def model(_: Any, effects: tuple[str, ...]) -> Any:
        values = dict(zip(effects, amplitudes[effects], strict=True))
        return SimpleNamespace(
            effects=effects,
            fitted=SimpleNamespace(solution=SimpleNamespace(values=values, std=dict.fromkeys(values, 0.1))),
        )

    full = SimpleNamespace(
        by_name=by_name, amplitudes=lambda e: (e,), setup=SimpleNamespace(effects=list(by_name.values()))
    )
    strategy: Any = SimpleNamespace(model=full)
    early: Any = [model(None, ("slope",)), model(None, ("step",))]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(nuisance_effects, "candidate_model", model)
        patch.setattr(nuisance_effects, "_exact", lambda _, one: one)
        found = nuisance_effects._later_than_each(strategy, cast(Any, SimpleNamespace(effects=())), early)
    assert [m.effects for m in found] == [("slope", "step")]
