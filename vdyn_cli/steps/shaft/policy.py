"""Every threshold by which a test of the half-shafts is refused, doubted or accepted, with its reason."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ShaftPolicy:
    """The thresholds of the step."""

    shaft_excess: float = 1.3
    """[times the sensors' noise] of the residuals, beyond which the law is doubted. Noise levels are known to 10 %."""

    delay_std: float = 3.0
    """[standard deviations] of the delay of a shaft's torque, below which none is corrected. By chance once in 400
    logs, and the fit must also leave a residual without the delay."""

    ratio_agreement: float = 0.02
    """[share of the gear ratio] by which the ratio of the speeds may differ from it. A gear ratio is exact, because
    teeth are counted; gains of two speed sensors differ by less."""


SHAFT_POLICY = ShaftPolicy()
