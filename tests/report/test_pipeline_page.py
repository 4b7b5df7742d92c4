"""The page of a pipeline: status of its steps, parameters, and what is missing."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

from tests.report import examples
from tests.report.test_html import Outline
from vdyn_cli.project.pipeline import StepOutcome
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.vocabulary import TABLE
from vdyn_cli.report import html
from vdyn_cli.report.step_page import step_page


def three_steps(folder: Path) -> tuple[StepOutcome, ...]:
    failure = Finding("cg.yaml:3", "wrong sign", "", "add it")
    return (
        replace(examples.outcome(examples.tire(), folder), status="reused"),
        StepOutcome("cg", "failed", reason="the input is wrong", problems=(failure,), exit_code=2),
        StepOutcome("bump", "skipped", reason="skipped because it needs parameters from cg"),
    )


def test_pipeline_shows_status_parameters_and_what_is_missing(tmp_path: Path) -> None:
    found = examples.parameter_set("A day", three_steps(tmp_path))
    missing = {**found.missing, "cg_height": "cg failed: the input is wrong"}
    page = html.render_pipeline(replace(found, missing=missing))
    outline = Outline(page)
    text = " ".join(outline.text.split())
    assert f"5 parameters known, {len(TABLE) - 5} parameters missing; 1 of 3 steps done." in text
    for part in (
        "✓ done",
        "✗ failed",
        "skipped",
        "wrong sign",
        "add it",
        "missing: cg failed",
        "vdyn bump estimates it",
    ):
        assert part in text, part
    assert text.count("Magic") <= 1
    assert [t for t, _ in outline.tags].count("h1") == 1
    assert len(outline.ids()) == len(set(outline.ids()))
    assert {"parameters", "step-tire", "tire-provenance", "p-tire_B"} <= set(outline.ids())
    assert "step-cg" not in outline.ids()
    links = [a["href"] or "" for t, a in outline.tags if t == "a"]
    assert all(link.startswith("#") for link in links)
    assert examples.outcome(examples.tire(), tmp_path).section in page


def test_pipeline_page_is_the_same_for_reused_and_done_steps(tmp_path: Path) -> None:
    outcomes = three_steps(tmp_path)
    again = (replace(outcomes[0], status="done"), *outcomes[1:])
    pages = [html.render_pipeline(examples.parameter_set("A", one)) for one in (outcomes, again)]
    assert pages[0] == pages[1]


def test_a_step_is_shown_alike_on_its_own_page_and_on_the_pipelines(tmp_path: Path) -> None:
    """The content of a record survives its JSON, except for figures, tables and methods, which the JSON lacks."""
    result = examples.coastdown()
    own, read = step_page(examples.record(result)), step_page(examples.as_read(result, tmp_path))
    lacking = {"comparisons", "maps", "figures", "tables", "methods"}
    for field in fields(own):
        value = getattr(read, field.name)
        assert value == (() if field.name in lacking else getattr(own, field.name)), field.name


def test_unknown_numbers_of_a_parameter_are_shown_as_unknown() -> None:
    nan = float("nan")
    parameters = Parameters({"mass": Estimate(1.0, nan, (nan, nan), "kg", "", "given")})
    text = Outline(html.render_pipeline(examples.parameter_set("A", (), parameters=parameters))).text
    assert "Mass" in text
    assert "not known" in text
