"""A wheel radius that is off by some percent shifts the slip: it is named, and the curve is published all the same."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from vdyn_cli.project.execute import execute
from vdyn_cli.project.result_document import to_json

TRUE = 0.308  # m, of the sample's tire


# A minute, and one like the other sign.
OTHERS = [pytest.param(given, marks=pytest.mark.thorough) for given in (0.296, 0.302)]


@pytest.mark.slow  # a diagnosis of 5 s each
@pytest.mark.parametrize("given", [0.316, *OTHERS])
def test_a_wrong_radius_is_named_and_the_curve_published(given: float, root: Path, tmp_path: Path) -> None:
    plain = execute("tire", root / "configs" / "tire.yaml", level=None)
    document = json.loads(to_json(plain.document))
    entry = {"value": given, "std": 0.0, "interval95": [given, given], "unit": "m", "meaning": "", "source": "inertia"}
    document |= {"parameters": {"wheel_radius": entry}, "diagnosis": None}
    known = tmp_path / "known.json"
    known.write_text(json.dumps(document), encoding="utf-8")
    found = execute("tire", root / "configs" / "tire.yaml", [known]).result
    assert found.diagnosis is not None
    assert [c.effect for c in found.diagnosis.causes] == ["slip_offset"]
    (offset,) = found.diagnosis.causes[0].unknowns.values()
    assert offset.value == pytest.approx(given / TRUE - 1, abs=0.006)
    for name in ("tire_B", "tire_C", "tire_D", "tire_longitudinal_stiffness"):
        low, high = found.parameters[name].interval95
        assert low < plain.result.parameters[name].value < high, name
