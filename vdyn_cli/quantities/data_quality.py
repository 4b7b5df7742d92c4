"""The quality of the logs of a test: states of their samples, cuts, differences of clocks, and the road's survey."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vdyn_cli.quantities.clock_difference import ClockDifference
    from vdyn_cli.quantities.cut_ledger import LedgerRow


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
        from vdyn_cli.quantities.clock_difference import ClockDifference
        from vdyn_cli.quantities.cut_ledger import LedgerRow

        clocks = tuple(ClockDifference.model_validate(c) for c in part.get("clocks", ()))
        ledger = tuple(LedgerRow.model_validate(row) for row in part["ledger"])
        return cls(part["channels"], ledger, clocks, part.get("road"))
