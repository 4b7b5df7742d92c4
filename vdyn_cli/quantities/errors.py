"""Findings, the messages to the user, and the two errors that end a command."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar


@dataclass(frozen=True)
class Finding:
    """One message to the user: place, fact, what was found there, remedy.

    Parameters
    ----------
    where : file with line (``coast.yaml:12``), or file with channel (``run1.csv, column 'Speed'``).
    what : one sentence fragment that states the fact.
    got : the offending text or value; empty where there is none to show.
    remedy : what the user can do; empty where nothing can be done.
    minor : a note, no reason to doubt the result.
    fault : a sensor did not measure, so that the diagnosis must not name another cause; also a doubt.
    doubt : a reason to doubt the result; reported first.
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
    """A problem of the user's input or result, with all its findings."""

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
    """The remedy for a misspelled name: up to three close names, case ignored, or ``otherwise`` where none is close."""
    from difflib import get_close_matches

    plain = {k.lower(): k for k in reversed(tuple(known))}
    near = [plain[k] for k in get_close_matches(name.lower(), plain, 3, 0.6)]
    return f"did you mean {' or '.join(near)}?" if near else otherwise


def merge_similar(findings: Sequence[Finding], least: int = 2) -> tuple[Finding, ...]:
    """Merge findings of several logs that differ in numbers only: the first log's finding, and how many more logs.

    Parameters
    ----------
    findings : in the order in which they are reported.
    least : smallest number of similar findings that are merged.
    """
    groups: dict[tuple[str, str, str], list[Finding]] = {}
    for found in findings:
        place = found.where.partition(", ")[2]
        groups.setdefault((place, re.sub(r"\d+(?:[.,]\d+)?", "#", found.what), found.remedy), []).append(found)
    merged: list[Finding] = []
    for (place, _, _), same in groups.items():
        first = same[0]
        if len(same) < least:
            merged += same
            continue
        if len(same) > 1:
            log = first.where.partition(", ")[0]
            where = f"{log} and {len(same) - 1} more" + (f", {place}" if place else "")
            first = replace(first, where=where)
        merged.append(first)
    return tuple(merged)
