"""How fast is the coast-down fit beside lmfit with solve_ivp, on the same logs to the same answer?

    python -m tests.bench.coastdown_vs_lmfit

Both minimise the squared difference of simulated and measured speed over rolling resistance, drag area and the start
speed of every run, white noise, from the same start. The first fit of a session also compiles the model, which is
stated apart.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.coast_cases import known, logs_of, spec_of
from tests.plant import coast
from tests.plant.vehicle import REFERENCE
from vdyn_cli.steps.coastdown.fit.campaign import Campaign
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit, fit_road_load
from vdyn_cli.steps.coastdown.preparation import prepare

Array = NDArray[np.float64]

GRAVITY = 9.80665
LEVEL = 0.03  # m/s, noise of the speed
START = {"rolling_resistance": 0.012, "drag_area": 0.65}
REPEATS = 20


def campaign(count: int, seed: int = 1) -> Campaign:
    """Coasts of the reference car."""
    runs = coast.campaign(REFERENCE, seed, coast.DAY.but(runs=count))
    spec = spec_of(runs, settings={"noise": "white"})
    return prepare(spec, logs_of(runs), known(REFERENCE)).campaign


def ours(case: Campaign) -> RoadLoadFit:
    return fit_road_load(case, rounds=0)


def theirs(case: Campaign) -> Any:
    """lmfit's Levenberg-Marquardt around scipy's Runge-Kutta, written as its documentation would have it."""
    import lmfit
    from scipy.integrate import solve_ivp

    at = case.values
    inertia, weight = at["mass"] + at["rotating_mass"], at["mass"] * GRAVITY

    def residual(p: Any) -> Array:
        rolling, drag = p["rolling_resistance"].value * weight, 0.5 * at["air_density"] * p["drag_area"].value
        found = []
        for k, run in enumerate(case.runs):
            span = (run.time[0], run.time[-1])
            solved = solve_ivp(
                lambda t, v: -(rolling + drag * v * abs(v)) / inertia,
                span,
                [p[f"start_{k}"].value],
                t_eval=run.time,
                rtol=1e-8,
                atol=1e-8,
            )
            found.append((solved.y[0] - run.speed) / LEVEL)
        return np.concatenate(found)

    parameters = lmfit.Parameters()
    for name, value in START.items():
        parameters.add(name, value=value, min=0.0)
    for k, run in enumerate(case.runs):
        parameters.add(f"start_{k}", value=float(run.speed[0]))
    return lmfit.minimize(residual, parameters)


def timed(call: Callable[[], Any], repeats: int) -> tuple[Any, float]:
    """The answer, and the shortest processor time it took, s."""
    shortest, answer = np.inf, None
    for _ in range(repeats):
        begun = time.process_time()
        answer = call()
        shortest = min(shortest, time.process_time() - begun)
    return answer, float(shortest)


def main() -> None:
    begun = time.process_time()
    ours(campaign(2, seed=2))
    print(f"First fit of a session, compiling the model: {time.process_time() - begun:.2f} s\n")
    print("| coasts | vdyn [ms] | lmfit + solve_ivp [ms] | times as fast | apart [standard errors] |")
    print("|---|---|---|---|---|")
    for count in (4, 8, 16):
        case = campaign(count)
        mine, fast = timed(lambda case=case: ours(replace(case)), REPEATS)  # type: ignore[misc] # a copy knows nothing yet
        other, slow = timed(lambda case=case: theirs(case), 2)  # type: ignore[misc]
        apart = max(abs(mine.solution.values[n] - other.params[n].value) / other.params[n].stderr for n in START)
        print(f"| {count} | {1e3 * fast:.1f} | {1e3 * slow:.0f} | {slow / fast:.0f} | {apart:.2f} |")


if __name__ == "__main__":
    main()
