"""Large candidates fitted alone, each on its own linearization.

On the baseline's linearization, a wrong candidate may seem to explain several times more than the true one: with a
wrong tire relaxation, half-shaft damping may show ten times the evidence of the relaxation, and none once linearized
about the latter.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from vdyn_cli.diagnosis.detect.detection import Detection
from vdyn_cli.diagnosis.gain.held_out_gain import noise_of, rms_of
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.full_model import FittedModel, hopeless_cost
from vdyn_cli.diagnosis.strategies.relinearization import Stop
from vdyn_cli.steps.added_effects import NO_EFFECTS

if TYPE_CHECKING:
    from vdyn_cli.diagnosis.strategies.linearized import LinearizedStrategy

FitsAlone = Mapping[str, FittedModel | None]  # by candidate; None where the fit fails


def fits_alone(strategy: LinearizedStrategy, found: Detection) -> dict[str, FittedModel | None]:
    """The strongest large candidates, each fitted alone on its own linearization; None where that fails.

    The true candidate may exceed its range on the baseline's linearization: its fit then starts from the one-step
    estimate of the score test.
    """
    if strategy.model.setup.far_off:
        return _from_coarse_starts(strategy, found)
    evidence = found.scores.evidence
    names = sorted((n for n in found.testable if evidence[n] > POLICY.large_t), key=lambda n: -evidence[n])
    fits: dict[str, FittedModel | None] = {}
    for name in names[: POLICY.most_relinearized]:
        linear = strategy.fitted((name,))
        if strategy.relinearization.nondifferentiable((name,)):  # the first linearization is invalid for it
            fits[name] = strategy.relinearization.about_likely(name) or linear
            continue
        start = linear.values if linear else _one_step(strategy, found, name)
        fits[name] = strategy.relinearization.from_values((name,), start, _stop_beside(fits, strategy))
    return fits


def _from_coarse_starts(strategy: LinearizedStrategy, found: Detection) -> dict[str, FittedModel | None]:
    """Candidates fitted alone from the best of coarse starts: scores mean little where the baseline is far off."""
    relinearization, starts = strategy.relinearization, {}
    for name in found.testable:
        if best_start := relinearization.coarse_start(name, _one_step(strategy, found, name)):
            starts[name] = best_start
    assert strategy.model.setup.coarse_error is not None
    baseline = strategy.model.setup.coarse_error(NO_EFFECTS)
    fits: dict[str, FittedModel | None] = {}
    for name in sorted(starts, key=lambda n: starts[n][0])[: POLICY.most_relinearized]:
        error, start = starts[name]
        best = _best_fit(fits)
        fits_already = best is not None and POLICY.far_worse * rms_of(best.runs) < baseline
        if not fits_already or error <= POLICY.coarse_gain * baseline:
            fits[name] = relinearization.from_values((name,), start, _stop_beside(fits, strategy))
    return fits


def _one_step(strategy: LinearizedStrategy, found: Detection, name: str) -> dict[str, float]:
    """A candidate's amplitudes by the score test."""
    return dict(zip(strategy.model.amplitudes(name), found.scores.estimate[name].tolist(), strict=True))


def _stop_beside(fits: FitsAlone, strategy: LinearizedStrategy) -> Stop:
    """The criterion by which a relinearized fit ends early: it cannot reach the best of ``fits``.

    It leaves much of what the best one explains, or misses the main channel by far more, twice in succession.
    """

    def stop(fit: FittedModel, before: FittedModel) -> bool:
        best = _best_fit(fits)
        if best is None:
            return False
        far = largest_error(best)
        now, last = rms_of(fit.runs), rms_of(before.runs)
        return (now > far and last > far and now > last / POLICY.far_worse) or is_hopeless(strategy, fit, best)

    return stop


def _best_fit(fits: FitsAlone) -> FittedModel | None:
    best = best_of(fits)
    return fits[best] if best else None


def best_of(fits: FitsAlone) -> str | None:
    """The candidate with the largest likelihood; None where none can be fitted.

    Each fit has its own noise estimate, which contains what the candidate leaves unexplained, so that only candidates
    with about the same error of the main channel are compared.
    """
    made = {n: fit for n, fit in fits.items() if fit is not None}
    if not made:
        return None
    error = {n: rms_of(fit.runs) for n, fit in made.items()}
    largest = largest_error(made[min(error, key=error.__getitem__)])
    return min((n for n in made if error[n] <= largest), key=lambda n: own_cost(made[n]))


def largest_error(best: FittedModel) -> float:
    """The rms error of the main channel beyond which a fit misses it by far more than the best one does.

    An error within the noise is no miss: a late sensor of another channel, repaired, leaves the main one as it was.
    """
    return max(POLICY.far_worse * rms_of(best.runs), noise_of(best.runs))


def is_hopeless(strategy: LinearizedStrategy, fit: FittedModel, best: FittedModel) -> bool:
    """Whether a candidate leaves so much of the misfit that the best one explains that it cannot be an answer.

    Costs are compared only if the baseline is not far off.
    """
    if strategy.model.setup.far_off:
        return False
    return own_cost(fit) > hopeless_cost(own_cost(strategy.base), own_cost(best))


def own_cost(fit: FittedModel) -> float:
    """Negative log likelihood with the fit's own noise."""
    return fit.solution.cost + fit.runs.regression.log_noise
