"""The order of the steps, and the parameter set from their results."""

from __future__ import annotations

from pathlib import Path

import pytest

from vdyn_cli.description.description_model import Description
from vdyn_cli.project.pipeline import in_order, load_plan
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.steps import Step


def step(name: str, needs: str = "", gives: str = "") -> Step:
    return Step(name, Description, (), (), tuple(needs.split()), tuple(gives.split()), lambda *_: None)  # type: ignore[arg-type, return-value]


def test_a_step_comes_after_what_it_needs_else_the_files_order_stands() -> None:
    steps = {s.name: s for s in (step("c", "b1"), step("z"), step("b", "a1", "b1"), step("a", "", "a1"))}
    assert in_order(steps) == ("z", "a", "b", "c")


def test_a_step_may_need_what_it_gives_itself() -> None:
    assert in_order({"a": step("a", "x", "x")}) == ("a",)


def test_steps_that_wait_for_each_other_are_refused() -> None:
    with pytest.raises(InputError, match="circular dependency of steps"):
        in_order({"a": step("a", "y", "x"), "b": step("b", "x", "y")})


def test_wrong_pipelines_are_refused_with_all_their_problems(tmp_path: Path) -> None:
    (tmp_path / "one.yaml").write_text("test: coastdown\n")
    (tmp_path / "two.yaml").write_text("test: coastdown\n")
    (tmp_path / "odd.yaml").write_text("test: teapot\n")
    path = tmp_path / "pipeline.yaml"
    path.write_text("pipeline: day\nsteps:\n  - one.yaml\n  - two.yaml\n  - odd.yaml\n  - none.yaml\n")
    with pytest.raises(InputError) as caught:
        load_plan(path)
    said = str(caught.value)
    for part in ("pipeline.yaml:4: duplicate description of 'coastdown'", "is not a known step", "does not exist"):
        assert part in said, said
