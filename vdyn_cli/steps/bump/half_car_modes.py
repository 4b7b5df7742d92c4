"""Vibration modes of the half car: natural frequencies and damping ratios of body and wheels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.physics.models.half_car import BODY_OF, sprung_body
from vdyn_cli.physics.models.longitudinal_hubs import moving_pitch_inertia
from vdyn_cli.quantities.arrays import Array

MODES = ("bounce", "pitch", "wheel hop front", "wheel hop rear")
STEP = 1e-4  # relative, for central differences: truncation and rounding errors are both below 1e-8


@dataclass(frozen=True)
class HalfCarMode:
    """A vibration mode: undamped natural frequency, Hz, and damping ratio, each with its 95 % interval."""

    name: str
    frequency: float
    frequency95: tuple[float, float]
    damping: float
    damping95: tuple[float, float]


def half_car_matrices(values: Mapping[str, float]) -> tuple[Array, Array, Array]:
    """Mass, damping and stiffness matrices (4, 4), SI, over (heave, pitch, front axle, rear axle), tires on the ground.

    With e_i the stroke of axle i as a row over these coordinates, K = sum K_i e_i' e_i + diag(0, 0, Kt, Kt) and
    C = sum C_i e_i' e_i.

    Parameters
    ----------
    values : of the half car by name, SI.
    """
    v = values
    sprung, to_front = sprung_body(*(v[name] for name in BODY_OF))
    strokes = np.array([[1.0, to_front, -1.0, 0.0], [1.0, to_front - v["wheelbase"], 0.0, -1.0]])
    inertia = moving_pitch_inertia(
        sprung, v["mass"] - sprung, v["sprung_pitch_inertia"], v.get("longitudinal_lever", 0.0)
    )
    mass = np.diag([sprung, inertia, v["unsprung_mass_front"], v["unsprung_mass_rear"]])
    stiffness, damping = (
        strokes.T @ np.diag([v[f"suspension_{kind}_{end}"] for end in ("front", "rear")]) @ strokes
        for kind in ("stiffness", "damping")
    )
    stiffness[2:, 2:] += np.eye(2) * v["tire_vertical_stiffness"]
    return mass, damping, stiffness


def half_car_accelerations(values: Mapping[str, float]) -> Array:
    """Matrix (4, 10) from heave, pitch, both axles, their rates and the road under both axles to accelerations.

    q'' = M^-1 (-K q - C q' + Kt u), with M, C, K of ``half_car_matrices`` and the heights u of the road

    Parameters
    ----------
    values : of the half car by name, SI.
    """
    mass, damping, stiffness = half_car_matrices(values)
    tires = values["tire_vertical_stiffness"] * np.eye(4)[:, 2:]
    return np.asarray(np.linalg.solve(mass, np.hstack([-stiffness, -damping, tires])))


def natural_modes(values: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Natural frequency (Hz) and damping ratio of bounce, pitch and both wheel hops.

    (M s^2 + C s + K) q = 0: frequency |s| / 2 pi, damping ratio -Re s / |s|

    with mass, damping and stiffness matrices M, C, K of ``half_car_matrices``, and q the heave, the pitch and both
    axles. In wheel hop an axle has the largest amplitude; of the two body modes, bounce is the one with more heave.
    Overdamped modes are left out. Source: complex modes of a damped system, L. Meirovitch, Fundamentals of
    Vibrations, 2001.

    Parameters
    ----------
    values : of the half car by name, SI.
    """
    roots, shapes = np.linalg.eig(np.vstack([np.eye(4, 8, 4), half_car_accelerations(values)[:, :8]]))
    upper = roots.imag > 1e-9 * np.abs(roots)
    half = values["wheelbase"] / 2
    body, found = [], {}
    for root, shape in zip(roots[upper], shapes[:4, upper].T, strict=True):
        size = np.abs(shape) * np.array([1.0, half, 1.0, 1.0])
        mode = float(np.abs(root) / (2 * np.pi)), float(-root.real / np.abs(root))
        if size[2:].max() > size[:2].max():
            found[f"wheel hop {'front' if size[2] > size[3] else 'rear'}"] = mode
        else:
            body.append((size[0] / size[1], mode))
    body.sort(key=lambda entry: -entry[0])
    found |= dict(zip(("bounce", "pitch"), (mode for _, mode in body), strict=False))
    return {name: found[name] for name in MODES if name in found}


def half_car_modes(solution: Solution, given: Mapping[str, float]) -> tuple[HalfCarMode, ...]:
    """The modes at a solution, with 95 % intervals to first order.

    Parameters
    ----------
    given : known numbers by name, SI, for those that the solution does not contain.
    """
    at = {**given, **solution.values}
    base = natural_modes(at)

    def numbers(unknown: str, change: float) -> Array:
        """Frequency and damping ratio of each mode (modes, 2); unchanged where a mode becomes overdamped."""
        found = {**base, **natural_modes({**at, unknown: at[unknown] + change})}
        return np.array([found[name] for name in base])

    steps = {n: STEP * abs(at[n]) or STEP for n in solution.names}
    slopes = np.array([(numbers(n, step) - numbers(n, -step)) / (2 * step) for n, step in steps.items()])
    interval = solution.interval_of
    return tuple(
        HalfCarMode(name, f, interval(f, slopes[:, k, 0]), damping, interval(damping, slopes[:, k, 1]))
        for k, (name, (f, damping)) in enumerate(base.items())
    )
