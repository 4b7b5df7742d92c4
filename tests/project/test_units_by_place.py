"""``vdyn init`` takes the unit of a speed and a distance that the file does not state from the logged places."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from vdyn_cli.project.drafting.description_draft import draft_description
from vdyn_cli.steps import load_step

SEMICIRCLES = 2.0**31 / 180.0
METERS = 6_371_000.0 * np.pi / 180.0  # per degree of latitude


def drafted(
    folder: Path, factor: float, meters: float = 1.0, per_degree: float = 1.0, crawl: float = 1.0, **log: object
) -> str:
    """The draft for a drive around bends, logged at 1 Hz with a pause.

    Parameters
    ----------
    factor : m/s per unit of the speed. log : ``name`` of the column of the speed, number of ``rows``.
    """
    noise = np.random.default_rng(1)
    time = np.arange(0.0, 300.0)
    speed = crawl * (14.0 + 6.0 * np.sin(time / 20.0))
    way = np.cumsum(speed)
    course = 0.5 + 0.8 * np.sin(way / 400.0)
    north, east = (np.cumsum(speed * f(course)) + noise.normal(0.0, 0.5, time.size) for f in (np.cos, np.sin))
    time[150:] += 90.0
    place = "position_" if per_degree == SEMICIRCLES else ""
    columns = {
        "time_s": time,
        f"{place}lat": per_degree * (48.0 + north / METERS),
        f"{place}lon": per_degree * (9.0 + east / METERS / np.cos(np.radians(48.0))),
        str(log.get("name", "Speed")): np.round(speed / factor, 2),
        "Distance": np.round(way / meters, 3),
    }
    rows = [",".join(columns), *(",".join(f"{x:.8f}" for x in row) for row in zip(*columns.values(), strict=True))]
    (folder / "drive.csv").write_text("\n".join(rows[: log.get("rows")]))  # type: ignore[misc]
    return draft_description(load_step("coastdown"), [folder / "drive.csv"], folder).text


def units(text: str) -> tuple[str, ...]:
    return tuple(re.findall(r'^  (?:speed|position): .*unit: "?([^",}]+)', text, re.MULTILINE))


@pytest.mark.parametrize(
    ("factor", "meters", "per_degree", "expected"),
    [
        (1.0, 1.0, SEMICIRCLES, ("m/s", "m")),
        (0.5144, 1.0, 1e7, ("kn", "m")),
        (1.0 / 3.6, 1000.0, 1.0, ("km/h", "km")),
        (0.44704, 1609.344, 60.0, ("mph", "mile")),
        (0.514444, 0.3048, 1.0, ("kn", "ft")),
    ],
)
def test_places_decide_the_units(
    tmp_path: Path, factor: float, meters: float, per_degree: float, expected: tuple[str, str]
) -> None:
    assert units(drafted(tmp_path, factor, meters, per_degree)) == expected


def test_no_unit_is_guessed_that_the_places_do_not_show(tmp_path: Path) -> None:
    assert units(drafted(tmp_path, 0.7, 1.3)) == ("?", "?")
    assert units(drafted(tmp_path, 1.0, 1.0, crawl=0.1)) == ("?", "?")


def test_a_short_log_is_compared_in_shorter_windows(tmp_path: Path) -> None:
    assert units(drafted(tmp_path, 1.0 / 3.6, rows=80)) == ("km/h", "m")


@pytest.mark.parametrize(("name", "unit"), [("Speed [mph]", "?"), ("Speed [km/h]", "km/h"), ("Speed [kph]", "kph")])
def test_a_unit_of_the_file_that_the_places_contradict_is_not_decided(name: str, unit: str, tmp_path: Path) -> None:
    text = drafted(tmp_path, 1.0 / 3.6, name=name)
    assert units(text)[0] == unit
    assert ("the file states mph, but only km/h agrees with 'lat' and 'lon'" in text) == (unit == "?")
