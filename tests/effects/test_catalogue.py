"""The catalog finds its files by itself and refuses what would confuse a diagnosis."""

from __future__ import annotations

import sys

import pytest

import vdyn_cli.effects as effects
from vdyn_cli.effects import catalog
from vdyn_cli.effects.definition.catalog import _found

FILE = """
from vdyn_cli.effects import effect
from vdyn_cli.quantities.quantity import Quantity

@effect(on="air", unknowns=(Quantity("{unknown}", "N", "a force", "", -1, 1),), reference="none")
def {function}(air, s, q):
    \"\"\"One more force.\"\"\"
    return air(s) + q.{unknown}
"""


@pytest.fixture
def add(tmp_path, monkeypatch):
    """Add a file to the catalog for the time of a test."""
    monkeypatch.setattr(effects, "__path__", [*effects.__path__, str(tmp_path)])

    def write(name: str, function: str, unknown: str) -> None:
        (tmp_path / f"{name}.py").write_text(FILE.format(function=function, unknown=unknown))

    _found.cache_clear()
    yield write
    _found.cache_clear()
    for path in tmp_path.glob("*.py"):
        sys.modules.pop(f"vdyn_cli.effects.{path.stem}", None)


def test_a_new_file_is_a_new_effect(add):
    add("another_force", "another_force", "another")
    names = [effect.name for effect in catalog()]
    assert names == sorted(names)
    assert "another_force" in names
    found = next(effect for effect in catalog() if effect.name == "another_force")
    assert found.summary == "One more force."
    assert found.unknowns["another"].unit == "N"


def test_a_file_must_hold_what_it_is_named_after(add):
    add("misnamed_force", "another_force", "another")
    with pytest.raises(ValueError, match="misnamed_force"):
        catalog()


def test_two_effects_cannot_share_an_unknown(add):
    add("second_headwind", "second_headwind", "headwind")
    with pytest.raises(ValueError, match=r"'headwind' and 'second_headwind' share the unknown 'headwind'"):
        catalog()
