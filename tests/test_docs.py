"""The pages name files that exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

PLACEHOLDER = re.compile(r"NAME|STEP|MODEL|FORMAT|LOGFILE|\*|<|\(")


PAGES = ("docs/architecture.md", "docs/logs.md", "docs/diagnosis.md", "docs/commands.md", "README.md")


@pytest.mark.parametrize("page", PAGES)
def test_every_named_file_exists(page: str, root: Path) -> None:
    named = re.findall(r"`([\w./*<>]+/[\w.*<>]*\.?(?:py|md|html|yaml)?)`", (root / page).read_text(encoding="utf-8"))
    links = re.findall(r"\]\(([\w./]+)\)", (root / page).read_text(encoding="utf-8"))
    assert [link for link in links if not ((root / page).parent / link).exists()] == []
    places = (root, root / "vdyn_cli", root / "tests" / "plugin_example")
    fixed = [n for n in named if not PLACEHOLDER.search(n) and not n.startswith(("out/", "../"))]
    assert fixed or links
    assert [n for n in fixed if not any((place / n).exists() for place in places)] == []
