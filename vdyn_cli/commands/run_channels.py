"""``vdyn channels``: the channels of a log, as a table for a terminal or as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path

from vdyn_cli.io.channel_survey import ChannelFacts, survey, without_clock
from vdyn_cli.io.csv.vbox_coastdown_table import HEAD
from vdyn_cli.io.file_units import words_and_unit
from vdyn_cli.io.files import distinct_names
from vdyn_cli.io.reader import clock_units
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.number_text import capitalized, decimals
from vdyn_cli.quantities.result_schema import ChannelEntry, ChannelsDocument

_LONGEST_NAME = 42  # characters of a name in the table; longer ones are shortened in the middle
_BUS_FRAMES = ("CAN_DataFrame", "LIN_Frame", "FLX_Frame", "ETH_Frame")  # names in the MDF 4 bus logging standard
_TOGETHER = 3  # number of channels constant at the same time from which the logger itself seems to have stopped
_LIKE_RATE = 0.05  # relative difference of clock rates that is normal between runs of one logger
_MOST_NAMED = 6  # missing or additional columns to name; of the others the number is stated
_ALIKE = 0.5  # share of the channels of a log from which their differences to those of another one are shown
_MOST_SPANS = 20  # recordings of a file that are listed
_SAME_TIME = 0.25  # s, largest difference of start and end of constant segments that count as simultaneous


def channels_table(*paths: Path) -> tuple[str, tuple[Finding, ...]]:
    """The channels of the first log, one line each, remarks, and how further logs differ from the most similar one.

    A log with other channels, such as that of another logger, has a table of its own.

    Returns
    -------
    The text on the logs that can be read, and the findings on the others.
    """
    found: list[tuple[str, tuple[ChannelFacts, ...]]] = []
    problems: list[Finding] = []
    for path, name in distinct_names(paths).items():
        try:
            found.append((name, survey(path)))
        except InputError as error:
            problems += [f.renamed(path.name or name, name) for f in error.findings]
    text = _table(*found[0]) if found else ""
    for k, (other, facts) in enumerate(found[1:], 1):
        like, share, _ = max(
            ((one, _shared(one[1], facts), _shared(facts, one[1])) for one in found[:k]), key=_by_share
        )
        if share < _ALIKE:
            text += "\n\n" + _table(other, facts)
        else:
            text += "\n" + "\n".join([*_summary(other, facts), *_differences(*like, facts)])
    return text, tuple(problems)


def _by_share(pair: tuple[object, float, float]) -> tuple[float, float]:
    return pair[1:]


def _shared(facts: Sequence[ChannelFacts], found: Sequence[ChannelFacts]) -> float:
    """The share of the varying channels of a log (``found``) whose names another log has; 1 if none varies."""
    own = {f.column for f in found if f.state == "varies"}
    return len(own & {f.column for f in facts}) / len(own) if own else 1.0


def _differences(name: str, facts: Sequence[ChannelFacts], found: Sequence[ChannelFacts]) -> list[str]:
    """A line on the differences between the channels of a log and those of the first one, matched by name."""
    first = {(f.info.group, f.column): f for f in facts}
    own = {(f.info.group, f.column): f for f in found}
    differs = [_absent("lacks", [n for _, n in first.keys() - own.keys()], [f.column for f in facts])]
    differs += [_absent("adds", [n for _, n in own.keys() - first.keys()], [f.column for f in found])]
    for key in (k for k in first if k in own):
        a, b = first[key], own[key]
        if a.info.unit != b.info.unit:
            differs.append(f"'{b.column}' in {b.info.unit or 'no stated unit'} instead of {a.info.unit or 'none'}")
        if a.state != b.state:
            differs.append(f"'{b.column}': {b.state} instead of {a.state}")
        differs += [f"'{b.column}': {note}" for note in (*_gap_notes(b), *([] if a.rest else _rest_notes(b)))]
    rates = [next((_running_rate(f) for f in some if f.state == "clock"), math.nan) for some in (facts, found)]
    if abs(rates[1] - rates[0]) > _LIKE_RATE * abs(rates[0]):
        differs.append(f"clock of {rates[1]:.4g} Hz instead of {rates[0]:.4g} Hz")
    said = "; ".join(text for text in differs if text)
    return [f"    against {name}: {said or 'the same columns and units'}"]


def _running_rate(clock: ChannelFacts) -> float:
    """The rate of a clock without its gap, Hz; NaN with several gaps, of which only the longest is known."""
    if clock.gaps is None:
        return clock.info.rate
    count, start, stop = clock.gaps
    running = clock.info.span[1] - clock.info.span[0] - (stop - start)
    return (clock.samples - 2) / running if count == 1 and running > 0 else math.nan


def _absent(verb: str, names: Sequence[str], order: Sequence[str]) -> str:
    """The missing or additional columns of a log, in the order of the file."""
    shown = [f"'{n}'" for n in order if n in names]
    more = f" and {len(shown) - _MOST_NAMED} more" if len(shown) > _MOST_NAMED else ""
    return f"{verb} " + ", ".join(shown[:_MOST_NAMED]) + more if shown else ""


def _table(name: str, facts: Sequence[ChannelFacts]) -> str:
    grouped = any(f.info.group for f in facts)
    header = ["channel", *(["group"] if grouped else []), "unit", "rate", "from", "to", "lowest", "highest", "note"]
    rows = [_row(f, grouped) for f in facts]
    widths = [max(len(row[i]) for row in (header, *rows)) for i in range(len(header))]
    right = {header.index(name) for name in ("rate", "from", "to", "lowest", "highest")}
    lines = [
        "  ".join(
            cell.rjust(w) if i in right else cell.ljust(w) for i, (cell, w) in enumerate(zip(r, widths, strict=True))
        )
        for r in (header, *rows)
    ]
    return "\n".join([*(line.rstrip() for line in lines), *_summary(name, facts)])


def channels_json(*paths: Path) -> str:
    """The channels as JSON, a list for several logs; the schema of each is ``vdyn schema channels``.

    Raises
    ------
    InputError : a file cannot be read.
    """
    documents = [
        ChannelsDocument(format="vdyn/channels/1", log=name, channels=[_entry(f) for f in survey(path)]).model_dump()
        for path, name in distinct_names(paths).items()
    ]
    return json.dumps(documents[0] if len(documents) == 1 else documents, indent=2, ensure_ascii=False) + "\n"


def _entry(facts: ChannelFacts) -> ChannelEntry:
    info = facts.info
    return ChannelEntry(
        column=facts.column,
        group=info.group,
        source=info.source,
        unit=_unit(facts)[0],
        rate=_known(info.rate),
        span=None if math.isnan(info.span[0]) else info.span,
        state=facts.state,
        samples=facts.samples,
        lowest=_known(facts.lowest),
        highest=_known(facts.highest),
        rest=facts.rest,
        same_as=facts.same_as,
        repeated=facts.repeated,
        gaps=facts.gaps,
        stalls=list(facts.stalls),
        recordings=list(info.recordings),
    )


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value


def _row(facts: ChannelFacts, grouped: bool) -> list[str]:
    info = facts.info
    name = facts.column if len(facts.column) <= _LONGEST_NAME else f"{facts.column[:25]}...{facts.column[-14:]}"
    rate = "" if math.isnan(info.rate) else f"{info.rate:.4g} Hz"
    span = ["", ""] if math.isnan(info.span[0]) else [_seconds(t, info.span[1] - info.span[0]) for t in info.span]
    limits = [_number(facts.lowest), _number(facts.highest)]
    return [name, *([info.group] if grouped else []), _unit(facts)[0], rate, *span, *limits, "; ".join(_notes(facts))]


def _unit(facts: ChannelFacts) -> tuple[str, str]:
    """The unit of a channel, and its source if that is the end of its name, such as ``vGPS_mph``."""
    if facts.info.unit or facts.state in ("clock", "text"):
        return facts.info.unit, ""
    unit = words_and_unit(facts.column)[1]
    return (unit, "the end of its name") if len(unit) > 1 else ("", "")  # _m and _s may mean something else


def _seconds(time: float, length: float) -> str:
    """A time, s, rounded to about a thousandth of a log's length."""
    return f"{time:.{decimals(max(length, 1e-6) / 100.0, 6)}f} s"


def _number(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.5g}"


def _notes(facts: ChannelFacts) -> list[str]:
    notes: list[str] = []
    if facts.state != "varies":
        notes.append(facts.state)
    if (by := _unit(facts)[1]) and facts.state != "clock":
        notes.append(f"unit by {by}")
    if facts.state == "clock" and (not facts.info.unit or facts.info.unit_from != "file"):
        notes.append(_clock_unit(facts))
    if facts.info.late:
        notes.append(
            f"{facts.info.late} rows have a time that steps back: leave them out with 'reading: {{clock: drop}}'"
        )
    if facts.sharing:
        notes.append(f"too few digits: {facts.sharing} rows share the time of the one before")
    notes += _gap_notes(facts)
    if facts.repeated > 1 and facts.state != "clock":
        notes.append(f"one of {facts.repeated} of this name" + (f", from '{s}'" if (s := facts.info.source) else ""))
    if facts.mark:
        notes.append(f"{facts.mark[0]} samples of {facts.mark[1]:.10g} count as missing")
    if facts.same_as:
        notes.append(f"same samples as '{facts.same_as}'")
    return notes + _rest_notes(facts)


def _gap_notes(facts: ChannelFacts) -> list[str]:
    if not facts.gaps:
        return []
    count, start, stop = facts.gaps
    longest = f"from {_seconds(start, stop - start)} to {_seconds(stop, stop - start)}"
    return [f"gap {longest}" if count == 1 else f"{count} gaps, the longest {longest}"]


def _rest_notes(facts: ChannelFacts) -> list[str]:
    if not facts.rest:
        return []
    start, stop, value = facts.rest
    length = facts.info.span[1] - facts.info.span[0]
    share = (stop - start) / length if length > 0 else 0.0
    return [f"constant at {value:.5g} from {_seconds(start, length)} to {_seconds(stop, length)} ({100 * share:.0f} %)"]


def _clock_unit(facts: ChannelFacts) -> str:
    """A note on the source of a clock's unit that the file does not state; the table assumes s for an unknown one."""
    if facts.info.unit:
        return f"unit by its {facts.info.unit_from}"
    units = clock_units(facts.info.rate, facts.lowest)
    return f"no unit: {' or '.join(units) or 'none known'} by its rate; rates and times of this table assume s"


def _is_report(facts: Sequence[ChannelFacts]) -> bool:
    """Whether the columns are those of a coast-down report (``io/csv/vbox_coastdown_table.py``)."""
    return {f.column for f in facts} >= set(HEAD)


def _recordings(clock: ChannelFacts) -> list[str]:
    """The recordings of a file whose clock restarts, and how a description selects them; none for other channels."""
    spans = clock.info.recordings
    if not spans:
        return []
    shown = [f"{k + 1}: {_seconds(a, b - a)} to {_seconds(b, b - a)}" for k, (a, b) in enumerate(spans[:_MOST_SPANS])]
    more = f", and {len(spans) - _MOST_SPANS} more" if len(spans) > _MOST_SPANS else ""
    return [
        f"'{clock.column}' restarts: the file has {len(spans)} recordings ({', '.join(shown)}{more}).",
        "    -> the table is that of the first; list the log once for each, with 'recording: 1', 'recording: 2', ...",
    ]


def _summary(log: str, facts: Sequence[ChannelFacts]) -> list[str]:
    lines = [""]
    count = {state: sum(f.state == state for f in facts) for state in ("constant", "empty", "text")}
    stated = ", ".join(f"{n} {state}" for state, n in count.items() if n)
    clocks = sum(f.state == "clock" for f in facts)
    lines.append(f"{log}: {len(facts)} channels" + (f", {stated}" if stated else ""))
    if _is_report(facts):
        lines.append(f"A report of coast-downs, one row per run: 'vdyn init coastdown {log}' describes its runs.")
    elif not clocks:
        what, remedy = without_clock(facts)
        lines += [f"{capitalized(what)}: this is not a log, or its time is damaged.", f"    -> {remedy}"]
    elif clocks > 1:
        lines.append(f"{clocks} clocks: a step resamples channels of different clocks to one clock.")
    for one in facts:
        lines += _recordings(one)
    if any(f.column.startswith(_BUS_FRAMES) for f in facts):
        lines.append("Raw bus frames without channels: decode them with the bus's DBC or ARXML file first.")
    rests = _common_rests(facts)
    for one in facts:
        stalls = [s for s in one.stalls if not any(a <= s[1] and s[0] <= b for a, b, _ in rests)]
        if stalls:
            start, stop = max(stalls, key=lambda s: s[1] - s[0])
            more = f", and in {len(stalls) - 1} more segments" if len(stalls) > 1 else ""
            lines.append(f"All channels repeat their values from {start:.1f} s to {stop:.1f} s, then jump{more}.")
            lines.append("    -> the logger seems to have stopped: 'vdyn check' lists what is cut")
    for start, stop, names in rests:
        shown = ", ".join(f"'{n}'" for n in names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
        lines.append(f"{len(names)} channels are constant together from {start:.1f} s to {stop:.1f} s: {shown}.")
        lines.append("    -> if the vehicle was moving, cut this part with from_time or to_time")
    return lines


def _common_rests(facts: Sequence[ChannelFacts]) -> list[tuple[float, float, list[str]]]:
    """Segments (start, stop, channels) in which several channels are constant together, at values other than zero."""
    found: list[tuple[float, float, list[str]]] = []
    for one in facts:
        if one.rest is None or one.rest[2] == 0.0:
            continue  # channels of a parked car are constant at zero
        start, stop, _ = one.rest
        for i, (first, last, names) in enumerate(found):
            if abs(first - start) <= _SAME_TIME and abs(last - stop) <= _SAME_TIME:
                found[i] = (first, last, [*names, one.column])
                break
        else:
            found.append((start, stop, [one.column]))
    return [rest for rest in found if len(rest[2]) >= _TOGETHER]
