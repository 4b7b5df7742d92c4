"""Estimates and the parameter set that steps pass on to each other."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.quantities.vocabulary import PARAMETERS

if TYPE_CHECKING:
    from vdyn_cli.quantities.law_definition import LawDefinition

FORMAT = "vdyn/parameters/1"


class MissingParameterError(InputError):
    """A step needs a parameter that is neither under ``vehicle`` nor in a ``--known`` file."""


# Entries of ``Estimate.spans`` that are not effects: the baseline's value, and a bias by an unexplained residual.
BASELINE, UNEXPLAINED = "baseline", "unexplained"
STATED = ("given", "measured")  # sources that are no step


def normal_interval(value: float, std: float) -> tuple[float, float]:
    """The 95 % interval of a normal distribution about a value, in its unit."""
    return value - NORMAL95 * std, value + NORMAL95 * std


@dataclass(frozen=True)
class Estimate:
    """One parameter's value with its uncertainty, in SI units.

    ``source`` is ``given``, ``measured`` or the step that estimated it; ``baseline`` is the value before the model was
    extended by an effect. ``std`` 0 means: stated as exact. ``spans`` names the other possible explanations of the
    diagnosis whose values the interval includes, where the data do not decide between several.
    """

    value: float
    std: float
    interval95: tuple[float, float]
    unit: str
    meaning: str
    source: str
    baseline: float | None = None
    spans: tuple[str, ...] = ()

    @property
    def half_width(self) -> float:
        """Half of the 95 % interval, in the unit of the value."""
        return 0.5 * (self.interval95[1] - self.interval95[0])

    @property
    def assumed(self) -> bool:
        """Whether the model of a step fixes this value, such as a road load without a term linear in the speed."""
        return self.interval95 == (self.value, self.value) and self.source not in STATED

    @classmethod
    def given(cls, quantity: Quantity, value: float, std: float = 0.0, source: str = "given") -> Estimate:
        """A number stated by the user, with the normal 95 % interval of its standard deviation.

        Parameters
        ----------
        value, std : in the quantity's SI unit. source : ``given`` or ``measured``.
        """
        return cls(value, std, normal_interval(value, std), quantity.unit, quantity.meaning, source)

    @classmethod
    def of(cls, name: str, value: float, std: float, interval95: tuple[float, float], source: str) -> Estimate:
        """An estimate of a parameter of the vocabulary, which provides unit and meaning.

        Parameters
        ----------
        value, std, interval95 : in the parameter's SI unit. source : the step.
        """
        quantity = PARAMETERS[name]
        low, high = interval95
        return cls(
            float(value), float(std), (float(low), float(high)), quantity.unit, quantity.meaning, source, float(value)
        )


Extensions = Mapping[str, Mapping[str, Estimate]]


@dataclass(frozen=True)
class Parameters(Mapping[str, Estimate]):
    """Named estimates, with the correlation of those estimated together.

    ``extensions`` are the accepted effects that belong to the vehicle: estimates by effect and unknown; ``laws`` define
    the learned ones among them.
    """

    estimates: Mapping[str, Estimate] = field(default_factory=dict)
    correlation: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    extensions: Extensions = field(default_factory=dict)
    laws: Mapping[str, LawDefinition] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Estimate:
        return self.estimates[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.estimates)

    def __len__(self) -> int:
        return len(self.estimates)

    def value(self, name: str, default: float) -> float:
        """The parameter's value, SI, or the default where it is missing."""
        estimate = self.estimates.get(name)
        return default if estimate is None else estimate.value

    def updated(self, later: Parameters) -> Parameters:
        """These parameters, with the later ones added or in their place."""
        correlation = {**self.correlation}
        for name, row in later.correlation.items():
            correlation[name] = {**correlation.get(name, {}), **row}
        extensions = {**self.extensions, **later.extensions}
        laws = {**self.laws, **later.laws}
        return Parameters({**self.estimates, **later.estimates}, correlation, extensions, laws)

    def without(self, names: Collection[str]) -> Parameters:
        """These parameters without those in ``names``, and without their correlations."""
        estimates = {n: e for n, e in self.estimates.items() if n not in names}
        correlation = {
            n: {other: value for other, value in row.items() if other not in names}
            for n, row in self.correlation.items()
            if n not in names
        }
        return replace(self, estimates=estimates, correlation=correlation)

    def require(self, *names: str, where: str) -> None:
        """Check that parameters are present.

        Parameters
        ----------
        names : of parameters. where : place for the message.

        Raises
        ------
        MissingParameterError : lists all missing parameters and the steps that estimate them.
        """
        missing = [n for n in names if n not in self.estimates]
        if missing:
            by_giver: dict[str, list[str]] = {}
            for name in missing:
                by_giver.setdefault(ESTIMATED_BY.get(name, name), []).append(name)
            raise MissingParameterError(*(_missing(names, where) for names in by_giver.values()))


_BY_STEP = {
    "area": "frontal_area",
    "coastdown": "rolling_resistance drag_area drag_coefficient road_load_f0 road_load_f1 road_load_f2",
    "cg": "cg_height cg_to_rear cg_to_front pitch_inertia",
    "bump": "suspension_stiffness_front suspension_stiffness_rear suspension_damping_front suspension_damping_rear "
    "tire_vertical_stiffness",
    "inertia": "wheel_inertia",
    "tire": "tire_B tire_C tire_D tire_E tire_longitudinal_stiffness",
    "shaft": "shaft_stiffness_left shaft_stiffness_right shaft_damping_left shaft_damping_right",
}


def wider_than_value(name: str, estimate: Estimate) -> bool:
    """Whether the half-width of the 95 % interval exceeds the value of a parameter that cannot be negative.

    Always False for a parameter that can have either sign, such as the magic formula's E.
    """
    quantity = PARAMETERS.get(name)
    return quantity is not None and quantity.lower >= 0.0 and estimate.half_width > abs(estimate.value)


# The step that estimates a parameter, for the remedy where it is missing; a test compares it with the steps.
ESTIMATED_BY: Mapping[str, str] = {name: step for step, names in _BY_STEP.items() for name in names.split()}


def _missing(names: Sequence[str], where: str) -> Finding:
    """The message for missing parameters that the same step estimates."""
    giver = ESTIMATED_BY.get(names[0])
    lines = "', '".join(f"{n}: <number> {PARAMETERS[n].unit}".rstrip() for n in names)
    remedy = f"add '{lines}' under vehicle"
    if "air_density" in names:
        remedy = f"add 'environment: {{temperature: 20 degC, pressure: 101.3 kPa}}' of the test, or {remedy}"
    if giver:
        remedy += f", or pass the result of 'vdyn {giver}' or of the pipeline with --known"
    if len(names) > 1:
        return Finding(where, f"{', '.join(names)} are needed and not given", remedy=remedy)
    return Finding(where, f"{names[0]} ({PARAMETERS[names[0]].meaning}) is needed and not given", remedy=remedy)


def to_document(parameters: Parameters) -> dict[str, Any]:
    """The ``parameters``, ``correlation`` and ``extensions`` parts of a result's JSON."""
    return {
        "parameters": {name: _entry(e) for name, e in parameters.items()},
        "correlation": {a: dict(row) for a, row in parameters.correlation.items()},
        "extensions": {
            effect: {name: _entry(e) for name, e in unknowns.items()}
            for effect, unknowns in parameters.extensions.items()
        },
        **({"laws": {n: law.model_dump(mode="json") for n, law in parameters.laws.items()}} if parameters.laws else {}),
    }


def _entry(e: Estimate) -> dict[str, Any]:
    return {
        "value": e.value,
        "std": e.std,
        "interval95": list(e.interval95),
        "unit": e.unit,
        "meaning": e.meaning,
        "baseline": e.baseline,
        "source": e.source,
        "spans": list(e.spans),
    }
