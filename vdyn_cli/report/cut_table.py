"""The cuts of the logs: a sentence for the top of the page, and the ledger as a table."""

from __future__ import annotations

from collections.abc import Sequence

from vdyn_cli.quantities.cut_ledger import LedgerRow
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.quality_flags import EVERY
from vdyn_cli.report import typography
from vdyn_cli.report.text_table import TextTable

_COLUMNS = ("log", "channel", "from (s)", "to (s)", "why", "samples", "before", "after", "decision", "changes")
_NUMERIC = (False, False, True, True, False, True, True, True, False, False)
_SINGLE = 3  # number of cuts by the same test in one channel from which they share one line
_SHOWN = 3  # parameters whose change is shown


def cut_sentence(ledger: Sequence[LedgerRow]) -> str:
    """The number of cut segments, and the longest one; empty without cuts."""
    cuts = [row for row in ledger if row.decision != "kept"]
    if not cuts:
        return ""
    logs = len({row.log for row in cuts})
    longest = max(cuts, key=lambda r: r.samples)
    channel = "all channels" if longest.channel == EVERY else longest.channel
    where = f"{typography.run_name(typography.clean(longest.log))}, {channel}"
    span = f"{longest.start:.1f} to {longest.stop:.1f} s"
    head = f"{typography.count(len(cuts), 'segment')} of {typography.count(logs, 'log')} cut"
    return f"{head}; the longest: {where}, {span} ({typography.prose(longest.why)})."


def cut_table(ledger: Sequence[LedgerRow], estimates: dict[str, Estimate]) -> TextTable | None:
    """The ledger, with many cuts by the same test in one channel as one line; None if it is empty."""
    if not ledger:
        return None
    groups: dict[tuple[str, ...], list[LedgerRow]] = {}
    for row in ledger:
        groups.setdefault((row.log, row.channel, row.test, row.decision), []).append(row)
    lines = [line for rows in groups.values() for line in _lines(rows, estimates)]
    caption = (
        "The estimate treats cut samples as missing. Before and after: number of samples of the channel with a value. "
        "Changes: the baseline's value with the cut minus that without it, in standard deviations of the published "
        "parameter."
    )
    return TextTable("Ledger of cuts", caption, _COLUMNS, tuple(lines), _NUMERIC)


def _lines(rows: list[LedgerRow], estimates: dict[str, Estimate]) -> list[tuple[str, ...]]:
    first = rows[0]
    name = typography.run_name(typography.clean(first.log))
    if len(rows) < _SINGLE:
        return [
            (
                name,
                row.channel,
                f"{row.start:.1f}",
                f"{row.stop:.1f}",
                typography.prose(row.why),
                *(str(k) for k in (row.samples, row.before, row.after)),
                row.decision,
                _changes(row, estimates),
            )
            for row in rows
        ]
    why = f"{len(rows)} segments, the first: {first.why}"
    samples = (str(sum(r.samples for r in rows)), str(first.before), str(first.after))
    span = (f"{first.start:.1f}", f"{rows[-1].stop:.1f}")
    return [(name, first.channel, *span, typography.prose(why), *samples, first.decision, "not evaluated")]


def _changes(row: LedgerRow, estimates: dict[str, Estimate]) -> str:
    """The largest changes, in standard deviations of the published parameter."""
    if row.changes == "not evaluated":
        return "not evaluated" if row.decision != "kept" else typography.DASH
    known = {n: shift / estimates[n].std for n, shift in row.changes.items() if n in estimates and estimates[n].std > 0}
    largest = sorted(known, key=lambda n: -abs(known[n]))[:_SHOWN]
    return ", ".join(f"{typography.title(n)} {typography.signed(known[n], 2)} sd" for n in largest) or "none"
