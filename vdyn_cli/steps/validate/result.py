"""Assembles the result of a validation: sentence, tables, figures and document."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vdyn_cli.physics.models.tip_in import tip_in
from vdyn_cli.physics.models.vehicle import Driven
from vdyn_cli.physics.models.vehicle_axle import Differential
from vdyn_cli.physics.models.vehicle_defaults import SIDE_GEAR_INERTIA
from vdyn_cli.physics.models.vibration_modes import modes
from vdyn_cli.quantities.arrays import rms
from vdyn_cli.quantities.constants import GRAVITY, NORMAL95, ZERO_CELSIUS
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Figure, FitSummary, Result, Table
from vdyn_cli.quantities.vocabulary import CHANNELS
from vdyn_cli.steps.validate import figures, tables, text
from vdyn_cli.steps.validate.road.open_road import SEASON_KMH, IntervalEstimate, RoadFindings
from vdyn_cli.steps.validate.spec import ValidateSpec
from vdyn_cli.steps.validate.text import short_name
from vdyn_cli.steps.validate.validation import Validation
from vdyn_cli.steps.validate.window_ends import WindowEnds, window_ends

CRUISE = 50 / 3.6  # m/s
PEDAL = 0.15  # drive force over weight in the tip-in: a firm press of the pedal
SHARES_WRITTEN = 8  # parameters in the document, for each output


def result(
    spec: ValidateSpec,
    logs: Sequence[Log],
    v: Validation,
    amplitudes: Mapping[str, Estimate],
    findings: Sequence[Finding],
) -> Result:
    """Sentence, tables, figures and document of a validation.

    Parameters
    ----------
    spec : the description. logs : of its runs. amplitudes : of accepted effects.
    findings : about logs and fit.
    """
    names, said = tuple(log.name for log in logs), text.sentence(v)
    shown = [tables.output_table(v), tables.regime_table(v), tables.share_table(v), tables.parameter_table(v)]
    drawn, numbers = figures.band_figures(v), document(v)
    if spec.settings.windows:
        ends = window_ends(v.shown, names)
        shown.insert(0, tables.window_table(ends))
        numbers["windows"] = _window_document(ends)
        said = text.windows_sentence(ends) + text.replaced_drives(v.missed)
        if v.missed:
            numbers["whole_drives"] = {"rms": v.missed, "unit": "m/s"}
    if v.road is not None:
        shown[1:1] = tables.road_tables(v.road)
        drawn.insert(0, figures.road_figure(v.road))
        numbers["road"] = _road_document(v.road)
    more: list[Finding] = []
    if spec.settings.model == "vehicle":
        modes_shown, tip_in_drawn, more = _oscillations(v, spec.settings.driven, spec.settings.differential)
        shown, drawn = shown + modes_shown, drawn + tip_in_drawn
    of_logs = [f for log in logs for f in log.findings]
    return Result(
        "validate",
        said,
        Parameters(),
        _summary(v, names),
        text.methods(v),
        figures.comparisons(v),
        tuple(drawn),
        tuple(shown),
        (*findings, *more, *v.prior.assumptions, *_unrecorded(logs, spec.settings.model), *of_logs),
        {"validation": numbers},
        amplitudes=amplitudes,
    )


def _oscillations(
    v: Validation, driven: Driven, differential: Differential
) -> tuple[list[Table], list[Figure], list[Finding]]:
    """Modes about a cruise, the jerk after a tip-in there, and a finding where the car has no steady state."""
    alone = {
        "wind_variance": 0.0,
        "gear_ratio": 1.0,
        "driveline_efficiency": 1.0,
        "recuperation_loss": 0.0,
        "side_gear_inertia": SIDE_GEAR_INERTIA,
    }
    values = {**alone, **v.prior.values}
    try:
        found = modes(values, CRUISE, driven, differential)
        torque = PEDAL * values["mass"] * GRAVITY * values["wheel_radius"] / values["gear_ratio"]
        jerk = figures.tip_in_figure(tip_in(values, CRUISE, torque, driven, differential))
        return [tables.mode_table(found)], [jerk], []
    except ResultError as error:
        return [], [], [Finding("modes", f.what, f.got, f.remedy, minor=True) for f in error.findings]


def _summary(v: Validation, names: tuple[str, ...]) -> FitSummary:
    expected = np.concatenate([one.half for one in v.bands_of("speed")]) / NORMAL95
    there = np.isfinite(np.concatenate([one.error for one in v.bands_of("speed")]))
    off = rms(v.errors("speed"))
    floor = rms(expected[there])
    runs = tuple(names[k] for k in dict.fromkeys(s.run for s in v.segments))
    return FitSummary(runs, off, floor, "m/s", (), warnings=text.warnings(v))


def _unrecorded(logs: Sequence[Log], model: str) -> list[Finding]:
    """Inputs that are taken as zero because they are not recorded."""
    missing = [n for n in ("brake_torque", "grade") if not all(n in log for log in logs)]
    if not missing:
        return []
    unbraked = "brake_torque" in missing and model != "vehicle"
    remedy = "map brake_torque, or write 'windows: {powered: true}' under settings" if unbraked else ""
    return [Finding("channels", f"{' and '.join(missing)} not recorded: taken as zero", "", remedy, minor=True)]


def document(v: Validation) -> dict[str, Any]:
    """``validation`` of the result's JSON: errors by output and regime, posterior of each parameter, and the noise.

    The key ``strain`` is the pull of a parameter; the verdict ``strained`` means that a pull is large.
    """
    outputs = {}
    for name, test in v.tests.items():
        error = v.errors(name)
        outputs[name] = {
            "unit": CHANNELS[name].unit,
            "rms": rms(error),
            "bias": float(error.mean()),
            "max": float(np.abs(error).max()),
            "sensor_noise": float(np.median([one.sensor for one in v.bands_of(name)])),
            "outside": test.share,
            "limit": test.limit,
            "chance": test.chance,
            "regimes": {r: {"outside": a, "limit": b} for r, (a, b) in test.by_regime.items()},
            "shares": {n: round(p, 4) for n, p in list(v.shares[name].items())[:SHARES_WRITTEN]},
        }
    b, after = v.prior, v.posterior
    parameters = {
        n: {
            "before": b.values[n],
            "std_before": float(b.std[i]),
            "after": float(after.values[i]),
            "std_after": float(after.std[i]),
            "strain": float(after.pull[i]),
            "seen": float(after.reduction[i]),
        }
        for i, n in enumerate(b.names)
    }
    return {
        "verdict": "outside" if v.outside else "strained" if v.contradicted else "inside",
        "outside": v.outside,
        "strained": v.contradicted,
        "chance": v.chance,
        "outputs": outputs,
        "parameters": parameters,
        "statistic": {"value": after.statistic, "degrees": after.degrees, "chance": after.chance},
        "noise": dict(v.whitened.sizes),
    }


def _window_document(found: WindowEnds) -> dict[str, Any]:
    by_trip = {short_name(found.names[u]): float(found.error[found.run == u].mean()) for u in np.unique(found.run)}
    return {
        "length_s": found.length,
        "windows": int(found.error.size),
        "trips": found.units,
        "mean_end_error": found.mean,
        "mean_over_windows": float(found.error.mean()),
        "interval95": list(found.interval95),
        "std_by_parameters": found.own,
        "by_trip": by_trip,
        "unit": "m/s",
    }


def _road_document(found: RoadFindings) -> dict[str, Any]:
    drives = {
        short_name(n): {
            "accelerometer_zero": _entry(z),
            "distance_m": [round(float(x), 1) for x in r.distance],
            "slope": [round(float(i), 5) for i in r.profile],
        }
        for n, r, z in zip(found.names, found.roads, found.zeros, strict=True)
    }
    made: dict[str, Any] = {
        "accelerometer_zero": {**_entry(found.common_zero), "unit": "m/s^2"},
        "holding_force": [{"speed_kmh": v, **_entry(f), "unit": "N"} for v, f in found.holding.items()],
        "drives": drives,
    }
    if (s := found.seasons) is not None:
        made["seasons"] = {
            "speed_kmh": SEASON_KMH,
            "cold": {**_entry(s.in_cold), "temperature_degC": s.cold - ZERO_CELSIUS},
            "warm": {**_entry(s.in_warm), "temperature_degC": s.warm - ZERO_CELSIUS},
            "more": _entry(s.more),
            "unit": "N",
        }
    if (ends := found.held_out) is not None:
        before, after = ends.by_drive()
        made["held_out"] = {
            "rms_before": float(before.mean()),
            "rms_after": float(after.mean()),
            "gain": _entry(ends.gain()),
            "mean_before": _entry(ends.means()[0]),
            "mean_after": _entry(ends.means()[1]),
            "by_drive": {
                short_name(n): [float(b), float(a)] for n, b, a in zip(found.names, before, after, strict=True)
            },
            "unit": "m/s",
        }
    return made


def _entry(one: IntervalEstimate) -> dict[str, Any]:
    return {"value": one.value, "std": one.std, "interval95": list(one.interval95)}
