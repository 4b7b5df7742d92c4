"""Delay of a run's second logger as an unknown of that run, with the standard error of its estimate as prior."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.inference import Unknown
from vdyn_cli.physics.models.load_transfer import MOMENTS
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects

DELAY = "logger_delay"
LIMIT = 0.2  # s, an error that the drawn signals of two loggers would show
# The channels of each moment of the balance, in the order of MOMENTS.
CHANNELS = (("front_load", "front_left_load"), ("pitch_rate", "pitch"), ("acceleration",))
CLOCKED = tuple(name for names in CHANNELS for name in names)


def run_clocks(logs: Sequence[Log]) -> AddedEffects:
    """Each run's delay of the other logger behind that of the pitch, s; none where all moments have one clock.

    The speeds of two loggers give their delay to 10 to 30 ms. Left out, such errors looked like a pitch axis meters
    away from the body, zeros of the loads of 300 N, and a height of the center of gravity that was 10 % too large.

    Parameters
    ----------
    logs : of the runs, with ``clock_std``.

    Assumes that second and third logger have the same delay where the channels come from three.
    """
    std = {f"{moment}_clock": _error(logs, names) for moment, names in zip(MOMENTS, CHANNELS, strict=True)}
    # Relative to the logger of the pitch, whose moment cannot be shifted: the pitch acceleration enters the balance as
    # the change of the measured pitch rate.
    reference = std[f"{MOMENTS[1]}_clock"]
    late = {law: float(np.hypot(error, reference)) for law, error in std.items() if error != reference}
    if not late:
        return NO_EFFECTS
    quantity = Quantity(DELAY, "s", "error of the estimated delay between a run's loggers", "", -LIMIT, LIMIT)

    def law(clock: Law, s: Signals, q: Signals) -> Number:
        """Channels of one logger that are late relative to those of the other."""
        return clock(s) + q.logger_delay

    law.__name__ = DELAY
    found = effect(on=tuple(late), unknowns=quantity, reference="standard error of the alignment of clocks")(law)
    prior = 0.0, max(late.values())
    return AddedEffects((found,), (Unknown(DELAY, 0.0, prior=prior, prior_stated=False, per_run=True, nuisance=True),))


def _error(logs: Sequence[Log], names: Sequence[str]) -> float:
    """The rms over the runs of the standard error of these channels' clock, s."""
    return float(np.sqrt(np.mean([max(log.clock_std.get(n, 0.0) for n in names) ** 2 for log in logs])))
