"""Findings on the quality of a fitted road load: its noise, its road, its agreement with the logs, single runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.number_text import number, two_digits
from vdyn_cli.steps.coastdown.doubts.agreement import LocalForces, influence, local_forces, shared_force
from vdyn_cli.steps.coastdown.doubts.changed_runs import changed_runs, findings_after_change
from vdyn_cli.steps.coastdown.doubts.one_way import one_way_shifts, unbalanced_finding, unbalanced_shift
from vdyn_cli.steps.coastdown.doubts.outlying_runs import influential_runs
from vdyn_cli.steps.coastdown.doubts.sheltered_wind import sheltered_wind_finding, sheltered_wind_shift
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit
from vdyn_cli.steps.coastdown.fit.road_load_rows import ROUGHNESS
from vdyn_cli.steps.coastdown.noise import LARGEST_GUST
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

# Largest physical amplitudes. Speed: receivers and wheel sensors are accurate to 0.1 m/s, or 0.3 m/s where the value is
# held or rounded to 1 km/h. Road: SAE J1263 allows a slope of 0.5 % on a test road.
LIMITS: Mapping[str, tuple[float, str]] = {
    "gust": (LARGEST_GUST, "gusts"),
    "speed_noise": (0.5, "noise of the speed"),
    ROUGHNESS: (0.005, "slope of the road"),
}
AT_LIMIT = 0.999  # share of the largest amplitude above which the noise counts as at the limit
LEAST_OTHERS = 0.05  # share of the variance attributed to the other runs at least: the shift is only to first order


@dataclass(frozen=True)
class FitQuality:
    """How well a fitted road load is supported by its runs.

    Parameters
    ----------
    fit : with intervals that include the answers of the doubts (``quality_of``).
    local : force from decelerations and fitted force.
    shared : correlation and force (N rms) that runs of a direction share, by heading. shifts : by run and parameter.
    notes : on a change between two runs, directions, and a wind that differs along the track.
    """

    fit: RoadLoadFit
    local: LocalForces | None
    shared: Mapping[float, tuple[float, float]]
    shifts: Mapping[str, Mapping[str, float]]
    notes: tuple[Finding, ...] = ()

    @property
    def disagreement(self) -> float:
        """Largest ``LocalForces.excess``: above 1 the forces disagree; 0 where no comparison was possible."""
        return 0.0 if self.local is None else float(np.max(self.local.excess))

    def document(self) -> dict[str, Any]:
        """The numbers for the JSON, under ``quality``."""
        local = self.local
        rows = (
            [] if local is None else np.column_stack([local.speed, local.measured, local.fitted, local.half]).tolist()
        )
        return {
            "influence": {run: dict(shift) for run, shift in self.shifts.items()},
            "agreement": {
                "worst": self.disagreement,
                "classes": [
                    {"speed_kmh": 3.6 * v, "from_deceleration_N": m, "fitted_N": f, "half_interval_N": h}
                    for v, m, f, h in rows
                ],
            },
            "shared_force": [
                {"heading": way, "correlation": c, "rms_N": f} for way, (c, f) in sorted(self.shared.items())
            ],
        }

    def findings(self) -> tuple[Finding, ...]:
        """What the user should know, each with a number and a remedy."""
        return (
            *self._noise(),
            *self._road(),
            *self._disagreement(),
            *findings_after_change(self.fit),
            *self.notes,
            *self._runs(),
        )

    def _noise(self) -> list[Finding]:
        found = []
        for name, (size, limit, words) in unphysical(self.fit).items():
            unit = "" if name == ROUGHNESS else " m/s"
            verb = "exceeds" if size > limit else "reaches"
            what = f"fitted {words}: {size:.2g}{unit} rms {verb} the limit {limit:.2g}{unit}: another force is likely"
            remedy = (
                "check for braking; inspect the residual force over speed and over runs; log position, wind and drive "
                "torque"
            )
            found.append(Finding("noise", what, remedy=remedy, doubt=True))
        return found

    def _road(self) -> list[Finding]:
        together = {w: (c, f) for w, (c, f) in self.shared.items() if c > COASTDOWN_POLICY.common_residual}
        if not together:
            return []
        correlation, force = max(together.values())
        slope = force / (self.fit.at["mass"] * GRAVITY)
        what = (
            f"runs of one direction share a force of {two_digits(force)} N rms (correlation {correlation:.2f}): the "
            f"road ({100 * slope:.2f} % rms of slope explains it), the wind or the driver; the intervals include it if "
            "it is the road, but not if it is a brake or clutch that drags at the start of every run"
        )
        if self.fit.campaign.road is not None:
            remedy = "log the wind, or add the road to the model with 'diagnose: {extend: [grade_profile]}'"
        elif self.fit.campaign.accelerometer != "none":  # which measures the slope
            remedy = "log the wind"
        else:
            remedy = "log the wind and the position, or survey the road and map 'grade'"
        return [Finding("runs", what, remedy=remedy)]

    def _disagreement(self) -> list[Finding]:
        local = self.local
        if local is None or self.disagreement <= 1.0:
            return []
        k = int(np.argmax(local.excess))
        measured, fitted, half = (
            number(float(x[k]), float(local.half[k])) for x in (local.measured, local.fitted, local.half)
        )
        what = (
            f"at {3.6 * local.speed[k]:.0f} km/h the force from the logged decelerations is {measured} N "
            f"(+- {half}), the fitted force {fitted} N; the intervals are widened"
        )
        remedy = "inspect the residual force over speed; narrow speed_window, or log the force that acts there"
        return [Finding("road_load", what, remedy=remedy, doubt=True)]

    def _runs(self) -> list[Finding]:
        if len(self.shifts) < COASTDOWN_POLICY.compared_runs:
            return []
        found, outliers = [], influential_runs(self.fit, COASTDOWN_POLICY.outlying_run)
        for run, shifts in self.shifts.items():
            moved = {n: s for n, s in shifts.items() if self._carries(n, s)}
            if not moved:
                continue
            off = set(moved) & set(outliers.get(run, ()))
            each = [f"{n} is {number(abs(s), 0.1 * abs(s))} {'higher' if s > 0 else 'lower'}" for n, s in moved.items()]
            what = f"without this run {' and '.join(each)}: "
            if off:
                remedy = "look for traffic, a brake or a gust in it; leave the run out only for such a reason"
                found.append(Finding(run, what + "it disagrees with the other runs", remedy=remedy, doubt=True))
            else:
                found.append(
                    Finding(run, what + "the result depends on this one run", remedy="repeat it, or drive more runs")
                )
        return found

    def _carries(self, name: str, shift: float) -> bool:
        """Whether a run shifts an unknown by more than the half interval that the other runs alone give."""
        half, std = self.fit.solution.half_width(name), self.fit.solution.std[name]
        return bool(abs(shift) > half * np.sqrt(max(1.0 - (shift / std) ** 2, LEAST_OTHERS)))


def quality_of(fit: RoadLoadFit) -> FitQuality:
    """The quality of a fit; its intervals include the answers of every doubt that it cannot exclude.

    Those are local forces that disagree with it, the runs before and after a change of the resistance, a slope and a
    wind where all or most runs have one direction, and a wind that differs along the track.
    """
    local, change, sheltered = local_forces(fit), changed_runs(fit), sheltered_wind_shift(fit)
    shifts = [*one_way_shifts(fit), unbalanced_shift(fit)]
    shifts += [] if change is None else change.shifts(fit)
    if local is not None and np.any(local.excess > 1.0):
        shifts.append(fit.shift_by(local.speed, local.measured - local.fitted, local.half))
    wider = fit
    for shift in shifts:
        wider = wider.including(shift)
    changed = () if change is None else (change.finding(fit.campaign.runs[change.run].name),)
    notes = (*changed, *unbalanced_finding(fit), *sheltered_wind_finding(wider, sheltered))
    return FitQuality(wider.including(sheltered), local, shared_force(fit), influence(fit), notes)


def unphysical(fit: RoadLoadFit) -> dict[str, tuple[float, float, str]]:
    """Noise amplitudes above their physical limit: amplitude, limit and name, by source."""
    found = {}
    for name, (limit, words) in LIMITS.items():
        size = fit.sizes.get(name, 0.0)
        if name == "speed_noise":
            size *= float(np.median([levels.get("speed", 0.0) for levels in fit.campaign.levels]))
        if size > AT_LIMIT * limit and not fit.campaign.white:
            found[name] = (size, limit, words)
    return found


def physical_sizes(fit: RoadLoadFit) -> dict[str, float]:
    """The noise amplitudes, each limited to the largest physical one."""
    return {**fit.sizes, **{n: fit.sizes[n] * limit / size for n, (size, limit, _) in unphysical(fit).items()}}
