"""Findings, the messages to the user, and the two errors that end a command."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

LONGEST_NAME = 100  # characters of names that are compared for a misspelling; headers of loggers have up to some 60
MOST_COMPARED = 2000  # names that are compared, in about 0.1 s
BEFORE_REMEDY = "\n    -> "  # between the fact and the remedy of a printed finding
MERGED = 4  # smallest number of similar errors that a terminal shows as one
MOST_LOGS = 3  # logs that one message names; of the others it states the number
_NUMBER = re.compile(r"(?<![\w.:/-])([+-]?\d+(?:[.,]\d+)?(?:e[+-]?\d+)?)(?![\w:/]|[.,]\d)")
_DIGITS = re.compile(r"\d+")  # within names, such as those of files

# Control characters, line ends, marks of writing direction, and lone surrogates.
_CONTROL = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


def visible(text: str, but: str = "") -> str:
    """The text with control characters escaped, so that a name from a file cannot control the terminal.

    Parameters
    ----------
    but : characters that are not escaped.
    """
    return _CONTROL.sub(lambda m: m[0] if m[0] in but else m[0].encode("unicode_escape").decode(), text)


@dataclass(frozen=True)
class Finding:
    """One message to the user: place, fact, offending value, remedy.

    Parameters
    ----------
    where : file with line (``coast.yaml:12``), or file with channel (``run1.csv, column 'Speed'``).
    what : a sentence fragment that states the fact.
    got : the offending text or value, or empty.
    remedy : what the user can do; empty if nothing.
    minor : a note, not a reason to doubt the result.
    fault : a sensor failed, so that the diagnosis must not name another cause; also a doubt.
    doubt : a reason to doubt the result; reported first.
    """

    where: str
    what: str
    got: str = ""
    remedy: str = ""
    minor: bool = False
    fault: bool = False
    doubt: bool = False

    @property
    def reason(self) -> str:
        """Place and fact, for a sentence; the fact alone where the place is the fit."""
        return self.what if self.where == "fit" else f"{self.where}: {self.what}"

    def __str__(self) -> str:
        text = f"{visible(self.where)}: {visible(self.what)}"
        if self.got:
            text += f" (got {visible(self.got)})"
        if self.remedy:
            text += f"{BEFORE_REMEDY}{visible(self.remedy)}"
        return text

    def renamed(self, file: str, name: str) -> Finding:
        """The same message on ``file`` with another name for it, such as one with its folder."""
        return replace(self, where=name + self.where.removeprefix(file)) if self.where.startswith(file) else self

    def to_json(self) -> dict[str, Any]:
        """The fields of a message; findings with further values are written like any other."""
        return {f.name: getattr(self, f.name) for f in fields(Finding)}


class ImplausibleValue(Finding):
    """A warning on the value of the parameter ``where``, which no vehicle of the usual kinds has."""


class VdynError(Exception):
    """A problem of the input or the result, with all its findings."""

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
    """The input is valid but the result is not good: exit code 1."""

    exit_code: ClassVar[int] = 1


def raise_all(findings: Iterable[Finding], error: type[VdynError] = InputError) -> None:
    """Raise one error with all findings, or return when there are none."""
    found = tuple(findings)
    if found:
        raise error(*found)


def attempt(problems: list[Finding], call: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R | None:
    """The value of ``call(*args, **kwargs)``; None after an InputError, whose findings are added to ``problems``."""
    try:
        return call(*args, **kwargs)
    except InputError as error:
        problems.extend(f for f in error.findings if f not in problems)
        return None


def close_names(name: str, known: Iterable[str]) -> list[str]:
    """Up to three of the known names with a similar spelling.

    The time grows with the product of two lengths, so names of more than 100 characters are left out, and only the
    first 2000 names are compared.
    """
    from difflib import get_close_matches
    from itertools import islice

    short = islice((k for k in known if len(k) <= LONGEST_NAME), MOST_COMPARED)
    return get_close_matches(name, list(short), 3, 0.6) if len(name) <= LONGEST_NAME else []


def did_you_mean(name: str, known: Iterable[str], otherwise: str) -> str:
    """The remedy for a misspelled name: up to three similar names, ignoring case; ``otherwise`` if there are none."""
    plain = {k.lower(): k for k in reversed(tuple(known))}
    near = [plain[k] for k in close_names(name.lower(), plain)]
    return f"did you mean {' or '.join(near)}?" if near else otherwise


def merge_lines(findings: Sequence[Finding], least: int) -> tuple[Finding, ...]:
    """Merge findings of a file that differ only in line and in list index: one finding with all lines.

    Parameters
    ----------
    findings : with ``file:line`` as ``where``. least : smallest number of similar findings that are merged.
    """
    groups: dict[tuple[str, str, str, str], list[Finding]] = {}
    for found in findings:
        file, _, line = found.where.rpartition(":")
        place = file if line.isdigit() else found.where
        groups.setdefault((place, re.sub(r"\.\d+\.", ".#.", found.what), found.got, found.remedy), []).append(found)
    merged: list[Finding] = []
    for same in groups.values():
        if len(same) < least or not same[0].where.rpartition(":")[2].isdigit():
            merged += same
            continue
        lines = ", ".join(f.where.rpartition(":")[2] for f in same)
        merged.append(replace(same[0], where=f"{same[0].where.rpartition(':')[0]}:{lines}"))
    return tuple(merged)


def merge_similar(findings: Sequence[Finding], least: int = 2) -> tuple[Finding, ...]:
    """Merge findings of several logs that differ only in numbers: one finding with the range of each number.

    ``a.csv and 7 more`` states what is in all logs; ``a.csv, similarly 7 more`` what is in the first one, where other
    numbers than those with a range differ, such as those of names and of remedies.

    Parameters
    ----------
    findings : in the order in which they are reported.
    least : smallest number of similar findings that are merged.
    """
    groups: dict[tuple[str | bool, ...], list[Finding]] = {}
    for found in dict.fromkeys(findings):
        place = found.where.partition(", ")[2]
        texts = (_DIGITS.sub("#", _NUMBER.sub("\0", text)) for text in (found.what, found.remedy))
        line = found.remedy if re.search(r":\d+$", found.where) else ""  # a remedy for one line of a description
        groups.setdefault((place, *texts, line, found.minor, found.doubt), []).append(found)
    merged: list[Finding] = []
    for same in groups.values():
        first = same[0]
        if len(same) < least:
            merged += same
            continue
        if len(same) > 1:
            log, _, place = first.where.partition(", ")
            what, whole = _with_ranges([f.what for f in same])
            others = " and" if whole and len({(f.remedy, f.got) for f in same}) == 1 else ", similarly"
            where = f"{log}{others} {len(same) - 1} more" + (f", {place}" if place else "")
            first = replace(first, where=where, what=what)
        merged.append(first)
    return tuple(merged)


def _with_ranges(texts: Sequence[str]) -> tuple[str, bool]:
    """The first of several texts with the range of each number that differs, and whether it then states all of them.

    A text with a range of its own, such as ``12 s to 15 s``, is the first one, unchanged.
    """
    first, *others = (_NUMBER.split(text) for text in texts)
    shown = [sorted(set(each), key=_value) for each in zip(*(one[1::2] for one in (first, *others)), strict=True)]
    if any(re.search(r"\bto $", between) for between in first[2::2][:-1]) and any(len(each) > 1 for each in shown):
        return texts[0], False
    first[1::2] = [each[0] if len(each) == 1 else f"{each[0]} to {each[-1]}" for each in shown]
    return "".join(first), all(one[::2] == first[::2] for one in others)


def _value(number: str) -> float:
    return float(number.replace(",", "."))


def merge_alike(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Findings merged for a terminal: those of single lines only if equal, those of whole logs also if numbers differ.

    Parameters
    ----------
    findings : in the order in which they are reported; from ``MERGED`` similar ones on, they are merged.
    """
    lines = [f for f in findings if re.search(r":\d+$", f.where)]
    return (*merge_lines(lines, MERGED), *merge_similar([f for f in findings if f not in lines], MERGED))


def in_file_order(findings: Sequence[Finding], file: str) -> tuple[Finding, ...]:
    """The findings, those with a line of the file (``coast.yaml:12``) first and by line."""

    def line(found: Finding) -> float:
        place, _, number = found.where.rpartition(":")
        return float(number) if place == file and number.isdecimal() else float("inf")

    return tuple(sorted(findings, key=line))


def merge_logs(findings: Sequence[Finding], logs: Sequence[str]) -> tuple[Finding, ...]:
    """Merge findings that differ only in the name of a log: one finding with the first logs and the number of others.

    Parameters
    ----------
    findings : in the order in which they are reported; a finding about a log has its name in ``what``.
    logs : names of the logs.
    """
    named = re.compile("|".join(rf"(?<!\S){re.escape(n)}(?![^\s,:])" for n in sorted(logs, key=len, reverse=True)))
    groups: dict[Finding, list[str]] = {}
    for found in findings:
        log = named.search(found.what) if logs else None
        hole = found if log is None else replace(found, what=f"{found.what[: log.start()]}\0{found.what[log.end() :]}")
        names = groups.setdefault(hole, [])
        names += [log[0]] if log is not None and log[0] not in names else []
    return tuple(replace(hole, what=hole.what.replace("\0", _some(names))) for hole, names in groups.items())


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - MOST_LOGS} more logs" if len(names) > MOST_LOGS + 1 else ""
    return ", ".join(names[:MOST_LOGS] if more else names) + more
