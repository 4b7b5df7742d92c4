"""Guess of the columns of an unknown log for the channels of a step, with reasons; undecided if several fit."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from vdyn_cli.io.channel_survey import ChannelFacts
from vdyn_cli.io.file_units import is_unit_of, remedy_for_unit, unit_text, words_and_unit
from vdyn_cli.io.reader import clock_units
from vdyn_cli.project.drafting.channel_names import (
    CORNERS,
    ELSEWHERE,
    NOT_DRIVEN,
    OF_ACCELERATION,
    OF_BATTERY,
    OF_TORQUE,
    RULES,
    SAME_WORD,
    STATES_UNIT,
    UNSPECIFIC,
    in_english,
)
from vdyn_cli.quantities.quantity import Quantity, UnitError, a_unit_of, to_si

Words = frozenset[str]
_Candidate = tuple[ChannelFacts, str, str]  # a column, its unit, and the source of the unit

NO_NAME = "no column has such a name"
NOT_DECIDED = "not decided between"
_FEWEST_OF_A_WHEEL = 3  # columns of one corner and none of another, from which the log is that of a wheel
_ROUNDED = 1e-3  # of the largest value: rounding of a column that a logger converted or interpolated
_SAME_MOTION = 0.05  # of the largest speed: greatest difference of its sensors; a worn tire is 3 % smaller
_SWINGS = 5.0  # ranges of a swing about its axis and others; a sensor 10 deg off its axis shows 5.7
_SATELLITE = frozenset(("gps", "gnss", "sat", "satellite"))
_DISPLAYED = frozenset(("indicated", "displayed", "display", "dash", "dashboard", "cluster", "speedometer"))

_FORWARD = frozenset(("speed", "vehicle_speed"))
_SINGLE = frozenset(("wheel_speed", "speed", "vehicle_speed", "position"))  # the position of a wheel is its angle


@dataclass(frozen=True)
class ChannelGuess:
    """The result of the search of a column for one channel.

    Parameters
    ----------
    facts : the column; None if no column or several columns fit.
    unit : unit of the column; ``?`` if the file does not state it.
    why : reason of the choice, or why there is none.
    sign : -1 if the file's values have the opposite sign of the channel's range.
    """

    facts: ChannelFacts | None
    unit: str
    why: str
    sign: int = 1

    @property
    def column(self) -> str:
        """The column's name in a description; empty if there is none."""
        return self.facts.column if self.facts is not None else ""


def without_unit(column: str) -> tuple[Words, str]:
    """The words of a column's name without its unit, and its number among equal names (empty if unique)."""
    return _words(column)[0] or frozenset((column,)), column.rpartition("#")[2] if re.search(r"#\d+$", column) else ""


def guess_channels(
    wanted: Mapping[str, Quantity],
    facts: Sequence[ChannelFacts],
    file_name: str,
    second_choice: Mapping[str, Words] | None = None,
) -> Mapping[str, ChannelGuess]:
    """The column of each channel of a step, from names, units and values; each column is used once.

    Parameters
    ----------
    wanted : the channels of the step.
    facts : the log's columns.
    file_name : its words are added to names that are unspecific alone, such as ``forward``.
    second_choice : for channels, words that exclude a column only where another one fits.
    """
    found: dict[str, ChannelGuess] = {}
    used: dict[int, str] = {}
    shared = _shared_corner(facts)
    for channel, quantity in wanted.items():
        guess = _time(facts) if channel == "time" else _guess(channel, quantity, facts, file_name)
        for ignored in (shared if channel != "position" else frozenset(), (second_choice or {}).get(channel)):
            if ignored and guess.why == NO_NAME:
                guess = _guess(channel, quantity, facts, file_name, ignored)
        if guess.facts is not None and id(guess.facts) in used:
            other = used[id(guess.facts)]
            guess = ChannelGuess(None, "", f"its only candidate '{guess.facts.column}' is used for '{other}'")
        elif guess.facts is not None:
            used[id(guess.facts)] = channel
        found[channel] = guess
    if "wheel_speed" in wanted and found["wheel_speed"].why == NO_NAME:
        found["wheel_speed"] = _of_one_wheel(wanted["wheel_speed"], [f for f in facts if id(f) not in used], file_name)
    return found


def _of_one_wheel(quantity: Quantity, facts: Sequence[ChannelFacts], file_name: str) -> ChannelGuess:
    """No choice, with the wheel speeds of single wheels as the reason; only the user knows which wheel was tested."""
    guess = _guess("wheel_speed", quantity, facts, file_name, ELSEWHERE)
    if guess.facts is None:
        return guess
    return ChannelGuess(None, "", f"{_label(guess.facts)} is that of one wheel: map it if that wheel was tested")


def _shared_corner(facts: Sequence[ChannelFacts]) -> Words:
    """The words of the only corner that columns name, as in a log of one wheel's sensor (RR_Fx, RR_My); else none."""
    named = [_words(f.column)[0] & CORNERS.keys() for f in facts]
    corners = frozenset().union(*named)
    if len(corners) != 1 or sum(map(bool, named)) < _FEWEST_OF_A_WHEEL:
        return frozenset()
    return corners | {word for corner in corners for word in CORNERS[corner]}


def columns_by_unit(quantity: Quantity, facts: Iterable[ChannelFacts]) -> list[str]:
    """The names of the columns whose stated unit and values fit a quantity, without those of a battery."""
    fitting: list[str] = []
    for one in facts:
        words, suffix = _words(one.column)
        if words & OF_BATTERY:
            continue
        unit, _ = _unit(one, quantity, suffix, "")
        if quantity.unit and unit not in ("", "?") and one.state == "varies" and not _unfit(one, quantity, unit):
            fitting.append(one.column)
    return fitting


def battery_columns(facts: Iterable[ChannelFacts]) -> tuple[str, str] | None:
    """The columns of a battery's voltage and current, whose product is its power; None without both."""
    own = [f for f in facts if f.state in ("varies", "constant") and _words(f.column)[0] & OF_BATTERY]
    voltage, current = (next((f.column for f in own if is_unit_of(f.info.unit, unit)), "") for unit in ("V", "A"))
    return (voltage, current) if voltage and current else None


def _time(facts: Sequence[ChannelFacts]) -> ChannelGuess:
    clocks = [f for f in facts if f.state == "clock"]
    if not clocks:
        return ChannelGuess(None, "", "no column increases like a clock")
    clock = clocks[0]
    several = f"; {len(clocks)} groups with separate clocks" if len(clocks) > 1 else ""
    if clock.sharing:
        several += "; several rows share each time: export it with more digits, or state 'reading: {rate: ...}' instead"
    if unit := clock.info.unit:
        how = f"unit from {'its name' if clock.info.unit_from == 'name' else 'the file'}"
        if clock.info.unit_from == "rate":
            how = f"only {unit} gives a usual rate, {clock.info.rate:.4g} Hz"
        return ChannelGuess(clock, unit, f"increases like a clock; {how}{several}")
    which = " or ".join(clock_units(clock.info.rate, clock.lowest)) or "none"
    return ChannelGuess(clock, "?", f"increases like a clock; the file states no unit, possible: {which}")


def _guess(
    channel: str, quantity: Quantity, facts: Sequence[ChannelFacts], file_name: str, ignored: Words = frozenset()
) -> ChannelGuess:
    """The column of a channel by the columns' names; if none has such a name, together with the file's name."""
    others: list[str] = []
    for name in ("", file_name.split(".")[0]):
        ranked = _ranked(channel, quantity, facts, (name, ignored), others)
        best = _distinct(ranked[min(ranked)], quantity) if ranked else []
        by = "name and file name" if name else "name"
        if len(best) == 1:
            return _decided(channel, best[0], facts, by)
        if channel == "angular_rate" and (axis := _axis_of_rotation(best)) is not None:
            return _decided(channel, axis, facts, f"{by}, the axis that turns most")
        if channel in _FORWARD and (better := _of_same_motion(best, quantity)) is not None:
            others_too = " and ".join(_label(f) for f, _, _ in best if f is not better[0])
            guess = _decided(channel, better, facts, by)
            return replace(
                guess, why=f"{guess.why}; {others_too} shows the same motion: map it if it is the better one"
            )
        if best:
            rivals = " and ".join(f"{_label(f)} ({_range(f, unit)})" for f, unit, _ in best[:4])
            return ChannelGuess(None, "", f"{NOT_DECIDED} {rivals}{_of_groups(channel, [f for f, _, _ in best])}")
    return ChannelGuess(None, "", "; ".join(dict.fromkeys(others)) or NO_NAME)


def _axis_of_rotation(best: Sequence[_Candidate]) -> _Candidate | None:
    """The axis of a gyroscope about which a wheel swings; None if several axes turn."""
    ranked = sorted(best, key=lambda one: one[0].lowest - one[0].highest)
    turns = [f.highest - f.lowest for f, _, _ in ranked]
    return ranked[0] if len(ranked) > 1 and turns[0] >= _SWINGS * turns[1] else None


def _of_same_motion(best: Sequence[_Candidate], quantity: Quantity) -> _Candidate | None:
    """Of speeds that show the same motion, the only one of known unit, in which the others are then compared; else the
    only one by satellite, which needs no wheel radius, or the only one that is not the dashboard's, which reads high.
    None if the speeds differ."""
    own = [one for one in best if one[1] != "?"]
    if len(own) == len(best):
        named = [(one, _words(one[0].column)[0]) for one in best]
        own = [one for one, words in named if words & _SATELLITE]
        own = own or [one for one, words in named if not words & _DISPLAYED]
    if len(own) != 1:
        return None
    units = [own[0][1] if unit == "?" else unit for _, unit, _ in best]
    columns = [(f.highest, *f.ends) for f, _, _ in best]
    shown = [[to_si(x, u, quantity.unit) for x in own_ends] for own_ends, u in zip(columns, units, strict=True)]
    apart = max(max(values) - min(values) for values in zip(*shown, strict=True))
    return own[0] if apart <= _SAME_MOTION * max(max(values) for values in shown) else None


def _of_groups(channel: str, best: Sequence[ChannelFacts]) -> str:
    """How a description names one of several channels of one name in different groups, which may be recordings."""
    paths = [f"{one.info.group}.{one.column}" for one in best if one.info.group]
    if len({one.column for one in best}) > 1 or len(set(paths)) < len(best):
        return ""
    key = f'columns: {{{channel}: "{paths[1]}"}}'
    return f"; write column: \"{paths[0]}\" for one; if the groups are recordings, add a run for each, with '{key}'"


def _ranked(
    channel: str,
    quantity: Quantity,
    facts: Sequence[ChannelFacts],
    context: tuple[str, Words],
    others: list[str],
) -> dict[int, list[_Candidate]]:
    """The columns that can be the channel, by the rank of their name.

    Parameters
    ----------
    context : name of the file if it counts, else empty; and words of the columns' names that do not count.
    others : to which columns of a fitting name are added that cannot be the channel, with the reason.
    """
    ways, never = RULES.get(channel, ((channel.replace("_", " "),), ""))
    file_name, ignored = context
    of_file = _words(file_name)[0] if file_name else frozenset[str]()
    ranked: dict[int, list[_Candidate]] = {}
    beside = frozenset().union(*(_words(one.column)[0] for one in facts))
    for one in facts:
        words, suffix = _words(one.column)
        # A rotational speed of the only wheel that a log names is that of this wheel.
        corner = channel == "wheel_speed" and words & ignored & CORNERS.keys()
        words = words - ignored | ({"wheel"} if corner else set())
        if one.state == "clock" or (of_file and words & {"time", "speed", "accel", "torque"}):
            continue
        rank = _rank(words | of_file, ways, frozenset(never.split()), channel)
        if rank is None or not words & set(ways[rank].split()):
            continue
        if one.state == "text":
            others.append(f"'{one.column}' holds text, no numbers")
            continue
        if len(words) == 1 and (of := sorted(UNSPECIFIC.get(ways[rank], frozenset[str]()) & beside)):
            others.append(f"'{one.column}' may be of another source, as the log has columns with '{of[0]}'")
            continue
        unit, how = _unit(one, quantity, suffix, file_name if of_file else "")
        if words == {"n"} and unit == "?":
            others.append(f"'{one.column}' may be a rotational speed, a number or a force: map it if it is the motor's")
            continue
        if why_not := _unfit(one, quantity, unit) if unit else how:
            others.append(f"'{one.column}' {why_not}")
        else:
            ranked.setdefault(rank, []).append((one, unit, how))
    return ranked


def _decided(channel: str, best: _Candidate, facts: Sequence[ChannelFacts], by: str) -> ChannelGuess:
    """The guess for the one column that fits, with its sign; none if another axis of its sensor moves more."""
    one, unit, how = best
    if (across := _axis_that_varies_more(one, facts)) is not None:
        why = f"{NOT_DECIDED} {_label(one)} (by its name) and {_label(across)} (varies more)"
        return ChannelGuess(None, "", why)
    why = f"by its {by}; {how}; {_range(one, unit)}"
    if channel.endswith(("_load", "force_z")) and one.highest <= 0.0:
        return ChannelGuess(one, unit, f"{why}: loads are positive in vdyn", sign=-1)
    if channel in _FORWARD and one.lowest < -abs(one.highest):
        return ChannelGuess(one, unit, f"{why}: speeds are positive in vdyn", sign=-1)
    return ChannelGuess(one, unit, why)


def _axis_that_varies_more(one: ChannelFacts, facts: Sequence[ChannelFacts]) -> ChannelFacts | None:
    """The y axis of the same accelerometer if it varies more than the x axis, as for a phone in any orientation."""
    words, _ = _words(one.column)
    for x, y in (("x", "y"), ("ax", "ay")):
        if x in words and words & {"accel", "ax", "force"}:
            across = [f for f in facts if f.state == "varies" and _words(f.column)[0] == words - {x} | {y}]
            return next((f for f in across if f.highest - f.lowest > one.highest - one.lowest), None)
    return None


def _words(name: str) -> tuple[Words, str]:
    """The words of a name in the spelling of the rules, and the unit stated by its last word.

    A name that is only a unit of speed, such as Km/h, names the speed.
    """
    if is_unit_of(name, "m/s"):
        return frozenset(("speed",)), unit_text(name)
    lower, suffix = words_and_unit(in_english(name))
    if suffix == "rpm":
        lower = (*lower, "n")  # WHEEL_RPM states the quantity, too
    words = {SAME_WORD.get(w, w) for w in lower}
    if "g" in words and (words & OF_ACCELERATION or {"a", "x"} <= words):
        suffix = suffix or "g"
    if lower[:1] == ("m",) and words & OF_TORQUE:
        words.add("torque")
    if words == {"s"}:
        words = {"position"}
    for corner, (end, side) in CORNERS.items():
        if {end, side} <= words:
            words.add(corner)
        elif corner in words:
            words |= {end, side}
    return frozenset(words), suffix


def _rank(words: Words, ways: Sequence[str], never: Words, channel: str) -> int | None:
    elsewhere = channel in _SINGLE and words & ELSEWHERE and "axle" not in words
    if words & (never | NOT_DRIVEN) or elsewhere:
        return None
    return next((rank for rank, way in enumerate(ways) if set(way.split()) <= words), None)


def _unit(one: ChannelFacts, quantity: Quantity, suffix: str, file_name: str) -> tuple[str, str]:
    """The unit of a column and its source; an empty unit and the reason if it has another dimension."""
    if one.info.unit:
        unit, how = one.info.unit, "unit from the file"
    elif STATES_UNIT.get(quantity.unit, frozenset("?")) <= _words(one.column)[0]:
        unit, how = quantity.unit, "unit of every message of this name"
    elif suffix:
        unit, how = suffix, "unit from the end of its name"
    elif file_name and (stated := _words(file_name.split(".")[0])[1]):
        unit, how = stated, "unit from the file's name"
    elif not quantity.unit:
        return "?", "the file states no unit: '' for a plain number, or %"
    else:
        return "?", f"the file states no unit (vdyn computes in {quantity.unit})"
    try:
        to_si(1.0, unit, quantity.unit)
    except UnitError:
        remedy = remedy_for_unit(unit, quantity.unit)
        return "", f"is in {unit}, which is not {a_unit_of(quantity.unit)}" + (f": {remedy}" if remedy else "")
    return unit, how


def _unfit(one: ChannelFacts, quantity: Quantity, unit: str) -> str:
    """Why the samples cannot be those of this channel; empty if they can."""
    if one.state == "empty":
        return "is empty"
    if one.state == "constant":
        return f"is constant at {one.lowest:.5g}"
    if unit == "?":
        return ""
    ends = [to_si(x, unit, quantity.unit) for x in (one.lowest, one.highest)]
    if all(quantity.allows(x) for x in ends):
        return ""
    return f"is {one.lowest:.5g} to {one.highest:.5g} {unit}, which is impossible for a vehicle"


def _distinct(found: Iterable[_Candidate], quantity: Quantity) -> list[_Candidate]:
    """The candidates without copies of another one, in the same or another unit."""
    kept: list[_Candidate] = []
    for one in found:
        labels = [label for f, _, _ in kept for label in (f.column, f"{f.info.group}.{f.column}")]
        if one[0].same_as not in labels and not any(_same_in_si(one, other, quantity) for other in kept):
            kept.append(one)
    return kept


def _same_in_si(one: _Candidate, other: _Candidate, quantity: Quantity) -> bool:
    """Whether two columns, in one unit or in two (km/h and mph), are the same, judged by their ends and extremes."""
    if (one[1] == "?") != (other[1] == "?") or one[0].samples != other[0].samples:
        return False
    own, others = (
        [x if unit == "?" else to_si(x, unit, quantity.unit) for x in (facts.lowest, facts.highest, *facts.ends)]
        for facts, unit, _ in (one, other)
    )
    return max(abs(a - b) for a, b in zip(own, others, strict=True)) <= _ROUNDED * max(map(abs, own))


def _label(facts: ChannelFacts) -> str:
    if facts.repeated > 1 and facts.info.group:
        return f"'{facts.info.group}: {facts.column}'"
    source = f" from {facts.info.source}" if facts.repeated > 1 and facts.info.source else ""
    return f"'{facts.column}'{source}"


def _range(facts: ChannelFacts, unit: str) -> str:
    return f"{facts.lowest:.4g} to {facts.highest:.4g}" + (f" {unit}" if unit != "?" else "")
