"""Console output of a step."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from vdyn_cli.commands.run_step import print_result, run_step
from vdyn_cli.quantities.parameters import Estimate


def test_an_interval_that_holds_other_answers_says_which() -> None:
    plain = Estimate(1.0, 0.1, (0.8, 1.2), "m", "a length", "a")
    wide = {"spans": ("headwind", "unexplained")}
    result: Any = SimpleNamespace(
        findings=(),
        fit=SimpleNamespace(warnings=()),
        parameters={"a": plain, "b": Estimate(1.0, 0.1, (0.8, 2.2), "m", "", "a", **wide), "c": plain},
        withheld={},
        sentence="Done.",
        diagnosis=None,
        refused=(),
    )
    said: list[str] = []
    print_result(SimpleNamespace(result=result), lambda text, detail=False, result=False: said.append(text))  # type: ignore[arg-type]
    (line,) = [text for text in said if "the interval is wider, since these data do not exclude" in text]
    assert "a headwind" in line
    assert line.startswith("  b: ")


def test_a_result_of_another_description_is_not_replaced_silently(root: Path, tmp_path: Path) -> None:
    own, other = tmp_path / "own.yaml", tmp_path / "other.yaml"
    text = (root / "configs/torsion_rod.yaml").read_text()
    for path in (own, other):
        path.write_text(text)
    replaced = [run_step("shaft", path, (), str(tmp_path / "out"), None).replaced for path in (own, own, other)]
    assert replaced == ["", "", "vdyn shaft own.yaml --no-diagnose"]
