"""The diagnosis as words and tables: what a reader is told, in which digits, and what is left out."""

from __future__ import annotations

from typing import Any

import pytest

from tests.report import examples
from vdyn_cli.project.pipeline import StepOutcome
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.report import effect_labels
from vdyn_cli.report.diagnosis_view import Diagnosis, diagnosis
from vdyn_cli.report.pipeline_page import pipeline_page
from vdyn_cli.report.views import TextTable


def told(**changed: Any) -> Diagnosis:
    found = diagnosis({**examples.DIAGNOSIS, **changed}, examples.coastdown().parameters)
    assert found is not None
    return found


def table(found: Diagnosis, title: str) -> TextTable:
    return next(t for t in found.tables if t.title.startswith(title))


def plain(text: str) -> str:
    return text.replace("\N{NARROW NO-BREAK SPACE}", " ").replace("\N{NO-BREAK SPACE}", " ")


def test_causes_have_the_words_of_the_catalogue() -> None:
    assert effect_labels.label("headwind") == "a headwind"
    assert effect_labels.bare(effect_labels.label("headwind")) == "headwind"
    assert effect_labels.label("force_over_speed") == "force over speed"  # a free profile is in no catalogue
    assert effect_labels.combined("headwind+tire_warmup") == "a headwind and tires that were still warming up"
    assert effect_labels.told({"effect": "headwind", "label": "a gale"}) == "a gale"
    assert plain(effect_labels.size("mass_error", 0.05)) == "5 %"
    assert effect_labels.size("brake_drag", 100.0) == "100 N"
    assert effect_labels.size("brake_drag", float("nan")) == ""


def test_what_the_verdict_rests_on_is_said_in_words() -> None:
    first, ambiguous, extended = told().notes
    assert first == (
        "Judged by 24 pieces of runs as independent evidence, worth 22 equal ones. Were nothing wrong, chance alone"
        " would show as much with p = 0.0005; the least that so many pieces can give is 0.0005."
    )
    assert ambiguous.startswith("With brakes that drag or a driveline that drags in the model, what is left is noise")
    assert extended == (
        "The parameters above are those of the model with a headwind in it. A headwind stays with this test, as no part"
        " of the vehicle."
    )
    lasting = {**examples.DIAGNOSIS["causes"][0], "lasts": True}
    assert told(causes=[lasting]).notes[-1].endswith("Later steps and exports keep a headwind as part of the vehicle.")
    assert "extend: never" in told(extended=[]).notes[-1]


def test_a_bias_is_told_in_per_cent_of_what_is_known() -> None:
    (row,) = table(told(), "What was found").rows
    assert plain(row[0]) == "headwind"
    assert plain(row[1]) == "2.91 ± 0.13 m/s"
    assert plain(row[-1]) == "rolling resistance +11 %; drag area +3.7 %"
    (hidden,) = table(told(), "What these data can't show").rows
    assert [plain(c) for c in hidden] == [
        "wrong mass",
        "5 %",
        "it scales all forces of a coast-down alike",
        "rolling resistance +2.0 %",
    ]
    unknown = diagnosis(examples.DIAGNOSIS)
    assert unknown is not None
    assert plain(table(unknown, "What was found").rows[0][-1]) == "rolling resistance +0.0011; drag area +0.021 m²"


def test_a_shift_that_only_follows_another_is_not_told_twice() -> None:
    cause = {**examples.DIAGNOSIS["causes"][0], "biased": {"drag_area": 0.02, "drag_coefficient": 0.009}}
    assert "drag coefficient" not in table(told(causes=[cause]), "What was found").rows[0][-1]


def test_one_reason_for_all_is_told_once() -> None:
    entry = examples.DIAGNOSIS["not_testable"][0]
    other = {**entry, "effect": "speed_delay", "size": 0.1, "would_bias": {}}
    shown = table(told(not_testable=[entry, other]), "What these data can't show")
    assert shown.columns == ("cause", "if there were", "it would shift")
    assert "All for one reason: it scales all forces" in shown.caption
    assert shown.rows[1][-1] == "no parameter noticeably"


def test_the_ranking_says_what_each_cause_leaves() -> None:
    shown = table(told(), "Causes that these data could show")
    assert [plain(c) for c in shown.rows[0]] == ["headwind", "18.4", "93 %", "0.31", "noise", "1.90 ± 0.20 m/s"]
    assert [plain(c) for c in shown.rows[1]] == ["brakes that drag", "16.9", "31 %", "0.0005", "headwind", ""]
    assert [plain(c) for c in shown.rows[2]][2:] == ["< 0.1 %", "not tried", "", ""]
    assert "no proof" in shown.caption
    untried = [{**r, "left_p": None} for r in examples.DIAGNOSIS["ranking"]]
    shown = table(told(ranking=untried), "Causes that these data could show")
    assert shown.columns == ("cause", "explains", "its own trace")


def test_where_is_told_in_everyday_units_without_raw_keys() -> None:
    shown = told().where
    assert shown is not None
    assert shown.columns == ("run", "channel", "where", "measured − simulated", "× noise")
    assert [plain(c) for c in shown.rows[0]] == [
        "coast_3 out",
        "speed",
        "time in the run 60 to 70 s",
        "−1.1 km/h",
        "10",
    ]
    assert [plain(c) for c in shown.rows[1]] == ["coast_6", "speed", "time 52.5 to 60 s", "+0.79 km/h", "7.3"]


def test_a_profile_of_many_values_is_told_by_its_largest() -> None:
    knots = {f"grade_{k}": {"value": 0.001 * k, "interval95": [0.0, 0.002 * k], "unit": ""} for k in range(1, 9)}
    cause = {"effect": "grade_profile", "unknowns": knots, "p_value": 0.01, "visibility": 0.5, "biased": {}}
    size = table(told(causes=[cause]), "What was found").rows[0][1]
    assert plain(size) == "8 values, the largest 0.0080 ± 0.0080"


def test_empty_columns_of_next_tests_are_left_out() -> None:
    shown = table(told(), "What to test next")
    assert shown.columns == ("what to do", "to tell", "runs", "expected t")
    assert shown.rows[0][1] == "brakes that drag from a driveline that drags"
    entry = {"manoeuvre": "Weigh the car.", "separates": ["mass_error"], "expected_t": None, "runs": None}
    shown = table(told(next_test=[entry], verdict="ambiguous"), "The next test to drive")
    assert shown.rows == (("Weigh the car.", "a wrong mass"),)
    entry = {**entry, "separates": ["mass_error", "torque_gain", "wheel_radius"]}
    shown = table(told(next_test=[entry], verdict="ambiguous"), "The next test to drive")
    assert shown.rows[0][1] == "a wrong mass from a drive torque with a wrong gain or a wrong wheel radius"


@pytest.mark.parametrize(
    ("verdict", "extended", "doubted"),
    [("named", ["headwind"], False), ("named", [], True), ("ambiguous", [], True), ("adequate", [], False)],
)
def test_a_model_that_lacks_something_is_doubted(verdict: str, extended: list[str], doubted: bool) -> None:
    assert told(verdict=verdict, extended=extended).doubted is doubted


@pytest.mark.parametrize(
    ("before", "after", "words"), [(2.0, 0.5, "75 % less"), (1.0, 1.2, "20 % more"), (1, 1, "unch")]
)
def test_the_gain_says_less_or_more(before: float, after: float, words: str) -> None:
    gain = told(gain={**examples.DIAGNOSIS["gain"], "before": before, "after": after}).gain
    assert gain is not None
    assert plain(gain.percent).startswith(words)


@pytest.mark.parametrize(
    ("certain", "ends"), [(True, "all channels together"), (False, "all channels together, though not for certain")]
)
def test_a_share_that_is_not_certain_says_so(certain: bool, ends: str) -> None:
    gain = told(gain={**examples.DIAGNOSIS["gain"], "certain": certain}).gain
    assert gain is not None
    assert plain(gain.explained).endswith(ends)


def test_a_gain_of_other_channels_than_the_one_that_is_shown_says_so() -> None:
    gain = told(gain={**examples.DIAGNOSIS["gain"], "certain": True, "interval95": [-0.02, 0.03]}).gain
    assert gain is not None
    assert plain(gain.explained).endswith("together, though of the speed rms alone that is not certain")


def test_the_pipeline_tells_each_diagnosis_and_the_causes_that_it_keeps() -> None:
    kept = Estimate(0.5, 0.02, (0.46, 0.54), "", "share", "wheel_inertia")
    entry = {"value": kept.value, "std": kept.std, "interval95": list(kept.interval95), "unit": "", "meaning": ""}
    document = {"parameters": {}, "extensions": {"wheel_inertia": {"wheel_inertia": entry}}}
    outcomes = [StepOutcome("coastdown", "done", "Rolling resistance is known."), StepOutcome("area", "done", "2.2.")]
    page = plain(pipeline_page("Day", outcomes, document, {}, {"coastdown": examples.DIAGNOSIS, "area": None}))
    assert "A headwind of 2.9 ± 0.1 m/s along the out direction explains 97 %" in page
    assert page.count("cause named") == 1
    assert "Causes in the model" in page
    assert "wrong moment of inertia of the wheels" in page
    assert "0.500 ± 0.040" in page
