"""The self-contained page of ``vdyn check``: verdict, flags over time, redundant channels, coast-downs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from vdyn_cli.io.quality.cuts import CutLog
from vdyn_cli.quantities.check_schema import CheckDocument, CoastBalance
from vdyn_cli.quantities.number_text import moment
from vdyn_cli.report import typography
from vdyn_cli.report.clock_table import clock_table
from vdyn_cli.report.flag_figure import flag_figures
from vdyn_cli.report.template import fill, markup
from vdyn_cli.report.text_table import TextTable

_AGREE = {True: "agree", False: "contradict", None: typography.DASH}


def render_check(document: CheckDocument, runs: Sequence[CutLog], units: Mapping[str, str]) -> str:
    """The whole HTML page of a check.

    Parameters
    ----------
    document : of ``vdyn check``. runs : the logs with their cuts. units : of the channels in the description.
    """
    found = (
        _flags(document),
        _pairs(document),
        clock_table(document.clocks),
    )
    tables = [t for t in found if t is not None and t.rows]
    coasts = document.coasts
    body = fill(
        "check.html",
        document=document,
        verdict="good"
        if document.good
        else "description wrong"
        if any(r.verdict in ("wrong", "unknown") for r in document.runs)
        else "unreadable log"
        if any(r.verdict == "unreadable" for r in document.runs)
        else "repeat",
        sentence=typography.prose(document.sentence),
        runs=_runs(document),
        plots=[
            {"title": "Flags over time", "caption": _CAPTION, "svg": markup(svg)} for svg in flag_figures(runs, units)
        ],
        tables=tables,
        coast_sentences=[typography.prose(s) for s in coasts.sentences] if coasts else [],
        coast_tables=_coast_tables(coasts) if coasts else [],
        findings=[
            {k: typography.prose(v) for k, v in f.model_dump(include={"where", "what", "got", "remedy"}).items()}
            for f in document.findings
        ],
    )
    title = f"{document.title or document.step}: {document.sentence}"
    nav = [("runs", "Runs"), ("flags", "Flags"), *([("coasts", "Coast-downs")] if coasts else []), ("data", "Notes")]
    return fill("page.html", title=title, name=f"check {document.step}", nav=nav, body=markup(body))


_CAPTION = (
    "Each row is a run over the time of its log, s; the numbers at the left are the smallest and largest value. "
    "Good: only a line. Bad: colored segments, each in the strip of its channel."
)


def _name(text: str) -> str:
    return typography.run_name(typography.clean(text))


def _runs(document: CheckDocument) -> TextTable:
    rows = tuple(
        (
            _name(r.run),
            r.verdict,
            typography.prose("; ".join(r.why) or "no fault found"),
            f"{r.duration:.1f}",
            f"{100 * r.lost:.1f} %",
        )
        for r in document.runs
    )
    caption = "Lost: share of the evaluated time in which a needed channel is cut."
    columns = ("run", "verdict", "why", "duration (s)", "lost")
    return TextTable("Runs", caption, columns, rows, (False, False, False, True, True))


def _flags(document: CheckDocument) -> TextTable:
    rows = tuple(
        (
            _name(f.run),
            f.channel,
            f.test.replace("_", " "),
            f.decision,
            moment(f.start),
            moment(f.stop),
            str(f.segments),
            f"{100 * f.share:.1f} %",
            typography.prose(f.why),
        )
        for f in document.flags
    )
    columns = ("run", "channel", "test", "decision", "from (s)", "to (s)", "segments", "of the run", "why")
    caption = "One row for each channel and test; 'from', 'to' and 'why' describe the longest segment."
    numeric = (False, False, False, False, True, True, True, True, False)
    return TextTable("Flags", caption, columns, rows, numeric)


def _pairs(document: CheckDocument) -> TextTable:
    rows = tuple(
        (_name(p.run), f"{p.first} and {p.second}", _AGREE[p.good], typography.prose(p.what))
        for p in document.redundancy
    )
    caption = "Gain, offset and delay of the first quantity relative to the second; physics relates the two."
    if document.untied:
        caption += f" No pair shows the gain of: {', '.join(document.untied)}."
    return TextTable("Redundant channels", caption, ("run", "pair", "", "result"), rows, (False,) * 4)


def _coast_tables(coasts: CoastBalance) -> list[TextTable]:
    def known(value: float | None, text: str) -> str:
        return typography.DASH if value is None else format(value, text)

    span = "" if coasts.speeds is None else f" from {coasts.speeds[0]:.0f} to {coasts.speeds[1]:.0f} km/h"
    runs = tuple(
        (
            _name(r.run),
            r.direction,
            known(r.start, ".0f"),
            known(r.mean, ".4f"),
            known(r.influence, "+.2%") + (" (beyond the interval of the others)" if r.material else ""),
            known(r.wind_mean, "+.1f"),
            known(r.wind_peak, ".1f"),
        )
        for r in coasts.runs
    )
    caption = "Without: change of the mean of both directions when the run is left out. Parameters: not evaluated."
    columns = ("run", "direction", "start (s)", "mean (m/s²)", "without", "wind (m/s)", "peak (m/s)")
    numeric = (False, False, True, True, True, True, True)
    tables = [TextTable(f"Mean deceleration{span}", caption, columns, runs, numeric)]
    times = tuple(
        (f"{a.speed:.0f}", f"{a.time:.2f}", known(a.r83, ".1%"), known(a.wltp, ".1%")) for a in coasts.accuracy
    )
    if times:
        caption = "Statistical accuracy p of the pairs' times for ±5 km/h about each speed."
        columns4 = ("km/h", "mean time (s)", "UN R83", "WLTP")
        tables.append(TextTable("Coast times", caption, columns4, times, (True,) * 4))
    limits = tuple((x.outcome, x.regulation, x.clause, x.limit, x.found) for x in coasts.limits)
    columns5 = ("", "regulation", "clause", "limit", "this test")
    caption = "Only limits that can be evaluated from the logs and the description are checked."
    tables.append(TextTable("Limits of regulations", caption, columns5, limits, (False,) * 5))
    return tables
