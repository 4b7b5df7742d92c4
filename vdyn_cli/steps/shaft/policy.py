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

    eccentric_share: float = 0.5
    """[share] of the variance of the twist beside torque and damping, from which an error that repeats with the wheel's
    turns is corrected. Twist and torque of a shaft without it leave noise and errors of its law, which have no period
    of a turn: below 0.05 on logs of centered encoders, also with backlash or a viscoelastic shaft. Over 2 to 12 turns
    with random pedal inputs, backlash reached it in 1 of 100 simulated logs, progressive and dry shafts in none."""

    eccentric_turns: float = 2.0
    """[turns] of the wheel in a log, at least. In fewer, the error is not seen to repeat, and resembles a tip-in."""

    late_end_share: float = 0.5
    """[share] of the variance of the twist beside torque and damping, from which a delay between the sensors of the
    shaft's ends is compensated. As eccentric_share: speed is no signal of the shaft's own law, so that a shaft without
    a delay leaves a small share to it."""

    ratio_agreement: float = 0.02
    """[share of the gear ratio] by which the ratio of the speeds may differ from it. A gear ratio is exact, because
    teeth are counted; gains of two speed sensors differ by less."""


SHAFT_POLICY = ShaftPolicy()
