"""Pages are complete and reproducible, and safe with any names and contents of files, channels and JSON."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.report import examples
from vdyn_cli.project.pipeline import ParameterSet, StepOutcome
from vdyn_cli.project.result_document import Provenance, StepRecord
from vdyn_cli.quantities.diagnosis import (
    Amplitude,
    Cause,
    Diagnosis,
    Evidence,
    Gain,
    NextTest,
    NotTestable,
    Ranked,
    Verdict,
    WorstSegment,
)
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Comparison, Figure, FitSummary, Result, Series, Table
from vdyn_cli.quantities.vocabulary import TABLE
from vdyn_cli.report import html, template
from vdyn_cli.report.diagnosis_view import diagnosis_section
from vdyn_cli.report.provenance_view import outline
from vdyn_cli.report.text_table import text_table

NASTY = "</style></script><script>alert(1)</script><img src=x onerror=alert(2)> & \"q\" 'a' {{7*7}} \x07\ud800 速度"
VOID = {"meta", "link", "br", "img", "path", "use", "rect"}


class Outline(HTMLParser):
    """Tags, attributes and text of a page; fails on a tag that closes what is not open."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(page)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data

    def ids(self) -> list[str]:
        return [a["id"] or "" for _, a in self.tags if "id" in a]


def page_of(result: Result, **changes: Any) -> str:
    return html.render(replace(examples.record(result), **changes)).page


def bare(**changes: Any) -> Result:
    fit = FitSummary((), float("nan"), float("nan"), "", ())
    return replace(Result("shaft", "Nothing to say.", Parameters(), fit, ""), **changes)


@pytest.fixture(scope="module")
def coastdown() -> str:
    return page_of(examples.coastdown())


def test_page_says_what_was_found(coastdown: str) -> None:
    text = " ".join(Outline(coastdown).text.split())
    for part in (
        "effect identified",
        "A headwind of 2.9 ± 0.1\N{NO-BREAK SPACE}m/s",
        "Rolling resistance is 0.01012 ± 0.00024",
        "held-out runs",
        "Drag area",
        "m²",
        "0.0112",
        "brakes that drag or a driveline that drags",
        "two slow rolls",
        "wrong mass",
        "the clock stands still",
        "check the logger",
        "Student's t",
        "sample_logs/coast_1_out.csv",
        "010101010101",
        "vdyn coastdown configs/coastdown.yaml",
        "Road load for the dynamometer",
        "Speed, run by run",
        "Correlation of the estimates",
        "Good:",
        "Bad:",
    ):
        assert part.replace("\N{NO-BREAK SPACE}", " ") in text.replace("\N{NO-BREAK SPACE}", " "), part


def test_same_result_same_bytes(coastdown: str) -> None:
    assert page_of(examples.coastdown()).encode() == coastdown.encode()
    assert len(coastdown) < 1_000_000


def test_page_stands_alone(coastdown: str) -> None:
    outline = Outline(coastdown)
    assert len(outline.ids()) == len(set(outline.ids()))
    for tag, attributes in outline.tags:
        assert tag not in ("script", "iframe", "object")
        for name in ("src", "href", "data"):
            address = attributes.get(name) or "#"
            assert address.startswith(("#", "data:")), (tag, address)
    assert "@import" not in coastdown
    assert "url(http" not in coastdown
    links = {a["href"] for t, a in outline.tags if t == "a"}
    assert {link.removeprefix("#") for link in links if link} <= set(outline.ids())


def nasty() -> Result:
    x = np.linspace(0, 1, 80)
    comparison = Comparison(NASTY, NASTY, NASTY, x, NASTY, x, x)
    estimates = {NASTY: Estimate(1.0, 0.1, (0.8, 1.2), NASTY, NASTY, NASTY, 0.5)}
    return Result(
        NASTY,
        NASTY,
        Parameters(estimates, {NASTY: {NASTY: 1.0, "b": 0.3}, "b": {NASTY: 0.3, "b": 1.0}}),
        FitSummary((NASTY,), 1.0, 1.0, NASTY, (NASTY,), NASTY, 3, 1.0, (NASTY,)),
        NASTY,
        (comparison, replace(comparison, run=NASTY + "2")),
        (Figure(NASTY, NASTY, NASTY, NASTY, NASTY, (Series(NASTY, x, x), Series("b", x, x))),),
        (Table(NASTY, NASTY, (NASTY,), ((NASTY,),), NASTY),),
        (Finding(NASTY, NASTY, NASTY, NASTY),),
    )


def nasty_diagnosis() -> Diagnosis:
    nan = float("nan")
    amplitude = Amplitude(value=1, std=nan, interval95=(nan, nan), unit=NASTY)
    return Diagnosis(
        verdict="named",
        sentence=NASTY,
        evidence=Evidence(unit=NASTY, units=1, stated=1, worth=nan, smallest_p=nan),
        causes=(
            Cause(
                effect=NASTY,
                label=NASTY,
                unknowns={NASTY: amplitude},
                p_value=None,
                visibility=nan,
                sensor=True,
                lasts=True,
                biased={NASTY: 1},
            ),
        ),
        extended=(NASTY,),
        ambiguous=((NASTY, NASTY),),
        not_testable=(NotTestable(effect=NASTY, because=NASTY, size=nan, unit=NASTY, would_bias={NASTY: 1}),),
        gain=Gain(
            metric=NASTY,
            unit=NASTY,
            before=2,
            after=1,
            interval95=(nan, nan),
            share_of_explainable=nan,
            certain=False,
            held_out=False,
            folds=0,
        ),
        where=(WorstSegment(run=NASTY, channel=NASTY, segment=NASTY, size=1, unit=NASTY, over_noise=1),),
        ranking=(Ranked(effect=NASTY, explains_t=nan, visibility=nan, left_p=0, left_mostly=NASTY, unknowns={}),),
        next_test=(NextTest(manoeuvre=NASTY, separates=(NASTY,), expected_t=nan, runs=1),),
        doubt=NASTY,
        not_extended=NASTY,
    )


def harmless(page: str) -> bool:
    """Whether the page shows the hostile texts as text, without a script, an image, or a handler of events."""
    page.encode("utf-8")
    outline = Outline(page)
    tags = {tag for tag, _ in outline.tags}
    handlers = [name for _, attributes in outline.tags for name in attributes if name.startswith("on")]
    shown = "{{7*7}}" in page and "<script>alert(1)</script>" in outline.text
    return shown and not handlers and not tags & {"script", "img"}


def test_no_text_becomes_a_tag() -> None:
    provenance = Provenance({NASTY: NASTY}, {NASTY: NASTY, "title": NASTY}, {NASTY: NASTY}, NASTY)
    record = StepRecord(replace(nasty(), diagnosis=nasty_diagnosis()), provenance)  # type: ignore[arg-type]
    rendered = html.render(record)
    assert harmless(rendered.page)
    finding = Finding(NASTY, NASTY, NASTY, NASTY)
    refused = replace(record.result, refused=(finding,), parameters=Parameters())
    assert harmless(html.render(StepRecord(refused, provenance)).page)  # type: ignore[arg-type]
    outcomes = (
        StepOutcome(NASTY, "done", record, rendered.section),
        StepOutcome("b", "failed", reason=NASTY, problems=(finding,), exit_code=1),
    )
    missing = dict.fromkeys(TABLE, NASTY)
    assert harmless(html.render_pipeline(ParameterSet(NASTY, record.result.parameters, missing, outcomes, provenance)))


def test_a_withheld_parameter_is_shown_with_the_reason() -> None:
    page = page_of(bare(withheld={"tire_C": "only the slope is determined"}))
    assert "withheld: only the slope is determined" in Outline(page).text


def test_a_result_of_nothing_is_a_page() -> None:
    page = page_of(bare())
    assert "Nothing to say." in Outline(page).text
    assert '<table class="params">' not in page


def test_estimates_that_are_not_finite_or_exact() -> None:
    nan, inf = float("nan"), float("inf")
    estimates = {
        "mass": Estimate(1588.0, 0.0, (1588.0, 1588.0), "kg", "as tested", "given"),
        "drag_area": Estimate(nan, nan, (nan, nan), "m^2", "", "coastdown"),
        "rolling_resistance": Estimate(0.01, inf, (-inf, inf), "", "", "coastdown", nan),
        "shear_modulus": Estimate(7.93e10, 1e8, (7.91e10, 7.95e10), "Pa", "", "given", 7.9e10),
        "tire_E": Estimate(0.2, 0.1, (-0.5, 0.3), "", "", "tire"),
        "tire_B": Estimate(1e-300, 0.0, (0.0, 1e300), "", "", "tire"),
        "road_load_f1": Estimate(0.0, 0.0, (0.0, 0.0), "N/(m/s)", "", "coastdown"),
    }
    text = " ".join(Outline(page_of(bare(parameters=Parameters(estimates)))).text.split())
    assert "exact" in text
    assert "assumed" in text
    assert "×1010 Pa" in text  # the power is set as superscript
    assert "+0.10" in text
    assert "−0.70" in text
    assert " nan" not in text
    assert "not known" in text


def test_extension_shows_what_it_moved(coastdown: str) -> None:
    assert "before extension" in Outline(coastdown).text
    plain = Outline(page_of(examples.coastdown(diagnosed=False))).text
    assert "before extension" not in plain
    assert "effect identified" not in plain


def test_where_it_was_wrong_is_drawn_before_and_after(coastdown: str) -> None:
    text = Outline(coastdown).text
    assert "measured minus simulated, run by run, before the extension" in text
    assert "measured minus simulated, run by run, after the extension" in text
    assert "Where the model is wrong" in text
    adequate = replace(examples.coastdown(diagnosed=False), diagnosis=Diagnosis(verdict="adequate", sentence="Good."))
    text = Outline(page_of(adequate)).text
    assert "Measured minus simulated, run by run" in text
    assert "is wrong" not in text
    assert "before the extension" not in text


def test_a_table_of_uneven_rows_and_columns_of_numbers() -> None:
    cells = text_table(
        Table("t", "T", ("name", "value"), (("a", "1.5"), ("b", "-2e3", "extra"), ("c",), ("d", "3 ± 1")))
    )
    assert cells.numeric == (False, True, False)
    assert all(len(row) == 3 for row in cells.rows)


def test_a_table_without_column_names_has_no_head() -> None:
    tables = (Table("t", "T", ("", ""), (("share of the box", "84.2 %"),)),)
    outline = Outline(page_of(bare(tables=tables)))
    assert "84.2\N{NO-BREAK SPACE}%" in outline.text
    assert "thead" not in [tag for tag, _ in outline.tags]


@pytest.mark.parametrize("verdict", get_args(Verdict))
def test_every_verdict_has_a_label(verdict: Verdict) -> None:
    section = diagnosis_section(Diagnosis(verdict=verdict, sentence="So it is."))
    assert section is not None
    assert section.label
    assert section.mood in ("good", "fair", "bad")


TEXT = st.text(max_size=8)
# The parts of a diagnosis whose fields are not free texts and numbers have strategies of their own.
AMPLITUDES = st.dictionaries(TEXT, st.builds(Amplitude, unit=TEXT), max_size=5)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.builds(
        Diagnosis,
        sentence=TEXT,
        p_value=st.none() | st.floats(),
        evidence=st.none() | st.builds(Evidence),
        causes=st.lists(st.builds(Cause, unknowns=AMPLITUDES), max_size=2),
        extended=st.lists(TEXT, max_size=2),
        ambiguous=st.lists(st.lists(TEXT, max_size=3), max_size=2),
        not_testable=st.lists(st.builds(NotTestable), max_size=2),
        gain=st.none() | st.builds(Gain),
        where=st.lists(st.builds(WorstSegment), max_size=2),
        ranking=st.lists(st.builds(Ranked, unknowns=AMPLITUDES), max_size=2),
        next_test=st.lists(st.builds(NextTest), max_size=2),
    )
)
def test_any_diagnosis_makes_a_page(diagnosis: Diagnosis) -> None:
    Outline(page_of(bare(diagnosis=diagnosis)))


def test_settings_are_outlined_in_few_lines() -> None:
    settings = {
        "window": 0.25,
        "channels": {n: {"column": n.title(), "unit": "m/s"} for n in ("speed", "wind", "gust")},
    }
    assert outline(settings) == [
        "window: 0.25",
        "channels:",
        '  speed: {"column": "Speed", "unit": "m/s"}',
        '  wind: {"column": "Wind", "unit": "m/s"}',
        '  gust: {"column": "Gust", "unit": "m/s"}',
    ]
    assert outline({"runs": [{"log": "a" * 60}, {"log": "b" * 60}]})[1:] == [
        '  - {"log": "' + "a" * 60 + '"}',
        '  - {"log": "' + "b" * 60 + '"}',
    ]


def test_numbers_group_by_space_that_is_not_copied() -> None:
    assert str(template.grouped("41230")) == '41<span class="k">230</span>'
    assert str(template.grouped("−1234567.5")) == '−1<span class="k">234</span><span class="k">567</span>.5'
    assert str(template.grouped("3120")) == "3120"
    assert str(template.grouped("<b>")) == "&lt;b&gt;"


def test_help_does_not_wait_for_the_drawing_room() -> None:
    program = "import sys, vdyn_cli.report.html; sys.exit(any(m in sys.modules for m in ('matplotlib', 'jinja2')))"
    root = Path(__file__).resolve().parents[2]
    assert subprocess.run([sys.executable, "-c", program], cwd=root, check=False).returncode == 0
