"""Synthetic results of coast-downs, bump crossings and tire sweeps for tests of the reports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from vdyn_cli.project.pipeline import ParameterSet, StepOutcome
from vdyn_cli.project.result_document import Provenance, StepRecord, read_record, to_json
from vdyn_cli.quantities.diagnosis import Diagnosis
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Comparison, Figure, FitSummary, Result, Series, Table
from vdyn_cli.quantities.vocabulary import TABLE
from vdyn_cli.report import html

G = 9.80665


def _estimate(name: str, value: float, std: float, source: str, baseline: float | None = None) -> Estimate:
    estimate = Estimate.of(name, value, std, (value - 2.2 * std, value + 2.2 * std), source)
    return estimate if baseline is None else replace(estimate, baseline=baseline)


def _coast(time: np.ndarray, start: float, wind: float, rolling: float, drag_area: float) -> np.ndarray:
    """Speed of a coasting car by small Euler steps, m/s."""
    speed, out, step = start, np.empty(time.size), time[1] - time[0]
    for i in range(time.size):
        out[i] = speed
        speed -= step * (rolling * G + 0.5 * 1.19 * drag_area * (speed + wind) ** 2 / 1640)
    return out


def coastdown(runs: int = 8, diagnosed: bool = True) -> Result:
    """Coast-downs both ways with gusts; a headwind that the extended model knows."""
    rng = np.random.default_rng(7)
    comparisons = []
    for k in range(runs):
        time = np.arange(0, 95 + rng.uniform(-8, 8), 0.05)
        way = 1 if k % 2 == 0 else -1
        truth = _coast(time, 20.3, 2.9 * way, 0.0101, 0.56)
        gust = np.cumsum(rng.normal(size=time.size)) * 0.0009
        measured = np.round((truth + gust + rng.normal(size=time.size) * 0.03) / 0.01) * 0.01
        measured[rng.random(time.size) < 0.002] = np.nan
        before = _coast(time, 20.3, 0, 0.0112, 0.58) if diagnosed else None
        used = (truth < 70 / 3.6) & (truth > 25 / 3.6)
        direction = "out" if way > 0 else "back"
        comparisons.append(
            Comparison(
                f"coast_{k + 1} {direction}",
                "speed",
                "m/s",
                time,
                "time since the run's start, s",
                measured,
                truth,
                before,
                used,
                held_out=diagnosed and k in (2, 5),
            )
        )
    estimates = {
        "rolling_resistance": _estimate("rolling_resistance", 0.010124, 0.00011, "coastdown", 0.0112),
        "drag_area": _estimate("drag_area", 0.5602, 0.0061, "coastdown", 0.5811),
        "drag_coefficient": _estimate("drag_coefficient", 0.2558, 0.0036, "coastdown", 0.2653),
        "road_load_f0": _estimate("road_load_f0", 157.7, 1.8, "coastdown", 174.4),
        "road_load_f1": _estimate("road_load_f1", 0.02, 0.11, "coastdown", 0.0),
        "road_load_f2": _estimate("road_load_f2", 0.3333, 0.0037, "coastdown", 0.3458),
    }
    if not diagnosed:
        estimates = {n: replace(e, baseline=e.value) for n, e in estimates.items()}
    names = list(estimates)[:3]
    rho = np.array([[1, -0.81, -0.66], [-0.81, 1, 0.82], [-0.66, 0.82, 1]])
    correlation = {a: {b: float(rho[i, j]) for j, b in enumerate(names)} for i, a in enumerate(names)}
    speed = np.linspace(20, 75, 60)
    load = 157.7 + 0.3333 * (speed / 3.6) ** 2
    at = np.arange(25, 71, 5.0)
    pairs = 157.7 + 0.3333 * (at / 3.6) ** 2 + rng.normal(size=at.size) * 3
    figures = (
        Figure(
            "road_load",
            "Road load against speed",
            "Points: mean deceleration force of each pair of runs, with 95 % intervals. Good: the curve passes through"
            " nearly all bars. Bad: points above it at low speed only, which speaks for brake or bearing drag.",
            "speed, km/h",
            "road load, N",
            (
                Series("95 % band", speed, load - 4, "band", y2=load + 4, role="simulated"),
                Series("pairs of runs", at, pairs, "points", error=np.full(at.size, 6.0)),
                Series("estimated", speed, load, role="simulated"),
                Series("certified curve", speed, load * 0.9 + 10, role="reference"),
            ),
        ),
        Figure(
            "runs",
            "Rolling resistance, run by run",
            "Each run estimated alone. Good: bars alike, out and back mixed. Bad: two groups by direction.",
            "run",
            "rolling resistance",
            (
                Series("each run alone", np.arange(1, runs + 1), 0.0101 + rng.normal(size=runs) * 2e-4, "bars"),
                Series("all runs", np.array([0.5, runs + 0.5]), np.array([0.0101, 0.0101]), role="accent"),
            ),
        ),
    )
    tables = (
        Table(
            "dynamometer",
            "Road load for the dynamometer",
            ("set", "F0", "F1", "F2", "remark"),
            (
                ("SI: N, km/h", "157.7", "0.0056", "0.02572", "20 degC, 100 kPa"),
                ("EPA: lbf, mph", "35.45", "0.0020", "0.01497", "as tested"),
                ("-", "-12.1", "", "0.1", "<b>never bold</b>"),
            ),
            "What a dynamometer operator types in.",
        ),
    )
    findings = (
        Finding("coast_4.csv, line 1204", "the clock stands still for 3 samples", "t = 60.15 s", "check the logger"),
        Finding("coast_6.csv", "run rejected: pair mean differs from the others by 4.1 standard deviations"),
    )
    fit = FitSummary(
        tuple(c.run for c in comparisons),
        0.041,
        0.031,
        "m/s",
        tuple(names),
        "block",
        34,
        0.043 if diagnosed else None,
        ("rolling_resistance and drag_area are correlated by -0.81: runs down to 15 km/h would halve it",),
    )
    return Result(
        "coastdown",
        "Rolling resistance is 0.01012 +- 0.00024 and drag area 0.560 +- 0.013 m^2, from 8 runs in both directions.",
        Parameters(estimates, correlation),
        fit,
        "Output error: the speed of every run is simulated from its own start and compared with the log over"
        " 70 to 25 km/h. Noise is white sensor noise and integrated gusts, both estimated from the data.\n\n"
        "Intervals come from the scatter of 34 blocks of equal information, with Student's t.",
        tuple(comparisons),
        figures,
        tables,
        findings,
        {"wltp": {"p": 0.012}},
        DIAGNOSIS if diagnosed else None,
    )


DIAGNOSIS = Diagnosis.model_validate(
    {
        "verdict": "named",
        "sentence": "A headwind of 2.9 +- 0.1 m/s along the out direction explains 97 % of the misfit.",
        "p_value": 0.0005,
        "evidence": {"unit": "block", "units": 24, "stated": 0, "worth": 21.6, "smallest_p": 0.0005},
        "extended": ["headwind"],
        "causes": [
            {
                "effect": "headwind",
                "label": "a headwind",
                "sensor": False,
                "lasts": False,
                "unknowns": {"headwind": {"value": 2.91, "std": 0.06, "interval95": [2.78, 3.04], "unit": "m/s"}},
                "p_value": 0.0005,
                "visibility": 0.93,
                "biased": {"rolling_resistance": 0.0011, "drag_area": 0.021},
            }
        ],
        "ambiguous": [["brake_drag", "driveline_drag"]],
        "not_testable": [
            {
                "effect": "mass_error",
                "because": "it scales all forces of a coast-down alike",
                "size": 0.05,
                "unit": "",
                "would_bias": {"rolling_resistance": 0.0002},
            }
        ],
        "gain": {
            "metric": "speed rms",
            "unit": "m/s",
            "before": 0.213,
            "after": 0.0412,
            "interval95": [0.151, 0.192],
            "share_of_explainable": 0.972,
            "certain": True,
            "held_out": True,
            "folds": 0,
        },
        "where": [
            {
                "run": "coast_3 out",
                "channel": "speed",
                "segment": "time in the run [s] 60 to 70",
                "size": -0.31,
                "unit": "m/s",
                "over_noise": -10.2,
            },
            {
                "run": "coast_6.csv",
                "channel": "speed",
                "segment": "time, s 52.5 to 60",
                "size": 0.22,
                "unit": "m/s",
                "over_noise": 7.31,
            },
        ],
        "ranking": [
            {
                "effect": "headwind",
                "explains_t": 18.42,
                "visibility": 0.93,
                "left_p": 0.31,
                "left_mostly": "force_over_day",
                "unknowns": {"headwind": {"value": 1.9, "std": 0.1, "interval95": [1.7, 2.1], "unit": "m/s"}},
            },
            {
                "effect": "brake_drag",
                "explains_t": 16.9,
                "visibility": 0.31,
                "left_p": 0.0005,
                "left_mostly": "headwind",
                "unknowns": {},
            },
            {
                "effect": "tire_warmup",
                "explains_t": 1.2,
                "visibility": 0.0004,
                "left_p": None,
                "left_mostly": None,
                "unknowns": {},
            },
        ],
        "next_test": [
            {
                "manoeuvre": "two slow rolls from 15 km/h to standstill, one each way",
                "separates": ["brake_drag", "driveline_drag"],
                "expected_t": 7.4,
                "runs": 2,
            }
        ],
    }
)


def bump(seed: int = 3) -> Result:
    """Four bump crossings of a half car, both axle loads and the body's acceleration."""
    rng = np.random.default_rng(seed)
    comparisons = []
    for channel, unit, size, noise in (
        ("front_load", "N", 6000, 60),
        ("rear_load", "N", 5200, 60),
        ("vertical_acceleration", "m/s^2", 4.0, 0.08),
    ):
        for k in range(4):
            time = np.arange(0, 2.5, 0.002)
            delay = 0.4 + 0.3 * (channel == "rear_load")
            after = np.maximum(time - delay, 0)
            truth = size * np.exp(-3.2 * after) * np.sin(2 * np.pi * 1.6 * after) * (after > 0)
            truth += 0.4 * size * np.exp(-14 * after) * np.sin(2 * np.pi * 11 * after) * (after > 0)
            offset = 9000.0 if unit == "N" else 0.0
            measured = truth * (1 + 0.02 * rng.normal()) + noise * rng.normal(size=time.size)
            comparisons.append(
                Comparison(f"bump_{k + 1}", channel, unit, time, "time, s", offset + measured, offset + truth)
            )
    source = "bump"
    estimates = {
        "suspension_stiffness_front": _estimate("suspension_stiffness_front", 44_310, 420, source),
        "suspension_stiffness_rear": _estimate("suspension_stiffness_rear", 41_870, 510, source),
        "suspension_damping_front": _estimate("suspension_damping_front", 3_122, 48, source),
        "suspension_damping_rear": _estimate("suspension_damping_rear", 2_871, 55, source),
        "tire_vertical_stiffness": Estimate.of("tire_vertical_stiffness", 402_300, 9000, (381_000, 431_000), source),
    }
    names = list(estimates)
    rho = np.corrcoef(rng.normal(size=(len(names), 9)))
    correlation = {a: {b: float(rho[i, j]) for j, b in enumerate(names)} for i, a in enumerate(names)}
    fit = FitSummary(("bump_1", "bump_2", "bump_3", "bump_4"), 74.0, 60.0, "N", tuple(names), "block", 16)
    return Result(
        "bump",
        "The front springs carry 44.3 +- 0.9 kN/m and the tires 402 kN/m; the wheels lifted off in all runs.",
        Parameters(estimates, correlation),
        fit,
        "Output error on three channels.",
        tuple(comparisons),
    )


def tire() -> Result:
    """Slip sweeps: friction over slip that goes to and fro, both with errors."""
    rng = np.random.default_rng(5)

    def friction(s: np.ndarray) -> np.ndarray:
        b, c, d, e = 12.0, 1.6, 0.95, 0.2
        return d * np.sin(c * np.arctan(b * s - e * (b * s - np.arctan(b * s))))

    comparisons = []
    for k in range(5):
        slip = 0.16 * np.sin(np.linspace(0, 2 * np.pi, 800))
        seen = slip + rng.normal(size=slip.size) * 0.004
        comparisons.append(
            Comparison(
                f"sweep_{k + 1}",
                "friction",
                "",
                seen,
                "slip",
                friction(slip) + rng.normal(size=slip.size) * 0.012,
                friction(seen),
            )
        )
    estimates = {
        "tire_B": _estimate("tire_B", 12.1, 0.31, "tire"),
        "tire_C": _estimate("tire_C", 1.58, 0.04, "tire"),
        "tire_D": _estimate("tire_D", 0.951, 0.004, "tire"),
        "tire_E": _estimate("tire_E", 0.17, 0.09, "tire"),
        "tire_longitudinal_stiffness": _estimate("tire_longitudinal_stiffness", 18.2, 0.2, "tire"),
    }
    fit = FitSummary(tuple(c.run for c in comparisons), 0.013, 0.012, "", tuple(estimates), "run", 5)
    return Result(
        "tire",
        "The magic formula has B 12.1 +- 0.7, C 1.58, D 0.951 and E 0.17; the peak lies at 14 % slip.",
        Parameters(estimates),
        fit,
        "Orthogonal distance regression.",
        tuple(comparisons),
    )


def record(result: Result) -> StepRecord:
    """A result with a provenance, as a command makes it."""
    return StepRecord(
        result,
        Provenance(
            {f"sample_logs/{r.replace(' ', '_')}.csv": f"{i + 1:02x}" * 32 for i, r in enumerate(result.fit.runs)},
            {"title": f"A day of {result.step}", "speed_window": [70.0, 25.0], "fix": {}},
            {"vdyn_cli": "0.1.0", "numpy": "2.1.0"},
            f"vdyn {result.step} configs/{result.step}.yaml",
        ),
    )


def as_read(result: Result, folder: Path) -> StepRecord:
    """The record of a result after it was written as JSON and read again."""
    path = folder / f"{result.step}.json"
    path.write_text(to_json(record(result).document), encoding="utf-8")
    return read_record(path)[0]


def parameter_set(title: str, outcomes: Sequence[StepOutcome], **changes: Any) -> ParameterSet:
    """The parameter set of the good steps; of the others, parameters are missing."""
    known = Parameters()
    for outcome in outcomes:
        known = known.updated(outcome.record.result.parameters) if outcome.record else known
    missing = {name: "no such test in this pipeline" for name in TABLE if name not in known}
    found = ParameterSet(title, known, missing, tuple(outcomes), Provenance({}, None, {}, "vdyn pipeline day.yaml"))
    return replace(found, **changes)


def outcome(result: Result, folder: Path) -> StepOutcome:
    """The step as a pipeline shows it: its record as read from JSON, and its section as it was rendered."""
    section = html.render(record(result)).section
    return StepOutcome(result.step, "done", as_read(result, folder), section)
