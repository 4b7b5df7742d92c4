"""Detection of runs with the same recording in different files, which would count as independent data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.arrays import Array, Mask
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log

Codes = NDArray[np.uint64]

COMMON = 0.5  # share of the shorter run's samples found in another, from which both are one recording
MOST_COMPARED = 1_000_000  # samples of all runs that are compared; sorting them takes about 0.2 s
# s: by as much a copy's clock may wander, as times that are rounded to 0.01 s do; also the unit in which steps of time
# are compared within a file. Split times of runs differ by some tenths of a second.
STEP = 0.02
FEWEST_COMMON = 20  # common samples that differ from the previous one; fewer may agree by chance
# Share of the samples from the first to the last common one that must be common. A copy has all of them in one of the
# two runs, also if it was cut or thinned out. Coast-downs in whole km/h at whole seconds agree in 30 to 60 % here and
# there over the whole run.
WITHOUT_GAPS = 0.9

# Odd numbers without a pattern: those of the mixing step of splitmix64 (Steele et al., OOPSLA 2014).
_MIX = tuple(np.uint64(n) for n in (0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB))


def repeated_runs(logs: Sequence[Log], places: Sequence[str]) -> Iterator[Finding]:
    """A finding for each run that contains samples of an earlier one.

    Two samples are the same if the time and all channels common to all logs are equal to the last bit. A copy with a
    shifted clock is found if all its samples, in order, are those of another run, and in the same file by its sequences
    of ``FEWEST_COMMON`` samples (runs of different files may be computed). The steps of time must agree, too: tables of
    split times have the same speeds in every run. Samples that repeat the previous one, as at rest, do not count.
    Independent recordings agree in single samples at most, because of noise; logs without noise, such as those of a
    simulation, agree if the runs are the same. The time is O(n log n) in the samples.

    Parameters
    ----------
    logs : of the runs, cut to their windows. places : of the runs in the description.
    """
    names = sorted(set.intersection(*(set(log.channels) for log in logs))) if len(logs) > 1 else []
    if not names:
        return
    codes = [_codes(log, names) for log in logs]
    paced = [_mixed(code, _steps(log.time)) for log, code in zip(logs, codes, strict=True)]
    firsts = _first_of_same_values(codes, [log.time for log in logs])
    shares = _common_codes([_mixed(code, log.time)[_moving(code)] for log, code in zip(logs, codes, strict=True)])
    repeats = _common_codes([_sequences(one[_moving(code)][1:]) for code, one in zip(codes, paced, strict=True)])
    shares |= {k: one for k, one in repeats.items() if k not in shares and _file(logs[k]) == _file(logs[one[0]])}
    for k, log in enumerate(logs):
        if k not in firsts and k not in shares:
            continue
        other, share = (firsts[k], 1.0) if k in firsts else shares[k]
        what = "has the same samples as" if share == 1.0 else f"has {100 * share:.0f} % of its samples in common with"
        remedy = "list each recording once: a copy is not independent data"
        yield Finding(places[k], f"{log.name} {what} {logs[other].name}", f"first at {places[other]}", remedy)


def _mixed(code: Codes, values: NDArray[np.float64]) -> Codes:
    """The codes with one more channel; adding zero makes -0 equal to 0."""
    code = (code ^ (values + 0.0).view(np.uint64)) * _MIX[0]
    code ^= code >> np.uint64(31)
    code = code * _MIX[1]
    return np.asarray(code ^ (code >> np.uint64(29)))


def _codes(log: Log, names: Sequence[str]) -> Codes:
    """A hash of each sample, equal for equal values."""
    code = np.zeros(log.time.size, dtype=np.uint64)
    for name in names:
        code = _mixed(code, log[name])
    return code


def _steps(time: Array) -> Array:
    """The steps of a clock in units of ``STEP``; the first is zero. A shift changes a step by rounding errors only."""
    # A sampling step in whole milliseconds is never at a boundary between two units.
    return np.floor((np.diff(time, prepend=time[:1]) + 0.0037) / STEP)


def _moving(code: Codes) -> Mask:
    """Whether each sample differs from the previous one."""
    return np.concatenate([[True], code[1:] != code[:-1]]) if code.size else np.zeros(0, dtype=bool)


def _first_of_same_values(codes: Sequence[Codes], times: Sequence[Array]) -> dict[int, int]:
    """The earlier run with the same samples in the same order, its clock shifted, for each run that has one."""
    seen: dict[tuple[int, int, int], list[int]] = {}
    found = {}
    for k, code in enumerate(codes):
        order = np.arange(1, code.size + 1, dtype=np.uint64) * _MIX[2]
        key = (code.size, int(np.bitwise_xor.reduce(code * order)), int(np.add.reduce(code * order)))
        if np.count_nonzero(_moving(code)) >= FEWEST_COMMON:
            alike = seen.setdefault(key, [])
            first = next((j for j in alike if np.ptp(times[j] - times[k]) < STEP), None)
            if first is None:
                alike.append(k)
            else:
                found[k] = first
    return found


def _file(log: Log) -> str:
    """The file of a run, whose name may end with its times in brackets."""
    return log.name.partition(" (")[0]


def _sequences(code: Codes) -> Codes:
    """A hash of each sequence of ``FEWEST_COMMON`` successive samples, without their times."""
    count = max(code.size - FEWEST_COMMON + 1, 0)
    found = np.zeros(count, dtype=np.uint64)
    for k in range(FEWEST_COMMON):
        found = (found ^ code[k : k + count]) * _MIX[1]
        found ^= found >> np.uint64(29)
    return found


def _common_codes(codes: Sequence[Codes]) -> dict[int, tuple[int, float]]:
    """The earlier run that has a large share of the same codes, and the share, for each run that has one."""
    # Of each run the same subset of codes is kept: those that are divisible.
    keep = np.uint64(max(1, -(-sum(code.size for code in codes) // MOST_COMPARED)))
    every = [np.unique(code[code % keep == 0]) for code in codes]
    run = np.repeat(np.arange(len(codes)), [code.size for code in every])
    code = np.concatenate(every)
    order = np.lexsort((run, code))
    code, run = code[order], run[order]
    # A code in three runs counts for the first and second, and for the second and third, which suffices.
    same = np.flatnonzero(code[1:] == code[:-1])
    pairs, counts = np.unique(run[same] * len(codes) + run[same + 1], return_counts=True)
    found: dict[int, tuple[int, float]] = {}
    for pair, count in zip(pairs.tolist(), counts.tolist(), strict=True):
        first, second = divmod(pair, len(codes))
        share = count / max(min(every[first].size, every[second].size), 1)
        if count < FEWEST_COMMON or share < COMMON or share <= found.get(second, (0, 0.0))[1]:
            continue
        if _without_gaps(codes[first], codes[second]):
            found[second] = (first, share)
    return found


def _without_gaps(one: Codes, other: Codes) -> bool:
    """Whether the common samples of two runs are nearly all of a segment of at least one of them."""
    for own, others in ((one, other), (other, one)):
        common = np.isin(own, others)
        places = np.flatnonzero(common)
        if places.size and np.mean(common[places[0] : places[-1] + 1]) >= WITHOUT_GAPS:
            return True
    return False
