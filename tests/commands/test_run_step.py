"""Console output of a step."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from vdyn_cli.commands.run_step import print_result, run_step
from vdyn_cli.quantities.diagnosis import Diagnosis, Verdict, WorstSegment
from vdyn_cli.quantities.parameters import Estimate


def said_of(**given: Any) -> list[str]:
    """The lines printed for a result."""
    fit, none = SimpleNamespace(warnings=()), {"findings": (), "parameters": {}, "withheld": {}, "refused": ()}
    result = SimpleNamespace(**{"fit": fit, "sentence": "Done.", "diagnosis": None, **none, **given})
    said: list[str] = []
    print_result(SimpleNamespace(result=result), lambda text, detail=False, result=False: said.append(text))  # type: ignore[arg-type]
    return said


def test_an_interval_that_holds_other_answers_says_which() -> None:
    plain = Estimate(1.0, 0.1, (0.8, 1.2), "m", "a length", "a")
    wide = {"spans": ("headwind", "unexplained")}
    said = said_of(parameters={"a": plain, "b": Estimate(1.0, 0.1, (0.8, 2.2), "m", "", "a", **wide), "c": plain})
    (line,) = [text for text in said if "the interval is wider, since these data do not exclude" in text]
    assert "a headwind" in line
    assert line.startswith("  b: ")


@pytest.mark.parametrize("verdict", ["unknown", "named"])
def test_an_unexplained_error_says_where_it_is_largest(verdict: Verdict) -> None:
    place = {"run": "wet.csv", "channel": "force_x", "segment": "time in s 1.93 to 2.48"}
    worst = WorstSegment(**place, size=-1903.7, unit="N", over_noise=-801.2)
    said = said_of(diagnosis=Diagnosis(verdict=verdict, sentence="Unmodeled effect present.", where=(worst,)))
    line = "Largest error: wet.csv, force_x, time in s 1.93 to 2.48: -1904 N on average, 801 times the noise."
    assert (line in said) == (verdict == "unknown")


def test_a_result_of_another_description_is_not_replaced_silently(root: Path, tmp_path: Path) -> None:
    own, other = tmp_path / "own.yaml", tmp_path / "other.yaml"
    text = (root / "configs/torsion_rod.yaml").read_text()
    for path in (own, other):
        path.write_text(text)
    replaced = [run_step("shaft", path, (), str(tmp_path / "out"), None).replaced for path in (own, own, other)]
    assert replaced == ["", "", "vdyn shaft own.yaml --no-diagnose"]
