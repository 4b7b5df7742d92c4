"""End errors over 20 s windows of real trips, before any extension:  python -m tests.bench.bmw_windows

Writes bmw_windows.md beside this file. The trips are looked for in ../shared/data or where VDYN_DATA points.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import yaml

from tests.conftest import ROOT, shared_data_folder
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.result import Result

SEASONS = ("summer", "winter")
HEAD = """# A BMW i3 against its certified road load

Windows of 20 s with motor torque above zero throughout, each simulated from its measured start speed: EPA road load,
1417 kg, no loss in the driveline, a flat road, nothing fitted. Trips are the independent units of the interval.
Written by `python -m tests.bench.bmw_windows`; the trips are those of doi:10.21227/6jr9-5235.
"""


def description(season: str, folder: Path) -> dict:  # type: ignore[type-arg]
    """The shipped description with its logs where they are here."""
    path = ROOT / "configs" / f"bmw_i3_{season}_validate.yaml"
    described = yaml.safe_load(path.read_text(encoding="utf-8"))
    for run in described["runs"]:
        run["log"] = str(folder / Path(run["log"]).name)
    assert isinstance(described, dict)
    return described


def validated(season: str, folder: Path, scratch: Path) -> Result:
    path = scratch / f"{season}.yaml"
    path.write_text(yaml.safe_dump(description(season, folder)), encoding="utf-8")
    return execute("validate", path, level=None).result


def markdown(season: str, result: Result) -> str:
    (table,) = [t for t in result.tables if t.key == "window_ends"]
    lines = [f"## {season.capitalize()}", "", result.sentence, "", "| " + " | ".join(table.columns) + " |"]
    lines.append("|" + "---|" * len(table.columns))
    lines += [
        "| " + " | ".join(Path(c).name if "/" in c and ".csv" in c else c for c in row) + " |" for row in table.rows
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    folder = shared_data_folder() / "bmw_i3"
    with tempfile.TemporaryDirectory() as scratch:
        parts = [markdown(season, validated(season, folder, Path(scratch))) for season in SEASONS]
    text = "\n".join([HEAD, *parts])
    Path(__file__).with_suffix(".md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
