"""What goes wrong and what to do about it: findings, and the two errors that end a command."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar


@dataclass(frozen=True)
class Finding:
    """One thing worth telling the user: where it is, what it is, what was found there, how to mend it.

    Parameters
    ----------
    where : file with line (``coast.yaml:12``), or file with channel (``run1.csv, column 'Speed'``).
    what : one sentence fragment naming the problem.
    got : the offending text or value, empty when there is none to show.
    remedy : what the user can do, empty when nothing can be done.
    minor : worth knowing, but no reason to doubt the result.
    fault : a sensor did not measure, so that nothing should be concluded from what looks odd beside it; also a doubt.
    doubt : a reason to doubt the result, told before anything else.
    """

    where: str
    what: str
    got: str = ""
    remedy: str = ""
    minor: bool = False
    fault: bool = False
    doubt: bool = False

    def __str__(self) -> str:
        text = f"{self.where}: {self.what}"
        if self.got:
            text += f" (got {self.got})"
        if self.remedy:
            text += f"\n    -> {self.remedy}"
        return text


class VdynError(Exception):
    """A problem of the user's input or result; carries every finding, never just the first."""

    exit_code: ClassVar[int] = 70

    def __init__(self, *findings: Finding) -> None:
        super().__init__(*findings)
        self.findings: tuple[Finding, ...] = findings

    def __str__(self) -> str:
        return "\n".join(str(f) for f in self.findings)


class InputError(VdynError):
    """The input is wrong: exit code 2."""

    exit_code: ClassVar[int] = 2


class ResultError(VdynError):
    """The input is well-formed but the answer is not good: exit code 1."""

    exit_code: ClassVar[int] = 1


def raise_all(findings: Iterable[Finding], error: type[VdynError] = InputError) -> None:
    """Raise one error with all findings, or return when there are none."""
    found = tuple(findings)
    if found:
        raise error(*found)


def did_you_mean(name: str, known: Iterable[str], otherwise: str = "") -> str:
    """The closest of the known names, whatever their case, as a remedy; ``otherwise`` where none is close."""
    from difflib import get_close_matches

    plain = {k.lower(): k for k in reversed(tuple(known))}
    near = [plain[k] for k in get_close_matches(name.lower(), plain, 3, 0.6)]
    return f"did you mean {' or '.join(near)}?" if near else otherwise


def alike(findings: Sequence[Finding], least: int = 2) -> tuple[Finding, ...]:
    """Findings that say the same of several logs, but for numbers, told once: of the first, and how many more.

    ``least`` : so many are told as one.
    """
    groups: dict[tuple[str, str, str], list[Finding]] = {}
    for found in findings:
        place = found.where.partition(", ")[2]
        groups.setdefault((place, re.sub(r"\d+(?:[.,]\d+)?", "#", found.what), found.remedy), []).append(found)
    told = []
    for (place, _, _), same in groups.items():
        first = same[0]
        if len(same) < least:
            told += same
            continue
        if len(same) > 1:
            log = first.where.partition(", ")[0]
            where = f"{log} and {len(same) - 1} more" + (f", {place}" if place else "")
            first = replace(first, where=where)
        told.append(first)
    return tuple(told)
