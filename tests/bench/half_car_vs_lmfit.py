"""How fast is the half-car fit beside lmfit with solve_ivp, on the same logs to the same answer?

    python -m tests.bench.half_car_vs_lmfit

Both minimise the squared difference of simulated and measured loads of both axles (the paper's weighting, w = 1) over
springs, dampers, tire stiffness and the place of the bump in each of four runs, from the same start: nine unknowns,
speed taken as smoothed, wheels that lift off. The first fit of a session also compiles the model; that is stated apart,
as is the whole step, which has forty more unknowns and two more channels.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.plant import bump
from tests.plant.vehicle import REFERENCE
from vdyn_cli.inference import Regression, Rows, Solution, solve
from vdyn_cli.physics.models.half_car import SOUGHT
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.bump.crossing import LOADS, Crossing
from vdyn_cli.steps.bump.half_car_fit import BumpFit, BumpRows
from vdyn_cli.steps.bump.measured_profile import BumpData
from vdyn_cli.steps.bump.problem import prepare
from vdyn_cli.steps.bump.spec import BumpSpec
from vdyn_cli.steps.bump.step import STEP

Array = NDArray[np.float64]

WANTED = 50.0
GRAVITY = 9.80665
SPEC = BumpSpec.model_validate({"test": "bump", "bump": {"height": 0.07, "width": 0.48}})
REPEATS = 5


def logs(seed: int = 1) -> tuple[Log, ...]:
    """Four crossings of the reference car."""
    found = []
    for k, record in enumerate(bump.campaign(REFERENCE, seed)):
        clock, front, rear, speed, acceleration, rate = record.values()
        channels = {"front_load": front, "rear_load": rear, "speed": speed / 3.6}
        channels |= {"vertical_acceleration": acceleration, "pitch_rate": np.radians(rate)}
        found.append(Log(f"bump_{k}", clock, channels))
    return tuple(found)


def known() -> Parameters:
    return Parameters({n: Estimate.given(PARAMETERS[n], v) for n, v in bump.known(REFERENCE).items()})


def prepared(data: tuple[Log, ...]) -> BumpFit:
    """The crossings, cut and with smooth speeds; loads alone."""
    loads = tuple(replace(log, channels={n: log[n] for n in (*LOADS, "speed")}) for log in data)
    return prepare(SPEC, BumpData(loads), known()).fit


def reduced(fit: BumpFit) -> Regression:
    """The step's regression with every unknown held but the five and the place of the bump."""
    free = [*range(len(SOUGHT)), len(SOUGHT)]
    unknowns = (*fit.shared, fit.own[0])

    def rows(run: int, theta: Array) -> Rows:
        whole = np.zeros(len(fit.shared) + len(fit.own))
        whole[free] = theta
        found = BumpRows(fit)(run, whole)
        return replace(found, jacobian=found.jacobian[:, free])

    starts = {"distance_front": np.array([c.distance for c in fit.crossings])}
    return Regression(unknowns, tuple(c.run for c in fit.crossings), rows, starts)


def ours(data: BumpFit) -> Solution:
    """From the prepared crossings, model assembly included; the machine code is there after the first time."""
    fresh = BumpFit(data.crossings, data.model, data.known, data.weights)
    return solve(reduced(fresh))


def theirs(fit: BumpFit) -> Any:
    """lmfit's Levenberg-Marquardt around scipy's Runge-Kutta, in plain floats, which is its fastest way here."""
    import lmfit

    def residual(p: Any) -> Array:
        at = {**fit.known.values, **{n: p[n].value for n in SOUGHT}}
        found = []
        for k, crossing in enumerate(fit.crossings):
            loads = _loads(at, crossing, p[f"distance_{k}"].value)
            found += [(loads[i] - crossing.channels[n]) / crossing.noise[n] for i, n in enumerate(LOADS)]
        return np.concatenate(found)

    parameters = lmfit.Parameters()
    for name in SOUGHT:
        parameters.add(name, value=fit.start[name], min=0.0)
    for k, crossing in enumerate(fit.crossings):
        parameters.add(f"distance_{k}", value=crossing.distance)
    # Steps of 1e-4: at the default ones differences show the integrator's own errors, and the fit ends far off.
    return lmfit.minimize(residual, parameters, epsfcn=1e-8)


def _loads(at: dict[str, float], crossing: Crossing, distance: float) -> Array:
    """Both axles' loads at the samples, (2, n)."""
    from scipy.integrate import solve_ivp

    mf, mr, length = at["unsprung_mass_front"], at["unsprung_mass_rear"], at["wheelbase"]
    sprung, inertia = at["mass"] - mf - mr, at["sprung_pitch_inertia"]
    lf = (at["mass"] * at["cg_to_front"] - mr * length) / sprung
    lr = length - lf
    rear = at["mass"] * GRAVITY * at["cg_to_front"] / length
    front = at["mass"] * GRAVITY - rear
    kf, kr, cf, cr, kt = (at[n] for n in SOUGHT)
    t, v = crossing.time, crossing.speed.value
    way = crossing.origin + np.concatenate([[0.0], np.cumsum(np.diff(t) * (v[1:] + v[:-1]) / 2)]) - distance
    begin, step = float(t[0]), float(t[-1] - t[0]) / (t.size - 1)
    even = np.interp(begin + step * np.arange(t.size + 1), t, way)
    height, width = at["bump_height"], at["bump_width"]

    def road(s: float) -> float:
        return height * math.sin(math.pi * s / width) ** 2 if 0.0 < s < width else 0.0

    def rates(time: float, y: Array) -> list[float]:
        z, dz, th, dth, zf, dzf, zr, dzr = y.tolist()
        place = (time - begin) / step
        k = int(place)
        s = float(even[k] + (place - k) * (even[k + 1] - even[k]))
        pull_f = kf * (z + lf * th - zf) + cf * (dz + lf * dth - dzf)
        pull_r = kr * (z - lr * th - zr) + cr * (dz - lr * dth - dzr)
        load_f = max(0.0, front + kt * (road(s) - zf))
        load_r = max(0.0, rear + kt * (road(s - length) - zr))
        turn = (lr * pull_r - lf * pull_f) / inertia
        heave = -(pull_f + pull_r) / sprung
        return [dz, heave, dth, turn, dzf, (pull_f + load_f - front) / mf, dzr, (pull_r + load_r - rear) / mr]

    # Without the largest step it would leap over the bump.
    y = solve_ivp(rates, (t[0], t[-1]), np.zeros(8), t_eval=t, rtol=1e-8, atol=1e-10, max_step=0.01).y
    roads = np.array([[road(s), road(s - length)] for s in way.tolist()]).T
    return np.maximum(0.0, np.array([[front], [rear]]) + kt * (roads - y[[4, 6]]))


def timed(call: Callable[[], Any], repeats: int) -> tuple[Any, float]:
    """The answer, and the shortest time it took, s."""
    took = []
    for _ in range(repeats):
        begun = time.perf_counter()
        answer = call()
        took.append(time.perf_counter() - begun)
    return answer, min(took)


def main() -> None:
    data = logs()
    fit = prepared(data)
    _, first = timed(lambda: ours(fit), 1)
    solution, fast = timed(lambda: ours(fit), REPEATS)
    _, step = timed(lambda: STEP.estimate(SPEC, BumpData(data), known()), REPEATS)
    reference, slow = timed(lambda: theirs(fit), 1)
    print(f"half-car fit   first {first:.3f} s (with compiling), then {fast:.3f} s, {solution.iterations} iterations")
    print(f"whole step     {step:.3f} s (four channels, every nuisance, tables and figures' data)")
    print(f"lmfit          {slow:.1f} s, {reference.nfev} evaluations, success {reference.success}")
    print(f"faster         {slow / fast:.0f} times, {slow / first:.0f} times with compiling (wanted {WANTED:.0f})")
    for name in SOUGHT:
        other, error = reference.params[name].value, solution.std[name]
        apart = (solution.values[name] - other) / error
        print(f"{name:<28} {solution.values[name]:12.2f} {other:12.2f}  apart by {apart:+.2f} standard deviations")


if __name__ == "__main__":
    main()
