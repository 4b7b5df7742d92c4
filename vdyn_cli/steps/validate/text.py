"""Sentences, warnings and the methods paragraph of a validation."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import rms
from vdyn_cli.quantities.number_text import listed
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.validate.car.prior import FARTHEST, INSENSITIVE
from vdyn_cli.steps.validate.drives.jerk import CORNER
from vdyn_cli.steps.validate.policy import VALIDATE_POLICY
from vdyn_cli.steps.validate.validation import Validation
from vdyn_cli.steps.validate.window_ends import WindowEnds


def words(name: str) -> str:
    """A name as words: ``shaft_torque_left`` is "shaft torque left"."""
    return name.replace("_", " ")


def short_name(log: str) -> str:
    """The file of a log without its folder."""
    return log.rpartition("/")[2]


def sentence(v: Validation) -> str:
    """The error of the speed over all logs, and which outputs leave their band; what is wrong is the diagnosis's."""
    logs = len({s.log for s in v.segments})  # a cut divides one into several runs
    off = rms(v.errors("speed"))
    start = f"Over {logs} log{'s' if logs > 1 else ''} the simulated speed is off by {3.6 * off:.2f} km/h rms"
    if v.outside:
        worst = max(v.outside, key=lambda n: v.tests[n].share)
        test, names = v.tests[worst], listed([words(n) for n in v.outside[:4]])
        at = max(test.by_regime, key=lambda r: test.by_regime[r][0] - test.by_regime[r][1], default="all regimes")
        return (
            f"{start}; {names} leave{'s' if len(v.outside) == 1 else ''} the prediction band ({words(worst)} for "
            f"{100 * test.share:.1f} % of the time, most in {at}; a correct model: at most "
            f"{100 * test.limit:.1f} %)."
        )
    if v.contradicted:
        names = listed([words(n) for n in v.contradicted[:3]])
        priors = f"prior{'s' if len(v.contradicted) > 1 else ''} of {names}"
        return f"{start}, within the prediction band, but the drives contradict the {priors}."
    outputs = f"all {len(v.tests)} outputs stay" if len(v.tests) > 1 else f"{words(next(iter(v.tests)))} stays"
    return (
        f"{start}, and {outputs} within the prediction band: the uncertainty of the parameters allows an "
        f"error of this size{_leading(v)}."
    )


def _leading(v: Validation) -> str:
    """The parameter whose uncertainty contributes most to the band of the speed, as the end of a sentence."""
    parts = v.shares.get("speed", {})
    name = next(iter(parts), "")
    if not name:
        return ""
    if parts[name] > 1.0:  # others compensate it
        return f" ({words(name)} contributes most)"
    return f" ({words(name)} contributes most, {100 * parts[name]:.0f} % of the variance of the speed)"


def windows_sentence(found: WindowEnds) -> str:
    """The mean error of the simulated speed at the end of windows, with its interval."""
    low, high = found.interval95
    way = "too fast" if found.mean > 0 else "too slow"
    error = f"After {found.length:.0f} s the simulated car is {abs(found.mean):.2f} m/s {way}"
    if found.units == 1:
        windows = f"mean of {found.error.size} windows of one trip" if found.error.size > 1 else "one window"
        return f"{error} ({windows}; log further trips for an interval)."
    error += f" (95 %: {low:+.2f} to {high:+.2f} m/s, {found.error.size} windows of {found.units} trips)"
    if not (low > 0 or high < 0):
        return f"{error}, which is within chance."
    beyond = np.hypot((high - low) / 4, found.own) * 2 < abs(found.mean)
    return f"{error}: {'more' if beyond else 'no more'} than its parameters' uncertainty explains."


def replaced_drives(missed: float) -> str:
    """The sentence on windows instead of drives, whose rms error of the speed is ``missed``, m/s; empty for 0."""
    if not missed:
        return ""
    return (
        f" This holds for windows with drive torque only: over the whole drives the simulated speed is off by "
        f"{3.6 * missed:.1f} km/h rms, which no candidate effect explains, and coasting and braking are not tested."
    )


def warnings(v: Validation) -> tuple[str, ...]:
    """Outputs outside their band, and parameters that the drives contradict."""
    made = [
        f"{words(n)} is outside its prediction band for {100 * v.tests[n].share:.1f} % of the time; a correct model "
        f"stays below {100 * v.tests[n].limit:.1f} % in 97.5 of 100 cases"
        for n in v.outside
    ]
    return (*made, *_contradictions(v))


def _contradictions(v: Validation) -> list[str]:
    """Estimates outside the physical range, and one sentence on all stated parameters that the drives contradict.

    They come from one fit, in which one wrong parameter or a wrong torque moves all that are nearly collinear with it.
    """
    b, after = v.prior, v.posterior
    made: list[str] = []
    pulled: list[str] = []
    for name in sorted(v.contradicted, key=lambda n: -abs(after.pull[b.names.index(n)])):
        i, q = b.names.index(name), PARAMETERS.get(name)
        if abs(after.pull[i]) > FARTHEST or (q and not q.lower <= after.values[i] <= q.upper):
            value = f"{words(name)} = {after.values[i]:.4g}"
            made.append(f"estimate outside the physical range ({value}): another parameter or the data are wrong")
            continue
        pulled.append(
            f"{words(name)} = {after.values[i]:.4g} instead of {b.values[name]:.4g} +- {b.std[i]:.2g} "
            f"(pull {after.pull[i]:+.1f})"
        )
    if pulled:
        which = "it" if len(pulled) == 1 else "one of them"
        made.append(
            f"the drives require {listed(pulled)}: {which} or the drive torque may be wrong, or an unmodeled effect is "
            f"present ({100 * _by_chance(v):.0f} % of correct models have a pull beyond {VALIDATE_POLICY.large_pull:g})"
        )
    return made


def _by_chance(v: Validation) -> float:
    """Probability that a correct model has a large pull among the parameters identifiable from the drives."""
    from scipy.special import ndtr

    pulls = zip(v.prior.names, v.posterior.pull, strict=True)
    seen = [n for n, pull in pulls if np.isfinite(pull) and n not in INSENSITIVE]
    return float(1.0 - (1.0 - 2.0 * ndtr(-VALIDATE_POLICY.large_pull)) ** len(seen))


def methods(v: Validation) -> str:
    """The methods paragraph: how the result was computed."""
    setup = v.whitened.setup
    channels = setup.sensors.channels
    force = " and specific force" if "acceleration" in channels else ""
    text = (
        f"The {setup.model.name} is simulated open loop from the measured start (Runge-Kutta, steps of at most "
        f"{1e3 * setup.point.car.step:g} ms), driven by the measured torque alone. "
        "Exact sensitivities to every uncertain parameter, with their covariance from the steps that estimated them, "
        "give the band of the parameters. Gusts and wind move the speed of the car and of all wheels alike; their "
        f"standard deviations come from the residual of speed{force} by restricted maximum likelihood with the "
        f"parameters as unknowns: gusts of {v.whitened.sizes.get('gust', 0.0):.2f} m/s. "
        "White noise of each sensor comes from third differences. "
    )
    if "shaft_torque_left" in channels:
        text += (
            "Drive and brake torque are averaged over as many neighbors as lie on a straight line within their noise. "
            "The simulation is repeated with additional noise of that amplitude; this gives the correlation of the "
            "other channels. Rows below 2 m/s are shown, but have no weight. "
        )
    if "acceleration" in channels:
        text += (
            "Jerk is the slope of the specific force, measured and simulated, through the same low-pass "
            f"(Gaussian, {CORNER:.1f} Hz), unless a jerk channel is logged. "
        )
    return text + (
        "\n\nTime outside the band is compared with 400 Monte Carlo drives of a correct model: parameters from their "
        "covariance, gusts, errors of channels and noise from theirs. All whitened rows and the parameters' covariance "
        "give the posterior of each parameter."
    )
