"""The trials of a long run, one line of JSON each, so that it can be stopped and gone on with.

What the page shows is kept, and to as many digits.
"""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from tests.bench.hidden_cases import Cell
from tests.bench.hidden_trial import Size, Trial

DIGITS = 6
WORDY = ("refused", "crashed")  # verdicts that mean nothing without their words


def remember(log: Path, cell: Cell, trial: Trial) -> None:
    kept = replace(trial, says=trial.says if trial.verdict in WORDY or cell.expect == "fault" else "")
    with log.open("a", encoding="utf-8") as file:
        file.write(json.dumps({"cell": cell.name, "trial": _rounded(asdict(kept))}) + "\n")


def _rounded(entry: Any) -> Any:
    if isinstance(entry, float):
        return float(f"{entry:.{DIGITS}g}")
    if isinstance(entry, dict):
        return {key: _rounded(value) for key, value in entry.items()}
    if isinstance(entry, frozenset):
        return sorted(entry)
    return [_rounded(value) for value in entry] if isinstance(entry, list | tuple) else entry


def recalled(log: Path) -> dict[tuple[str, int], Trial]:
    """Trials by the cell's name and the vehicle's seed; none where there is no log yet."""
    if not log.exists():
        return {}
    lines = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    return {(line["cell"], line["trial"]["seed"]): _trial(line["trial"]) for line in lines}


def _trial(entry: dict[str, Any]) -> Trial:
    trial = Trial(**entry)
    return replace(
        trial,
        named=frozenset(trial.named),
        among=tuple(frozenset(answer) for answer in trial.among),
        sizes=tuple(Size(**size) for size in entry["sizes"]),
        gain=None if trial.gain is None else (trial.gain[0], trial.gain[1], trial.gain[2]),
        listed=frozenset(trial.listed),
    )
