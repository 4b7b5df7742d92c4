"""Every step and reader of vdyn keeps the contract to which ``vdyn test-plugin`` holds those of other packages.

Effects are held to theirs in ``tests/effects/test_contract.py``, in every variant of every model.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.descriptions import described
from tests.steps.validate.validate_cases import known_file, true_parameters
from vdyn_cli.commands.contract_checks import Outcome, outcomes, reader_checks, step_checks
from vdyn_cli.io.csv.csv_reader import CSV
from vdyn_cli.steps import load_step, names

TAKEN_OUT = {"cg": ("launch", {3: "out", 4: "back"}), "validate": ("drive", {2: "back", 3: "out"})}


@pytest.mark.parametrize("name", names())
def test_every_step_keeps_its_contract(name: str, root: Path, tmp_path: Path) -> None:
    """With the true values of what other steps estimate."""
    step = load_step(name)
    known = known_file(tmp_path, true_parameters(without=step.gives))
    example = root / "configs" / f"{name}.yaml"
    if name in TAKEN_OUT:  # the contract is that of a step, however many runs it has
        log, ways = TAKEN_OUT[name]
        runs = [(f"  - {{log: {root}/sample_logs/{log}_{k}.csv, direction: {w}}}\n", "") for k, w in ways.items()]
        example = described(tmp_path, root, name, *runs)
    found = outcomes(step_checks(step, example, [known]))
    assert len(found) >= 4
    assert not [outcome for outcome in found if outcome.wrong]


@pytest.mark.parametrize("log", ["coast_1.csv", "slip_1.csv"])
def test_csv_keeps_the_contract_of_a_reader(log: str, root: Path) -> None:
    found = outcomes(reader_checks(CSV, root / "sample_logs" / log))
    assert not [outcome for outcome in found if outcome.wrong]


def test_a_check_that_raises_has_failed_and_the_others_run() -> None:
    def raises():  # type: ignore[no-untyped-def]
        yield "first"
        raise ZeroDivisionError("no")

    found = outcomes({"a": raises, "b": lambda: iter(())})
    assert found == (Outcome("a", ("ZeroDivisionError: no",)), Outcome("b", ()))
