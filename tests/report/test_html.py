"""Pages: complete, the same twice, and safe with whatever a file, a channel or a JSON may be called or hold."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.report import examples
from vdyn_cli.project.pipeline import StepOutcome
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Comparison, Figure, FitSummary, Result, Series, Table
from vdyn_cli.quantities.vocabulary import TABLE
from vdyn_cli.report import html, template, views
from vdyn_cli.report.diagnosis_view import VERDICTS, diagnosis
from vdyn_cli.report.pipeline_page import pipeline_page

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
    return html.render(result, {**examples.document(result), **changes})


def bare(**changes: Any) -> Result:
    fit = FitSummary((), float("nan"), float("nan"), "", ())
    return replace(Result("shaft", "Nothing to say.", Parameters(), fit, ""), **changes)


@pytest.fixture(scope="module")
def coastdown() -> str:
    return page_of(examples.coastdown())


def test_page_says_what_was_found(coastdown: str) -> None:
    text = " ".join(Outline(coastdown).text.split())
    for part in (
        "cause named",
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


@pytest.mark.parametrize("result", [examples.coastdown(), examples.bump(), examples.tire()], ids=lambda r: r.step)
def test_same_result_same_bytes(result: Result) -> None:
    first, second = page_of(result), page_of(result)
    assert first.encode() == second.encode()
    assert len(first) < 1_000_000


def test_same_bytes_from_another_process(coastdown: str, tmp_path: Path) -> None:
    program = (
        "import sys; from tests.report import examples; from vdyn_cli.report import html; r = examples.coastdown();"
        " sys.stdout.buffer.write(html.render(r, examples.document(r)).encode())"
    )
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run([sys.executable, "-c", program], cwd=root, capture_output=True, check=True)
    assert done.stdout == coastdown.encode()


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


def nasty_diagnosis() -> dict[str, Any]:
    return {
        "verdict": NASTY,
        "sentence": NASTY,
        "causes": [{"effect": NASTY, "unknowns": {NASTY: {"value": 1, "unit": NASTY}}, "biased": {NASTY: 1}}],
        "ambiguous": [[NASTY, NASTY]],
        "not_testable": [{"effect": NASTY, "because": NASTY}],
        "gain": {"metric": NASTY, "unit": NASTY, "before": 2, "after": 1},
        "where": [{NASTY: NASTY}],
        "next_test": [{"manoeuvre": NASTY, "separates": [NASTY], "runs": NASTY}],
    }


def harmless(page: str) -> None:
    page.encode("utf-8")
    outline = Outline(page)
    for tag, attributes in outline.tags:
        assert tag not in ("script", "img")
        assert not [name for name in attributes if name.startswith("on")]
    assert "{{7*7}}" in page
    assert "<script>alert(1)</script>" in outline.text


def test_no_text_becomes_a_tag() -> None:
    result = nasty()
    provenance = {"inputs": {NASTY: NASTY}, "settings": {NASTY: NASTY}, "versions": {NASTY: NASTY}, "command": NASTY}
    page = html.render(result, {"diagnosis": nasty_diagnosis(), "provenance": provenance})
    harmless(page)
    finding = Finding(NASTY, NASTY, NASTY, NASTY)
    harmless(html.render_failure(NASTY, [finding]))
    document = {
        "parameters": {NASTY: {"value": 1, "interval95": [0, 2], "unit": NASTY, "meaning": NASTY, "source": NASTY}},
        "missing": dict.fromkeys(TABLE, NASTY),
        "provenance": provenance,
    }
    outcomes = [StepOutcome(NASTY, "done", NASTY), StepOutcome("b", "failed", NASTY, (finding,), 1)]
    harmless(pipeline_page(NASTY, outcomes, document, {NASTY: page}))


def test_a_result_of_nothing_is_a_page() -> None:
    page = html.render(bare(), {})
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
    }
    text = " ".join(Outline(html.render(bare(parameters=Parameters(estimates)), {})).text.split())
    assert "exact" in text
    assert "×1010 Pa" in text  # the power is set as superscript
    assert "+0.10" in text
    assert "−0.70" in text
    assert " nan" not in text
    assert "not known" in text


def test_extension_shows_what_it_moved(coastdown: str) -> None:
    assert "before extension" in Outline(coastdown).text
    plain = Outline(page_of(examples.coastdown(diagnosed=False))).text
    assert "before extension" not in plain
    assert "cause named" not in plain


def test_where_it_was_wrong_is_drawn_before_and_after(coastdown: str) -> None:
    text = Outline(coastdown).text
    assert "where the residual sits before the extension" in text
    assert "where the residual sits after it" in text
    assert "Where the simulation is wrong" in text
    adequate = replace(examples.coastdown(diagnosed=False), diagnosis={"verdict": "adequate", "sentence": "Good."})
    text = Outline(page_of(adequate)).text
    assert "Where the residual sits" in text
    assert "is wrong" not in text
    assert "before the extension" not in text


def test_a_table_of_uneven_rows_and_columns_of_numbers() -> None:
    cells = views.cells(
        Table("t", "T", ("name", "value"), (("a", "1.5"), ("b", "-2e3", "extra"), ("c",), ("d", "3 ± 1")))
    )
    assert cells.numeric == (False, True, False)
    assert all(len(row) == 3 for row in cells.rows)


def test_a_table_without_column_names_has_no_head() -> None:
    tables = (Table("t", "T", ("", ""), (("share of the box", "84.2 %"),)),)
    outline = Outline(html.render(bare(tables=tables), {}))
    assert "84.2\N{NO-BREAK SPACE}%" in outline.text
    assert "thead" not in [tag for tag, _ in outline.tags]


@pytest.mark.parametrize("verdict", sorted(VERDICTS))
def test_every_verdict_has_words(verdict: str) -> None:
    told = diagnosis({"verdict": verdict, "sentence": "So it is."})
    assert told is not None
    assert told.label
    assert told.mood in ("good", "fair", "bad")


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)
KEYS = ("verdict", "sentence", "causes", "ambiguous", "not_testable", "gain", "where", "next_test")
INNER = ("effect", "unknowns", "value", "interval95", "unit", "biased", "separates", "before", "after", "p_value")
TREE = st.dictionaries(st.sampled_from(INNER), JSON | st.dictionaries(st.sampled_from(INNER), JSON, max_size=3))


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.dictionaries(st.sampled_from(KEYS), JSON | TREE | st.lists(TREE, max_size=2)))
def test_a_strange_diagnosis_does_not_cost_the_report(source: dict[str, Any]) -> None:
    Outline(html.render(bare(), {"diagnosis": source, "provenance": source}))


def outcomes_and_document() -> tuple[list[StepOutcome], dict[str, Any], dict[str, str]]:
    result = examples.tire()
    outcomes = [
        StepOutcome("tire", "reused", result.sentence),
        StepOutcome("cg", "failed", "the answer is not good", (Finding("cg.yaml:3", "wrong sign", "", "add it"),), 1),
        StepOutcome("bump", "skipped", "needs what cg did not give"),
    ]
    document = {**examples.document(result), "missing": {"cg_height": "cg failed: the answer is not good"}}
    return outcomes, document, {"tire": page_of(result)}


def test_pipeline_shows_status_parameters_and_what_is_missing() -> None:
    outcomes, document, pages = outcomes_and_document()
    page = pipeline_page("A day", outcomes, document, pages)
    outline = Outline(page)
    text = " ".join(outline.text.split())
    assert f"5 parameters known, {len(TABLE) - 5} parameters still missing; 1 of 3 steps done." in text
    for part in ("✓ done", "✗ failed", "skipped", "wrong sign", "add it", "missing: cg failed", "vdyn bump gives it"):
        assert part in text, part
    assert text.count("Magic") <= 1
    assert [t for t, _ in outline.tags].count("h1") == 1
    assert len(outline.ids()) == len(set(outline.ids()))
    assert {"parameters", "step-tire", "tire-fit", "p-tire_B"} <= set(outline.ids())


def test_pipeline_page_does_not_tell_reused_from_done() -> None:
    outcomes, document, pages = outcomes_and_document()
    again = [replace(outcomes[0], status="done"), *outcomes[1:]]
    assert pipeline_page("A", outcomes, document, pages) == pipeline_page("A", again, document, pages)


def test_pipeline_reads_the_pages_of_its_good_steps_only(tmp_path: Path) -> None:
    outcomes, document, pages = outcomes_and_document()
    for name in ("tire", "cg"):
        (tmp_path / f"{name}.html").write_text(pages["tire"], encoding="utf-8")
    page = html.render_pipeline("A day", outcomes, document, tmp_path)
    assert 'id="step-tire"' in page
    assert 'id="step-cg"' not in page
    assert page == pipeline_page("A day", outcomes, document, pages)


@pytest.mark.parametrize("page", ["", "<html>", "<!--step-->", "<!--/step--><!--step-->"])
def test_a_page_without_a_section_gives_none(page: str) -> None:
    assert template.section_of(page) == ""
    outcomes, document, _ = outcomes_and_document()
    Outline(pipeline_page("A", outcomes, document, {"tire": page}))


@pytest.mark.parametrize("parameters", [None, [], {"mass": None}, {"mass": {}}, {"mass": {"interval95": [1]}}])
def test_pipeline_leaves_malformed_parameters_out(parameters: Any) -> None:
    Outline(pipeline_page("A", [], {"parameters": parameters}, {}))


def test_null_of_a_json_is_an_unknown_number() -> None:
    entry = {"value": 1.0, "std": None, "interval95": [None, None], "unit": "kg", "meaning": "", "source": "given"}
    text = Outline(pipeline_page("A", [], json.loads(json.dumps({"parameters": {"mass": entry}})), {})).text
    assert "Mass" in text


def test_settings_are_outlined_in_few_lines() -> None:
    settings = {
        "window": 0.25,
        "channels": {n: {"column": n.title(), "unit": "m/s"} for n in ("speed", "wind", "gust")},
    }
    assert views.outline(settings) == [
        "window: 0.25",
        "channels:",
        '  speed: {"column": "Speed", "unit": "m/s"}',
        '  wind: {"column": "Wind", "unit": "m/s"}',
        '  gust: {"column": "Gust", "unit": "m/s"}',
    ]
    assert views.outline({"runs": [{"log": "a" * 60}, {"log": "b" * 60}]})[1:] == [
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
