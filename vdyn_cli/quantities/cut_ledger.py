"""The ledger of cuts: which segments of which logs were left out, why, and what each cut changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from pydantic import ConfigDict, Field

from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.quantities.entry import Entry

Decision = Literal["automatic", "requested", "kept"]


class LedgerRow(Entry):
    """One row of the ledger of cuts: a segment that was cut, or that failed a test and was kept on request."""

    model_config = ConfigDict(populate_by_name=True)

    log: str = Field(description="log of the segment")
    channel: str = Field(description="channel of the segment, or 'all'")
    start: float = Field(
        validation_alias="from",
        serialization_alias="from",
        description="time of its first sample on the log's clock, s",
    )
    stop: float = Field(validation_alias="to", serialization_alias="to", description="time of its last sample, s")
    test: str = Field(description="test that failed: frozen, straight_line, spike, dropout; or requested")
    why: str = Field(description="the fact, with its numbers")
    samples: int = Field(description="number of samples of the segment")
    before: int = Field(description="samples with a value in the channel before all cuts")
    after: int = Field(description="samples with a value in the channel after all cuts")
    decision: Decision = Field(
        description="automatic: cut by the test; requested: cut by the description; kept: not cut, by the description",
    )
    changes: dict[str, float] | Literal["not evaluated"] = Field(
        description="parameter: its value with this cut minus that without it, in its SI unit, both without extensions",
    )


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
        clocks = {"clocks": [c.model_dump() for c in self.clocks]} if self.clocks else {}
        road = {"road": dict(self.road)} if self.road is not None else {}
        return {
            "channels": channels,
            "ledger": [row.model_dump(by_alias=True) for row in self.ledger],
            **clocks,
            **road,
        }

    @classmethod
    def from_json(cls, part: Mapping[str, Any]) -> DataQuality:
        """The object from the part that ``to_json`` returns."""
        clocks = tuple(ClockDifference.model_validate(c) for c in part.get("clocks", ()))
        ledger = tuple(LedgerRow.model_validate(row) for row in part["ledger"])
        return cls(part["channels"], ledger, clocks, part.get("road"))
