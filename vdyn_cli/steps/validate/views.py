"""What a validation shows: measured and simulated traces, bands, tables of regimes, parameters and modes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.uncertainty_budget import two_digits
from vdyn_cli.quantities.result import Comparison, Figure, Series, Table
from vdyn_cli.quantities.vocabulary import CHANNELS, PARAMETERS
from vdyn_cli.steps.validate.band import WIDE, Band, Verdict
from vdyn_cli.steps.validate.posterior import Posterior
from vdyn_cli.steps.validate.regimes import REGIMES
from vdyn_cli.steps.validate.regression import Weighed

Array = NDArray[np.float64]
Found = tuple[dict[str, Band], ...]

DRAWN = ("speed", "wheel_speed_fl", "wheel_speed_rl", "shaft_torque_left", "shaft_torque_right", "acceleration", "jerk")
MOST_DRAWN = 40  # stretches whose traces are kept for the report
TOLD = 4  # parameters named for each output


def unit_of(name: str) -> str:
    return CHANNELS[name].unit


def word(name: str) -> str:
    """A name of the field in plain words."""
    return name.replace("_", " ")


def comparisons(w: Weighed, found: Found) -> tuple[Comparison, ...]:
    """Every output of every stretch, measured and simulated."""
    made = []
    kept = range(0, len(found), max(1, -(-len(found) // MOST_DRAWN)))
    for name in outputs(found):
        for k in kept:
            s, one = w.trial.stretches[k], found[k].get(name)
            if one is None:
                continue
            simulated = one.measured + one.error
            since = s.time - s.time[0]
            made.append(
                Comparison(s.name, name, unit_of(name), since, "time in the drive [s]", one.measured, simulated)
            )
    return tuple(made)


def outputs(found: Found) -> list[str]:
    return list(dict.fromkeys(n for one in found for n in one))


def figures(w: Weighed, found: Found) -> tuple[Figure, ...]:
    """The error of each output with its bands, in the drive in which most of it lies outside."""
    made = []
    for name in (n for n in DRAWN if n in outputs(found)):
        there = [k for k in range(len(found)) if name in found[k]]
        worst = max(there, key=lambda k: float(np.mean(found[k][name].outside)))
        made.append(_error_figure(w, worst, name, found[worst][name]))
    return tuple(made)


def _error_figure(w: Weighed, run: int, name: str, band: Band) -> Figure:
    s = w.trial.stretches[run]
    since = s.time - s.time[0]
    own = WIDE * band.own
    series = (
        Series("95 % with gusts and sensors", since, -band.half, "band", band.half, role="muted"),
        Series("95 % of the parameters alone", since, -own, "band", own, role="reference"),
        Series("simulated less measured", since, np.where(s.stopping, np.nan, band.error), role="residual"),
    )
    return Figure(
        f"band_{name}",
        f"{word(name).capitalize()}: error and prediction band, {s.name.rpartition('/')[2]}",
        "Simulated less measured, with the band that the parameters' own uncertainty gives and the wider one that "
        "gusts and sensors add. Good: the line keeps within the wide band but for some 5 % of its noise. Outside it "
        "the model is wrong, whatever the parameters; within it they are merely uncertain. The moment of coming to "
        "rest is left out: every gust shifts it.",
        "time in the drive [s]",
        f"{word(name)} [{unit_of(name)}]",
        series,
    )


def output_table(found: Found, told: dict[str, Verdict]) -> Table:
    """Every output over all drives."""
    rows = []
    for name in outputs(found):
        error = np.concatenate([one[name].error for one in found if name in one])
        error = error[np.isfinite(error)]
        sensor = float(np.median([one[name].sensor for one in found if name in one]))
        own = float(np.sqrt(np.mean(np.concatenate([one[name].own for one in found if name in one]) ** 2)))
        v = told[name]
        rows.append(
            (
                word(name),
                unit_of(name),
                *(f"{x:.3g}" for x in (np.sqrt(np.mean(error**2)), error.mean(), np.abs(error).max(), sensor, own)),
                f"{v.share:.1%}",
                f"{v.limit:.0%}",
                f"{v.chance:.2g}",
            )
        )
    head = ("output", "unit", "rms", "bias", "largest", "sensor noise", "parameters", "outside", "limit", "chance")
    return Table(
        "outputs",
        "Error of every output over all drives",
        head,
        tuple(rows),
        "Error is simulated less measured; 'parameters' is the rms of the standard deviation that their uncertainty "
        "gives. 'outside' is the share of time outside the 95 % band; gusts and parameters move a whole drive at once, "
        "so that a right model can be outside for longer: it stays below 'limit' in 97.5 of 100 cases, and is as far "
        "outside as here with the chance in the last column.",
    )


def regime_table(w: Weighed, found: Found, told: dict[str, Verdict]) -> Table:
    """Rms error against sensor noise and share of time outside, by regime."""
    rows = []
    for name in outputs(found):
        for i, regime in enumerate(REGIMES):
            error, expected = _in_regime(w, found, name, i)
            if error.size < 10 or regime not in told[name].by_regime:
                continue
            share, limit = told[name].by_regime[regime]
            rms = float(np.sqrt(np.mean(error**2)))
            rows.append(
                (
                    word(name),
                    regime,
                    f"{rms:.3g}",
                    f"{error.mean():+.2g}",
                    f"{np.abs(error).max():.3g}",
                    f"{expected:.3g}",
                    f"{share:.1%}",
                    f"{limit:.0%}",
                    "look here" if share > max(limit, 0.05) else "",
                )
            )
    head = ("output", "regime", "rms", "bias", "largest", "expected rms", "outside", "limit", "")
    return Table(
        "regimes",
        "Error by regime",
        head,
        tuple(rows),
        "Launch: from rest to 6 m/s; low speed: below 3 m/s otherwise, without the moment of coming to rest, which "
        "every gust shifts. 'expected rms' is what uncertain parameters, gusts and sensors explain. Good: rms near or "
        "below it everywhere. 'look here': outside for longer than a right model is in 97.5 of 100 cases, regime by "
        f"regime; of these {len(rows)} about {0.025 * len(rows):.0f} would be so by chance, and the sentence above "
        "reckons with that.",
    )


def _in_regime(w: Weighed, found: Found, name: str, regime: int) -> tuple[Array, float]:
    errors, variances = [], []
    for s, one in zip(w.trial.stretches, found, strict=True):
        if name in one:
            here = (s.marks == regime) & np.isfinite(one[name].error) & ~s.stopping
            errors.append(one[name].error[here])
            variances.append((one[name].half[here] / WIDE) ** 2)
    error, variance = np.concatenate(errors), np.concatenate(variances)
    return error, float(np.sqrt(variance.mean())) if variance.size else 0.0


def shares(w: Weighed, found: Found) -> dict[str, dict[str, float]]:
    """Of every output, each parameter's share of the variance that their uncertainty gives, largest first."""
    names = w.trial.beliefs.names
    made = {}
    for name in outputs(found):
        parts = np.sum([one[name].shares for one in found if name in one], axis=0)
        total = float(parts.sum())
        order = np.argsort(-parts)
        made[name] = {names[i]: float(parts[i] / total) for i in order} if total > 0 else {}
    return made


def share_table(w: Weighed, found: Found) -> Table:
    rows = []
    for name, parts in shares(w, found).items():
        leading = [f"{word(n)} {p:.0%}" for n, p in list(parts.items())[:TOLD] if p > 0.005]
        own = float(np.sqrt(np.mean(np.concatenate([one[name].own for one in found if name in one]) ** 2)))
        rows.append((word(name), f"{two_digits(own)} {unit_of(name)}", ", ".join(leading)))
    return Table(
        "shares",
        "Whose uncertainty makes the band",
        ("output", "standard deviation", "share of its variance"),
        tuple(rows),
        "Of the band that the parameters alone give, over all drives. To narrow it, measure the first one better; "
        "correlated parameters share what they do together.",
    )


def parameter_table(w: Weighed, after: Posterior) -> Table:
    """Prior, posterior and strain of each parameter that the drives see; the others named below."""
    b = w.trial.beliefs
    rows, unseen = [], []
    for i in np.argsort(-np.nan_to_num(np.abs(after.strain), nan=-1.0)):
        name = b.names[i]
        unit = PARAMETERS[name].unit if name in PARAMETERS else ""
        if not np.isfinite(after.strain[i]):
            unseen.append(word(name))
            continue
        rows.append(
            (
                word(name),
                b.sources[name],
                f"{b.values[name]:.5g} ± {two_digits(float(b.std[i]))} {unit}".strip(),
                f"{after.values[i]:.5g} ± {two_digits(float(after.std[i]))} {unit}".strip(),
                f"{np.sqrt(after.told[i]):.0%}" if after.told[i] < 0.995 else "all",
                f"{after.strain[i]:+.1f}",
            )
        )
    blind = f" Not seen by these drives: {', '.join(sorted(unseen))}." if unseen else ""
    return Table(
        "parameters",
        "What the drives say of each parameter",
        ("parameter", "from", "before", "after", "seen", "strain"),
        tuple(rows),
        "'seen': how much of the uncertainty before the drives takes away (as a standard deviation). Strain: the move "
        "that the drives ask for, over the standard deviation that a right model would move by. Good: within ±2; "
        "beyond ±2.5 that parameter, or something that acts like it, may be wrong. Nothing is published from this "
        f"table: the estimates of the steps stand.{blind}",
    )
