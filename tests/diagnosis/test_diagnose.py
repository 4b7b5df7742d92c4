"""From a step's baseline to its diagnosed and extended result, on a step whose logs are straight lines."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.diagnosis.line_step import (
    HIDDEN_SLOPE,
    HIDDEN_WIND,
    SLOPE,
    STEP,
    WAVE,
    WIND,
    diagnosed,
    estimate,
    offer,
    prepared,
    publishing,
    size,
    spec_of,
    unsure_sizes,
)
from tests.diagnosis.linear import BASE, Campaign, cause
from vdyn_cli.diagnosis import diagnose
from vdyn_cli.project.result_document import to_json
from vdyn_cli.quantities.errors import Finding, InputError, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameter_json import read_document
from vdyn_cli.quantities.parameters import FORMAT, Parameters, to_document
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.validate.step import too_short as too_short_drives

BOTH = Campaign(1, hidden={"wind": 2.0, "slope": 0.8})
KEYS = {
    "verdict",
    "sentence",
    "causes",
    "extended",
    "ambiguous",
    "not_testable",
    "gain",
    "where",
    "ranking",
    "next_test",
}


@pytest.fixture(autouse=True)
def catalog(monkeypatch: pytest.MonkeyPatch) -> None:
    offer(monkeypatch, SLOPE, WIND, WAVE)


def test_a_named_effect_extends_the_model() -> None:
    base, result = diagnosed(HIDDEN_SLOPE)
    told = result.diagnosis
    assert told is not None
    assert told.model_dump().keys() >= KEYS
    assert told.verdict == "named"
    assert told.extended == ("slope",)
    (found,) = told.causes
    low, high = found.unknowns["slope"].interval95
    assert low < 0.6 < high
    assert f"A slope of {found.unknowns['slope'].value:.3f} +- " in told.sentence
    assert (found.effect, found.label, found.sensor, found.lasts) == ("slope", "a slope", False, True)
    for name in BASE:
        assert result.parameters[name].baseline == base.parameters[name].value
        moved = base.parameters[name].value - result.parameters[name].value
        assert found.biased.get(name, 0.0) == moved  # runs there and back: the level may not move at all
    assert "bend" in found.biased
    for before, after in zip(base.comparisons, result.comparisons, strict=True):
        assert after.baseline is not None
        np.testing.assert_array_equal(after.baseline, before.simulated)
        assert np.std(after.measured - after.simulated) < np.std(after.measured - after.baseline)


def test_an_effect_of_the_car_lasts_and_one_of_the_day_does_not(tmp_path: Path) -> None:
    _, car = diagnosed(HIDDEN_SLOPE)
    _, day = diagnosed(HIDDEN_WIND)
    assert day.diagnosis is not None
    assert day.diagnosis.extended == ("wind",)
    assert not day.parameters.extensions
    slope = car.parameters.extensions["slope"]["slope"]
    assert slope.source == "slope"
    path = tmp_path / "line.json"
    path.write_text(to_json({"format": FORMAT, **to_document(car.parameters)}), encoding="utf-8")
    again = read_document(path).parameters
    assert again.extensions == car.parameters.extensions
    assert again.estimates == car.parameters.estimates
    assert Parameters().updated(again).extensions == again.extensions


def test_never_leaves_the_model_alone_and_still_names() -> None:
    base, result = diagnosed(HIDDEN_SLOPE, extend="never")
    told = result.diagnosis
    assert told is not None
    assert told.verdict == "named"
    assert told.extended == ()
    assert told.causes[0].effect == "slope"
    assert told.causes[0].unknowns["slope"].value == pytest.approx(0.6, abs=0.2)
    assert told.causes[0].biased == {}
    assert result.parameters == base.parameters
    assert result.comparisons == base.comparisons


def test_what_is_asked_for_is_taken_in_whatever_was_found() -> None:
    base, result = diagnosed(Campaign(2), extend=["wind", "slope"])
    told = result.diagnosis
    assert told is not None
    assert told.verdict == "adequate"
    assert told.extended == ("slope", "wind")
    assert [c.effect for c in told.causes] == ["slope", "wind"]
    assert all(c.unknowns[c.effect].std > 0 for c in told.causes)
    assert result.parameters["level"].baseline == base.parameters["level"].value


def test_a_shape_parameter_keeps_its_nominal_value_where_the_data_do_not_determine_it() -> None:
    _, result = diagnosed(Campaign(3, hidden={"wave": 1.0}))
    told = result.diagnosis
    assert told is not None
    assert told.extended == ("wave",)
    assert told.causes[0].unknowns["wave_time"].value == pytest.approx(7.0)


def test_no_effects_is_no_diagnosis() -> None:
    base, result = diagnosed(HIDDEN_SLOPE, effects="none")
    assert result is base
    assert result.diagnosis is None
    assert diagnosed(HIDDEN_SLOPE, replace(STEP, diagnosable=None))[1].diagnosis is None


def test_only_the_effects_that_are_listed_are_looked_for() -> None:
    _, result = diagnosed(HIDDEN_WIND, effects=["slope", "wave"])
    told = result.diagnosis
    assert told is not None
    assert {r.effect for r in told.ranking} <= {"slope", "wave"}
    assert told.verdict != "adequate"


@pytest.mark.parametrize("key", ["effects", "extend"])
def test_an_effect_that_is_not_known_is_refused_with_those_that_are(key: str) -> None:
    with pytest.raises(InputError) as refused:
        diagnosed(HIDDEN_SLOPE, **{key: ["slope", "gremlins", "imps"]})
    findings = refused.value.findings
    assert [f.got for f in findings] == ["gremlins", "imps"]
    assert all(f.where == f"diagnose.{key}" for f in findings)
    assert all("slope, wind, wave" in f.remedy for f in findings)


def test_what_an_earlier_step_found_is_neither_refused_nor_taken_in_twice() -> None:
    known = Parameters(extensions={"wind": {}})
    assert STEP.diagnosable is not None
    step = replace(STEP, diagnosable=replace(STEP.diagnosable, carries=True))
    spec = spec_of(HIDDEN_SLOPE, extend=["wind", "slope"])
    base = step.estimate(spec, HIDDEN_SLOPE, known)
    result = diagnose.diagnosed(prepared(spec, HIDDEN_SLOPE, step, known), base)
    assert result.diagnosis is not None
    assert result.diagnosis.extended == ("slope",)
    (finding,) = result.findings
    assert finding.what == "wind is already in the model, from an earlier step"
    assert finding.minor


def test_the_estimates_of_two_effects_are_reported_beside_each_other_whatever_is_extended() -> None:
    left, taken = diagnosed(BOTH, extend="never")[1].diagnosis, diagnosed(BOTH, extend=["slope"])[1]
    told = taken.diagnosis
    assert left is not None
    assert told is not None
    assert (told.verdict, told.extended) == ("named", ("slope",))
    assert left.sentence == told.sentence
    (beside,), (alone,) = ([c.unknowns["slope"] for c in one.causes if c.effect == "slope"] for one in (left, told))
    assert alone.value == taken.parameters.extensions["slope"]["slope"].value
    assert alone.value > 1.2 * beside.value  # in a model without the wind
    assert f"a slope of {alone.value:.3f} +- " in taken.sentence


def test_of_two_effects_each_has_its_own_part_in_what_was_biased() -> None:
    """Without one effect, the parameters are those of the model with the other."""
    both = diagnosed(BOTH)[1]
    assert both.diagnosis is not None
    told = {c.effect: c.biased for c in both.diagnosis.causes}
    assert told.keys() == {"slope", "wind"}
    for cause_, other in (("slope", "wind"), ("wind", "slope")):
        without = diagnosed(BOTH, extend=[other])[1].parameters
        for name in BASE:
            off = without[name].value - both.parameters[name].value
            assert told[cause_].get(name, 0.0) == pytest.approx(off, abs=1e-6)


@pytest.mark.parametrize(("seconds", "verdict"), [(4.9, "not_testable"), (5.1, "named")])
def test_at_least_one_run_lasts_long_enough(seconds: float, verdict: str) -> None:
    drives = SimpleNamespace(logs=[Log("line.csv", np.linspace(10.0, 10.0 + last, 9), {}) for last in (1.0, seconds)])
    assert STEP.diagnosable is not None
    step = replace(STEP, diagnosable=replace(STEP.diagnosable, too_short=lambda problem: too_short_drives(drives)))
    told = diagnosed(Campaign(1, hidden={"slope": 0.6, "bend": -2.0}), step)[1].diagnosis
    assert told is not None
    assert told.verdict == verdict
    assert ("no drive lasts longer than 4.9 s" in told.sentence) == (verdict == "not_testable")


def test_runs_one_way_do_not_name_a_wind() -> None:
    _, result = diagnosed(replace(HIDDEN_WIND, one_way=True))
    told = result.diagnosis
    assert told is not None
    assert told.verdict == "ambiguous"
    assert told.ambiguous == (("wind", "wave"),)
    assert told.causes == ()
    assert "out and back" in told.next_test[0].manoeuvre


def test_runs_that_do_not_say_which_way_they_went_are_no_second_way() -> None:
    spec = spec_of(HIDDEN_WIND)
    silent = [r.model_copy(update={"direction": None}) if r.direction == "back" else r for r in spec.runs]
    spec = spec.model_copy(update={"runs": silent})
    base = STEP.estimate(spec, HIDDEN_WIND, Parameters())
    told = diagnose.diagnosed(prepared(spec, HIDDEN_WIND), base).diagnosis
    assert told is not None
    assert told.verdict == "not_testable"
    assert "some runs do not state their direction" in told.sentence


def test_a_requested_effect_is_not_reported_with_the_gain_of_the_one_that_was_found() -> None:
    _, result = diagnosed(HIDDEN_SLOPE, extend=["wave"])
    told = result.diagnosis
    assert told is not None
    found, asked = told.causes
    assert (found.effect, found.biased, asked.effect, asked.p_value) == ("slope", {}, "wave", None)
    assert found.p_value == told.p_value
    assert found.unknowns["slope"].value == pytest.approx(0.6, abs=0.2)
    assert asked.biased


def test_a_warning_that_no_effect_explains_is_not_called_adequate_in_words() -> None:
    spec = spec_of(Campaign(4))
    base = STEP.estimate(spec, Campaign(4), Parameters())
    base = replace(base, fit=replace(base.fit, warnings=("jerk is outside its prediction band",)))
    told = diagnose.diagnosed(prepared(spec, Campaign(4)), base).diagnosis
    assert told is not None
    assert told.sentence.startswith("No candidate effect is significant (p = ")
    assert "jerk is outside its prediction band." in told.sentence
    assert told.doubt


def test_a_residual_far_above_the_noise_is_unknown_where_no_test_is_significant() -> None:
    spec = spec_of(Campaign(4))
    base = STEP.estimate(spec, Campaign(4), Parameters())
    doubt = Finding("mass", "contradicts the weight", doubt=True)
    base = replace(base, fit=replace(base.fit, rms=11.0, noise_floor=1.0), findings=(doubt,))
    told = diagnose.diagnosed(prepared(spec, Campaign(4)), base).diagnosis
    assert told is not None
    assert told.verdict == "unknown"
    assert "the rms residual is 11 times the noise floor, and no candidate effect explains" in told.sentence
    assert told.doubt == "mass: contradicts the weight"


@pytest.mark.parametrize("asked", ["named", "never"])
def test_what_the_extended_model_no_longer_misses_is_in_doubt_no_more(asked: str) -> None:
    spec = spec_of(HIDDEN_SLOPE, extend=asked)
    base = STEP.estimate(spec, HIDDEN_SLOPE, Parameters())
    base = replace(base, fit=replace(base.fit, rms=11.0, noise_floor=1.0))
    told = diagnose.diagnosed(prepared(spec, HIDDEN_SLOPE), base).diagnosis
    assert told is not None
    assert bool(told.doubt) == (asked == "never")


@pytest.mark.parametrize("unsure", [True, False])
@pytest.mark.parametrize(("asked", "who"), [("named", "wind"), (["wind"], "wind"), (["slope"], "slope")])
def test_a_requested_extension_that_fails_is_reported(
    monkeypatch: pytest.MonkeyPatch, asked: Any, who: str, unsure: bool
) -> None:
    def failing(data: Campaign, added: AddedEffects) -> Result:
        if added:
            raise ResultError(Finding("fit", "the data do not determine wind"))
        return estimate(data, added)

    if unsure:
        size(monkeypatch, unsure_sizes)
    base, result = diagnosed(HIDDEN_WIND, publishing(failing), extend=asked)
    told = result.diagnosis
    assert told is not None
    assert told.verdict == ("unknown" if unsure else "named")
    assert told.extended == ()
    assert told.not_extended == f"the model could not be extended by {who}: the data do not determine wind"
    (finding,) = [f for f in result.findings if f.what == told.not_extended]
    assert finding.doubt == isinstance(asked, list)
    values = {n: e.value for n, e in result.parameters.items()}
    assert values == {n: e.value for n, e in base.parameters.items()}
    for name, one in base.parameters.items():  # of an unknown error they may be wider, never narrower
        low, high = result.parameters[name].interval95
        assert (low, high) == one.interval95 or (unsure and low <= one.interval95[0] and high >= one.interval95[1])


def test_where_none_is_wanted_nothing_has_failed() -> None:
    _, result = diagnosed(HIDDEN_SLOPE, extend="never")
    assert result.diagnosis is not None
    assert result.diagnosis.not_extended == ""
    assert result.findings == ()


def test_one_of_an_ambiguous_set_stands_in_for_a_baseline_that_is_excluded(monkeypatch: pytest.MonkeyPatch) -> None:
    twin = cause("wind_twin")
    offer(monkeypatch, SLOPE, WIND, twin)
    base, result = diagnosed(HIDDEN_WIND)
    told = result.diagnosis
    assert told is not None
    assert told.verdict == "ambiguous"
    assert sorted(told.ambiguous[0]) == ["wind", "wind_twin"]
    assert told.gain is None
    assert told.extended in (("wind",), ("wind_twin",))
    assert not told.causes
    assert not result.parameters.extensions
    _, alone = diagnosed(HIDDEN_WIND, extend=[told.extended[0]])
    for name, one in result.parameters.items():
        assert one.value == pytest.approx(alone.parameters[name].value)
        assert one.baseline == base.parameters[name].value
    _, never = diagnosed(HIDDEN_WIND, extend="never")
    assert {n: e.value for n, e in never.parameters.items()} == {n: e.value for n, e in base.parameters.items()}
    sizes = {r.effect: r.unknowns for r in told.ranking}
    for name in ("wind", "wind_twin"):
        low, high = sizes[name][name].interval95
        assert low < 2.0 < high
        (stated,) = re.findall(rf"a {name} of ([\d.]+) \+- ", told.sentence)  # by the step's own fit
        assert float(stated) == pytest.approx(sizes[name][name].value, abs=0.05)


def test_where_it_is_wrong_is_where_the_shape_is() -> None:
    _, result = diagnosed(Campaign(5, rows=240, hidden={"bump": 3.0}))
    told = result.diagnosis
    assert told is not None
    assert told.verdict == "unknown"
    largest, *others = told.where
    assert len({w.run for w in told.where}) == len(others) + 1 > 3  # the worst piece of each run
    assert abs(largest.over_noise) >= max(abs(w.over_noise) for w in others)
    assert largest.channel == "height"
    first = float(largest.segment.split()[-3])
    assert 2.5 < first < 5.5  # the bump stands at 4.5 of 10
    assert 1.0 < largest.size < 3.5


def test_a_diagnosis_that_cannot_be_made_costs_no_result(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(case: Any) -> Any:
        raise ArithmeticError("the model has no finite derivatives at the fit")

    monkeypatch.setattr(diagnose, "open_strategy", broken)
    base, result = diagnosed(HIDDEN_SLOPE)
    told = result.diagnosis
    assert told is not None
    assert told.verdict == "not_testable"
    assert told.model_dump().keys() >= KEYS
    assert result.parameters == base.parameters
    assert "no finite derivatives" in result.findings[-1].what


def dump(result: Result) -> dict[str, Any]:
    assert result.diagnosis is not None
    return result.diagnosis.model_dump()


def test_the_same_data_give_the_same_bytes() -> None:
    for campaign in (HIDDEN_SLOPE, HIDDEN_WIND, Campaign(4), Campaign(5, hidden={"bump": 3.0})):
        texts = {to_json({"diagnosis": dump(diagnosed(campaign)[1])}) for _ in range(2)}
        assert len(texts) == 1
        assert json.loads(texts.pop())["diagnosis"]["verdict"]
