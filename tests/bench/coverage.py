"""How often 95 % intervals hold the truth: ``python -m tests.bench.coverage [SEEDS]`` writes coverage.md beside itself.

Set OPENBLAS_NUM_THREADS=1: its threads slow small problems down twentyfold.

The rule of each row is what ``solve`` chooses itself (units="auto"). The last rows show what a wrong belief about the
noise costs: runs as units stand it, blocks within few runs only in part, textbook intervals not at all.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from tests.inference.gusty import TRUTH, Case, campaign
from vdyn_cli.inference import solve
from vdyn_cli.inference.intervals import t_quantile

WRONG = {"believed_gust": 0.3, "believed_memory": 3.0}
CASES = {
    "16 runs": Case(16),
    "8 runs": Case(8),
    "8 runs of 20 to 70 s": Case(8, duration=(20.0, 70.0)),
    "8 runs, wind of 0.3 m/s from run to run": Case(8, run_wind=0.3),
    "6 runs": Case(6),
    "4 runs": Case(4),
    "4 runs of 20 to 70 s": Case(4, duration=(20.0, 70.0)),
    "4 runs, wind of 0.3 m/s from run to run under a prior": Case(4, run_wind=0.3, wind_prior=0.3),
    "2 runs": Case(2),
    "1 run": Case(1),
    "8 runs, gusts believed half as strong and 3 s long": Case(8, **WRONG),
    "4 runs, gusts believed half as strong and 3 s long": Case(4, **WRONG),
}


def row(name: str, case: Case, seeds: int) -> str:
    """One line of the table: what covers, and how wide."""
    errors, stds, inside, textbook, units = [], [], [], [], []
    for seed in range(seeds):
        solution = solve(campaign(case, seed))
        error = np.array([solution.values[n] - TRUTH[n] for n in TRUTH])
        errors.append(error)
        stds.append([solution.std[n] for n in TRUTH])
        inside.append([solution.interval95[n][0] <= TRUTH[n] <= solution.interval95[n][1] for n in TRUTH])
        classical = np.array([solution.classical_std[n] for n in TRUTH])
        textbook.append(np.abs(error) <= t_quantile(np.inf) * classical)
        units.append((solution.unit, solution.n_units))
    spread = np.std(errors, axis=0)
    cells = [
        name,
        _units(units),
        " / ".join(f"{100 * c:.1f}" for c in np.mean(inside, axis=0)),
        " / ".join(f"{r:.2f}" for r in np.mean(stds, axis=0) / spread),
        " / ".join(f"{b:+.2f}" for b in np.mean(errors, axis=0) / spread),
        " / ".join(f"{100 * c:.1f}" for c in np.mean(textbook, axis=0)),
    ]
    return "| " + " | ".join(cells) + " |"


def _units(units: list[tuple[str, int]]) -> str:
    """``runs``, or ``runs 89 %, blocks 11 %``, with how many there were."""
    parts = []
    for kind in sorted({u for u, _ in units}, reverse=True):
        counts = [n for u, n in units if u == kind]
        number = str(min(counts)) if min(counts) == max(counts) else f"{min(counts)} to {max(counts)}"
        share = "" if len(counts) == len(units) else f" in {100 * len(counts) / len(units):.0f} %"
        parts.append(("noise model" if kind == "model" else f"{number} {kind}s") + share)
    return ", ".join(parts)


def table(seeds: int) -> str:
    head = (
        "# Coverage of 95 % intervals\n\n"
        f"Coast-downs in gusts (sd 0.6 m/s, 8 s), {seeds} seeds a row; unknowns: constant and quadratic part.\n"
        "Written by `python -m tests.bench.coverage`. Sampling error of a coverage: "
        f"{100 * np.sqrt(0.95 * 0.05 / seeds):.1f} %.\n\n"
        "| campaign | unit of evidence | covers, % | mean std / true | bias / std | textbook covers, % |\n"
        "|---|---|---|---|---|---|\n"
    )
    return head + "\n".join(row(name, case, seeds) for name, case in CASES.items()) + "\n"


if __name__ == "__main__":
    text = table(int(sys.argv[1]) if len(sys.argv) > 1 else 300)
    Path(__file__).with_suffix(".md").write_text(text)
    print(text)
