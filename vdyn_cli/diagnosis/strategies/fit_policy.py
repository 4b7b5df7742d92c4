"""Every threshold of the fits of candidate models, with its reason; part of ``POLICY``."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FitPolicy:
    """The thresholds of the fits of candidate models: ranges, start values, relinearization."""

    # Fits of candidate models ---------------------------------------------------------------------------------------
    range_factor: float = 1.5
    """[times the plausible range] that an amplitude may reach before the candidate is refused. Ranges come from
    published measurements; half as much again allows for vehicles that were not measured."""

    open_range: float = 3.0
    """[times the plausible range] up to which an effect that fits equally well is listed with the answers. Twice
    range_factor: small and special vehicles differ by that from those of the published measurements. Such an effect is
    not named, and its rivals are not named either."""

    heaviest_car: float = 2500.0
    """[kg] mass of the vehicle above which ranges measured on cars grow in proportion to it. The published brake drags,
    spin losses and drag areas are those of cars of 1 to 2.5 t. Forces of brakes, axles and air grow roughly with the
    mass: a truck of 12 t has ten times the drag area of a car."""

    heaviest_wheel: float = 40.0
    """[kg] mass of the wheel above which ranges measured on cars grow in proportion to it, if the vehicle's mass is
    unknown. Wheels of cars with the parts that turn with them have 15 to 40 kg."""

    common_car: float = 1500.0
    """[kg] below which ranges of force-to-weight coefficients grow as the mass falls. Linear terms of certified road
    loads, up to 6 N s/m, are those of cars of 1.5 t; seals, bearings and gears of a race car of 600 kg have the same
    losses, so that its coefficient may be 2.5 times as large."""

    catalog_prior: float = 0.5
    """[share of the plausible range] standard deviation of the prior while all candidates are fitted at once. Two
    standard deviations reach the edge of the plausible range. Of published results, only laws in another form use it,
    to which intervals extend: coasts that begin at one speed leave their amplitude open."""

    shape_prior: float = 0.25
    """[share of the range] standard deviation of the prior of a shape parameter about its nominal value. Two standard
    deviations each way span the range; without a prior a shape is undetermined at zero amplitude."""

    secant_ratio: float = 0.05
    """slope over secant, below which a sensitivity at zero is replaced by the secant over a probe. Nondifferentiable
    effects such as backlash have no slope at zero, differentiable ones a ratio near 1; set by the rows backlash and
    suspension_friction of the hidden-effect matrix, tests/bench/hidden.md."""

    most_probes: int = 6
    """[starts] from probe amplitudes of a nondifferentiable effect. A bound of the cost: each start is a fit. Backlash
    lists 18 probes from 1e-4 to 0.06 rad, of which six are a factor of 600^(1/5) = 3.6 apart. Only the rows 'backlash'
    of the shaft in tests/bench/hidden.md show that this is close enough."""

    probe_floor: float = 0.1
    """[of the smallest probe] lower bound of a fit started at a probe. Below, such a fit returns to zero, and the start
    at zero covers that; the probes cover larger amplitudes."""

    delay_start: float = 0.01
    """[s] least delay of either sign at which fits of delays are started, besides zero. Suspensions and tires oscillate
    at up to 15 Hz: a residual has its next minimum half a period, 33 ms, away. Bump loads 12 ms late were fitted from
    zero to a significant residual, and to the true delay from starts of 6 to 18 ms."""

    delay_factor: float = 2.5
    """between the delays at which fits are started: 10, 25, 63 and 156 ms. The nearest is off by at most 40 ms, the
    duration of a pedal step, for delays up to 0.2 s."""

    shape_start: float = 0.1
    """[share of the plausible range] amplitude with which fits of another shape are started. The shape needs an
    amplitude to show; a tenth of the range is large enough for that and within it."""

    # Relinearization ------------------------------------------------------------------------------------------------
    large_t: float = 6.0
    """[standard errors] above which an effect is relinearized about its own amplitude. The neglected second order grows
    with the square of the amplitude: of an effect of t standard errors whose law bends by a tenth over its amplitude,
    the fit misses t / 10 standard errors. From t = 6 that exceeds settled_std. It is a bound of the cost as well: each
    takes one simulation with sensitivities."""

    most_relinearized: int = 8
    """[effects] with the largest scores, each compared on its own linearization. A bound of the cost: each takes one
    simulation with sensitivities. The strongest alone is not sufficient: on one log half-shaft damping had a score of
    59 standard errors, and the missing motor inertia one of 14."""

    linearizations: int = 3
    """[rounds] of relinearization, each about the amplitude that the last one found. Steps shrink quadratically
    (Gauss-Newton): three reach the tolerance settled_std or do not converge at all."""

    far_worse: float = 2.0
    """[times the least rms error] of the main channel, above which a large candidate is no answer. A sufficient
    candidate reaches the noise, as the best one does; equivalent ones differ by a few percent. An error within the
    noise of the main channel is allowed: effects on other channels leave the main one as it was."""

    hopeless_share: float = 0.2
    """[share of the misfit] that a large candidate leaves beyond an answer, above which it is rejected. Twice
    negligible_rest, the most that an answer may leave. The share is the root of a ratio of log likelihoods. The noise
    is estimated with the candidate and contains part of what it leaves: the true share is larger."""

    coarse_gain: float = 0.9
    """[of the baseline's rms error] below which a candidate must be at a coarse start, if another one fits. Where the
    baseline is far off, the true effect removes a third or more of the error at the nearest of its starts, which is off
    by at most a factor of 1.6 (coarse_factor) or 2 (coarse_ratio)."""

    coarse_ratio: float = 4.0
    """between the amplitudes from which a fit is started where the baseline is far off. A relinearized fit moves an
    amplitude by a factor of 2 and more in a round. Three starts on either side of zero, from 1/24 to 2/3 of the
    possible range: below the first, the baseline is not far off."""

    coarse_factor: float = 2.5
    """between the scales from which a fit is started where the baseline is far off. Starts at 1.6, 4 and 10 and their
    inverses: the nearest start is off by at most a factor of 1.6."""

    most_linearizations: int = 10
    """[rounds] of relinearization of one effect alone. A bound of the cost: the first rounds move a scale that is off
    by a factor of 10 by a factor of 7 each, and three more reach the estimate; a fit that needs more does not
    converge at all."""

    settled_std: float = 0.5
    """[standard deviations] change of an amplitude between rounds, below which the relinearization ends. Half of its
    own uncertainty: a further round changes the amplitude by less than a quarter of that."""

    near_share: float = 0.1
    """[share of an amplitude] by which a fit may leave its linearization and still be judged by it. The error of a
    linearization is of second order: 1 % of what the effect explains, far below hopeless_share."""
