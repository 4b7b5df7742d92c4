"""Reading of a road survey, and the grade along each run from it, with the survey's error.

The file has a column ``position`` (road coordinate), and ``elevation`` or ``grade`` (positive if the road rises with
increasing position), each with its unit in brackets or in a units row; ``elevation_std`` or ``grade_std`` if the survey
states its errors. Between two points the grade is the difference of elevation over distance, or is interpolated.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from vdyn_cli.description.description_model import Description
from vdyn_cli.description.yaml_source import YamlSource
from vdyn_cli.io.channel_survey import ChannelFacts, survey
from vdyn_cli.io.fingerprinted_reading import read_unchanged
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.reader import Column, ReadOptions
from vdyn_cli.project.reading.channel_sources import channel_maps
from vdyn_cli.quantities.arrays import Array, filled, net_change
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.road_survey import RoadSurvey

NAMES: Mapping[str, tuple[str, ...]] = {
    "position": ("position", "station", "distance", "chainage", "x"),
    "elevation": ("elevation", "height", "altitude", "z"),
    "grade": ("grade", "slope", "gradient"),
    "elevation_std": ("elevation_std", "height_std"),
    "grade_std": ("grade_std", "slope_std"),
}
UNITS = {"position": "m", "elevation": "m", "grade": "", "elevation_std": "m", "grade_std": ""}
BEYOND = 5.0  # m, largest distance of a run beyond the survey: the uncertainty of a receiver's position


def surveyed_road(spec: Description, source: YamlSource, files: dict[Path, str]) -> RoadSurvey | None:
    """The road survey named in the description; None if there is none.

    Parameters
    ----------
    files : to which the file is added, with its sha256.

    Raises
    ------
    InputError : the file cannot be read, lacks a column, or has fewer than two points.
    """
    name = _named(spec)
    if name is None:
        return None
    path, where = source.path.parent / name, source.where(("settings", "road", "profile"))
    found, digests = read_unchanged(lambda: (_read(path, name, where), (path,)))
    files |= digests
    return found


def _named(spec: Description) -> str | None:
    road = getattr(getattr(spec, "settings", None), "road", None)
    return getattr(road, "profile", None)


def _read(path: Path, name: str, where: str) -> RoadSurvey:
    if not path.exists():
        remedy = "write its path relative to the folder of the description"
        raise InputError(Finding(where, f"the road profile {name} does not exist", remedy=remedy))
    columns = _columns(survey(path), name)
    mapping = {("time" if n == "position" else n): c for n, c in columns.items()}  # the position increases like a clock
    table = read_log(path, mapping, ReadOptions(), name)
    shape = "elevation" if "elevation" in columns else "grade"
    good = np.isfinite(table[shape])
    if good.sum() < 2:
        raise InputError(Finding(name, "has fewer than two points of the road", remedy="check its columns"))
    error = table[f"{shape}_std"][good] if f"{shape}_std" in columns else np.zeros(int(good.sum()))
    return RoadSurvey(name, table.time[good], table[shape][good], np.nan_to_num(error), shape == "elevation")


def _columns(facts: Sequence[ChannelFacts], name: str) -> dict[str, Column]:
    """The columns of a survey by quantity."""
    found: dict[str, Column] = {}
    for one in facts:
        plain = one.info.name.partition("[")[0].partition("(")[0].strip().lower().replace(" ", "_")
        kind = next((k for k, names in NAMES.items() if plain in names), None)
        if kind is not None and kind not in found:
            unit = one.info.unit or ("1" if not UNITS[kind] else UNITS[kind])
            found[kind] = Column(one.column, unit, UNITS[kind], where=f"{name}, {one.column}")
    missing = [n for n in ("position",) if n not in found]
    missing += [] if {"elevation", "grade"} & set(found) else ["elevation or grade"]
    if missing:
        headers = ", ".join(f"'{one.info.name}'" for one in facts)
        remedy = "name its columns 'position [m]' and 'elevation [m]' or 'grade [%]'"
        raise InputError(Finding(name, f"has no column {' and no column '.join(missing)}", headers, remedy))
    return found


def with_grade(log: Log, road: RoadSurvey | None) -> Log:
    """The log with the surveyed grade in its direction of travel; unchanged without a road or a position."""
    if road is None or "position" not in log or not np.isfinite(log["position"]).any():
        return log
    place = _place(log)
    return log.with_channels(grade=np.where(np.isfinite(log["speed"]), _sense(log) * road.grade(place), np.nan))


def with_survey_error(log: Log, road: RoadSurvey, mode: int, times: float) -> Log:
    """The log with ``times`` standard deviations of one ``mode`` of the survey's error added to its grade."""
    if "position" not in log or "grade" not in log:
        return log
    return log.with_channels(grade=log["grade"] + times * _sense(log) * road.error(_place(log), mode))


def _place(log: Log) -> Array:
    return filled(log.time, log["position"])


def _sense(log: Log) -> float:
    """-1 if the position decreases in a run, else +1."""
    return -1.0 if net_change(log["position"]) < 0.0 else 1.0


def road_findings(road: RoadSurvey | None, spec: Description, logs: Sequence[Log]) -> Iterator[Finding]:
    """Findings if a survey cannot be used for these runs: no position, a logged grade, a trip meter, a short survey.

    Parameters
    ----------
    road : the survey, or None. spec, logs : the description, and the logs of its runs.
    """
    if road is None:
        return
    if any("grade" in channels for channels, _ in channel_maps(spec)):
        what = "channel 'grade' is mapped, but 'road: {profile: ...}' also gives the grade"
        yield Finding("channels.grade", what, remedy="remove one of them")
        return
    for log in logs:
        if "position" not in log:
            remedy = "map the position along the road, in the survey's coordinate, or remove 'road: {profile: ...}'"
            yield Finding(log.name, f"has no channel 'position', so its place on {road.name} is unknown", "", remedy)
            return
    senses = {run.direction: _sense(log) for run, log in zip(spec.runs, logs, strict=False) if run.direction}
    if len(senses) == 2 and len(set(senses.values())) == 1:
        what = "position increases (or decreases) in runs of both directions: a trip meter, not a road coordinate"
        yield Finding(logs[0].name, what, "", f"map the coordinate used in {road.name}, or remove 'profile'")
        return
    for log in logs:
        moving = np.isfinite(log["position"]) & (np.abs(np.nan_to_num(log["speed"])) > 1.0)
        place = log["position"][moving]
        if place.size and (place.min() < road.span[0] - BEYOND or place.max() > road.span[1] + BEYOND):
            what = f"runs from {place.min():.0f} m to {place.max():.0f} m; {road.name} covers {road.span[0]:.0f} m to "
            what += f"{road.span[1]:.0f} m"
            remedy = "survey the rest, or cut the run with from_time and to_time to the surveyed part"
            yield Finding(log.name, what, "", remedy)


def survey_note(road: RoadSurvey | None) -> tuple[Finding, ...]:
    """A note of the source of the grade and its error."""
    if road is None:
        return ()
    what = f"gives the grade from {road.span[0]:.0f} m to {road.span[1]:.0f} m ({road.position.size} points)"
    if road.uncertain:
        return (Finding(road.name, f"{what}; the intervals include its error, {road.size}"),)
    column = "elevation_std [m]" if road.elevation else "grade_std [%]"
    return (Finding(road.name, f"{what}, taken as exact", "", f"add a column '{column}' with the survey's error"),)
