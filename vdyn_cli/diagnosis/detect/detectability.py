"""What these data would reveal of each candidate, and the bias of the parameters by what they would not."""

from __future__ import annotations

import math

import numpy as np

from vdyn_cli.diagnosis.detect.detection import Detection, Obstacle, fewest_runs, obstacle
from vdyn_cli.diagnosis.detect.scores import Scores, omitted_effect_bias
from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.effect_unknowns import largest_plausible
from vdyn_cli.diagnosis.strategies.full_model import FittedModel, FullModel
from vdyn_cli.quantities.diagnosis import Detectable, NotTestable

# These choose words and what is shown, no verdict.
NOTICEABLE = 0.01  # standard deviations of a parameter: a smaller bias does not change its last published digit
COLLINEAR = 1e-3  # visibility below which the text says "exactly collinear"
NAMED = 3  # largest number of parameters that the text names as collinear with an effect
DISTINCT = 0.9  # visibility above which the text does not mention collinearity


def untestable(model: FullModel, base: FittedModel, found: Scores) -> tuple[NotTestable, ...]:
    """The candidates that change the outputs in these data but are not detectable beside the fitted baseline.

    Each has an assumed amplitude, and the bias of the parameters if it were present with that.
    """
    result = []
    for name, effect in model.setup.candidates.items():
        unknown = model.amplitudes(name)[0]
        sensitivity = base.system.columns_of([unknown])[:, 0]
        why = obstacle(model, found, name)
        if why in (None, "nuisance") or not np.any(sensitivity):
            continue
        amplitude = POLICY.typical_share * largest_plausible(effect, unknown)
        noticed = biased(model, base, unknown, amplitude)
        bias = {n: m for n, m in noticed.items() if n not in model.nuisances}
        like = " and ".join(bias) if bias == noticed and 0 < len(bias) <= NAMED else "the fitted parameters"
        because = _because(model, why, found.visibility[name], like)
        unit = effect.unknowns[unknown].unit
        result.append(NotTestable(effect=name, because=because, size=amplitude, unit=unit, would_bias=bias))
    return tuple(result)


def biased(model: FullModel, base: FittedModel, unknown: str, amplitude: float) -> dict[str, float]:
    """The noticeable bias of each fitted unknown, in its unit, by an effect of this amplitude that is not in the model.

    Parameters
    ----------
    unknown : amplitude of the effect. base : fit of the model without it, on whose linearization the bias is computed.
    """
    moved = amplitude * omitted_effect_bias(base.system, model.base_unknowns, base.system.columns_of([unknown])[:, 0])
    return {
        n: float(m)
        for n, m in zip(model.base_unknowns, moved, strict=True)
        if abs(m) > NOTICEABLE * base.solution.std[n]
    }


def lacking_channels(setup: DiagnosisSetup) -> tuple[NotTestable, ...]:
    """The effects of the catalog that lack a channel, each with the reason."""
    return tuple(
        NotTestable(effect=name, because=f"needs {lacked}", size=math.nan, unit="", would_bias={})
        for name, lacked in setup.lacking.items()
    )


def _because(model: FullModel, why: Obstacle, visibility: float, like: str) -> str:
    run, share = model.setup.run, f"{100 * visibility:.2g} % of its sensitivity"
    if why == "runs":
        fewest = fewest_runs(model.setup.level)
        return f"it varies between {run}s: {model.run_count} {run}s are too few to test it (needed: {fewest})"
    if why == "collinear":
        if visibility <= COLLINEAR:
            return f"exactly collinear with {like}"
        return f"collinear with {like}: only {share} is not"
    if visibility < DISTINCT:
        return f"only {share} is not collinear with the fitted parameters, which is below the noise"
    return "not detectable above the noise at any plausible amplitude"


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
