"""Findings about a coast-down and its road load: left-out parts, air, implausible values, outlying runs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from vdyn_cli.quantities.constants import ZERO_CELSIUS
from vdyn_cli.quantities.errors import Finding, ImplausibleValue
from vdyn_cli.quantities.log_names import log_of
from vdyn_cli.quantities.number_text import number, two_digits
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.steps.coastdown.coasts.segments import longest_of_runs
from vdyn_cli.steps.coastdown.coasts.selection import SegmentSelection
from vdyn_cli.steps.coastdown.doubts.odd_decelerations import CHANGED_PAIR, INSPECT, RunDecelerations
from vdyn_cli.steps.coastdown.doubts.outlying_runs import outlying_run
from vdyn_cli.steps.coastdown.doubts.partial_coasts import partial_coasts, whole_coasts
from vdyn_cli.steps.coastdown.fit.residuals import run_forces
from vdyn_cli.steps.coastdown.fit.road_load_fit import MAIN
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY
from vdyn_cli.steps.coastdown.quoted_speeds import quoted_speed
from vdyn_cli.steps.coastdown.road_load_estimates import RoadLoadEstimates, changing_drag

LEAST_SHIFT = 0.1  # half intervals, of a parameter without a run that are written
STANDARD_DAY = (5.0, 35.0)  # degC, SAE J1263


def doubts(estimates: RoadLoadEstimates) -> tuple[Finding, ...]:
    """Findings about the runs and the result.

    On rejected segments, the air of the test, implausible values, the assumed zero of the accelerometer, the quality
    of the fit, outlying runs and contradicted priors.
    """
    found = []
    if estimates.fit.campaign.coasting:  # most of an open road is left out, as the table of rejected parts shows
        found += _rejected(estimates.selection)
        coasts = longest_of_runs(estimates.selection.segments)
        found += partial_coasts(coasts, {s.run: log_of(s.name) for s in coasts})
    if estimates.test is None:
        remedy = "add 'environment: {temperature: ..., pressure: ...}'"
        found.append(Finding("environment", "the road load is not corrected: the temperature is unknown", "", remedy))
    elif not STANDARD_DAY[0] <= estimates.test.temperature - ZERO_CELSIUS <= STANDARD_DAY[1]:
        got = f"{estimates.test.temperature - ZERO_CELSIUS:.1f} degC"
        found.append(Finding("environment", "temperature outside the 5 to 35 degC of SAE J1263", got))
    rolling = estimates.main["rolling_resistance"].value
    if rolling > COASTDOWN_POLICY.most_rolling:
        what = "higher than the rolling resistance of tires: it includes a brake, an engaged driveline or a slope"
        found.append(Finding("rolling_resistance", what, f"{rolling:.4f}"))
    if estimates.zeros and not any(z.by_elevation for z in estimates.zeros.values()):
        what = "the accelerometer's zero assumes a mean slope of zero over all roads"
        found.append(Finding("channels", what, remedy="map 'elevation' if the logs have it, or add more logs"))
    found += _collinear_mass(estimates)
    found += [] if (changing := changing_drag(estimates)) is None else [changing.finding()]
    return (*found, *estimates.quality.findings(), *_outlying_runs(estimates), *_contradicted_givens(estimates))


def _collinear_mass(estimates: RoadLoadEstimates) -> list[Finding]:
    """A note that coasts do not show a wrong mass, where it is stated with an error; an exact one has its own note."""
    mass = next((u.prior for u in estimates.fit.campaign.unknowns if u.name == "mass"), None)
    if not estimates.fit.campaign.coasting or mass is None:
        return []
    speed = quoted_speed(estimates.fit.speeds)
    force = 0.01 * float(estimates.load.force(speed))
    what = (
        f"a wrong mass is collinear with drag area and road load, and coast-downs do not show it: 1 % of mass is "
        f"{two_digits(force)} N at {3.6 * speed:.0f} km/h; the intervals include the stated +- {mass[1]:.2g} kg"
    )
    return [Finding("vehicle.mass", what, "", "weigh the car as it was driven, with crew, fuel and load")]


def _rejected(selection: SegmentSelection) -> list[Finding]:
    """A note for each part of a run that is left out, and a warning for each run of which nothing is used."""
    used = {log_of(s.name) for s in selection.segments}
    lost = {log_of(r.run) for r in selection.rejected} - used
    found = []
    for r in (r for r in selection.rejected if not r.usual):
        span = f"{r.start:.0f} to {r.stop:.0f} s left out: {r.why}"
        if log_of(r.run) in lost:
            what = f"{len(lost)} of {len(used | lost)} runs not used; {span}"
            remedy = "repeat the run, or remove it from 'runs' if it is not a coast-down"
            found.append(Finding(r.run, what, "", remedy, doubt=True))
        else:
            found.append(Finding(r.run, span))
    return found


def implausible_values(parameters: Mapping[str, Estimate]) -> tuple[Finding, ...]:
    """A warning for each estimate of drag coefficient and rolling resistance that no road vehicle has."""
    policy, found = COASTDOWN_POLICY, []
    for name, least, most, whose, digits in (
        ("drag_coefficient", policy.least_drag, policy.most_drag, "any road vehicle", 3),
        ("rolling_resistance", policy.least_rolling, math.inf, "any car's tires", 4),
    ):
        one = parameters.get(name)
        if one is None or one.source == "given" or least <= one.value <= most:
            continue
        side = "lower" if one.value < least else "higher"
        what = f"{side} than the {name.replace('_', ' ')} of {whose}"
        remedy = "check the unit of the speed, the mass and the frontal area, and that the runs are coast-downs"
        value = f"{one.value:.{digits}f}"
        found.append(ImplausibleValue(name, what, value, remedy, doubt=True))
    return tuple(found)


def _outlying_runs(estimates: RoadLoadEstimates) -> list[Finding]:
    """Coasts that are outliers by a share of the road load that matters; on an open road they are not tested.

    First those that ``vdyn check`` reports, by their mean decelerations and without the noise model of the fit.
    """
    if not estimates.fit.campaign.coasting:
        return []
    runs, found = estimates.fit.campaign.runs, _contradicting_coasts(estimates)
    forces, headings = run_forces(estimates.fit)[0], estimates.fit.campaign.headings
    least = COASTDOWN_POLICY.material_run_force * float(estimates.load.force(quoted_speed(estimates.fit.speeds)))
    if (outlier := outlying_run(forces, headings, COASTDOWN_POLICY.outlying_run)) and abs(outlier.force) > least:
        way, size = "higher" if outlier.force > 0 else "lower", abs(outlier.force)
        what = f"resistance is {size:.0f} N {way} than predicted from the other runs (p = {outlier.p_value:.1g})"
        if runs[outlier.run].name not in {f.where for f in found}:
            found.append(Finding(runs[outlier.run].name, what, remedy=INSPECT, doubt=True))
    return found


def _contradicting_coasts(estimates: RoadLoadEstimates) -> list[Finding]:
    """The run that ``vdyn check`` rejects for its deceleration, or two successive ones, and what they change."""
    runs = estimates.fit.campaign.runs
    coasts = [replace(s, run=r.origin) for s, r in zip(estimates.selection.segments, runs, strict=True)]
    rates = RunDecelerations(whole_coasts(longest_of_runs(coasts)), estimates.fit.inertia)
    odd = [one for one in rates.odd() if one.rejected or one.remedy == CHANGED_PAIR]
    if not odd:
        return []
    name, what = odd[0].segment.name, odd[0].fact + _without(estimates, [one.segment.name for one in odd])
    return [Finding(name, what, remedy=odd[0].remedy, doubt=True)]


def _without(estimates: RoadLoadEstimates, runs: Sequence[str]) -> str:
    """The changes of the main parameters without these runs, to first order, by more than ``LEAST_SHIFT``."""
    quality, each = estimates.quality, []
    for name in MAIN:
        shift = sum(quality.shifts.get(run, {}).get(name, 0.0) for run in runs)
        half = quality.fit.solution.half_width(name) if shift else 0.0
        if abs(shift) > LEAST_SHIFT * half:
            each.append(f"{name} is {number(abs(shift), 0.1 * abs(shift))} {'higher' if shift > 0 else 'lower'}")
    return f"; without {'it' if len(runs) == 1 else 'both'} {' and '.join(each)}" if each else ""


def _contradicted_givens(estimates: RoadLoadEstimates) -> list[Finding]:
    """Findings on uncertain given values that the runs contradict."""
    found = []
    for unknown in estimates.fit.campaign.unknowns:
        if unknown.prior is None or unknown.name.startswith("accelerometer"):
            continue
        mean, std = unknown.prior
        value = estimates.fit.solution.values[unknown.name]
        if abs(value - mean) > COASTDOWN_POLICY.given_shift * std:
            what = f"given as {mean:.4g} +- {std:.2g}; the given value and the runs together give {value:.4g}"
            found.append(Finding(f"vehicle.{unknown.name}", what, remedy="check the value and its standard deviation"))
    return found
