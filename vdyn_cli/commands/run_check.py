"""``vdyn check``: whether the runs of a test are good, as text, JSON or a page."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from vdyn_cli.commands.run_step import write_out
from vdyn_cli.project.check import check
from vdyn_cli.project.result_document import to_json
from vdyn_cli.quantities.check_schema import CheckDocument, CoastBalance

Tell = Callable[..., None]
MOST_PAIRS = 24  # lines of the table of tied channels on a terminal; JSON and page hold all


def run_check(path: Path, known_files: tuple[Path, ...], output: str, tell: Tell) -> int:
    """Check a test, print what is found, and give the exit code: 0 all runs are good, 1 one should be repeated.

    Parameters
    ----------
    output : ``-`` writes the JSON to stdout; a folder gets ``check.json`` and ``check.html``; empty: text only.

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
        write_together({folder / "check.json": text, folder / "check.html": render_check(document, inputs.unsplit)})
        tell(f"{folder / 'check'}.json and .html")
    return 0 if document.good else 1


def check_lines(document: CheckDocument) -> Iterator[str]:
    """The text for a terminal, the answer first."""
    yield document.sentence
    yield ""
    for run in document.runs:
        why = "; ".join(run.why) or "no fault found"
        yield f"  {run.verdict:<6}  {run.run}: {why}"
    if document.flags:
        yield "\nFlags"
        rows = [
            (f.run, f.channel, f.test, f.decision, f"{f.start:.6g}", f"{f.stop:.6g}", str(f.segments), f"{f.share:.1%}")
            for f in document.flags
        ]
        yield from table(("run", "channel", "test", "", "from [s]", "to [s]", "segments", "of the run"), rows)
    if document.redundancy:
        yield "\nChannels that physics ties"
        rows4 = [
            (p.run, f"{p.first} ~ {p.second}", {True: "agree", False: "contradict", None: "-"}[p.good], p.what)
            for p in document.redundancy
        ]
        yield from table(("run", "pair", "", "first over second"), rows4[:MOST_PAIRS])
        if len(rows4) > MOST_PAIRS:
            yield f"  and {len(rows4) - MOST_PAIRS} more, in the JSON (-o -)"
    if document.coasts is not None:
        yield from _coast_lines(document.coasts)
    shown = [f for f in document.findings if f.doubt or not f.minor]
    if shown:
        yield "\nNotes"
        for f in shown:
            yield f"  {f.where}: {f.what}" + (f" (got {f.got})" if f.got else "")
            if f.remedy:
                yield f"      -> {f.remedy}"


def _coast_lines(coasts: CoastBalance) -> Iterator[str]:
    yield "\nCoast-downs"
    yield from (f"  {s}" for s in coasts.sentences)
    if coasts.speeds is not None:
        span = f"{coasts.speeds[0]:.0f} to {coasts.speeds[1]:.0f} km/h"
        yield f"\nMean deceleration from {span}, and its change without the run (parameters: not evaluated)"
        rows = [
            (
                r.run,
                r.direction,
                "-" if r.start is None else f"{r.start:.0f}",
                "-" if r.mean is None else f"{r.mean:.4f}",
                "-" if r.influence is None else f"{r.influence:+.2%}",
                "more than the others' 95 % interval" if r.material else "",
                "" if r.wind_mean is None else f"wind {r.wind_mean:+.1f}, at most {r.wind_peak:.1f} m/s",
            )
            for r in coasts.runs
        ]
        yield from table(("run", "way", "start [s]", "[m/s^2]", "without", "", ""), rows)
    if coasts.accuracy:
        yield "\nStatistical accuracy p of the pairs' coast times (+-5 km/h)"
        yield from table(
            ("[km/h]", "time [s]", "UN R83", "WLTP"),
            [(f"{a.speed:.0f}", f"{a.time:.2f}", _percent(a.r83), _percent(a.wltp)) for a in coasts.accuracy],
        )
    yield "\nLimits of regulations"
    rows5 = [(x.outcome, x.regulation, x.clause, x.limit, x.found) for x in coasts.limits]
    yield from table(("", "regulation", "clause", "limit", "this test"), sorted(rows5, key=_order))


def _order(row: Sequence[str]) -> int:
    return ("not met", "met", "not checked").index(row[0])


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{value:.1%}"


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Columns of texts, aligned left, two spaces apart; columns without any text are left out."""
    used = [i for i in range(len(header)) if any(row[i] for row in rows)]
    lines = [tuple(header[i] for i in used), *(tuple(row[i] for i in used) for row in rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(used))]
    for line in lines:
        yield "  " + "  ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)).rstrip()
