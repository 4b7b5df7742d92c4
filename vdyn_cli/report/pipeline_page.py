"""The pipeline's page: how every step ended, the full parameter set, then the section of each step's own page."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from vdyn_cli.quantities.parameters import GIVERS, Estimate
from vdyn_cli.quantities.vocabulary import TABLE
from vdyn_cli.report import views, words
from vdyn_cli.report.diagnosis_tables import extensions
from vdyn_cli.report.diagnosis_view import diagnosis
from vdyn_cli.report.template import demoted, fill, markup, section_of, slug

if TYPE_CHECKING:
    from vdyn_cli.project.pipeline import StepOutcome


def render_pipeline(title: str, outcomes: Sequence[StepOutcome], document: Mapping[str, Any], folder: Path) -> str:
    """The pipeline's page; the sections of its good steps are those of the pages that stand in ``folder``."""
    pages, diagnoses = {}, {}
    for outcome in outcomes:
        file = folder / f"{outcome.name}.html"
        if outcome.good and file.is_file():
            pages[outcome.name] = file.read_text(encoding="utf-8")
            diagnoses[outcome.name] = _diagnosis(folder / f"{outcome.name}.json")
    return pipeline_page(title, outcomes, document, pages, diagnoses)


def _diagnosis(path: Path) -> Any:
    """The diagnosis of a step's result, None where it can't be read."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found.get("diagnosis") if isinstance(found, dict) else None


def pipeline_page(
    title: str,
    outcomes: Sequence[StepOutcome],
    document: Mapping[str, Any],
    pages: Mapping[str, str],
    diagnoses: Mapping[str, Any] = MappingProxyType({}),
) -> str:
    """The pipeline's page from the pages of its steps: status of each, the full parameter set, then every section.

    Parameters
    ----------
    diagnoses : the diagnosis of each step's document.
    """
    steps = [
        {
            "name": words.clean(o.name),
            "slug": slug(o.name),
            "status": "done" if o.good else o.status,
            "sentence": words.prose(o.sentence),
            "diagnosis": diagnosis(diagnoses.get(o.name)),
            "findings": [views.finding(f) for f in o.findings],
            "section": markup(demoted(section_of(pages[o.name]))) if o.name in pages else "",
        }
        for o in outcomes
    ]
    estimates = _estimates(document.get("parameters"))
    missing = _missing(document.get("missing"), estimates)
    rows = views.parameter_rows(estimates)
    good = sum(o.good for o in outcomes)
    body = fill(
        "pipeline.html",
        title=words.prose(title) or "Test day",
        steps=steps,
        verdict=_verdict(len(estimates), len(missing), good, len(outcomes)),
        whole=good == len(outcomes),
        doubts=sum(len(o.findings) for o in outcomes if o.good),
        parameters=rows,
        widths=views.widths(rows),
        moved=any(r.before for r in rows),
        missing=missing,
        extensions=extensions(document.get("extensions")),
        linked={s["name"]: s["slug"] for s in steps if s["section"]},
        provenance=views.provenance(document.get("provenance")),
    )
    nav = [("parameters", "Parameter set"), *((f"step-{s['slug']}", s["name"]) for s in steps if s["section"])]
    return fill("page.html", title=f"{words.prose(title)}: parameter set", name="pipeline", nav=nav, body=markup(body))


def _estimates(parameters: Any) -> dict[str, Estimate]:
    """Estimates of a parameter document, in the order of the table; what is malformed is left out."""
    found = {}
    entries = parameters if isinstance(parameters, Mapping) else {}
    for name in [*(n for n in TABLE if n in entries), *(n for n in entries if n not in TABLE)]:
        entry = entries[name]
        try:
            low, high = entry["interval95"]
            bounds = tuple(float("nan") if v is None else float(v) for v in (low, high))
            value = float("nan") if entry["value"] is None else float(entry["value"])
            baseline = entry.get("baseline")
            found[name] = Estimate(
                value,
                float(entry.get("std") or 0.0),
                (bounds[0], bounds[1]),
                str(entry.get("unit", "")),
                str(entry.get("meaning", "")),
                str(entry.get("source", "")),
                None if baseline is None else float(baseline),
            )
        except (KeyError, TypeError, ValueError, AttributeError):
            continue
    return found


def _missing(reasons: Any, known: Mapping[str, Estimate]) -> list[dict[str, Any]]:
    """The parameters of the full set that nothing gave, each with why and what would give it."""
    told = reasons if isinstance(reasons, Mapping) else {}
    names = [n for n in TABLE if n not in known]
    return [
        {
            "name": words.title(n),
            "symbol": views.symbol(n, TABLE[n].symbol),
            "unit": words.unit(TABLE[n].unit),
            "meaning": words.prose(TABLE[n].meaning),
            "why": words.prose(told.get(n, "not estimated")),
            "giver": GIVERS.get(n, ""),
        }
        for n in names
    ]


def _verdict(known: int, missing: int, good: int, total: int) -> str:
    of_steps = f"{good} of {words.count(total, 'step')} done"
    whole = "the parameter set is complete" if not missing else f"{words.count(missing, 'parameter')} still missing"
    return f"{words.count(known, 'parameter')} known, {whole}; {of_steps}."
