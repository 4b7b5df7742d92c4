"""What the templates set: every part of a result as texts and shares, ready to be laid out."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.result import FitSummary, Table
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.report import words
from vdyn_cli.report.lanes import Channel, judged, rms


@dataclass(frozen=True)
class ParameterRow:
    """One line of a parameter table; ``before`` is empty where no extension moved the value."""

    key: str
    name: str
    symbol: tuple[tuple[str, str], ...]
    reading: words.Reading
    exact: bool
    unit: str
    relative: str
    meaning: str
    source: str
    before: str
    shift: str


@dataclass(frozen=True)
class Chip:
    """One reading of the instrument strip; ``mood`` is good, fair or bad, or empty where there is nothing to judge."""

    label: str
    value: str
    unit: str = ""
    note: str = ""
    mood: str = ""
    link: str = ""


@dataclass(frozen=True)
class Cells:
    """A table of texts; ``numeric`` says which columns are set flush right."""

    title: str
    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numeric: tuple[bool, ...]


def parameter_rows(estimates: Mapping[str, Estimate]) -> tuple[ParameterRow, ...]:
    return tuple(_parameter_row(key, estimate) for key, estimate in estimates.items())


def _parameter_row(key: str, e: Estimate) -> ParameterRow:
    reading = words.reading(e.value, *e.interval95)
    quantity = PARAMETERS.get(key)
    before, shift = _shift(e, reading)
    return ParameterRow(
        key,
        words.title(key),
        symbol(key, quantity.symbol if quantity else ""),
        reading,
        e.interval95 == (e.value, e.value),
        words.unit(e.unit),
        words.relative(e.value, *e.interval95) if reading.plus else "",
        words.prose(e.meaning),
        words.clean(e.source),
        before,
        shift,
    )


def symbol(key: str, text: str) -> tuple[tuple[str, str], ...]:
    """The textbook symbol, none where the name ends with it ("tire B")."""
    return () if text and words.name(key).endswith(f" {text}") else words.symbol(text)


def _shift(e: Estimate, reading: words.Reading) -> tuple[str, str]:
    """The value before the extension with the digits of the value after it, and by how much it moved."""
    if e.baseline is None or not math.isfinite(e.baseline) or not math.isfinite(e.value):
        return "", ""
    decimals = len(reading.value.partition(".")[2])
    scale = 10.0**-reading.exponent
    before = words.fixed(e.baseline * scale, decimals)
    if before == reading.value or abs(e.baseline - e.value) <= 1e-9 * abs(e.value):
        return "", ""
    moved = 100 * (e.value - e.baseline) / abs(e.baseline) if e.baseline else math.nan
    share = "" if not math.isfinite(moved) or abs(moved) >= 1000 else f"{signed(moved, 2)}{words.NARROW}%"
    return before, share


def signed(value: float, digits: int = 3) -> str:
    text = words.significant(value, digits)
    return f"+{text}" if value > 0 and text != "0" else text


def chips(fit: FitSummary, findings: int, slug: str, gained: bool = False, doubted: bool = False) -> tuple[Chip, ...]:
    """Residual against noise floor, held-out error, runs, the unit behind the intervals, what to read before use.

    Parameters
    ----------
    gained : a gain on held-out runs is shown beside them, so that the held-out error is not said twice.
    doubted : something is wrong that the model lacks: a noise floor taken from the same residual is no praise.
    """
    out = []
    shown = words.unit(fit.unit)
    if math.isfinite(fit.rms):
        out.append(
            Chip(
                "residual rms",
                words.significant(fit.rms, 2),
                shown,
                _noise_note(fit),
                "fair" if doubted else _mood(fit),
            )
        )
    if fit.held_out_rms is not None and math.isfinite(fit.held_out_rms) and not gained:
        out.append(Chip("held-out rms", words.significant(fit.held_out_rms, 2), shown, "on runs not seen by the fit"))
    if fit.runs:
        note = words.count(len(fit.unknowns), "unknown") + " estimated" if fit.unknowns else ""
        out.append(Chip("runs", str(len(fit.runs)), "", note))
    if fit.interval_units:
        kind = words.count(fit.interval_units, fit.interval_unit or "unit").partition(" ")[2]
        out.append(Chip("intervals from", str(fit.interval_units), kind, "independent units of evidence"))
    if fit.warnings or findings:
        notes = [words.count(len(fit.warnings), "warning")] if fit.warnings else []
        link = f"#{slug}-warnings" if fit.warnings else f"#{slug}-data"
        if findings:
            notes.append(words.count(findings, "data finding"))
        out.append(Chip("to read first", str(len(fit.warnings) + findings), "", ", ".join(notes), "fair", link))
    return tuple(out)


def _ratio(fit: FitSummary) -> float:
    known = math.isfinite(fit.noise_floor) and fit.noise_floor > 0
    return fit.rms / fit.noise_floor if known else math.nan


def _noise_note(fit: FitSummary) -> str:
    ratio = _ratio(fit)
    everyday = words.everyday(fit.unit)
    also = f"{words.quantity(fit.rms * everyday[1], everyday[0], 2)}, " if everyday else ""
    if not math.isfinite(ratio):
        return also.removesuffix(", ") or "noise floor not known"
    return f"{also}{words.significant(ratio, 2)} × the noise floor"


def _mood(fit: FitSummary) -> str:
    ratio = _ratio(fit)
    return "" if not math.isfinite(ratio) else "good" if ratio < 1.3 else "fair" if ratio < 2.5 else "bad"


_NUMERIC = re.compile(r"[+\-−±<>≈]?\s*[\d.,\s  ]*\d[\d.,\s  ]*(?:%|e[+-]?\d+)?(?:\s*[±×].*)?")
_BLANK = ("", "-", "–", "—", "n/a")


def cells(table: Table) -> Cells:
    """A step's table as texts of equal columns; columns of numbers are found by their cells."""
    columns = tuple(words.prose(c) for c in table.columns)
    width = max([len(columns), *(len(row) for row in table.rows)], default=0)
    columns += ("",) * (width - len(columns))
    rows = tuple(tuple(words.run_name(words.prose(c)) for c in row) + ("",) * (width - len(row)) for row in table.rows)
    numeric = tuple(_is_numeric([row[i] for row in rows]) for i in range(width))
    return Cells(words.prose(table.title), words.prose(table.caption), columns, rows, numeric)


def _is_numeric(column: Sequence[str]) -> bool:
    filled = [c for c in column if c not in _BLANK]
    return bool(filled) and sum(bool(_NUMERIC.fullmatch(c)) for c in filled) > 0.6 * len(filled)


def run_table(channel: Channel) -> Cells:
    """Run by run: samples behind the fit, error before and after, mean and largest residual."""
    rows = []
    for one in channel.traces:
        residual = judged(one)[np.isfinite(judged(one))]
        error, mean = rms(residual), float(residual.mean()) if residual.size else math.nan
        rows.append(
            (
                one.run + (" (held out)" if one.held_out else ""),
                f"{int(np.count_nonzero(one.used & np.isfinite(one.residual)))} of {one.x.size}",
                words.significant(error, 3),
                "" if one.before is None else words.significant(rms(one.before), 3),
                "0" if abs(mean) < 1e-3 * error else signed(mean, 2),
                words.significant(float(abs(residual).max()), 2) if residual.size else words.DASH,
            )
        )
    unit = words.unit(channel.unit)
    columns = ("run", "samples used", "rms", "rms before the extension", "mean", "largest")
    keep = [i for i in range(6) if i != 3 or channel.extended]
    title = f"{words.title(channel.name)}, run by run" + (f" ({unit})" if unit else "")
    return Cells(
        title,
        "",
        tuple(columns[i] for i in keep),
        tuple(tuple(row[i] for i in keep) for row in rows),
        tuple(i > 0 for i in keep),
    )


@dataclass(frozen=True)
class Heat:
    """A cell of the correlation table: its text, background, and whether the text is white."""

    text: str
    colour: str
    light: bool


def correlation(table: Mapping[str, Mapping[str, float]]) -> tuple[tuple[str, tuple[Heat, ...]], ...]:
    """The correlation table: name and cells of every row; only parameters that correlate with another."""
    names = [a for a in table if any(b != a for b in table[a])]
    return tuple((words.name(a), tuple(_heat(table[a].get(b, math.nan), a == b) for b in names)) for a in names)


def _heat(value: float, own: bool) -> Heat:
    try:
        rho = float(value)
    except (TypeError, ValueError):
        rho = math.nan
    if own:
        return Heat("1", "#e3e3e3", False)
    if not math.isfinite(rho):
        return Heat(words.DASH, "#ffffff", False)
    strength = min(abs(rho), 1.0) ** 1.5
    full = (0, 90, 150) if rho < 0 else (190, 75, 0)
    red, green, blue = (round(255 + (c - 255) * strength) for c in full)
    return Heat(words.fixed(rho, 2), f"#{red:02x}{green:02x}{blue:02x}", strength > 0.55)


def strongest(table: Mapping[str, Mapping[str, float]]) -> str:
    """The strongest pair in words, empty where none is beyond 0.9."""
    pairs = [(abs(r), a, b, r) for a in table for b, r in table[a].items() if a < b and isinstance(r, float)]
    if not pairs or max(pairs)[0] < 0.9:
        return ""
    _, a, b, r = max(pairs)
    return (
        f"{words.title(a)} and {words.name(b)} are hardly told apart ({words.fixed(r, 2)}): trust their combination"
        " more than either."
    )


def finding(source: Finding) -> dict[str, str]:
    return {
        "where": words.clean(source.where),
        "what": words.clean(source.what),
        "got": words.clean(source.got),
        "remedy": words.clean(source.remedy),
    }


def widths(rows: Sequence[ParameterRow]) -> dict[str, int]:
    """Characters before and after the decimal point, per column: numbers align on their points."""
    out = {}
    for key, texts in {
        "value": [r.reading.value for r in rows],
        "half": [t for r in rows for t in (r.reading.plus, r.reading.minus)],
        "before": [r.before for r in rows],
    }.items():
        parts = [t.partition(".") for t in texts] or [("", "", "")]
        out[f"{key}_whole"] = max(len(whole) for whole, _, _ in parts)
        out[f"{key}_rest"] = max(len(rest) + len(point) for _, point, rest in parts)
    return out


def outline(value: Any, indent: str = "", width: int = 108) -> list[str]:
    """Lines of a nested mapping, YAML's way: what fits stands on one line."""
    lines = []
    items = value.items() if isinstance(value, Mapping) else (("-", v) for v in value)
    for key, inner in items:
        head = f"{indent}{words.clean(key)}" + ("" if key == "-" else ":")
        flat = json.dumps(inner, ensure_ascii=False, default=str)
        if isinstance(inner, (Mapping, list, tuple)) and inner and len(head) + len(flat) > width:
            lines += [head, *outline(inner, indent + "  ", width)]
        else:
            lines.append(f"{head} {words.clean(flat)}")
    return lines


def provenance(source: Any) -> dict[str, Any]:
    made = source if isinstance(source, Mapping) else {}
    inputs = made.get("inputs")
    settings = made.get("settings")
    versions = made.get("versions")
    return {
        "inputs": [
            (words.clean(k), words.clean(v)) for k, v in (inputs.items() if isinstance(inputs, Mapping) else ())
        ],
        "settings": "\n".join(outline(settings)) if isinstance(settings, Mapping) else "",
        "versions": ", ".join(f"{k} {v}" for k, v in (versions.items() if isinstance(versions, Mapping) else ())),
        "command": words.clean(made.get("command", "")),
    }
