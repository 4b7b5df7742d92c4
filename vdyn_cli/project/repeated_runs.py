"""Runs that hold the same recording, whatever their files are called: they would count as independent evidence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log

Codes = NDArray[np.uint64]

COMMON = 0.5  # share of the shorter run's samples found in another, from which both hold one recording
MOST_COMPARED = 1_000_000  # samples of all runs that are compared; sorting them takes about 0.2 s
FEWEST = 20  # samples in common that differ from the ones before; fewer may agree by chance

# Odd numbers without a pattern: those of the mixing step of splitmix64 (Steele et al., OOPSLA 2014).
_MIX = tuple(np.uint64(n) for n in (0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB))


def repeated_runs(logs: Sequence[Log], places: Sequence[str]) -> Iterator[Finding]:
    """A finding for each run that holds samples of an earlier one.

    Two samples are the same if all channels that all logs have are equal to the last bit, and the time; a copy whose
    clock was shifted is found where all of its samples, in their order, are those of another. A sample that repeats
    the one before, as at rest, counts for nothing. Independent recordings agree in single samples at most, since
    sensors scatter; logs without scatter, of a simulation say, agree if the runs are the same. The work grows with
    the samples as n log n.

    Parameters
    ----------
    logs : of the runs, cut to their windows. places : of the runs in the description.
    """
    names = sorted(set.intersection(*(set(log.channels) for log in logs))) if len(logs) > 1 else []
    if not names:
        return
    codes = [_codes(log, names) for log in logs]
    firsts = _first_of_same_values(codes)
    shares = _common_samples(logs, codes)
    for k, log in enumerate(logs):
        if k not in firsts and k not in shares:
            continue
        other, share = (firsts[k], 1.0) if k in firsts else shares[k]
        what = "holds the same samples as" if share == 1.0 else f"has {100 * share:.0f} % of its samples in common with"
        remedy = "list each recording once: a copy is not independent evidence"
        yield Finding(places[k], f"{log.name} {what} {logs[other].name}", f"first at {places[other]}", remedy)


def _mixed(code: Codes, values: NDArray[np.float64]) -> Codes:
    """The codes with one more channel; adding zero makes -0 equal to 0."""
    code = (code ^ (values + 0.0).view(np.uint64)) * _MIX[0]
    code ^= code >> np.uint64(31)
    code = code * _MIX[1]
    return np.asarray(code ^ (code >> np.uint64(29)))


def _codes(log: Log, names: Sequence[str]) -> Codes:
    """A number for each sample, the same for the same values."""
    code = np.zeros(log.time.size, dtype=np.uint64)
    for name in names:
        code = _mixed(code, log[name])
    return code


def _moving(code: Codes) -> NDArray[np.bool_]:
    """Which samples differ from the one before."""
    return np.concatenate([[True], code[1:] != code[:-1]]) if code.size else np.zeros(0, dtype=bool)


def _first_of_same_values(codes: Sequence[Codes]) -> dict[int, int]:
    """For each run whose samples are those of an earlier run, in their order, that run."""
    seen: dict[tuple[int, int, int], int] = {}
    found = {}
    for k, code in enumerate(codes):
        order = np.arange(1, code.size + 1, dtype=np.uint64) * _MIX[2]
        key = (code.size, int(np.bitwise_xor.reduce(code * order)), int(np.add.reduce(code * order)))
        if np.count_nonzero(_moving(code)) >= FEWEST:
            if key in seen:
                found[k] = seen[key]
            seen.setdefault(key, k)
    return found


def _common_samples(logs: Sequence[Log], codes: Sequence[Codes]) -> dict[int, tuple[int, float]]:
    """For each run of which a large share of samples is in an earlier run: that run, and the share."""
    # The same samples of each log are kept: those whose number is divisible.
    keep = np.uint64(max(1, -(-sum(code.size for code in codes) // MOST_COMPARED)))
    timed = [_mixed(code, log.time)[_moving(code)] for log, code in zip(logs, codes, strict=True)]
    every = [np.unique(code[code % keep == 0]) for code in timed]
    run = np.repeat(np.arange(len(logs)), [code.size for code in every])
    code = np.concatenate(every)
    order = np.lexsort((run, code))
    code, run = code[order], run[order]
    # A sample of three runs counts for the first and second, and for the second and third: enough to name each.
    same = np.flatnonzero(code[1:] == code[:-1])
    pairs, counts = np.unique(run[same] * len(logs) + run[same + 1], return_counts=True)
    found: dict[int, tuple[int, float]] = {}
    for pair, count in zip(pairs.tolist(), counts.tolist(), strict=True):
        first, second = divmod(pair, len(logs))
        share = count / max(min(every[first].size, every[second].size), 1)
        if count >= FEWEST and share >= COMMON and share > found.get(second, (0, 0.0))[1]:
            found[second] = (first, share)
    return found
