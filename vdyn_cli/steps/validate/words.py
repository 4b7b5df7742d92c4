"""The sentences of a validation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.validate.band import CHANCE, Band, Verdict
from vdyn_cli.steps.validate.defaults import UNFELT
from vdyn_cli.steps.validate.jerk import JERK
from vdyn_cli.steps.validate.posterior import Posterior
from vdyn_cli.steps.validate.regression import Weighed
from vdyn_cli.steps.validate.sought import FARTHEST
from vdyn_cli.steps.validate.views import shares, word
from vdyn_cli.steps.validate.windows import Ends

STRAINED = 2.5  # standard deviations of a parameter's move, beyond which it is told
RARE = 0.01  # chance of one output's time outside, below which it is named


def outside(told: Mapping[str, Verdict], chance: float) -> list[str]:
    """The outputs that a right model would not miss so long; none where all together are as chance has them."""
    if chance >= CHANCE:
        return []
    found = [n for n, v in told.items() if v.chance <= RARE]
    return found or [min(told, key=lambda n: told[n].chance)]


def strained(w: Weighed, after: Posterior) -> list[str]:
    """Parameters that the drives contradict, the worst first, but for those that a straight drive does not feel."""
    names, strain = w.trial.beliefs.names, np.abs(np.nan_to_num(after.strain))
    return [names[i] for i in np.argsort(-strain) if strain[i] > STRAINED and names[i] not in UNFELT]


def _by_chance(w: Weighed, after: Posterior) -> float:
    """How often a right model shows one strained parameter among those that the drives see."""
    from scipy.special import ndtr

    seen = [n for n, s in zip(w.trial.beliefs.names, after.strain, strict=True) if np.isfinite(s) and n not in UNFELT]
    return float(1.0 - (1.0 - 2.0 * ndtr(-STRAINED)) ** len(seen))


def sentence(
    w: Weighed, found: tuple[dict[str, Band], ...], told: Mapping[str, Verdict], chance: float, after: Posterior
) -> str:
    """What an engineer would say."""
    missed, off = outside(told, chance), strained(w, after)
    drives = len({s.run for s in w.trial.stretches})
    speed = np.concatenate([one["speed"].error for one in found])
    rms = float(np.sqrt(np.nanmean(speed**2)))
    count = f"{drives} drive" + ("s" if drives > 1 else "")
    start = f"Over {count} the simulated speed is off by {3.6 * rms:.2f} km/h rms"
    if missed:
        worst = max(missed, key=lambda n: told[n].share)
        where = _worst_regime(told[worst])
        names = ", ".join(word(n) for n in missed[:4])
        return (
            f"{start}; {names} leave{'s' if len(missed) == 1 else ''} the prediction band ({word(worst)} for "
            f"{told[worst].share:.0%} of the time, most in {where}): the model or a parameter is wrong."
        )
    if off:
        names = ", ".join(word(n) for n in off[:3])
        return f"{start}, within the band, but the drives contradict what was known of {names}."
    leading = _leading(w, found)
    outputs = f"all {len(told)} outputs stay" if len(told) > 1 else f"{word(next(iter(told)))} stays"
    return f"{start}, and {outputs} within the prediction band: the model is as good as its parameters{leading}."


def _leading(w: Weighed, found: tuple[dict[str, Band], ...]) -> str:
    """The parameter whose uncertainty limits the speed."""
    parts = shares(w, found).get("speed", {})
    name = next(iter(parts), "")
    return f", of which {word(name)} limits the speed most ({parts[name]:.0%} of the variance)" if name else ""


def _worst_regime(v: Verdict) -> str:
    return max(v.by_regime, key=lambda r: v.by_regime[r][0] - v.by_regime[r][1], default="all regimes")


def windows_sentence(found: Ends, told: Mapping[str, Verdict]) -> str:
    low, high = found.interval95
    way = "too fast" if found.mean > 0 else "too slow"
    sure = low > 0 or high < 0
    certain = "" if sure else ", which is within chance"
    beyond = np.hypot((high - low) / 4, found.own) * 2 < abs(found.mean)
    why = (
        "more than its parameters' uncertainty explains" if beyond else "no more than its uncertain parameters explain"
    )
    return (
        f"After {found.length:.0f} s the simulated car runs {abs(found.mean):.2f} m/s {way} (95 %: {low:+.2f} to "
        f"{high:+.2f} m/s, {found.error.size} windows of {found.units} trips){certain}" + (f": {why}." if sure else ".")
    )


def warnings(w: Weighed, told: Mapping[str, Verdict], chance: float, after: Posterior) -> tuple[str, ...]:
    """What is to be read first."""
    made = [
        f"{word(n)} is outside its prediction band for {told[n].share:.1%} of the time; a right model stays below "
        f"{told[n].limit:.0%} in 97.5 of 100 cases"
        for n in outside(told, chance)
    ]
    b = w.trial.beliefs
    chance_of_one = _by_chance(w, after)
    for name in strained(w, after):
        i = b.names.index(name)
        q = PARAMETERS.get(name)
        if abs(after.strain[i]) > FARTHEST or (q and not q.lower <= after.values[i] <= q.upper):
            made.append(f"the drives ask for a {word(name)} that is out of the question: something else is wrong")
            continue
        made.append(
            f"the drives ask for {word(name)} = {after.values[i]:.4g} instead of {b.values[name]:.4g} +- "
            f"{b.std[i]:.2g} ({after.strain[i]:+.1f} standard deviations of such a move; {chance_of_one:.0%} of right "
            f"models show one beyond {STRAINED:g}): it, or something that acts like it, may be wrong"
        )
    return tuple(made)


def methods(w: Weighed, model: str) -> str:
    """A paragraph in words."""
    sizes = w.sizes
    felt = " and specific force" if "acceleration" in w.trial.channels else ""
    text = (
        f"The {model} is simulated open loop from the measured start (Runge-Kutta, steps of at most "
        f"{1e3 * w.trial.step:g} ms), driven by the measured torque alone. "
        "Exact sensitivities to every uncertain parameter, with their covariance from the steps that estimated them, "
        "give the band of the parameters. Gusts and wind move the speed of the car and of all wheels alike; their "
        f"sizes come from the residual of speed{felt} by restricted maximum likelihood, what the parameters can "
        f"explain being reckoned with: gusts of {sizes.get('gust', 0.0):.2f} m/s. "
        "White noise of each sensor comes from third differences. "
    )
    if "shaft_torque_left" in w.trial.channels:
        text += (
            "Drive and brake torque are averaged over as many neighbours as lie on a straight line within their noise; "
            "what is left of that noise is sent through the car once more to learn how it colours the other channels. "
            "Rows below 2 m/s are shown, but not weighed. "
        )
    if "acceleration" in w.trial.channels:
        text += (
            "Jerk is the slope of the specific force, measured and simulated, through the same low-pass "
            f"(Gaussian, {JERK.corner:.1f} Hz), unless a jerk channel is there. "
        )
    return text + (
        "\n\nTime outside the band is held against 400 drawn drives of a right model: parameters from their "
        "covariance, gusts, zeros and noise from theirs. All rows, whitened, are weighed with the parameters' "
        "covariance for what the drives say of each parameter."
    )
