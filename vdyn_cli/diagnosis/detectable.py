"""The smallest amplitude of each candidate that these data would reveal: what an adequate model stands for."""

from __future__ import annotations

from vdyn_cli.diagnosis.detection import Detection
from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.effect_unknowns import reach
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.quantities.diagnosis import Detectable


def detectable(setup: DiagnosisSetup, found: Detection) -> tuple[Detectable, ...]:
    """The testable candidates of one amplitude, the smallest share of its plausible range first.

    a = s (z(1 - level / 2m) + z(power)), with the standard error s of the amplitude beside what is fitted, m testable
    candidates and normal quantiles z: with this amplitude the test rejects with the probability ``power``.

    Parameters
    ----------
    found : scores beside the fitted baseline.

    Assumes that the noise is as the fit shows it, and one family of tests.
    """
    from scipy.special import ndtri

    quantile = float(ndtri(1.0 - setup.level / (2 * max(len(found.testable), 1))) + ndtri(POLICY.revealing_power))
    shares: list[tuple[float, Detectable]] = []
    for name in found.testable:
        effect, spread = setup.candidates[name], found.scores.spread[name]
        if spread.size != 1:
            continue
        unknown = next(iter(effect.unknowns))
        least, most = quantile * float(spread[0]), reach(effect, unknown)
        if least < most:
            entry = Detectable(effect=name, label=effect.label, amplitude=least, unit=effect.unknowns[unknown].unit)
            shares.append((least / most, entry))
    return tuple(entry for _, entry in sorted(shares, key=lambda pair: pair[0]))
