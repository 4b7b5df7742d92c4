"""Every threshold by which a tire test is refused, doubted or accepted, with its reason."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class TirePolicy:
    """The thresholds of the step."""

    prior_contradicted: float = 3.0
    """[standard deviations] from a stated shape factor, beyond which the fitted one contradicts it. By chance once in
    400 tests."""

    peak_slip: float = 0.15
    """[slip] by which a tire on asphalt has passed its peak. Pacejka, Tire and Vehicle Dynamics, ch. 4: 0.1 to 0.2."""

    departure: float = 0.1
    """[share of the peak friction] standard deviation of each coefficient of a curve's departure from the magic
    formula. Coefficients fitted to brush and exponential laws reach 0.15."""

    free_form_e: float = 2.0
    """[-] standard deviation of E, about 0, for a curve that may depart from the magic formula. Fitted to laws of other
    forms, the magic formula has E from -3 to 1."""

    departs: float = 0.003
    """[probability] below which the sweeps contradict the magic formula, and the slope at zero slip is that of a curve
    with a free form: three standard deviations. The free form's interval is wider, and a tire of the formula seldom
    needs it."""

    kept_slope: float = 0.5
    """[share] of a change in friction by which the slope at zero slip does not change: mean and standard deviation for
    a curve that may depart from the magic formula. 0: the whole curve is scaled (load sensitivity of the contact); 1:
    the slope of the tread's stiffness stays, as in the brush model (Pacejka, section 4.2). The middle is one standard
    deviation from both."""

    rim_share: float = 0.5
    """[share] q of the curve in s (1 + s)^(-q), s the slip: mean and standard deviation for a curve that may depart
    from the magic formula. 0: the formula, odd in the slip; 1: models of the contact patch, odd in the slip relative to
    the rim's speed (Pacejka, section 3.2). The middle is one standard deviation from both."""

    speeds_differ: float = 0.1
    """[share of their mean] standard deviation of the squared speeds, below which the sweeps have one speed. A radius
    that is 0.5 % larger by growth then varies by 0.05 %, less than the 0.1 % to which radii are measured: it is a wrong
    radius."""

    two_peaks: float = 0.04
    """[share of the friction] by which the peaks in driving and braking must differ to be reported. Twice the effect of
    a force zero of 1 % of full scale."""


TIRE_POLICY = TirePolicy()
