"""The hidden-effect matrix as Markdown: a row a cell, the rates that are wanted, and every cell that falls short."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binom

from tests.bench.hidden_cases import CASES, Cell
from tests.bench.hidden_trial import Trial, judged

SEEN = 6.0  # Cramer-Rao t from which an effect must be found
HEAD = """# Hidden effects

Written by `python -m tests.bench.hidden`. Each row: an effect hidden in the logs of random vehicles from the truth
plant, and what the program made of logs and description. *t*: median Cramer-Rao t of the hidden size (size over the
least standard deviation that any estimator can reach); *rival*: the least such t when any one other effect of the
catalog is unknown too. *right*: the cause named, or what else was wanted of the row; *set*: several named that these
data can't tell apart, the truth among them; *silent*: nothing claimed; *wrong*: another cause named, or a set without
the truth; for rows with nothing to find, a false alarm. *size covered*: 95 % intervals that hold the hidden size.
*gain*: reported held-out gain whose interval holds the gain on fresh logs of the same car.

Wanted: false alarms and wrong names at most 5 %; right or set at least 95 % of those with t >= 6; right alone at least
85 % of those with t >= 6 against every rival; unlisted causes `unknown` at least 90 %; sizes covered 92 to 97 %; gains
90 %. Bold: short of that. A share's own chance error is sqrt(p (1 - p)/n).
"""


@dataclass(frozen=True)
class Rate:
    """A share of trials beside what is wanted of it."""

    good: int
    of: int
    least: float  # wanted share; for errors the share of trials without

    @property
    def short(self) -> bool:
        return self.of > 0 and self.good < self.least * self.of - 1e-9

    @property
    def chance(self) -> float:
        """How often so few would come out if the wanted share were the true one."""
        return float(binom.cdf(self.good, self.of, self.least))

    def __str__(self) -> str:
        if not self.of:
            return "-"
        text = f"{self.good}/{self.of}"
        return f"**{text}**" if self.short else text


def section(step: str, rows: Sequence[tuple[Cell, Sequence[Trial]]]) -> str:
    """The step's rows, its rates over all of them, and the cells that fall short."""
    lines = [f"## {step}", ""]
    lines += ["| hidden | wanted | t | rival | right | set | silent | unknown | wrong | found, t >= 6 "
              "| alone, t >= 6 to rivals | not wrong | size covered | gain | s |"]  # fmt: skip
    lines += ["|" + "---|" * 15]
    lines += [_row(cell, trials) for cell, trials in rows]
    lines += ["", *_summary(rows), "", *_shortfalls(rows)]
    return "\n".join(lines) + "\n"


def _row(cell: Cell, trials: Sequence[Trial]) -> str:
    count = Counter(judged(cell, trial) for trial in trials)
    odd = "".join(f" ({count[k]} {k})" for k in ("guess", "part", "refused", "crashed") if count[k])
    cells = [
        cell.name.partition(": ")[2] + (f" ({cell.variant})" if cell.variant else ""),
        cell.expect.replace("_", " "),
        _median(trials, lambda trial: trial.t.values()),
        _median(trials, lambda trial: trial.least.values()),
        f"{count['right']}{odd}",
        *(str(count[kind]) for kind in ("set", "silent", "unknown")),
        str(count["wrong"] + count["alarm"]),
        *(str(rate([(cell, trials)])) for rate in (found, alone, not_wrong)),
        str(covered([(cell, trials)])),
        str(gained([(cell, trials)])),
        f"{np.median([trial.seconds for trial in trials]):.1f}",
    ]
    return "| " + " | ".join(cells) + " |"


def _median(trials: Sequence[Trial], values: Callable[[Trial], object]) -> str:
    least = [min(list(values(trial)), default=np.nan) for trial in trials]  # type: ignore[call-overload]
    return "-" if not least or np.isnan(least).all() else f"{np.nanmedian(least):.1f}"


Rows = Sequence[tuple[Cell, Sequence[Trial]]]


def _verdicts(rows: Rows, expects: Sequence[str], strong: Callable[[Trial], float]) -> list[str]:
    return [
        judged(cell, trial)
        for cell, trials in rows
        if cell.expect in expects
        for trial in trials
        if strong(trial) >= SEEN
    ]


def _weakest(trial: Trial) -> float:
    return min(trial.t.values(), default=0.0)


def _least(trial: Trial) -> float:
    return min(trial.least.values(), default=0.0)


def found(rows: Rows) -> Rate:
    """Named, or in a set, where the logs can show it; of what no data tell apart, the set."""
    verdicts = _verdicts(rows, ("named", "both", "class"), _weakest)
    return Rate(sum(v in ("right", "set") for v in verdicts), len(verdicts), 0.95)


def alone(rows: Rows) -> Rate:
    """Exactly the name where the logs can tell it from every rival; ``unknown`` where no name would be right."""
    named = _verdicts(rows, ("named", "both"), _least)
    if not named and any(cell.expect == "unknown" for cell, _ in rows):
        return unlisted(rows)
    return Rate(named.count("right"), len(named), 0.85)


def unlisted(rows: Rows) -> Rate:
    """Said to be unknown, where no listed cause could stand in for it."""
    verdicts = _verdicts(rows, ("unknown",), _least)
    return Rate(verdicts.count("right"), len(verdicts), 0.90)


def not_wrong(rows: Rows) -> Rate:
    verdicts = [judged(cell, trial) for cell, trials in rows for trial in trials if cell.expect != "fault"]
    return Rate(sum(v not in ("wrong", "alarm", "guess", "crashed") for v in verdicts), len(verdicts), 0.95)


def quiet(rows: Rows) -> Rate:
    """No alarm where there is nothing."""
    verdicts = [judged(cell, trial) for cell, trials in rows for trial in trials if cell.expect == "nothing"]
    return Rate(verdicts.count("right") + verdicts.count("refused"), len(verdicts), 0.95)


def covered(rows: Rows) -> Rate:
    sizes = [size for _, trials in rows for trial in trials for size in trial.sizes]
    return Rate(sum(size.covered for size in sizes), len(sizes), 0.92)


def gained(rows: Rows) -> Rate:
    fresh = [t for _, trials in rows for t in trials if t.fresh is not None and t.gain is not None]
    inside = [t for t in fresh if t.gain is not None and t.fresh is not None and t.gain[1] <= t.fresh <= t.gain[2]]
    return Rate(len(inside), len(fresh), 0.90)


RATES: dict[str, Callable[[Rows], Rate]] = {
    "no alarm where nothing is hidden": quiet,
    "no wrong name": not_wrong,
    "named or in a set, of those with t >= 6": found,
    "named alone, of those with t >= 6 against every rival": alone,
    "unlisted causes said to be unknown": unlisted,
    "sizes within their 95 % interval (92 to 97 %)": covered,
    "stated gain holds on fresh logs": gained,
}


def _summary(rows: Rows) -> list[str]:
    lines = ["| over all rows | count | share | wanted |", "|---|---|---|---|"]
    for about, measure in RATES.items():
        rate = measure(rows)
        share = f"{100 * rate.good / rate.of:.0f} %" if rate.of else "-"
        lines.append(f"| {about} | {rate} | {share} | {100 * rate.least:.0f} % |")
    return lines


def _shortfalls(rows: Rows) -> list[str]:
    """Each cell and rate that is short, how likely by chance, and what was said instead."""
    lines = []
    for cell, trials in rows:
        for about, measure in RATES.items():
            rate = measure([(cell, trials)])
            if rate.short and not (measure is alone and cell.expect == "unknown"):
                lines.append(
                    f"* {cell.name}: {about} {rate.good}/{rate.of} (by chance {rate.chance:.2g}). {_said(trials)}"
                )
        if cell.expect == "fault" and (missed := sum(judged(cell, trial) != "right" for trial in trials)):
            lines.append(f"* {cell.name}: not noticed in {missed} of {len(trials)}. {_said(trials)}")
    return ["### Falls short", "", *lines] if lines else []


def _said(trials: Sequence[Trial]) -> str:
    """The three commonest answers."""
    said = Counter(
        " or ".join(sorted(trial.named))
        or " or ".join(sorted("+".join(sorted(answer)) for answer in trial.among))
        or (f"{trial.verdict}: {trial.says}" if trial.verdict in ("refused", "crashed") else trial.verdict)
        for trial in trials
    )
    return "Said: " + "; ".join(f"{answer} ({count})" for answer, count in said.most_common(3))


def merged(page: str, sections: dict[str, str]) -> str:
    """The page with the new sections in the place of their old ones, in the order of the cases."""
    old = {part.split("\n", 1)[0].strip(): f"## {part.rstrip()}\n" for part in page.split("\n## ")[1:]}
    kept = {**old, **sections}
    return "\n".join([HEAD, *(kept[step] for step in dict.fromkeys(cell.step for cell in CASES) if step in kept)])
