"""The prior of parameters and effects from earlier steps: values and covariance; wide assumptions for the rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.effects import Effect, catalog
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Unknown
from vdyn_cli.physics.models.road_load import Resistances
from vdyn_cli.physics.models.vehicle_defaults import Completed, complete
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY, ROTATING_SHARE, USUAL_WHEELS
from vdyn_cli.quantities.errors import Finding, InputError, raise_all
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.learned_effect import learned_effects

# Standard deviations of assumed values: relative, or in SI where the value is zero (``ABSOLUTE``); others are exact.
RELATIVE: Mapping[str, float] = {
    "unsprung_mass_front": 0.2,
    "unsprung_mass_rear": 0.2,
    "tire_relaxation_length": 0.4,
    "drag_height": 0.15,
    "driveline_efficiency": 0.01,
    "air_density": 0.02,
    "driveline_inertia": 0.1,
    "shaft_damping_left": 0.4,
    "shaft_damping_right": 0.4,
    "brake_share_front": 0.08,
    "hub_swing": 1.0,
    "driveline_pitch": 1.0,
    "rotating_mass": 0.3,
}
ABSOLUTE: Mapping[str, float] = {
    "tire_load_sensitivity": 2e-5,  # 1/N: friction falls by 0 to 4 % per kN
    "tire_rest_damping": 0.3,  # s/m: 0 to 20 % of critical damping of a braked car that rocks on its tires
    "tire_vertical_damping": 100.0,  # N s/m: a few percent of critical for the wheel hop
    "recuperation_loss": 1.0,  # 1: the gears' loss; -1: a torque that holds the efficiency of driving
}
# Parameters without an effect on a straight and level drive, or with a negligible one (side gears; the motor's
# reaction, 0.1 % of the load): the report does not list that they are assumed.
INSENSITIVE = frozenset(
    {"roll_inertia", "yaw_inertia", "track_front", "track_rear", "tire_cornering_stiffness", "tire_vertical_damping",
     "tire_rest_damping", "rolling_speed", "wind_variance", "cg_to_front", "drag_area", "side_gear_inertia",
     "motor_reaction", "recuperation_loss"}
)  # fmt: skip

SIGNED = ("hub_swing", "driveline_pitch", "motor_reaction", "rolling_speed", "recuperation_loss")  # may be negative
FARTHEST = 200.0  # standard deviations, bounds of a parameter about its prior mean
LEAST_SHARE = 0.02  # lower bound of a positive parameter over its prior mean
LINEAR_RANGE = 5.0  # standard deviations about the prior mean: bounds of a point of linearization
COASTED = "coastdown"  # the step that estimates both resistances from decelerations and the stated mass
DERIVED = ("cg_to_front", "drag_area")  # derived exactly from given parameters
DERIVATIVE_STEP = 1e-3  # standard deviations, step of the numerical derivatives of derived parameters
ALMOST = 1e-6  # least eigenvalue of a correlation matrix, so that it can be inverted
APART = 0.02  # m, largest difference between the wheelbase and the sum of its parts


@dataclass(frozen=True)
class ParameterPrior:
    """The model's parameters before the drives.

    Parameters
    ----------
    values : every parameter of the model, SI.
    names : (k,) those with a standard deviation.
    std : (k,); correlation : (k, k).
    sources : by name, the step that estimated it, "given", or "assumed".
    assumptions : findings on assumed values.
    """

    values: Mapping[str, float]
    names: tuple[str, ...]
    std: Array
    correlation: Array
    sources: Mapping[str, str]
    assumptions: tuple[Finding, ...]

    @property
    def root(self) -> Array:
        """Lower triangular root L (k, k) of the covariance L L' of the parameters."""
        return np.asarray(self.std[:, None] * np.linalg.cholesky(self.correlation))


def parameter_prior(known: Parameters, names: tuple[str, ...]) -> ParameterPrior:
    """The prior of the parameters ``names`` of a model, SI.

    Parameters that are not given are derived from others or assumed (vehicle_defaults) with a standard deviation. A
    stated road load F0, F1, F2 replaces rolling resistance and drag area where these are not known.

    Parameters
    ----------
    known : estimates of other steps and of the vehicle, with their correlation.

    Raises
    ------
    InputError : parameters are missing (each with the step that estimates it) or outside their physical range.
    """
    _refuse_unphysical(known)
    wanted = tuple(n for n in names if n != "wind_variance")
    full = complete(wanted, _road_load({n: e.value for n, e in known.items()}))
    known.require(*full.missing, where="validate")
    assumed = dict(full.assumed)
    if "rotating_mass" in wanted and not {"rotating_mass"} & known.keys() and "wheel_inertia" not in known:
        assumed["rotating_mass"] = f"{100 * ROTATING_SHARE:.1f} % of the mass, typical for wheels; motors add to it"
    return _propagated(known, wanted, full, assumed)


def resistances(known: Parameters) -> Resistances:
    """How the rolling resistance and the drag area of a car on the road were determined (``road_load``)."""
    if "rolling_resistance" not in known:
        return "forces"
    sources = {known[n].source for n in ("rolling_resistance", "drag_area") if n in known}
    return "coasted" if sources == {COASTED} else "coefficients"


def with_accepted_effects(prior: ParameterPrior, sizes: Mapping[str, Estimate]) -> ParameterPrior:
    """The prior with the amplitudes of effects that earlier steps accepted, with their standard deviations.

    Parameters
    ----------
    sizes : amplitudes by name of the unknown, SI. One without a standard deviation is almost fixed.
    """
    std = [e.std if e.std > 0 else ALMOST * max(abs(e.value), 1.0) for e in sizes.values()]
    k, m = len(prior.names), len(sizes)
    correlation = np.eye(k + m)
    correlation[:k, :k] = prior.correlation
    return replace(
        prior,
        values={**prior.values, **{n: e.value for n, e in sizes.items()}},
        names=(*prior.names, *sizes),
        std=np.concatenate([prior.std, std]),
        correlation=correlation,
        sources={**prior.sources, **{n: e.source for n, e in sizes.items()}},
    )


def _propagated(
    known: Parameters, wanted: tuple[str, ...], full: Completed, assumed: Mapping[str, str]
) -> ParameterPrior:
    """The model's parameters and their covariance D R D', with D the derivatives to given and assumed values."""
    base = {n: e.value for n, e in known.items()}
    added = {n: ABSOLUTE.get(n, RELATIVE.get(n, 0.0) * abs(full.values[n])) for n in assumed if n not in DERIVED}
    if full.values.get("driveline_efficiency") == 1.0:  # without a loss its sign has no effect
        added.pop("recuperation_loss", None)
    sizes = {n: size for n, size in ({n: e.std for n, e in known.items()} | added).items() if size > 0}
    slopes, related = np.zeros((len(wanted), len(sizes))), np.eye(len(sizes))
    for j, (name, size) in enumerate(sizes.items()):
        at, step = (full.values if name in added else base)[name], DERIVATIVE_STEP * size
        above, below = (complete(wanted, _road_load({**base, name: at + s})).values for s in (step, -step))
        slopes[:, j] = [(above[n] - below[n]) / (2 * DERIVATIVE_STEP) for n in wanted]  # per standard deviation
        related[:, j] = [float(n == name) or known.correlation.get(n, {}).get(name, 0.0) for n in sizes]
    covariance = slopes @ _positive_definite(related) @ slopes.T
    std = np.sqrt(np.diag(covariance))
    values = {n: full.values[n] for n in wanted}
    kept = np.flatnonzero(std > 1e-9 * np.maximum(np.abs(list(values.values())), 1e-9))
    inner = covariance[np.ix_(kept, kept)] / np.outer(std[kept], std[kept])
    names = tuple(wanted[i] for i in kept)
    sources = {n: known[n].source if n in known else "assumed" if n in assumed else "given" for n in names}
    assumptions = tuple(
        _assumption(n, values[n], float(std[wanted.index(n)]), why)
        for n, why in assumed.items()
        if n not in INSENSITIVE
    )
    return ParameterPrior(values, names, std[kept], _positive_definite(inner), sources, assumptions)


def _positive_definite(correlation: Array) -> Array:
    """A nearby positive definite correlation matrix; rounded or exactly dependent values make the given one indefinite.

    Eigenvalues below ``ALMOST`` are raised to it, and the diagonal is scaled to one.
    """
    if not correlation.size:
        return correlation
    values, vectors = np.linalg.eigh(0.5 * (correlation + correlation.T))
    if values[0] >= ALMOST:
        return correlation
    mended = (vectors * np.maximum(values, ALMOST)) @ vectors.T
    scale = np.sqrt(np.diag(mended))
    return np.asarray(mended / np.outer(scale, scale))


def _road_load(v: Mapping[str, float]) -> dict[str, float]:
    """The values with rolling resistance and drag area of a stated road load, and with the rotating mass."""
    found = dict(v)
    if "rolling_resistance" not in v and {"road_load_f0", "mass"} <= v.keys():
        weight = v["mass"] * GRAVITY
        found["rolling_resistance"] = v["road_load_f0"] / weight
        found["rolling_speed"] = v.get("road_load_f1", 0.0) / weight
    parts = {"drag_coefficient", "frontal_area"} <= v.keys()
    if "drag_area" not in v and not parts and {"road_load_f2", "air_density"} <= v.keys():
        found["drag_area"] = 2 * v["road_load_f2"] / v["air_density"]
    if "rotating_mass" not in v and {"wheel_inertia", "wheel_radius"} <= v.keys():
        inertia = v.get("wheels", USUAL_WHEELS) * v["wheel_inertia"] + v.get("driveline_inertia", 0.0)
        found["rotating_mass"] = inertia / v["wheel_radius"] ** 2
    elif "rotating_mass" not in v and "mass" in v:
        found["rotating_mass"] = ROTATING_SHARE * v["mass"]
    return found


def _assumption(name: str, value: float, std: float, source: str) -> Finding:
    unit = PARAMETERS[name].unit if name in PARAMETERS else ""
    taken = f"{value:.3g} +- {std:.2g} {unit}".strip() if std else f"{value:.3g} {unit}".strip()
    what = f"{name} is not given: assumed {taken} ({source})"
    return Finding("vehicle", what, remedy=f"add '{f'{name}: <number> {unit}'.strip()}' under vehicle", minor=True)


def _refuse_unphysical(known: Parameters) -> None:
    problems = []
    for name, e in known.items():
        quantity = PARAMETERS.get(name)
        where = f"parameter '{name}' (source: {e.source})"
        if not (np.isfinite(e.value) and np.isfinite(e.std) and e.std >= 0):
            what = "is not a finite number with a standard deviation"
            problems.append(Finding(where, what, f"{e.value} +- {e.std}", "correct it in its source"))
        elif quantity is not None and not quantity.allows(e.value):
            got = f"{e.value:.4g} {quantity.unit}".strip()
            what = f"is outside the physical range ({quantity.range_text})"
            problems.append(Finding(where, what, got, "check its unit and source"))
    raise_all(problems)
    parts = {"wheelbase", "cg_to_front", "cg_to_rear"}
    if parts <= set(known):
        whole, front, rear = (known[n].value for n in ("wheelbase", "cg_to_front", "cg_to_rear"))
        if abs(front + rear - whole) > APART:
            what = "cg_to_front and cg_to_rear do not add up to the wheelbase"
            got = f"{front:.3f} + {rear:.3f} m, not {whole:.3f} m"
            raise InputError(Finding("parameters", what, got, "correct one of the three"))


def prior_unknowns(prior: ParameterPrior) -> tuple[Unknown, ...]:
    """Every parameter as an unknown with its prior, started at its mean.

    The bounds are wide: drives may contradict the prior by many standard deviations, which is then a finding.
    """
    found = []
    for name, std, row in zip(prior.names, prior.std.tolist(), prior.correlation.tolist(), strict=True):
        value = prior.values[name]
        related = {b: r for b, r in zip(prior.names, row, strict=True) if b != name and abs(r) > 1e-12}
        low, high = value - FARTHEST * std, value + FARTHEST * std
        if value > 0 and name not in SIGNED:
            low = max(low, LEAST_SHARE * value)
        found.append(Unknown(name, value, low, high, "", (value, std), nuisance=True, prior_correlation=related))
    return tuple(found)


def clipped_to_prior(prior: ParameterPrior, values: Mapping[str, float]) -> dict[str, float]:
    """The values of parameters of the prior, clipped to their bounds and to 5 standard deviations.

    Parameters
    ----------
    values : SI, by name; names that are not parameters of the prior are ignored.
    """
    near = {}
    for u, std in zip(prior_unknowns(prior), prior.std.tolist(), strict=True):
        if u.name in values:
            low, high = max(u.lower, u.start - LINEAR_RANGE * std), min(u.upper, u.start + LINEAR_RANGE * std)
            near[u.name] = float(np.clip(values[u.name], low, high))
    return near


def carried_effects(model: Model, known: Parameters) -> tuple[Effect, ...]:
    """Effects that earlier steps accepted and that are applicable to this model: the baseline includes them."""
    listed = [e for e in catalog() if e.name in known.extensions]
    return applicable(model, [*listed, *learned_effects(known)])


def dropped_effects(model: Model, known: Parameters) -> tuple[Finding, ...]:
    """A warning for each effect of earlier steps that is not applicable to this model and therefore omitted."""
    taken, installed = {e.name for e in carried_effects(model, known)}, {e.name for e in catalog()}
    found = []
    for name in (n for n in known.extensions if n not in taken):
        why = (
            "this model does not have the part that it changes" if name in installed else "no such effect is installed"
        )
        remedy = (
            "ignore it if this test does not depend on it" if name in installed else "install the package that has it"
        )
        found.append(Finding(f"extensions.{name}", f"the simulation does not include this effect: {why}", "", remedy))
    return tuple(found)
