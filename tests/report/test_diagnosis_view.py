"""Sentences and tables of the diagnosis on the page: content and rounding."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.report import examples
from vdyn_cli.quantities.diagnosis import Diagnosis
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.report import effect_labels
from vdyn_cli.report.diagnosis_view import DiagnosisSection, diagnosis_section
from vdyn_cli.report.html import render_pipeline
from vdyn_cli.report.text_table import TextTable

EXAMPLE: dict[str, Any] = examples.DIAGNOSIS.model_dump()


def shown(**changed: Any) -> DiagnosisSection:
    found = diagnosis_section(Diagnosis.model_validate({**EXAMPLE, **changed}), examples.coastdown().parameters)
    assert found is not None
    return found


def table(found: DiagnosisSection, title: str) -> TextTable:
    return next(t for t in found.tables if t.title.startswith(title))


def plain(text: str) -> str:
    return text.replace("\N{NARROW NO-BREAK SPACE}", " ").replace("\N{NO-BREAK SPACE}", " ")


def test_effects_have_the_labels_of_the_catalog() -> None:
    assert effect_labels.label("headwind") == "a headwind"
    assert effect_labels.bare(effect_labels.label("headwind")) == "headwind"
    assert effect_labels.label("force_over_speed") == "force over speed"  # a free profile is in no catalog
    assert effect_labels.combined("headwind+tire_warmup") == "a headwind and tires that were still warming up"
    cause = {**EXAMPLE["causes"][0], "label": "a gale"}
    assert table(shown(causes=[cause]), "Identified effects").rows[0][0] == "gale"
    assert plain(effect_labels.amplitude("mass_error", 0.05)) == "5 %"
    assert effect_labels.amplitude("brake_drag", 100.0) == "100 N"
    assert effect_labels.amplitude("brake_drag", float("nan")) == ""


def test_what_the_verdict_is_based_on_is_said_in_sentences() -> None:
    first, ambiguous, extended = shown().notes
    assert first == (
        "The test uses 24 blocks as independent units (effective number 22). Probability of a statistic at least this"
        " large without a model error: p = 0.0005; the smallest possible p with these units is 0.0005."
    )
    assert ambiguous.startswith(
        "With brakes that drag or a driveline that drags in the model, the remaining residual is noise"
    )
    assert extended == (
        "The parameters above are those of the model with a headwind. A headwind belongs to this test, not to the"
        " vehicle."
    )
    lasting = {**EXAMPLE["causes"][0], "lasts": True}
    assert shown(causes=[lasting]).notes[-1].endswith("Later steps and exports keep a headwind as part of the vehicle.")
    assert "extend: never" in shown(extended=[]).notes[-1]


def test_a_bias_is_given_in_percent_of_what_is_known() -> None:
    (row,) = table(shown(), "Identified effects").rows
    assert plain(row[0]) == "headwind"
    assert plain(row[1]) == "2.91 ± 0.13 m/s"
    assert plain(row[-1]) == "rolling resistance +11 %; drag area +3.7 %"
    (hidden,) = table(shown(), "Effects not testable with these data").rows
    assert [plain(c) for c in hidden] == [
        "wrong mass",
        "5 %",
        "it scales all forces of a coast-down alike",
        "rolling resistance +2.0 %",
    ]
    unknown = diagnosis_section(examples.DIAGNOSIS)
    assert unknown is not None
    assert plain(table(unknown, "Identified").rows[0][-1]) == "rolling resistance +0.0011; drag area +0.021 m²"


def test_a_verdict_is_not_green_beside_an_interval_wider_than_its_value() -> None:
    parameters = examples.coastdown().parameters
    assert shown().mood == "good"
    area = parameters["drag_area"]
    wide = {**parameters, "drag_area": replace(area, interval95=(area.value - 2.0, area.value + 2.0))}
    found = diagnosis_section(examples.DIAGNOSIS, wide)
    assert found is not None
    assert (found.label, found.mood) == ("effect identified, in doubt", "fair")
    doubted = shown(doubt="fit: the residual is 3 times the noise floor")
    assert (doubted.label, doubted.mood) == ("effect identified, in doubt", "fair")


def test_a_bias_that_follows_from_another_is_not_repeated() -> None:
    cause = {**EXAMPLE["causes"][0], "biased": {"drag_area": 0.02, "drag_coefficient": 0.009}}
    assert "drag coefficient" not in table(shown(causes=[cause]), "Identified effects").rows[0][-1]


def test_one_reason_for_all_is_given_once() -> None:
    entry = EXAMPLE["not_testable"][0]
    other = {**entry, "effect": "speed_delay", "size": 0.1, "would_bias": {}}
    found = table(shown(not_testable=[entry, other]), "Effects not testable with these data")
    assert found.columns == ("effect", "assumed amplitude", "parameter bias")
    assert "Reason for all of them: it scales all forces" in found.caption
    assert found.rows[1][-1] == "negligible"


def test_the_ranking_says_what_remains_with_each_candidate() -> None:
    found = table(shown(), "Candidate effects")
    assert [plain(c) for c in found.rows[0]] == ["headwind", "18.4", "93 %", "0.31", "noise", "1.90 ± 0.20 m/s"]
    assert [plain(c) for c in found.rows[1]] == ["brakes that drag", "16.9", "31 %", "0.0005", "headwind", ""]
    assert [plain(c) for c in found.rows[2]][2:] == ["< 0.1 %", "not fitted", "", ""]
    assert "not a proof" in found.caption
    unfitted = [{**r, "left_p": None} for r in EXAMPLE["ranking"]]
    found = table(shown(ranking=unfitted), "Candidate effects")
    assert found.columns == ("candidate effect", "score test", "own sensitivity")


def test_worst_segments_are_in_everyday_units_without_raw_keys() -> None:
    found = shown().worst
    assert found is not None
    assert found.columns == ("run", "channel", "segment", "measured − simulated", "× noise")
    assert [plain(c) for c in found.rows[0]] == [
        "coast_3 out",
        "speed",
        "time in the run 60 to 70 s",
        "−1.1 km/h",
        "10",
    ]
    assert [plain(c) for c in found.rows[1]] == ["coast_6", "speed", "time 52.5 to 60 s", "+0.79 km/h", "7.3"]


def test_a_profile_of_many_values_is_given_by_its_largest() -> None:
    knots = {
        f"grade_{k}": {"value": 0.001 * k, "std": 0.0, "interval95": [0.0, 0.002 * k], "unit": ""} for k in range(1, 9)
    }
    cause = {**EXAMPLE["causes"][0], "effect": "grade_profile", "unknowns": knots}
    size = table(shown(causes=[cause]), "Identified effects").rows[0][1]
    assert plain(size) == "8 values, largest 0.0080 ± 0.0080"


def test_one_test_of_several_effects_is_one_row_beside_a_planned_one() -> None:
    read = {"manoeuvre": "Read it at rest.", "expected_t": None, "runs": None}
    planned = {"manoeuvre": "Two coasts.", "separates": ["mass_error"], "expected_t": 9.0, "runs": 2}
    again = {**planned, "manoeuvre": "Weigh the car.", "expected_t": None, "runs": None}
    entries = [planned, again, {**read, "separates": ["wheel_radius"]}, {**read, "separates": ["torque_gain"]}]
    rows = table(shown(next_test=entries, verdict="ambiguous"), "Next test").rows
    assert [row[:2] for row in rows] == [
        ("Two coasts.", "a wrong mass"),
        ("Read it at rest.", "a wrong wheel radius; a drive torque with a wrong gain"),
    ]


def test_empty_columns_of_next_tests_are_left_out() -> None:
    found = table(shown(), "Tests for the remaining effects")
    assert found.columns == ("what to do", "separates", "runs", "expected t")
    assert found.rows[0][1] == "brakes that drag from a driveline that drags"
    entry = {"manoeuvre": "Weigh the car.", "separates": ["mass_error"], "expected_t": None, "runs": None}
    found = table(shown(next_test=[entry], verdict="ambiguous"), "Next test")
    assert found.columns == ("what to do", "effect")
    assert found.rows == (("Weigh the car.", "a wrong mass"),)
    entry = {**entry, "separates": ["mass_error", "torque_gain", "wheel_radius"]}
    found = table(shown(next_test=[entry], verdict="ambiguous"), "Next test")
    assert found.rows[0][1] == "a wrong mass from a drive torque with a wrong gain or a wrong wheel radius"


@pytest.mark.parametrize(
    ("verdict", "extended", "incomplete"),
    [("named", ["headwind"], False), ("named", [], True), ("ambiguous", [], True), ("adequate", [], False)],
)
def test_a_model_that_lacks_an_effect_is_incomplete(verdict: str, extended: list[str], incomplete: bool) -> None:
    assert shown(verdict=verdict, extended=extended).incomplete is incomplete


@pytest.mark.parametrize(
    ("before", "after", "words"), [(2.0, 0.5, "75 % less"), (1.0, 1.2, "20 % more"), (1, 1, "unch")]
)
def test_the_gain_says_less_or_more(before: float, after: float, words: str) -> None:
    gain = shown(gain={**EXAMPLE["gain"], "before": before, "after": after}).gain
    assert gain is not None
    assert plain(gain.percent).startswith(words)


@pytest.mark.parametrize(
    ("certain", "ends"), [(True, "above the noise floor"), (False, "above the noise floor, not significant")]
)
def test_a_share_that_is_not_significant_says_so(certain: bool, ends: str) -> None:
    gain = shown(gain={**EXAMPLE["gain"], "certain": certain}).gain
    assert gain is not None
    assert plain(gain.explained).endswith(ends)


def test_the_pipeline_shows_each_diagnosis_and_the_effects_that_it_keeps(tmp_path: Path) -> None:
    kept = Estimate(0.5, 0.02, (0.46, 0.54), "", "share", "wheel_inertia")
    outcomes = [
        examples.outcome(examples.coastdown(), tmp_path),
        examples.outcome(examples.tire(), tmp_path),
    ]
    parameters = Parameters(extensions={"wheel_inertia": {"wheel_inertia": kept}})
    page = plain(render_pipeline(examples.parameter_set("Day", outcomes, parameters=parameters)))
    assert "A headwind of 2.9 ± 0.1 m/s along the out direction explains 97 %" in page
    assert page.count("effect identified") == 3  # in the table of the steps, and twice in the step's own section
    assert "Effects in the model" in page
    assert "wrong moment of inertia of the wheels" in page
    assert "0.500 ± 0.040" in page
