"""The interval of a quantity that has several possible values, each with a probability."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.constants import NORMAL95

TAIL = 0.025  # on either side of a 95 % interval


def mixture_interval(
    own: tuple[float, float], others: Sequence[tuple[float, tuple[float, float]]]
) -> tuple[float, float]:
    """The 95 % interval of a mixture of normal distributions: sum_k p_k Phi((x - m_k) / s_k) = 0.025 and 0.975.

    Parameters
    ----------
    own : 95 % interval m_0 -+ 1.96 s_0 of the component that has the remaining probability.
    others : probability p_k and 95 % interval of each other component. All intervals have a positive width.

    Returns
    -------
    Low and high, in the unit of the intervals.
    """
    from scipy.optimize import brentq
    from scipy.special import ndtr

    p = np.array([1.0 - sum(p for p, _ in others), *(p for p, _ in others)])
    low, high = np.array([own, *(interval for _, interval in others)]).T
    middle, std = 0.5 * (low + high), 0.5 * (high - low) / NORMAL95
    ends = float(np.min(low - 5 * std)), float(np.max(high + 5 * std))

    def above(x: float, level: float) -> float:
        return float(p @ ndtr((x - middle) / std)) - level

    return float(brentq(above, *ends, args=(TAIL,))), float(brentq(above, *ends, args=(1.0 - TAIL,)))
