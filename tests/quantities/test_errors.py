"""Findings of several logs that say the same are told once."""

from __future__ import annotations

from vdyn_cli.quantities.errors import Finding, merge_similar


def test_findings_that_differ_in_numbers_alone_are_told_once() -> None:
    uneven = [Finding(f"slip_{i}.csv, column 'Time'", f"uneven clock: {80 + i} % of steps", "", "r") for i in range(5)]
    other = Finding("slip_1.csv, column 'Fx'", "clipped", "", "r")
    told = merge_similar([*uneven, other])
    assert [f.where for f in told] == ["slip_0.csv and 4 more, column 'Time'", "slip_1.csv, column 'Fx'"]
