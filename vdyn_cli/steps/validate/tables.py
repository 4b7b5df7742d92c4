"""Tables of a validation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.physics.models.vibration_modes import Mode
from vdyn_cli.quantities.arrays import Array, rms
from vdyn_cli.quantities.constants import NORMAL95, ZERO_CELSIUS
from vdyn_cli.quantities.number_text import two_digits
from vdyn_cli.quantities.result import Table
from vdyn_cli.quantities.vocabulary import CHANNELS, PARAMETERS
from vdyn_cli.steps.validate.drives.regimes import REGIMES
from vdyn_cli.steps.validate.road.open_road import HeldOutEnds, RoadFindings
from vdyn_cli.steps.validate.text import short_name, words
from vdyn_cli.steps.validate.validation import Validation
from vdyn_cli.steps.validate.window_ends import WindowEnds

Row = tuple[str, ...]

NAMED = 4  # parameters named for each output


def output_table(v: Validation) -> Table:
    """Every output over all drives."""
    rows: list[Row] = []
    for name in v.outputs:
        error, test = v.errors(name), v.tests[name]
        sensor = float(np.median([one.sensor for one in v.bands_of(name)]))
        sizes = rms(error), error.mean(), np.abs(error).max(), sensor, v.parameter_std(name)
        numbers = (
            *(f"{x:.3g}" for x in sizes),
            f"{100 * test.share:.1f} %",
            f"{100 * test.limit:.0f} %",
            f"{test.chance:.2g}",
        )
        rows.append((words(name), CHANNELS[name].unit, *numbers))
    return Table(
        "outputs",
        "Error of every output over all drives",
        ("output", "unit", "rms", "bias", "largest", "sensor noise", "parameters", "outside", "limit", "chance"),
        tuple(rows),
        "Error is simulated minus measured; 'parameters' is the rms of the standard deviation that their uncertainty "
        "causes. 'outside' is the share of time outside the 95 % band. Gusts and parameters move a whole drive at "
        "once, so a correct model can be outside for longer than 5 %: it stays below 'limit' in 97.5 of 100 cases. "
        "'chance' is the p value of the time outside.",
    )


def regime_table(v: Validation) -> Table:
    """Rms error against sensor noise and share of time outside, by regime."""
    rows: list[Row] = []
    for name in v.outputs:
        for i, regime in enumerate(REGIMES):
            error, expected = _in_regime(v, name, i)
            if error.size < 10 or regime not in v.tests[name].by_regime:
                continue
            share, limit = v.tests[name].by_regime[regime]
            numbers = (
                f"{rms(error):.3g}",
                f"{error.mean():+.2g}",
                f"{np.abs(error).max():.3g}",
                f"{expected:.3g}",
                f"{100 * share:.1f} %",
                f"{100 * limit:.0f} %",
            )
            rows.append((words(name), regime, *numbers, "look here" if share > max(limit, 0.05) else ""))
    return Table(
        "regimes",
        "Error by regime",
        ("output", "regime", "rms", "bias", "largest", "expected rms", "outside", "limit", ""),
        tuple(rows),
        "Launch: from rest to 6 m/s; low speed: below 3 m/s otherwise, without the last moment before standstill, "
        "which gusts shift. 'expected rms' is what uncertain parameters, gusts and sensors explain. Good: rms near or "
        "below it everywhere. 'look here': outside for longer than a correct model in 97.5 of 100 cases, regime by "
        f"regime; of these {len(rows)} rows about {0.025 * len(rows):.0f} are expected by chance; the sentence above "
        "accounts for that.",
    )


def _in_regime(v: Validation, name: str, regime: int) -> tuple[Array, float]:
    """The errors of an output in a regime, and their expected rms."""
    errors, variances = [], []
    for s, one in zip(v.segments, v.bands, strict=True):
        if name in one:
            here = (s.marks == regime) & np.isfinite(one[name].error) & ~s.stopping
            errors.append(one[name].error[here])
            variances.append((one[name].half[here] / NORMAL95) ** 2)
    error, variance = np.concatenate(errors), np.concatenate(variances)
    return error, float(np.sqrt(variance.mean())) if variance.size else 0.0


def share_table(v: Validation) -> Table:
    """The parameters that contribute most to the band of each output."""
    rows = []
    for name, parts in v.shares.items():
        leading = [f"{words(n)} {100 * p:.0f} %" for n, p in list(parts.items())[:NAMED] if p > 0.005]
        std = f"{two_digits(v.parameter_std(name))} {CHANNELS[name].unit}"
        rows.append((words(name), std, ", ".join(leading)))
    return Table(
        "shares",
        "Contributions to the prediction band",
        ("output", "standard deviation", "share of its variance"),
        tuple(rows),
        "Contributions to the band of the parameters alone, over all drives. To narrow it, measure the first "
        "parameter more accurately. Correlated parameters share their common part.",
    )


def parameter_table(v: Validation) -> Table:
    """Prior, posterior and pull of each parameter that is identifiable from the drives; the note names the others."""
    b, after = v.prior, v.posterior
    rows, unseen = [], []
    for i in np.argsort(-np.nan_to_num(np.abs(after.pull), nan=-1.0)):
        name = b.names[i]
        unit = PARAMETERS[name].unit if name in PARAMETERS else ""
        if not np.isfinite(after.pull[i]):
            unseen.append(words(name))
            continue
        rows.append(
            (
                words(name),
                b.sources[name],
                f"{b.values[name]:.5g} ± {two_digits(float(b.std[i]))} {unit}".strip(),
                f"{after.values[i]:.5g} ± {two_digits(float(after.std[i]))} {unit}".strip(),
                f"{100 * np.sqrt(after.reduction[i]):.0f} %" if after.reduction[i] < 0.995 else "all",
                f"{after.pull[i]:+.1f}",
            )
        )
    blind = f" Not identifiable from these drives: {', '.join(sorted(unseen))}." if unseen else ""
    return Table(
        "parameters",
        "Pull of each parameter",
        ("parameter", "from", "before", "after", "reduction", "pull"),
        tuple(rows),
        "'reduction': root of the share of the prior variance that the drives remove. Pull: the change that the "
        "drives require, over its standard deviation with a correct model. Good: within ±2; beyond ±2.5 that "
        "parameter may be wrong, or an effect collinear with it is present. This table changes no parameter: the "
        f"estimates of the steps stay.{blind}",
    )


def mode_table(found: Sequence[Mode]) -> Table:
    """Eigenmodes of the car about a cruise."""
    rows = tuple(
        (
            m.name,
            f"{m.frequency:.2f}",
            f"{100 * m.damping:.0f} %",
            ", ".join(words(n) for n, _ in m.frequency_movers(2)),
            ", ".join(words(n) for n, _ in m.damping_movers(2)),
        )
        for m in found
    )
    return Table(
        "modes",
        "Eigenmodes about a cruise at 50 km/h",
        ("mode", "frequency [Hz]", "damping", "frequency moved most by", "damping moved most by"),
        rows,
        "Natural frequencies of the car, slowest first. Damping is the share of critical damping.",
    )


def window_table(found: WindowEnds) -> Table:
    """End errors of windows, one row a trip."""

    def cells(e: Array) -> Row:
        spread = f"{e.std(ddof=1):.2f}" if e.size > 1 else ""
        return f"{e.size}", f"{e.mean():+.2f}", spread, f"{100 * np.mean(e > 0):.0f} %"

    rows = [(short_name(found.names[u]), *cells(found.error[found.run == u])) for u in np.unique(found.run)]
    low, high = found.interval95
    if found.units > 1:
        rows.append(("mean of windows", *cells(found.error)))
        rows.append(("mean of trips", "", f"{found.mean:+.2f} ({low:+.2f} to {high:+.2f})", "", ""))
    return Table(
        "window_ends",
        f"End speed of {found.length:.0f} s windows, simulated minus measured",
        ("trip", "windows", "mean [m/s]", "scatter [m/s]", "too fast"),
        tuple(rows),
        "Each window is simulated from its measured start speed. Good: the mean over all trips is zero within its "
        "95 % interval, which comes from the scatter between trips. Bad: nearly all windows end too fast (resistance "
        "or mass is larger, or torque smaller, than in the model) or too slow.",
    )


def road_tables(found: RoadFindings) -> list[Table]:
    """Held-out drives, roads with the accelerometer's zero, and the force that holds a speed."""
    held_out = [] if found.held_out is None else [_held_out(found.names, found.held_out)]
    return [*held_out, _roads(found), _holding(found)]


def _held_out(names: tuple[str, ...], ends: HeldOutEnds) -> Table:
    before, after = ends.by_drive()
    rows: list[Row] = []
    for k, name in enumerate(names):
        mine = ends.run == k
        means = (f"{e[mine].mean():+.2f}" for e in (ends.before, ends.after))
        rows.append((short_name(name), f"{mine.sum()}", *means, f"{before[k]:.2f}", f"{after[k]:.2f}"))
    gain, means = ends.gain(), (f"{m.value:+.2f}" for m in ends.means())
    rows.append(("mean of drives", "", *means, f"{before.mean():.2f}", f"{after.mean():.2f}"))
    rows.append(("reduction of rms, 95 %", "", "", "", "", f"{gain.interval95[0]:.2f} to {gain.interval95[1]:.2f}"))
    return Table(
        "held_out_ends",
        "End errors of held-out drives, m/s",
        ("drive", "windows", "mean before", "mean after", "rms before", "rms after"),
        tuple(rows),
        "Simulated minus measured speed at the end of each window. 'before' is the simulation as described; 'after' "
        "is the extended one, fitted to all other drives; of the drive itself only its start speeds and its "
        "accelerometer are used. Good: the mean 'after' is near zero, and the rms decreases in nearly every drive.",
    )


def _roads(found: RoadFindings) -> Table:
    rows = [
        (
            short_name(n),
            f"{r.distance[-1] / 1000:.1f}",
            f"{100 * r.profile.std():.2f}",
            f"{z.value:+.3f}",
            f"{z.std:.3f}",
        )
        for n, r, z in zip(found.names, found.roads, found.zeros, strict=True)
    ]
    zero = found.common_zero
    low, high = zero.interval95
    rows.append(("all drives", "", "", f"{zero.value:+.3f}", f"95 %: {low:+.3f} to {high:+.3f}"))
    return Table(
        "roads",
        "Roads and the accelerometer's zero",
        ("drive", "length [km]", "scatter of the slope [%]", "zero [m/s^2]", "+-"),
        tuple(rows),
        "The slope of each 100 m is (specific force - rate of speed - zero) / g. The zero is chosen so that the whole "
        "drive has the mean slope that is estimated from its torque and from the other drives (all share one sensor). "
        "A tilt of one degree is a zero of 0.17 m/s^2.",
    )


def _holding(found: RoadFindings) -> Table:
    forces = [(f"{v:.0f}", f) for v, f in found.holding.items()]
    s = found.seasons
    if s is not None:
        cold, warm = s.cold - ZERO_CELSIUS, s.warm - ZERO_CELSIUS
        forces += [(f"60 at {warm:.0f} degC", s.in_warm), (f"60 at {cold:.0f} degC", s.in_cold)]
        forces.append(("60: increase by cold", s.more))
    rows = [
        (what, f"{f.value:.0f}", f"{f.std:.0f}", f"{f.interval95[0]:.0f} to {f.interval95[1]:.0f}")
        for what, f in forces
    ]
    return Table(
        "holding_force",
        "Drive force that holds a speed on a level road",
        ("speed [km/h]", "force [N]", "+-", "95 %"),
        tuple(rows),
        "Torque x gear ratio / radius at the sensor, in still air at the drives' mean temperature, driveline losses "
        "included. It compares seasons, tires and loads without separate mass and loss.",
    )
