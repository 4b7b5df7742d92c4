"""Names of logs and of their parts."""

from __future__ import annotations

import re


def log_of(name: str) -> str:
    """The name of the log of a run, without the times of a part, such as ``run_1.csv, 12 to 40 s``."""
    return re.sub(r", [\d.]+ to [\d.]+ s$", "", name)
