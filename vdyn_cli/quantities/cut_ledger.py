"""The ledger of cuts: which segments of which logs were left out, why, and what each cut changed."""

from __future__ import annotations

from typing import Literal

from pydantic import ConfigDict, Field

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
