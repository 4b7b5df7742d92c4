"""What the simulation of a real car gets wrong, found by the program:  python -m tests.bench.bmw_diagnosis

Runs ``vdyn validate`` on configs/bmw_i3_diagnose.yaml (all trips) and on the summer's and the winter's trips alone, and
writes what it says to bmw_diagnosis.md. The elevation channel of the logs is not given to the program; here its slope
is laid beside the slope that the program found. The trips are looked for in ../shared/data or where VDYN_DATA points.
"""

from __future__ import annotations

import gzip
import tempfile
from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from tests.conftest import ROOT, shared_data_folder
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.result import Result

Array = NDArray[np.float64]

SEASONS = {"all": "", "summer": "TripA", "winter": "TripB"}
COARSE = 5  # pieces of 100 m: the elevation channel is smoothed over as much and more
LIVE = 0.002  # scatter of the elevation's slope below which it tells nothing
THERE, BACK = ("TripA03", "TripA17", "TripA24"), ("TripA04", "TripA18", "TripA25")  # over one road
SHIFTS = np.arange(-25, 26)  # pieces of 100 m by which two trips over one road may have begun apart
HEAD = """# A BMW i3 on public roads: what its simulation gets wrong

Baseline: the road load of the US certification, no loss in the driveline, a flat road. Found by `vdyn validate
configs/bmw_i3_diagnose.yaml` from torque, speed and forward acceleration alone, in windows of 20 s with motor torque
above zero, faster than 30 km/h. +- and intervals are 95 %; drives are the independent units.
Written by `python -m tests.bench.bmw_diagnosis`; the trips are those of doi:10.21227/6jr9-5235.
"""


def description(season: str, folder: Path) -> dict[str, Any]:
    """The shipped description, of one season's trips or of all, with the logs where they are here."""
    described = yaml.safe_load((ROOT / "configs" / "bmw_i3_diagnose.yaml").read_text(encoding="utf-8"))
    described["runs"] = [r for r in described["runs"] if SEASONS[season] in r["log"]]
    for run in described["runs"]:
        run["log"] = str(folder / Path(run["log"]).name)
    # One season alone can't tell what the temperature does, nor four trips how a warm-up dies out.
    beyond = {"all": (), "summer": ("temperature_rolling",), "winter": ("temperature_rolling", "tire_warmup")}[season]
    described["diagnose"]["extend"] = [e for e in described["diagnose"]["extend"] if e not in beyond]
    assert isinstance(described, dict)
    return described


def diagnosed(season: str, folder: Path, scratch: Path) -> Result:
    path = scratch / f"{season}.yaml"
    path.write_text(yaml.safe_dump(description(season, folder)), encoding="utf-8")
    return execute("validate", path).result


def elevation(path: Path) -> tuple[Array, Array]:
    """Distance and elevation of a trip, m, read here and nowhere else."""
    with gzip.open(path, "rt", encoding="latin-1") as file:
        names = file.readline().strip().split(";")
        wanted = [next(i for i, n in enumerate(names) if n.startswith(w)) for w in ("Time", "Velocity", "Elevation")]
        rows = np.array([[float(c or "nan") for c in (line.split(";")[i] for i in wanted)] for line in file])
    rows = rows[np.all(np.isfinite(rows), axis=1)]
    speed = rows[:, 1] / 3.6
    along = np.r_[0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(rows[:, 0]))]
    return along, rows[:, 2]


def slopes(found: Mapping[str, Any], folder: Path) -> dict[str, tuple[Array, Array]]:
    """Slope found and slope of the withheld elevation, over pieces of 500 m of each trip."""
    both = {}
    for name, drive in found["drives"].items():
        edges = np.array(drive["distance_m"])
        along, height = elevation(folder / name)
        survey = np.diff(np.interp(edges, along, height)) / np.diff(edges)
        both[name] = (coarse(np.array(drive["slope"])), coarse(survey))
    return both


def heights(found: Mapping[str, Any], folder: Path) -> dict[str, float]:
    """Correlation of the heights along each trip, about the straight line from its start to its end."""
    told = {}
    for name, drive in found["drives"].items():
        edges = np.array(drive["distance_m"])
        mine = np.r_[0.0, np.cumsum(np.array(drive["slope"]) * np.diff(edges))]
        survey = np.interp(edges, *elevation(folder / name))
        told[name] = correlation(*(h - np.interp(edges, edges[[0, -1]], h[[0, -1]]) for h in (mine, survey)))
    return told


def coarse(fine: Array) -> Array:
    whole = fine[: fine.size // COARSE * COARSE]
    return np.asarray(whole.reshape(-1, COARSE).mean(axis=1))


def correlation(a: Array, b: Array) -> float:
    return float(np.corrcoef(a, b)[0, 1]) if a.size > 3 and a.std() > 0 and b.std() > 0 else float("nan")


def pooled(pairs: list[tuple[Array, Array]]) -> float:
    """Correlation over all trips, each about its own mean."""
    return correlation(*(np.concatenate([p[i] - p[i].mean() for p in pairs]) for i in (0, 1)))


def repeats(found: Mapping[str, Any]) -> list[tuple[str, str, float]]:
    """Correlation of the slopes of 100 m that two trips over one road found, begun apart by what fits best."""
    by_trip = {n.partition(".")[0]: np.array(d["slope"]) for n, d in found["drives"].items()}
    told = []
    for group in (THERE, BACK):
        for a, b in combinations([t for t in group if t in by_trip], 2):
            told.append((a, b, max(_shifted(by_trip[a], by_trip[b], int(s)) for s in SHIFTS)))
    for a, b in ((THERE[0], BACK[0]), (THERE[1], BACK[1])):
        if a in by_trip and b in by_trip:
            told.append((a, f"{b} backwards", max(_shifted(by_trip[a], -by_trip[b][::-1], int(s)) for s in SHIFTS)))
    return told


def _shifted(a: Array, b: Array, by: int) -> float:
    a, b = (a[by:], b) if by >= 0 else (a, b[-by:])
    n = min(a.size, b.size)
    return correlation(a[:n], b[:n])


def section(season: str, result: Result) -> str:
    """One season in words, with the sizes of its causes and the gain."""
    d, road = result.diagnosis, result.extra["validation"]["road"]
    assert d is not None
    lines = [f"## {season.capitalize()} ({len(result.fit.runs)} trips)", "", d.sentence, ""]
    lines += [f"Verdict: {d.verdict}" + _or(d.ambiguous) + f" (p = {d.p_value:.1g}).", ""]
    lines += ["| finding | size | 95 % |", "|---|---|---|"]
    for cause in d.causes:
        for unknown in cause.unknowns.values():
            low, high = unknown.interval95
            entry = f"{low:.3g} to {high:.3g}"
            lines.append(f"| {cause.label} ({cause.effect}) | {unknown.value:.3g} {unknown.unit} | {entry} |")
    lines.append(row("accelerometer's zero [m/s^2]", road["accelerometer_zero"], ".3f"))
    lines += [
        row(f"drive force that holds {f['speed_kmh']:.0f} km/h [N]", f, ".0f")
        for f in road["holding_force"]
        if f["speed_kmh"] in (60.0, 120.0)
    ]
    if "seasons" in road:
        s = road["seasons"]
        for key in ("warm", "cold"):
            lines.append(row(f"the same at 60 km/h and {s[key]['temperature_degC']:.0f} degC [N]", s[key], ".0f"))
        lines.append(row("winter more than summer at 60 km/h [N]", s["more"], ".0f"))
    held = road["held_out"]
    lines.append(row("mean end error of 20 s windows before [m/s]", held["mean_before"], "+.2f"))
    lines.append(row("the same of trips that the extension was not fitted to [m/s]", held["mean_after"], "+.2f"))
    lines.append(
        f"| rms end error before, and of trips left out after [m/s] | {held['rms_before']:.2f}, "
        f"{held['rms_after']:.2f} | |"
    )
    lines.append(row("fall of the rms end error [m/s]", held["gain"], ".2f"))
    return "\n".join(lines) + "\n"


def _or(sets: Sequence[Sequence[str]]) -> str:
    return "".join(f"; not to be told apart: {', '.join(one)}" for one in sets if len(one) > 1)


def row(what: str, one: Mapping[str, Any], digits: str) -> str:
    low, high = one["interval95"]
    return f"| {what} | {one['value']:{digits}} | {low:{digits}} to {high:{digits}} |"


def road_section(result: Result, folder: Path) -> str:
    """The slope found beside the withheld elevation's, and beside itself on the same road another day."""
    road = result.extra["validation"]["road"]
    both = slopes(road, folder)
    lines = ["## The road's slope against the withheld elevation", ""]
    lines += ["| trip | zero [m/s^2] | scatter found [%] | of the elevation [%] | correlation | of heights |"]
    lines += ["|---|---|---|---|---|---|"]
    level = heights(road, folder)
    for name, (found, survey) in both.items():
        zero = road["drives"][name]["accelerometer_zero"]
        r = correlation(found, survey)
        told = f"{r:+.2f}" if np.isfinite(r) else "elevation stands still"
        lines.append(
            f"| {name.partition('.')[0]} | {zero['value']:+.3f} +- {1.96 * zero['std']:.3f} | "
            f"{100 * found.std():.2f} | {100 * survey.std():.2f} | {told} | "
            f"{level[name]:+.2f} |".replace("+nan", "")
        )
    live = [p for p in both.values() if p[1].std() > LIVE]
    lines += [
        "",
        f"All trips together: {pooled(list(both.values())):+.2f}; the {len(live)} trips whose elevation moves "
        f"(scatter above {100 * LIVE:.1f} %): {pooled(live):+.2f}. Pieces of 500 m, about each trip's mean.",
        "",
    ]
    lines += [
        "The elevation channel is smoothed over kilometres and stands still for whole trips, so it judges little. "
        "Better witnesses are other trips over the same road; pieces of 100 m, found from each trip alone:",
        "",
    ]
    lines += ["| trips | correlation |", "|---|---|"]
    lines += [f"| {a}, {b} | {r:+.2f} |" for a, b, r in repeats(road)]
    return "\n".join(lines) + "\n"


def main() -> None:
    folder = shared_data_folder() / "bmw_i3"
    parts = [HEAD]
    with tempfile.TemporaryDirectory() as scratch:
        for season in SEASONS:
            result = diagnosed(season, folder, Path(scratch))
            parts.append(section(season, result))
            if season == "all":
                road = road_section(result, folder)
    text = "\n".join([*parts, road])
    Path(__file__).with_suffix(".md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
