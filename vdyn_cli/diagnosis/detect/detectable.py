"""The smallest amplitude of each candidate that these data would reveal, reported with an adequate model."""

from __future__ import annotations

from vdyn_cli.diagnosis.detect.detection import Detection
from vdyn_cli.diagnosis.detect.untestable import biased
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.effect_unknowns import largest_plausible
from vdyn_cli.diagnosis.strategies.full_model import FittedModel, FullModel
from vdyn_cli.quantities.diagnosis import Detectable


def detectable(model: FullModel, base: FittedModel, found: Detection) -> tuple[Detectable, ...]:
    """Detectable amplitudes of the testable candidates with one amplitude, the smallest share of its range first.

    Each has the bias of the parameters of the fitted ``base`` by an effect of that amplitude.

    a = s (z(1 - level / 2m) + z(power)), with the standard error s of the amplitude beside the fitted unknowns, m
    testable candidates and normal quantiles z: at this amplitude the test rejects with probability ``power``.

    Assumes the noise of the fit and one family of tests.
    """
    from scipy.special import ndtri

    setup = model.setup
    quantile = float(ndtri(1.0 - setup.level / (2 * max(len(found.testable), 1))) + ndtri(POLICY.revealing_power))
    shares: list[tuple[float, Detectable]] = []
    for name in found.testable:
        effect, spread = setup.candidates[name], found.scores.spread[name]
        if spread.size != 1:
            continue
        unknown = next(iter(effect.unknowns))
        least, most = quantile * float(spread[0]), largest_plausible(effect, unknown)
        if least < most:
            bias = {n: b for n, b in biased(model, base, unknown, least).items() if n not in model.nuisances}
            unit = effect.unknowns[unknown].unit
            entry = Detectable(effect=name, label=effect.label, amplitude=least, unit=unit, would_bias=bias)
            shares.append((least / most, entry))
    return tuple(entry for _, entry in sorted(shares, key=lambda pair: pair[0]))
