"""The ledger of cuts: which segments of which logs were left out, why, and what each cut changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from vdyn_cli.quantities.clock_difference import ClockDifference

Decision = Literal["automatic", "requested", "kept"]


@dataclass(frozen=True)
class LedgerRow:
    """One row of the ledger: a segment of a channel that was cut, or that failed a test and was kept on request.

    Parameters
    ----------
    log, channel : where; ``all`` stands for every channel.
    start, stop : s on the log's clock, times of the first and the last sample.
    test, why : the failed test (``requested`` for a requested cut), and the fact.
    samples : number in the segment. before, after : number of samples with a value in the channel before and after the
        cut; for a cut of every channel, in the channel with the most.
    decision : automatic, requested (by the description), or kept (by the description: nothing is cut).
    changes : shift of each parameter by the cut, SI; None where it is not evaluated.
    """

    log: str
    channel: str
    start: float
    stop: float
    test: str
    why: str
    samples: int
    before: int
    after: int
    decision: Decision = "automatic"
    changes: Mapping[str, float] | None = None

    def to_json(self) -> dict[str, Any]:
        """The row for a result's JSON; ``changes`` is ``"not evaluated"`` where there are none."""
        return {
            "log": self.log,
            "channel": self.channel,
            "from": self.start,
            "to": self.stop,
            "test": self.test,
            "why": self.why,
            "samples": self.samples,
            "before": self.before,
            "after": self.after,
            "decision": self.decision,
            "changes": "not evaluated" if self.changes is None else dict(self.changes),
        }

    @classmethod
    def from_json(cls, row: Mapping[str, Any]) -> LedgerRow:
        """The row from an entry of ``to_json``."""
        changes = row["changes"]
        rest = {k: row[k] for k in ("log", "channel", "test", "why", "samples", "before", "after", "decision")}
        return cls(start=row["from"], stop=row["to"], changes=None if isinstance(changes, str) else changes, **rest)


@dataclass(frozen=True)
class DataQuality:
    """The quality of all logs of a test.

    Parameters
    ----------
    channels : number of samples by log, channel and state.
    ledger : in the order of the runs. clocks : of the other loggers, relative to the first one's.
    road : survey from which the grade was computed (file, span in m, number of points, kind, error); None without one.
    """

    channels: Mapping[str, Mapping[str, Mapping[str, int]]] = field(default_factory=dict)
    ledger: tuple[LedgerRow, ...] = ()
    clocks: tuple[ClockDifference, ...] = ()
    road: Mapping[str, str | float | int] | None = None

    def to_json(self) -> dict[str, Any]:
        """The ``quality`` part of a result's JSON."""
        channels = {log: {n: dict(states) for n, states in of.items()} for log, of in self.channels.items()}
        clocks = {"clocks": [c.to_json() for c in self.clocks]} if self.clocks else {}
        road = {"road": dict(self.road)} if self.road is not None else {}
        return {"channels": channels, "ledger": [row.to_json() for row in self.ledger], **clocks, **road}

    @classmethod
    def from_json(cls, part: Mapping[str, Any]) -> DataQuality:
        """The object from the part that ``to_json`` returns."""
        clocks = tuple(ClockDifference.from_json(c) for c in part.get("clocks", ()))
        return cls(
            part["channels"], tuple(LedgerRow.from_json(row) for row in part["ledger"]), clocks, part.get("road")
        )
