"""Every step and reader of vdyn keeps the contract to which ``vdyn test-plugin`` holds those of other packages.

Effects are held to theirs in ``tests/effects/test_contract.py``, in every variant of every model.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.descriptions import described
from tests.steps.validate.validate_cases import known_file, true_parameters
from vdyn_cli.commands.contract_checks import Outcome, outcomes, reader_checks, step_checks
from vdyn_cli.io.csv.csv_reader import CSV
from vdyn_cli.steps import load_step, names

RUNS = {"bump": 2, "cg": 2, "coastdown": 4, "inertia": 2, "tire": 2, "validate": 1}


@pytest.mark.parametrize("name", names())
def test_every_step_keeps_its_contract(name: str, root: Path, tmp_path: Path) -> None:
    """With the true values of what other steps estimate, and few runs: the contract is the same for any number."""
    step = load_step(name)
    known = known_file(tmp_path, true_parameters(without=step.gives))
    runs = re.findall(r"  - \{log: .*\n", described(tmp_path, root, name).read_text())
    example = described(tmp_path, root, name, *((run, "") for run in runs[RUNS.get(name, 1) :]))
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
