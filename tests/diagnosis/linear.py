"""Campaigns of straight lines and curves instead of vehicles: every sensitivity is known, and a fit takes one step.

A run measures y = base + own exp(-8 x) + effects + noise over x from 0 to 1; the fit assumes a noise level of 1.
Effects and profiles have sensitivities over x and the direction h = +1 or -1 of the run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.name.candidate_judgment import judge
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.diagnosis.verdict_text import verdict_sentence
from vdyn_cli.effects import Effect, effect
from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.inference import Regression, Rows, Unknown
from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.steps.added_effects import NO_EFFECTS

Array = NDArray[np.float64]
Trace = Callable[[Array, int, int], Array]  # over x, direction and number of the run

BASE: dict[str, Trace] = {"level": lambda x, h, k: 0 * x + 1.0, "bend": lambda x, h, k: x**2}
PROFILE = 8  # knots over x


def _hat(knot: int) -> Trace:
    return lambda x, h, k: np.maximum(1 - np.abs(x * (PROFILE - 1) - knot), 0.0)


def _bump(x: Array) -> Array:
    return np.asarray(np.exp(-0.5 * ((x - 0.45) / 0.07) ** 2))


TRACES: dict[str, Trace] = {
    **BASE,
    "slope": lambda x, h, k: h + 0 * x,
    "wind": lambda x, h, k: h * (1 - x) ** 2,
    "wind_twin": lambda x, h, k: h * ((1 - x) ** 2 + 1e-3 * np.sin(9 * x)),
    "wave": lambda x, h, k: np.sin(7 * x),
    "wave_again": lambda x, h, k: np.sin(7 * x),
    "wave_time": lambda x, h, k: 0 * x,  # shapes a cause, and shows in no data by itself
    "step": lambda x, h, k: 1.0 * (x > 0.6),
    "warming": lambda x, h, k: (k - 3.5) / 5 + 0 * x,
    "copy_of_bend": lambda x, h, k: 3 * x**2,
    "nothing": lambda x, h, k: 0 * x,
    "hat": _hat(3),
    "mixture": lambda x, h, k: np.sin(7 * x) + (x > 0.6) + 0.5 * _bump(x),
    "bump": lambda x, h, k: _bump(x),
    **{f"shape_{k + 1}": _hat(k) for k in range(PROFILE)},
}


def cause(
    name: str,
    unknowns: Sequence[str] = (),
    reach: float = 20.0,
    least: float | None = None,
    between: bool = False,
    sensor: bool = False,
    lasts: bool = True,
    turns: bool = False,
    late: bool = False,
    nominal: Mapping[str, float] | None = None,
) -> Effect:
    """An effect that has only a name; the campaign defines its sensitivity."""

    def law(element: Law, s: Signals, q: Signals) -> Number:
        """Nothing."""
        return element(s)

    law.__name__ = name
    tags = {"between_runs": between, "sensor": sensor, "latency": late, "test_only": not lasts}
    tags["turns_with_heading"] = turns
    low = -reach if least is None else least
    return effect(
        on="line_clock" if late else "line",
        unknowns=tuple(Quantity(n, "m", n, n, low, reach) for n in (unknowns or (name,))),
        reference="made up",
        label=f"a {name}",
        confirm=f"Show the {name} alone.",
        tags={tag for tag, given in tags.items() if given},
        nominal=nominal or {},
    )(law)


SHAPE = cause("shape", tuple(f"shape_{k + 1}" for k in range(PROFILE)))


@dataclass(frozen=True)
class Campaign:
    """Runs of one car.

    Parameters
    ----------
    hidden : true size of each trace, the baseline's too.
    noise : level of each run's noise, where the fit believes in 1.
    one_way : all runs go the same way.
    priors : of baseline unknowns, mean and standard deviation.
    own : every run has an unknown start, known beforehand to within 5.
    plain : the rows also say what they are in the channel's own unit.
    scale : of each trace, as the unit of its unknown makes it.
    """

    seed: int
    runs: int = 8
    rows: int = 72
    hidden: Mapping[str, float] = field(default_factory=dict)
    noise: Sequence[float] = (1.0,)
    one_way: bool = False
    priors: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    own: bool = True
    plain: bool = False
    scale: Mapping[str, float] = field(default_factory=dict)

    def x(self) -> Array:
        return np.linspace(0.0, 1.0, self.rows)

    def heading(self, run: int) -> int:
        return 1 if self.one_way or run % 2 == 0 else -1

    def trace(self, name: str, run: int) -> Array:
        return TRACES[name](self.x(), self.heading(run), run) * self.scale.get(name, 1.0)

    def measured(self, run: int) -> Array:
        rng = np.random.default_rng([self.seed, run])
        y = rng.normal(size=self.rows) * self.noise[run % len(self.noise)]
        y += rng.normal() * np.exp(-8 * self.x()) if self.own else 0.0
        for name, size in {"level": 3.0, "bend": -2.0, **self.hidden}.items():
            y = y + size * self.trace(name, run)
        return np.asarray(y)

    def regression(self, extra: Sequence[Unknown] = ()) -> Regression:
        base = tuple(Unknown(n, 0.0, -1e3, 1e3, "m", self.priors.get(n)) for n in BASE)
        own = (Unknown("start", 0.0, -1e3, 1e3, "m", (0.0, 5.0), per_run=True),) if self.own else ()
        names = [*BASE, *(u.name for u in extra)]
        measured = [self.measured(k) for k in range(self.runs)]

        def rows(run: int, theta: Array) -> Rows:
            columns = [self.trace(n, run) for n in names] + [np.exp(-8 * self.x())] * len(own)
            jacobian = np.column_stack(columns)
            residual = jacobian @ theta - measured[run]
            return Rows(residual, jacobian, time=self.x(), plain=(residual, jacobian) if self.plain else None)

        return Regression((*base, *extra, *own), tuple(f"run {k + 1}" for k in range(self.runs)), rows)

    def setup(self, *causes: Effect, profiles: Sequence[Effect] = (SHAPE,), **more: Any) -> DiagnosisSetup:
        return DiagnosisSetup(
            regression=lambda added=NO_EFFECTS, **begun: self.regression(added.unknowns),
            chord_regression=lambda added=NO_EFFECTS, **begun: self.regression(added.unknowns),
            effects=causes,
            profiles=tuple(profiles),
            **{"directions": ("out",) * self.runs if self.one_way else (), **more},
        )


SLOPE, WIND = cause("slope", turns=True), cause("wind", turns=True)
WAVE, STEP = cause("wave"), cause("step")
CATALOG = (SLOPE, WIND, WAVE, STEP)


def judged(campaign: Campaign, *causes: Effect, level: float = 0.05, **case: Any) -> tuple[DiagnosisSetup, Judgment]:
    made = campaign.setup(*(causes or CATALOG), level=level, **case)
    return made, judge(open_strategy(made))


def told(case: DiagnosisSetup, verdict: Judgment) -> str:
    return verdict_sentence(verdict, case.candidates, {})
