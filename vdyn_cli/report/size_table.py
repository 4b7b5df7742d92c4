"""Table of the size of a finding: its change of the output, of the parameters and of the rms error."""

from __future__ import annotations

import math

from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.verdict_text import remainder_sentence
from vdyn_cli.quantities.diagnosis import Diagnosis, Size
from vdyn_cli.report import effect_labels, typography
from vdyn_cli.report.text_table import TextTable

_SHIFTS = 4  # parameters in one cell: they fit into two lines of the column


def sizes(source: Diagnosis) -> TextTable | None:
    """The size of each identified effect; of the finding as a whole if no effect is identified.

    Parameters
    ----------
    source : the diagnosis; without a significant finding there is no table.
    """
    rows = [(effect_labels.row_label(c.effect), *_row(c.size)) for c in source.causes if c.size is not None]
    if not rows and source.size is not None:
        rows = [("closest candidate" if source.verdict == "unknown" else "the finding", *_row(source.size))]
    if not rows:
        return None
    caption = (
        "Change of the output: with the effect minus without it, rms over all runs, with the noise floor for"
        " comparison. At: in the run with the largest change, at the start, at its maximum and at the end. Share of"
        " rms: (error before − after) / (error before − noise floor), by rms. A finding below a tenth of the noise"
        " floor and of the half-width of every parameter's interval, or below the limits under 'matters' in the"
        " description, is only a note."
    )
    columns = ("finding", "change of the output", "at", "shift of parameters, std", "share of rms")
    return TextTable("Size of the finding", caption, columns, tuple(rows), (False, False, False, False, True))


def remainder_note(source: Diagnosis) -> str:
    """A sentence on the residual that remains with the identified effects; empty if it is noise."""
    left = source.remainder
    if left is None or left.p_value > POLICY.rest_level or not math.isfinite(left.share_of_rms) or not source.causes:
        return ""
    like = f", most like {effect_labels.label(left.mostly)}" if left.mostly else ""
    return remainder_sentence(left.share_of_rms, like)


def _row(size: Size) -> tuple[str, str, str, str]:
    unit = typography.unit(size.unit)
    floor = f" (noise {typography.significant(size.noise_floor, 2)})" if math.isfinite(size.noise_floor) else ""
    change = f"{typography.name(size.output)} {typography.significant(size.change, 2)}{floor} {unit}".strip()
    points = "; ".join(f"{typography.prose(p.at)}: {typography.signed(p.change, 2)}" for p in size.points)
    run = f"{typography.run_name(typography.prose(size.points[0].run))}: " if size.points else ""
    shifts = sorted(size.shifts_in_std.items(), key=lambda item: -abs(item[1]))
    more = f"; {len(shifts) - _SHIFTS} more" if len(shifts) > _SHIFTS else ""
    moved = "; ".join(f"{typography.name(n)} {typography.signed(t, 2)}" for n, t in shifts[:_SHIFTS]) + more
    share = f"{typography.fixed(100 * size.share_of_rms, 0)}{typography.NARROW}%"
    return change, f"{run}{points}", moved, share
