"""How much the speeds of a coast-down campaign can tell at best: their covariance, and the Cramer-Rao bound."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tests.plant import coast
from tests.plant.coast import DAY, Day
from tests.plant.coast_motion import Car, Plan, Scatter, calm
from tests.plant.information import Information, prior, total
from tests.plant.sensors import Array
from tests.plant.vehicle import Vehicle

# Sizes at which finite differences are taken (SI); 1e-3 where not listed.
SMALL = dict.fromkeys(("road_grade", "grade_profile", "speed_dependent_rolling", "temperature_rolling"), 1e-5)
SMALL |= {"rolling_resistance": 1e-5, "brake_drag": 0.1, "brake_drag_fading": 0.1, "driveline_drag": 0.1}
SMALL |= {"rotating_mass": 0.1, "torque_offset": 0.01, "driveline_drag_viscous": 0.01, "drag_bump": 0.1}


@dataclass(frozen=True)
class Case:
    """A campaign with everything about it that can be varied."""

    vehicle: Vehicle
    plan: Plan
    day: Day
    effects: Mapping[str, float]
    scatter: Scatter

    def speeds(self) -> tuple[Array, ...]:
        return coast.noise_free(self.vehicle, self.plan, self.day, self.effects, self.scatter)

    def shifted(self, name: str, by: float) -> Case:
        """The same with one parameter, effect, start speed, wind or rolling scatter moved, in every run."""
        v, n = self.vehicle, self.day.runs
        if name == "rolling_resistance":
            return replace(self, vehicle=v.but(rolling_resistance=v.rolling_resistance + by))
        if name == "drag_area":
            return replace(self, vehicle=v.but(drag_coefficient=v.drag_coefficient + by / v.frontal_area))
        if name == "start_speed":
            return replace(self, plan=replace(self.plan, speed=self.plan.speed + by))
        if name in ("wind", "rolling"):
            return replace(self, scatter=replace(self.scatter, **{name: np.full(n, by)}))
        return replace(self, effects={**self.effects, name: self.effects.get(name, 0.0) + by})

    def slope(self, name: str) -> list[Array]:
        """d speed / d that thing, of each run.

        The speed is reckoned from the torque that was read. A torque sensor that reads (1 + q) T leaves the car with
        the force that a larger wheel would; one that reads T + q, with the force that a rubbing brake would.
        """
        if name == "torque_gain":
            return self.slope("wheel_radius")
        if name == "torque_offset":
            per_torque = self.vehicle.gear_ratio / self.vehicle.wheel_radius
            return [per_torque * slope for slope in self.slope("brake_drag")]
        by = SMALL.get(name, 1e-3)
        ends = self.shifted(name, by).speeds(), self.shifted(name, -by).speeds()
        return [(high - low) / (2.0 * by) for high, low in zip(*ends, strict=True)]


def information(
    vehicle: Vehicle,
    seed: int,
    day: Day = DAY,
    effects: Mapping[str, float] | None = None,
    unknowns: Sequence[str] = (),
) -> Information:
    """About rolling_resistance, drag_area, the effects in ``unknowns``, and what run k has of its own.

    That is start_speed_k, and under priors wind_k, rolling_k (and torque_zero_k). From the logged speeds alone:
    position and accelerometer, whose zero is unknown, add little under gusts.
    """
    decided = coast.plan(vehicle, seed, day, effects)
    case = Case(vehicle, decided, day, effects or {}, calm(day.runs, decided.steps))
    own = {"start_speed": 0.0, "wind": day.wind.between_runs, "rolling": day.rolling_scatter}
    if day.powered:
        own["torque_offset"] = day.torque.zero
    own = {name: sd for name, sd in own.items() if sd > 0 or name == "start_speed"}
    shared = ("rolling_resistance", "drag_area", *unknowns)
    slopes = [case.slope(name) for name in (*shared, *own)]
    columns = [np.column_stack([slope[run] for slope in slopes]) for run in range(day.runs)]
    parts = []
    for run, white in enumerate(whiten(case, columns)):
        parts.append(Information((*shared, *(f"{name}_{run}" for name in own)), white.T @ white))
        parts.append(prior({f"{name}_{run}": sd for name, sd in own.items() if sd > 0}))
    return total(parts)


def whiten(case: Case, columns: Sequence[Array]) -> list[Array]:
    """Speed series (samples, any number) of each run, filtered so that the plant's noise would come out white and unit.

    The noise is a white, quantized reading of a speed that gusts (Ornstein-Uhlenbeck) and torque noise have moved: the
    innovations of a two-state Kalman filter over (speed error, gust), all runs side by side.
    """
    day, decided = case.day, case.plan
    car = Car(case.vehicle, day.air_density, decided, case.effects)
    motion = car.move(case.scatter, decided.steps)
    longest = max(times.size for times in decided.samples)
    times = np.stack([_padded(t, longest) for t in decided.samples], axis=1)
    there = np.stack([np.arange(longest) < t.size for t in decided.samples], axis=1)
    series = np.stack([np.pad(c, ((0, longest - len(c)), (0, 0))) for c in columns], axis=1)
    pull, fade = (
        np.stack([np.interp(t, motion.clock, r) for t, r in zip(times.T, rate.T, strict=True)], axis=1)
        for rate in car.wind_response(motion)
    )
    jolt = car.force_per_torque / car.inertia * np.hypot(day.torque.noise, day.torque.step / 12**0.5)
    read = day.speed.noise**2 + day.speed.step**2 / 12
    speed, gust = np.zeros((2, day.runs, series.shape[2]))
    vv, vw, ww = np.zeros(day.runs), np.zeros(day.runs), np.full(day.runs, day.wind.gust**2)
    result = np.empty_like(series)
    for k in range(longest):
        if k:
            dt = times[k] - times[k - 1]
            keep, stay = np.exp(-dt * fade[k]), np.exp(-dt / day.wind.time)
            push, fresh = -0.5 * dt * pull[k], day.wind.gust**2 * (1.0 - stay**2)
            moved = push * (1.0 + stay)
            speed, gust = keep[:, None] * speed + moved[:, None] * gust, stay[:, None] * gust
            vv, vw, ww = (
                keep**2 * vv + 2 * keep * moved * vw + moved**2 * ww + push**2 * fresh,
                stay * (keep * vw + moved * ww) + push * fresh,
                stay**2 * ww + fresh,
            )
            if day.powered:
                vv = vv + (jolt * dt) ** 2
        spread = vv + read
        surprise = series[k] - speed
        result[k] = surprise / np.sqrt(spread)[:, None]
        by_speed, by_gust = vv / spread, vw / spread
        speed, gust = speed + by_speed[:, None] * surprise, gust + by_gust[:, None] * surprise
        vv, vw, ww = vv - by_speed * vv, vw - by_speed * vw, ww - by_gust * vw
    return [result[there[:, run], run] for run in range(day.runs)]


def _padded(times: Array, longest: int) -> Array:
    return np.concatenate([times, times[-1] + 0.1 * np.arange(1, longest - times.size + 1)])
