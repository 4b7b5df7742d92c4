"""``vdyn check``: whether the runs of a test are usable, as text, JSON or a page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from vdyn_cli.commands.console import Tell, note_lines, text_columns, write_out
from vdyn_cli.project.checks.check import check
from vdyn_cli.project.reading.channel_sources import logged_channels
from vdyn_cli.project.result_document import to_json
from vdyn_cli.quantities.check_schema import CheckDocument, CoastBalance, TiedPair
from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.quantities.number_text import moment
from vdyn_cli.report.typography import run_name


def run_check(path: Path, known_files: tuple[Path, ...], output: str, tell: Tell) -> int:
    """Check a test, print the result, and return the exit code: 0 all runs are good, 1 a run or the description is not.

    Parameters
    ----------
    path, known_files : the description, and parameter files of other steps.
    output : ``-``: JSON to stdout instead of the text; a folder: also ``check.json`` and ``check.html``; empty: text.
    tell : prints text.

    Raises
    ------
    InputError : the input is wrong, or the output cannot be written.
    """
    document, inputs = check(path, known_files)
    if output == "-":
        write_out(to_json(document.model_dump(mode="json", by_alias=True)))
        return 0 if document.good else 1
    tell("\n".join(check_lines(document)))
    if output:
        from vdyn_cli.io.files import write_together
        from vdyn_cli.report.check_page import render_check

        folder = Path(output)
        text = to_json(document.model_dump(mode="json", by_alias=True))
        units = {name: channel.unit for name, channel in logged_channels(inputs.spec.channels).items()}
        page = render_check(document, inputs.unsplit, units)
        write_together({folder / "check.json": text, folder / "check.html": page})
        tell(f"{folder / 'check'}.json and .html")
    return 0 if document.good else 1


def check_lines(document: CheckDocument) -> Iterator[str]:
    """The text for a terminal, the conclusion first."""
    yield document.sentence
    yield ""
    wide = max(len(run_name(run.run)) for run in document.runs)
    first = max(len("repeat"), *(len(run.verdict) for run in document.runs))
    for run in document.runs:
        yield f"  {run.verdict:<{first}}  {run_name(run.run):<{wide}}  {'; '.join(run.why) or 'no fault found'}"
    if document.flags:
        yield "\nFlags"
        rows = [
            (
                *(run_name(f.run), f.channel, f.test, f.decision),
                *(moment(f.start), moment(f.stop), str(f.segments), f"{100 * f.share:.1f} %"),
            )
            for f in document.flags
        ]
        yield from text_columns(("run", "channel", "test", "", "from [s]", "to [s]", "segments", "of the run"), rows)
    if document.redundancy or document.untied:
        yield "\nRedundant channels"
    if document.redundancy:
        yield from text_columns(("pair", "", "runs", "first over second"), list(_pair_rows(document.redundancy)))
    if document.untied:
        yield f"  no pair shows the gain of: {', '.join(document.untied)}"
    if document.clocks:
        yield "\nClocks of several loggers"
        yield from text_columns(
            ("logger", "against", "by", "delay [ms]", "drift [ppm]", ""), [_clock_row(c) for c in document.clocks]
        )
    if document.coasts is not None:
        yield from _coast_lines(document.coasts)
    yield from note_lines(document.findings)


def _clock_row(clock: ClockDifference) -> tuple[str, ...]:
    first, second = clock.pair
    return (
        *(run_name(clock.logger), run_name(clock.run), first if first == second else f"{first} ~ {second}"),
        f"{1e3 * clock.delay:+z.1f} +- {1e3 * clock.delay_std:.1f}",
        f"{1e6 * clock.drift:+z.0f} +- {1e6 * clock.drift_std:.0f}",
        "drift corrected" if clock.corrected else "drift not significant",
    )


def _peak(peak: float | None) -> str:
    return "" if peak is None else f", at most {peak:.1f}"


def _coast_lines(coasts: CoastBalance) -> Iterator[str]:
    yield "\nCoast-downs"
    yield from (f"  {s}" for s in coasts.sentences)
    if coasts.speeds is not None:
        span = f"{coasts.speeds[0]:.0f} to {coasts.speeds[1]:.0f} km/h"
        yield f"\nMean deceleration from {span}, and its change without the run (parameters: not evaluated)"
        rows = [
            (
                run_name(r.run),
                r.direction,
                "-" if r.start is None else f"{r.start:.0f}",
                "-" if r.mean is None else f"{r.mean:.4f}",
                "-" if r.influence is None else f"{100 * r.influence:+.2f} %",
                "more than the others' 95 % interval" if r.material else "",
                "" if r.wind_mean is None else f"wind {r.wind_mean:+.1f}{_peak(r.wind_peak)} m/s",
            )
            for r in coasts.runs
        ]
        yield from text_columns(("run", "direction", "start [s]", "[m/s^2]", "without", "", ""), rows)
    if coasts.accuracy:
        yield "\nStatistical accuracy p of the pairs' coast times (+-5 km/h)"
        yield from text_columns(
            ("[km/h]", "time [s]", "UN R83", "WLTP"),
            [(f"{a.speed:.0f}", f"{a.time:.2f}", _percent(a.r83), _percent(a.wltp)) for a in coasts.accuracy],
        )
    yield "\nLimits of regulations"
    checked = [x for x in coasts.limits if x.outcome != "not checked"]
    cells = sorted(((x.outcome, x.regulation, x.clause, x.limit, x.found) for x in checked), reverse=True)
    yield from text_columns(("", "regulation", "clause", "limit", "this test"), cells)
    because = Counter(x.found.partition(":")[0] for x in coasts.limits if x.outcome == "not checked")
    if because:
        reasons = "; ".join(f"{why} ({n})" for why, n in because.items())
        yield f"  {because.total()} not checked: {reasons}. 'vdyn check -o DIR' lists them."


def _pair_rows(pairs: Sequence[TiedPair]) -> Iterator[tuple[str, str, str, str]]:
    """Rows of the pairs: one for all runs if they agree or nothing is determined, else one per run."""
    groups: dict[tuple[str, str, bool | None], list[TiedPair]] = {}
    for pair in pairs:
        groups.setdefault((pair.first, pair.second, pair.good), []).append(pair)
    for (first, second, good), members in groups.items():
        name = f"{first} ~ {second}"
        if good is False or len(members) == 1:
            for one in members:
                outcome = {True: "agree", False: "contradict", None: "-"}[good]
                yield name, outcome, run_name(one.run), one.what
            continue
        parts = []
        for key, unit in (("gain", ""), ("offset", ""), ("delay", " s")):
            values = [v for one in members if (v := getattr(one, key)) is not None]
            if values:
                parts.append(f"{key} {min(values):z.3f} to {max(values):z.3f}{unit}")
        what = ", ".join(parts) or members[0].what
        if good is None and parts and all(one.gain is None for one in members):
            what += " m/s^2; gain not determined: hardly correlated"
        yield name, "agree" if good else "-", f"{len(members)} runs", what


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.1f} %"
