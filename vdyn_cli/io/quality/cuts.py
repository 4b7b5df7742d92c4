"""Cuts: samples that failed a test, or that the description cuts, become NaN; each cut is a row of the ledger."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vdyn_cli.io.quality.log_flags import flags
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.cut_ledger import Decision, LedgerRow
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.number_text import moment
from vdyn_cli.quantities.quality_flags import EVERY, Fault, Flag, LogFlags
from vdyn_cli.quantities.vocabulary import VARYING

TESTS = {
    "frozen": "sensor or logger frozen",
    "straight_line": "gap interpolated by the logger",
    "spike": "single wrong sample",
    "dropout": "signal lost",
    "requested": "cut by the description",
}

_FAILURES = ("frozen", "dropout")
_LOOK = "look for the fault in sensor, connector or logger before the next run; the rest of the log is used"


@dataclass(frozen=True)
class TimeSpan:
    """A segment of a channel (or ``all``), s on the log's clock, both ends included."""

    channel: str
    start: float
    stop: float


@dataclass(frozen=True)
class CutOrders:
    """The keys of a description on cuts.

    Parameters
    ----------
    automatic : cut the segments that fail a test. requested : cut these. kept : do not cut segments within these.
    units : the file's unit of each channel, for messages.
    """

    automatic: bool = True
    requested: tuple[TimeSpan, ...] = ()
    kept: tuple[TimeSpan, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)


AUTOMATIC = CutOrders()


@dataclass(frozen=True, eq=False)
class CutLog:
    """A log after its cuts.

    Parameters
    ----------
    log : with cut samples NaN. whole : before the cuts. flags : of the whole log. ledger : one row per segment.
    """

    log: Log
    whole: Log
    flags: LogFlags
    ledger: tuple[LedgerRow, ...]

    def without(self, row: LedgerRow) -> Log:
        """The log with all cuts but one."""
        return _cut(self.whole, [r for r in self.ledger if r is not row and r.decision != "kept"])

    def between(self, start: float, stop: float) -> CutLog:
        """The part with start <= time <= stop (s), with the cuts in it."""
        first, last = np.searchsorted(self.whole.time, start, "left"), np.searchsorted(self.whole.time, stop, "right")
        states = {n: s[first:last] for n, s in self.flags.states.items()}
        inside = [f for f in self.flags.faults if f.stop > first and f.first < last]
        moved = tuple(
            replace(f, first=max(f.first - int(first), 0), stop=min(f.stop, int(last)) - int(first)) for f in inside
        )
        ledger = tuple(r for r in self.ledger if r.stop >= start and r.start <= stop)
        return CutLog(
            self.log.between(start, stop),
            self.whole.between(start, stop),
            LogFlags(self.flags.name, states, moved),
            ledger,
        )


def with_cuts(log: Log, orders: CutOrders = AUTOMATIC) -> CutLog:
    """The log without the samples that failed a test or that the description cuts, and the ledger of these cuts.

    Parameters
    ----------
    log : channels in SI on one clock. orders : the description's; requested cuts have priority over kept segments.
    """
    found = flags(log, orders.units)
    failed = (_row(log, f, orders) for f in found.faults if f.state == Flag.FAILED)
    rows = [
        *(r for r in failed if not any(_holds(span, r, log) for span in orders.requested)),
        *(_requested(log, span) for span in orders.requested),
    ]
    cut = _cut(log, [r for r in rows if r.decision != "kept"])
    ledger = tuple(_counted(r, log, cut) for r in rows)
    return CutLog(cut, log, found, ledger)


def _row(log: Log, fault: Fault, orders: CutOrders) -> LedgerRow:
    start, stop = float(log.time[fault.first]), float(log.time[fault.stop - 1])
    row = _uncounted(log, TimeSpan(fault.channel, start, stop), fault.test, fault.why, fault.samples)
    kept = not orders.automatic or any(_holds(span, row, log) for span in orders.kept)
    return row.model_copy(update={"decision": "kept"}) if kept else row


def _holds(span: TimeSpan, row: LedgerRow, log: Log) -> bool:
    """Whether a row lies within a span, to the rounding of the times in messages."""
    slack = 0.5 * log.duration / max(log.time.size - 1, 1)
    return span.channel in (row.channel, EVERY) and span.start - slack <= row.start and row.stop <= span.stop + slack


def _requested(log: Log, span: TimeSpan) -> LedgerRow:
    samples = int(np.count_nonzero((log.time >= span.start) & (log.time <= span.stop)))
    row = _uncounted(log, span, "requested", "cut by the description", samples)
    return row.model_copy(update={"decision": "requested"})


def _uncounted(log: Log, span: TimeSpan, test: str, why: str, samples: int) -> LedgerRow:
    """The row of an automatic cut, without the samples of its channel and the changes of the parameters."""
    return LedgerRow(
        log=log.name,
        channel=span.channel,
        start=span.start,
        stop=span.stop,
        test=test,
        why=why,
        samples=samples,
        before=0,
        after=0,
        decision="automatic",
        changes="not evaluated",
    )


def _counted(row: LedgerRow, before: Log, after: Log) -> LedgerRow:
    """The row with the number of samples of its channel before and after all cuts."""
    names = list(before.channels) if row.channel == EVERY else [row.channel]
    counts = [[int(np.count_nonzero(np.isfinite(log[n]))) for n in names if n in log] for log in (before, after)]
    return row.model_copy(update={"before": max(counts[0], default=0), "after": max(counts[1], default=0)})


def _cut(log: Log, rows: Sequence[LedgerRow]) -> Log:
    """The log with NaN in the segments of the rows, and without the entries of ``samples`` there."""
    channels, cut = log.channels, dict[str, Array]()
    for row in rows:
        first, stop = np.searchsorted(log.time, row.start, "left"), np.searchsorted(log.time, row.stop, "right")
        for name in channels if row.channel == EVERY else [row.channel]:
            if name in channels:
                if name not in cut:
                    cut[name] = channels[name].copy()
                cut[name][first:stop] = np.nan
    samples = dict(log.samples)
    for name in cut.keys() & samples.keys():
        time, values = samples[name]
        left = np.isfinite(np.interp(time, log.time, cut[name]))
        samples[name] = time[left], values[left]
    return replace(log, channels={**channels, **cut}, samples=samples) if rows else log


def suspect_findings(cut: CutLog) -> Iterator[Finding]:
    """A fault for each channel that jumps permanently; which side of the jump is wrong is unknown."""
    for fault in cut.flags.faults:
        if fault.test == "level_step":
            at = f"{moment(cut.log.time[fault.first])} s"
            remedy = f"cut the run with from_time or to_time: {at}, or repeat the test"
            where = f"{cut.log.name}, channel '{fault.channel}'"
            yield Finding(where, f"{fault.why}, at {at}", "", remedy, fault=True, doubt=True)


def cut_findings(ledger: Sequence[LedgerRow]) -> Iterator[Finding]:
    """A note for each channel and test with cuts, and a warning for failed segments that are kept."""
    groups: dict[tuple[str, str, str, Decision], list[LedgerRow]] = {}
    for row in ledger:
        groups.setdefault((row.log, row.channel, row.test, row.decision), []).append(row)
    for (log, channel, test, decision), rows in groups.items():
        if decision == "requested":
            continue  # the user knows
        longest = max(rows, key=lambda r: (r.samples, -r.start))
        where = log if channel == EVERY else f"{log}, channel '{channel}'"
        at = f"{moment(longest.start)} s"
        span = f"at {at}" if longest.samples == 1 else f"from {at} to {moment(longest.stop)} s"
        what = f"{longest.why}, {span} ({TESTS[test]})"
        if len(rows) > 1:
            what += f", and {len(rows) - 1} more of this kind"
        first, last = np.floor(np.round(1e3 * longest.start, 3)), np.ceil(np.round(1e3 * longest.stop, 3))
        keep = f"{{channel: {channel}, from: {first / 1e3:.15g} s, to: {last / 1e3:.15g} s}}"  # ms, outwards
        if decision == "kept":
            remedy = "remove 'keep' or 'cuts' from the run to cut it"
            yield Finding(where, f"{what}; kept by the description", "", remedy, doubt=True)
        else:
            total = sum(r.samples for r in rows)
            what += f": {total} sample{'s' if total != 1 else ''} cut"
            lost = test in _FAILURES and longest.stop - longest.start > QUALITY.longest_bridge
            remedy = f"no action needed. To use these samples, add 'keep: [{keep}]' to the run"
            if test == "frozen" and channel in (EVERY, *VARYING):  # a working sensor never does
                remedy = _LOOK
            elif lost:
                remedy = f"{_LOOK}. If they are right, add 'keep: [{keep}]' to the run"
            yield Finding(where, what, "", remedy)
