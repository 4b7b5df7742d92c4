"""Reports in a browser; skipped if Chromium is not installed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.report import chromium, examples
from vdyn_cli.project.pipeline import StepOutcome
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.report import html
from vdyn_cli.steps import Failure

pytestmark = pytest.mark.skipif(chromium.find() is None, reason="no Chromium on the PATH to open the report with")


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[chromium.Browser]:
    with chromium.running(tmp_path_factory.mktemp("profile")) as running:
        yield running


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Pages of three steps, a failed one, and their pipeline."""
    folder = tmp_path_factory.mktemp("pages")
    outcomes = []
    for result in (examples.coastdown(), examples.bump(), examples.tire()):
        (folder / f"{result.step}.html").write_text(html.render(examples.record(result)).page, encoding="utf-8")
        outcomes.append(examples.outcome(result, folder))
    failure = Finding("cg.yaml:12", "the pitch sign contradicts the loads", "-0.9", "add 'sign: -1'")
    reason = "no result that can be published"
    outcomes.append(StepOutcome("cg", "failed", reason=reason, problems=(failure,), exit_code=1))
    page = html.render_pipeline(examples.parameter_set("A day", outcomes))
    (folder / "report.html").write_text(page, encoding="utf-8")
    refused = Failure((failure,)).refused("cg")
    (folder / "cg.html").write_text(html.render(examples.record(refused)).page, encoding="utf-8")
    return folder


Pages = Callable[..., chromium.Page]


@pytest.fixture(scope="module")
def shown(browser: chromium.Browser, folder: Path) -> Pages:
    """A page by its name and width, each opened once; tests that change a page open their own."""

    @cache
    def page(name: str, width: int = 1366, height: int = 768) -> chromium.Page:
        return chromium.open_page(browser, folder / f"{name}.html", width, height)

    return page


BOTTOM = "document.querySelector({!r}).getBoundingClientRect().bottom"


@pytest.mark.parametrize("name", ["coastdown", "bump", "tire", "cg", "report"])
def test_page_is_quiet_and_fetches_nothing(shown: Pages, name: str) -> None:
    page = shown(name)
    assert page.logged == []
    assert page.requests == []
    assert page.evaluate("document.compatMode") == "CSS1Compat"
    assert page.evaluate("document.querySelectorAll('h1').length") == 1


@pytest.mark.parametrize("name", ["coastdown", "bump", "tire"])
def test_first_screen_holds_verdict_gain_and_all_parameters(shown: Pages, name: str) -> None:
    page = shown(name)
    assert page.evaluate(BOTTOM.format(".sentence")) < 250
    assert page.evaluate(BOTTOM.format(".strip")) < 400
    assert page.evaluate(BOTTOM.format("table.params")) < 700
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    overflow = "[...document.querySelectorAll('.lead .scroll')].some(e => e.scrollWidth > e.clientWidth)"
    assert not page.evaluate(overflow)


def test_pipeline_starts_with_the_steps_and_the_parameter_set(shown: Pages) -> None:
    page = shown("report")
    assert page.evaluate(BOTTOM.format("table.status")) < 500
    assert page.evaluate("document.querySelectorAll('table.params')[0].getBoundingClientRect().top") < 700
    assert page.evaluate("[...document.querySelectorAll('.scroll')].every(e => e.scrollWidth <= e.clientWidth)")
    dead = "[...document.querySelectorAll('a[href^=\"#\"]')].filter(a => !document.getElementById(a.hash.slice(1)))"
    assert page.evaluate(f"{dead}.length") == 0
    twice = "(ids => ids.length - new Set(ids).size)([...document.querySelectorAll('[id]')].map(e => e.id))"
    assert page.evaluate(twice) == 0


@pytest.mark.parametrize("name", ["coastdown", "report"])
def test_telephone_scrolls_tables_and_figures_but_not_the_page(shown: Pages, name: str) -> None:
    page = shown(name, 400, 800)
    assert page.evaluate("document.documentElement.scrollWidth") <= 400


def test_all_that_scrolls_or_opens_is_reached_by_key(browser: chromium.Browser, folder: Path) -> None:
    page = chromium.open_page(browser, folder / "coastdown.html", 400, 800)
    page.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
    scrolling = "[...document.querySelectorAll('*')].filter(e => getComputedStyle(e).overflowX === 'auto')"
    assert page.evaluate(f"{scrolling}.length") > 3
    assert page.evaluate(f"{scrolling}.every(e => e.tabIndex === 0)")
    assert page.evaluate("document.querySelector('a').textContent") == "Skip to the result"
    contrast = "getComputedStyle(document.body).color"
    assert page.evaluate(contrast) == "rgb(21, 24, 27)"


def test_figures_keep_their_text_readable(shown: Pages) -> None:
    page = shown("coastdown")
    smallest = (
        "Math.min(...[...document.querySelectorAll('svg.plot')].map(s => s.getBoundingClientRect().width"
        " / s.viewBox.baseVal.width * 12))"
    )
    assert page.evaluate(smallest) > 11
    outside = (
        "[...document.querySelectorAll('svg.plot text')].filter(t => { const b = t.getBoundingClientRect(),"
        " s = t.ownerSVGElement.getBoundingClientRect(); return b.left < s.left - 1 || b.right > s.right + 1"
        " || b.top < s.top - 1 || b.bottom > s.bottom + 1 }).map(t => t.textContent)"
    )
    assert page.evaluate(outside) == []


def test_prints_as_pages(shown: Pages) -> None:
    page = shown("coastdown")
    pdf = page.pdf()
    assert pdf.startswith(b"%PDF")
    assert 4 <= pdf.count(b"/Type /Page\n") <= 9
