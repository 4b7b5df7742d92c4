"""The clocks of several loggers as a table."""

from __future__ import annotations

from collections.abc import Sequence

from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.report import typography
from vdyn_cli.report.text_table import TextTable

_COLUMNS = ("logger", "against", "by", "delay (ms)", "+- (ms)", "drift (ppm)", "+- (ppm)", "channels")
_CAPTION = (
    "At time t of the first clock, the logger's clock shows t + delay + drift. +-: standard errors; the intervals of "
    "the parameters include them. A drift within two standard errors of zero is not corrected."
)


def clock_table(clocks: Sequence[ClockDifference]) -> TextTable | None:
    """One row for each further logger of each run; None for tests with one logger."""
    rows = tuple(
        (
            typography.run_name(typography.clean(c.logger)),
            typography.run_name(typography.clean(c.run)),
            _by(c),
            f"{1e3 * c.delay:+.1f}",
            f"{1e3 * c.delay_std:.1f}",
            f"{1e6 * c.drift:+.0f}" + ("" if c.corrected else " (not corrected)"),
            f"{1e6 * c.drift_std:.0f}",
            ", ".join(c.channels) or "none",
        )
        for c in clocks
    )
    numeric = (False, False, False, True, True, True, True, False)
    return TextTable("Clocks of several loggers", _CAPTION, _COLUMNS, rows, numeric) if rows else None


def _by(clock: ClockDifference) -> str:
    first, second = clock.pair
    return "stated" if clock.stated else first if first == second else f"{first} and {second}"
