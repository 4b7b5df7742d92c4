"""Console output of a step."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from vdyn_cli.commands.run_step import tell_result
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
    tell_result(SimpleNamespace(result=result), lambda text, detail=False: said.append(text))  # type: ignore[arg-type]
    (line,) = [text for text in said if "the interval is wider, since these data do not exclude" in text]
    assert "a headwind" in line
    assert line.startswith("  b: ")
