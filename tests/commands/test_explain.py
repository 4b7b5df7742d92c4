"""`vdyn explain`: steps, effects, parameters, and the two pages."""

from __future__ import annotations

from typing import get_args

import pytest

from vdyn_cli.commands.explain import explanation, listing
from vdyn_cli.commands.glossary import GLOSSARY, glossary
from vdyn_cli.quantities.diagnosis import Verdict
from vdyn_cli.quantities.errors import InputError


def test_the_glossary_is_one_page_of_one_line_each() -> None:
    lines = glossary().splitlines()
    assert explanation("glossary").splitlines() == lines
    assert len(lines) == len(GLOSSARY) <= 50
    assert max(map(len, lines)) <= 120
    assert all(word in glossary() for word in ("candidate effect", "baseline", "block", "held-out gain", "evidence"))


def test_the_glossary_explains_every_verdict() -> None:
    assert set(get_args(Verdict)) <= set(GLOSSARY)


def test_the_policy_lists_the_thresholds_of_the_diagnosis() -> None:
    from vdyn_cli.diagnosis.policy import POLICY
    from vdyn_cli.quantities.threshold import thresholds_text

    assert explanation("policy").startswith(f"Diagnosis\n\n{thresholds_text(POLICY)}")
    assert "false_alarm = 0.001 probability" in explanation("policy")
    assert len(thresholds_text(POLICY).splitlines()) > 5


def test_a_parameter_that_is_an_effect_too_has_both_explanations() -> None:
    text = explanation("wheel_radius")
    assert "wheel_radius, a parameter" in text
    assert "wheel_radius, a candidate effect" in text
    assert "effective rolling radius" in text
    assert "candidate in:" in text
    assert "changes the model's parameters; visible" in text


def test_a_misspelled_topic_gets_the_closest_names() -> None:
    with pytest.raises(InputError, match="did you mean glossary"):
        explanation("glosary")


def test_an_effect_of_one_manoeuvre_is_listed_with_its_step() -> None:
    (line,) = [one for one in listing().splitlines() if one.startswith("  wheel_windage")]
    assert line.endswith("wheel windage: inertia")


def test_an_unknown_topic_that_is_a_word_of_others_names_them() -> None:
    with pytest.raises(InputError, match=r"rolling_force or .*rolling_resistance"):
        explanation("rolling")
    with pytest.raises(InputError, match=r"see 'vdyn explain changed_car"):
        explanation("roofbox")
