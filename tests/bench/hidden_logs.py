"""Scenarios on disk: the logs with something hidden in them, and the description that a tester would write."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tests.bench import cases
from tests.plant.hidden import Scenario

Writer = Callable[[Scenario, Path], Path]


@dataclass(frozen=True)
class Made:
    """A description on disk; ``truth`` is what is hidden in its logs, ``scenario`` what more there is to know."""

    description: Path
    scenario: Scenario

    @property
    def truth(self) -> dict[str, float]:
        return dict(self.scenario.effects)

    @property
    def t(self) -> dict[str, float]:
        return self.scenario.evidence().t()

    @property
    def rivals(self) -> dict[str, dict[str, float]]:
        return self.scenario.evidence().rivals()


def make(scenario: Scenario, folder: Path) -> Made:
    """Write the scenario's logs and description into ``folder``."""
    path = WRITERS[scenario.step](scenario, folder)
    if scenario.fault:
        damage(sorted(folder.glob(f"{scenario.step}_*.csv")), scenario.fault)
    return Made(path, scenario)


def _coastdown(scenario: Scenario, folder: Path) -> Path:
    way = scenario.way
    assert way.day is not None
    return cases.coast_downs(scenario.vehicle, scenario.drawn, folder, way.day, way.fixed, scenario.effects)


def _tire(scenario: Scenario, folder: Path) -> Path:
    return cases.tire_sweeps(scenario.vehicle, scenario.drawn, folder, effects=scenario.effects)


def _plain(write: Callable[..., Path]) -> Writer:
    return lambda scenario, folder: write(scenario.vehicle, scenario.drawn, folder, scenario.effects)


WRITERS: dict[str, Writer] = {
    "coastdown": _coastdown,
    "cg": _plain(cases.launches),
    "bump": _plain(cases.crossings),
    "inertia": _plain(cases.wheel_drives),
    "tire": _tire,
    "shaft": _plain(cases.tip_in),
}

# Channels that break in a sensor fault, by step; the header as logged.
FRAGILE = {
    "coastdown": "GPS Speed [km/h]",
    "cg": "FL Fz [N]",
    "bump": "Front Load [N]",
    "inertia": "Hub Torque [N m]",
    "tire": "Fx [N]",
    "shaft": "Shaft Torque [N m]",
    "validate": "Speed [km/h]",
}


def damage(logs: list[Path], fault: str) -> None:
    """Break a channel of every third log: ``stuck`` holds one value for a fifth of the log, ``clipped`` cuts the top.

    A logger goes on writing; nothing in the file says that anything is wrong.
    """
    for path in logs[::3]:
        with path.open(encoding="utf-8", newline="") as file:
            head, *rows = list(csv.reader(file))
        column = head.index(next(FRAGILE[step] for step in FRAGILE if path.name.startswith(step)))
        values = [float(row[column]) for row in rows]
        if fault == "stuck":
            start, stop = int(0.4 * len(rows)), int(0.6 * len(rows))
            broken = [values[start] if start <= k < stop else value for k, value in enumerate(values)]
        elif fault == "clipped":
            top = sorted(values)[int(0.85 * len(values))]
            broken = [min(value, top) for value in values]
        else:
            raise ValueError(f"no such fault: {fault}")
        for row, value in zip(rows, broken, strict=True):
            row[column] = f"{value:.2f}"
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerows([head, *rows])
