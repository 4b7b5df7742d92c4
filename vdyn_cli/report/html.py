"""One self-contained page for a step, and one for a pipeline: same input, same bytes, nothing fetched."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from vdyn_cli.quantities.errors import Finding, alike
from vdyn_cli.quantities.result import Result
from vdyn_cli.report import comparison, residual_map, views, words
from vdyn_cli.report.diagnosis_view import diagnosis
from vdyn_cli.report.figures import figure_svg
from vdyn_cli.report.lanes import Channel, channels
from vdyn_cli.report.pipeline_page import render_pipeline
from vdyn_cli.report.template import END, START, fill, markup, slug

__all__ = ["render", "render_failure", "render_pipeline"]

_MAPS = 4  # channels that get a residual map; more would say the same again


def render(result: Result, document: Mapping[str, Any]) -> str:
    """The page of one step, from its result and its JSON document."""
    context = _step(result, document)
    section = markup(START + fill("step.html", **context) + END)
    return fill(
        "page.html",
        title=f"{context['step']}: {words.prose(result.sentence)}",
        name=context["step"],
        nav=_nav(context),
        body=section,
    )


def render_failure(name: str, findings: Sequence[Finding]) -> str:
    """The page of a step whose answer is not good: every reason with its remedy, and no parameters."""
    shown = words.clean(name)
    body = markup(fill("failure.html", name=shown, findings=[views.finding(f) for f in findings]))
    return fill("page.html", title=f"{shown}: no result", name=shown, nav=(), body=body)


def _nav(context: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Links to the parts that this page has: (id, text)."""
    parts = (
        ("fit", "Fit", context["comparisons"]),
        (
            "where",
            context["where_title"].replace("the simulation", "it"),
            context["maps"] or (context["diagnosis"] and context["diagnosis"].where),
        ),
        ("diagnosis", "Diagnosis", context["diagnosis"]),
        ("detail", "Results", context["figures"] or context["tables"]),
        ("data", "Data", context["findings"]),
        ("methods", "Methods", True),
        ("provenance", "Provenance", True),
    )
    return [(f"{context['slug']}-{part}", text) for part, text, there in parts if there]


def _step(result: Result, document: Mapping[str, Any]) -> dict[str, Any]:
    name = slug(result.step)
    grouped = channels(result.comparisons, result.fit.noise_floor, result.fit.unit)
    rows = views.parameter_rows(result.parameters)
    findings = alike(result.findings)
    to_read = sum(not (f.minor or f.doubt) for f in findings)
    found = document.get("diagnosis") or (None if result.diagnosis is None else result.diagnosis.model_dump())
    told = diagnosis(found, result.parameters)
    return {
        "slug": name,
        "step": words.clean(result.step),
        "about": _about(result.step),
        "sentence": words.prose(result.sentence),
        "diagnosis": told,
        "chips": views.chips(
            result.fit,
            to_read,
            name,
            gained=bool(told and told.gain and told.gain.held_out),
            doubted=bool(told and told.doubted) or bool(result.fit.warnings),
        ),
        "parameters": rows,
        "widths": views.widths(rows),
        "moved": any(r.before for r in rows),
        "warnings": [words.prose(w) for w in result.fit.warnings],
        "comparisons": [_comparison(c, f"{name}-run{i}") for i, c in enumerate(grouped)],
        "maps": _maps(grouped, name),
        "where_title": "Where the residual sits"
        if told and told.mood == "good" and not told.where
        else "Where the simulation is wrong",
        "figures": [
            {
                "title": words.prose(f.title),
                "caption": words.prose(f.caption),
                "svg": markup(figure_svg(f, f"{name}-fig{i}")),
            }
            for i, f in enumerate(result.figures)
        ],
        "tables": [views.cells(t) for t in result.tables],
        "findings": [views.finding(f) for f in findings],
        "methods": [words.prose(p) for p in result.methods.split("\n\n") if p.strip()],
        "correlation": views.correlation(result.parameters.correlation),
        "strongest": views.strongest(result.parameters.correlation),
        "provenance": views.provenance(document.get("provenance")),
    }


def _about(step: str) -> str:
    from vdyn_cli.steps import names, summary

    return words.prose(summary(step)) if step in names() else ""


def _comparison(channel: Channel, name: str) -> dict[str, Any]:
    return {
        "title": f"{words.title(channel.name)}, measured and simulated",
        "svg": markup(comparison.comparison_svg(channel, name)),
        "caption": words.prose(comparison.caption(channel)),
        "runs": views.run_table(channel),
    }


def _maps(grouped: Sequence[Channel], name: str) -> list[dict[str, Any]]:
    """Maps of the residual; of an extended model also before, in the same colours."""
    mapped = [c for c in grouped if residual_map.has_map(c)][:_MAPS]
    found = []
    for i, channel in enumerate(mapped):
        before = channel.before() if channel.extended else None
        what = f"{words.title(channel.name)}: where the residual sits"
        limit = 0.0 if before is None else residual_map.limit(before)
        if before is not None:
            found.append(_map(before, f"{name}-map{i}-before", f"{what} before the extension", limit))
            what += " after it"
        found.append(_map(channel, f"{name}-map{i}", what, limit, again=before is not None))
    return found


def _map(channel: Channel, name: str, title: str, limit: float, again: bool = False) -> dict[str, Any]:
    text = "In the same colours as before." if again else residual_map.caption(channel)
    return {
        "title": title,
        "svg": markup(residual_map.map_svg(channel, name, limit)),
        "caption": words.prose(text),
    }
