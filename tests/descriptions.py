"""Shipped descriptions with something changed, in a folder of their own."""

from __future__ import annotations

from pathlib import Path


def described(folder: Path, root: Path, step: str, *changes: tuple[str, str]) -> Path:
    """A step's own description with its logs where they are, changed and added to."""
    text = (root / "configs" / f"{step}.yaml").read_text().replace("../sample_logs", str(root / "sample_logs"))
    text = text.replace("vehicle: vehicle.yaml", f"vehicle: {root / 'configs' / 'vehicle.yaml'}")
    for old, new in changes:
        assert old in text or not old
        text = text.replace(old, new) if old else text + new
    (folder / f"{step}.yaml").write_text(text)
    return folder / f"{step}.yaml"
