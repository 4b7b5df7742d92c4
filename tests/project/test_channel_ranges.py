"""A channel outside its physical range is refused, unless the step's diagnosis finds its gain."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.project.reading.run_reading import within_physical_limits
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps import load_step


def driven(top: float) -> Log:
    """A log whose speed rises to ``top``, m/s."""
    time = np.arange(0.0, 20.0, 0.1)
    return Log("run.csv", time, {"speed": top * time / 20.0})


def test_a_speed_several_times_too_high_is_diagnosed_in_drives_and_refused_in_coast_downs() -> None:
    (finding,) = within_physical_limits(load_step("validate"), driven(270.0)).findings
    assert "lies outside -30 to 150 m/s" in finding.what
    assert finding.doubt
    for step, top in (("coastdown", 270.0), ("validate", 3000.0)):
        with pytest.raises(InputError, match="lies outside -30 to 150 m/s"):
            within_physical_limits(load_step(step), driven(top))


def test_a_speed_in_its_range_has_no_finding() -> None:
    assert not within_physical_limits(load_step("validate"), driven(60.0)).findings


def test_a_speed_of_the_wrong_sign_has_the_sign_among_its_remedies() -> None:
    with pytest.raises(InputError, match=r"check the sign \('signs: \{speed: -1\}' at the run\), the unit"):
        within_physical_limits(load_step("coastdown"), driven(-60.0))
    with pytest.raises(InputError, match="check the unit and the column"):
        within_physical_limits(load_step("coastdown"), driven(-3000.0))


def test_a_clock_too_slow_for_the_test_has_its_unit_as_remedy() -> None:
    """Milliseconds read as seconds: the fit of cg ended at a bound, and inertia published a thousand times too much."""
    slow = Log("run.csv", np.arange(0.0, 4000.0, 10.0), {"speed": np.linspace(0.0, 20.0, 400)})
    for step in ("cg", "inertia", "validate"):
        with pytest.raises(
            InputError, match=r"typical step is 10 s; this test needs 2 s or less\n.*units: \{time: ms\}"
        ):
            within_physical_limits(load_step(step), slow)
    assert not within_physical_limits(load_step("coastdown"), slow).findings
