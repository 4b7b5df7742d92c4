"""The builder of a model: it calls element laws with their effects, and collects states and sensors.

Contract, with ``s`` the signals that a law reads and ``q`` the unknowns of an effect::

    element   law(s) -> number
    effect    law'(law, s, q) -> number        equals law(s), bit for bit, when q = 0
    model     model(e, u) -> None              calls e(law, ...), e.state(...), e.integrate(...), e.sensor(...)

Laws use ordinary arithmetic, so the same law runs on floats and on symbols.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import SimpleNamespace
from typing import Any, Protocol

Number = Any  # a float, or a symbol of the graph
Law = Callable[["Signals"], Number]


class MissingSignalError(AttributeError):
    """A law or an effect needs a signal that the model does not have; such an effect is not applicable."""


class Signals(SimpleNamespace):
    """Named numbers or symbols, the arguments of a law; never modified, only copied with changes."""

    def but(self, **changed: Number) -> Signals:
        """A copy with some signals replaced or added."""
        return Signals(**{**self.__dict__, **changed})

    def __getattr__(self, name: str) -> Any:
        raise MissingSignalError(name)


class Correction(Protocol):
    """The part of an effect that the builder uses."""

    @property
    def name(self) -> str:
        """Name of the effect."""

    @property
    def laws(self) -> Mapping[str, Callable[[Law, Signals, Signals], Number]]:
        """The corrected law by the name of the law: (law, signals, unknowns) -> number."""

    @property
    def unknowns(self) -> Mapping[str, Any]:
        """Unit, meaning and range by unknown."""

    @property
    def nominal(self) -> Mapping[str, float]:
        """Neutral value, SI, of the unknowns whose neutral value is not zero."""

    @property
    def states(self) -> Mapping[str, Callable[[Signals], Number]]:
        """Rate of each state that the effect adds to the model, as a law of the signals."""

    @property
    def starts(self) -> Mapping[str, Callable[[Signals], Number]]:
        """Start values of these states as laws of the signals; zero where omitted."""

    @property
    def probes(self) -> tuple[float, ...]:
        """Amplitudes, SI, at which an effect whose derivative vanishes at zero is tried; empty for others."""


class ModelBuilder:
    """Assembles one model: ``e(law, at, **signals)`` evaluates the law with every effect that corrects it.

    Parameters
    ----------
    read : returns a state's value (or symbol) for its name and start value.
    parameters, unknowns, context : named numbers or symbols.
    effects : the corrections to apply, in this order; several effects on one law are nested.
    """

    def __init__(
        self,
        read: Callable[[str, Number], Number],
        parameters: Mapping[str, Number],
        unknowns: Mapping[str, Number],
        effects: Iterable[Correction] = (),
        context: Mapping[str, Number] | None = None,
    ) -> None:
        self._read = read
        self._unknowns = unknowns
        self._effects = tuple(effects)
        self._context = dict(context or {})
        self.rates: dict[str, Number] = {}
        self.outputs: dict[str, tuple[Number, Number | None, Number]] = {}
        self.met: set[str] = set()
        self._sought: dict[str, Number] = {}
        self.p = self("parameters", **parameters)

    def __call__(self, law: Law | str, at: str = "", **signals: Number) -> Any:
        """The law's value with its effects; a name ("parameters", an input, a sensor) is a law that changes nothing."""
        if isinstance(law, str):
            name = law
            value: Law = (lambda s: s) if law == "parameters" else (lambda s: s.value)
        else:
            name, value = law.__name__, law
        s = Signals(**{**self._context, "place": at, **signals})
        for effect in self._effects:
            if name in effect.laws:
                self.met.add(effect.name)
                place = at or signals.get("sensor", "")  # each corrected sensor has states of its own
                value = self._wrap(effect, name, value, self._states(effect, place, s))
        return value(s)

    def _states(self, effect: Correction, at: str, s: Signals) -> dict[str, Number]:
        """The states that the effect adds; rates and starts depend on the law's signals and the effect's unknowns."""
        seen = s.but(**{name: self._unknowns[name] for name in effect.unknowns})
        starts = {name: effect.starts[name](seen) if name in effect.starts else 0.0 for name in effect.states}
        states = {name: self.state(f"{effect.name}.{name}{at}", start) for name, start in starts.items()}
        seen = seen.but(**states)
        self.rates.update({f"{effect.name}.{name}{at}": rate(seen) for name, rate in effect.states.items()})
        return states

    def _wrap(self, effect: Correction, name: str, law: Law, states: Mapping[str, Number]) -> Law:
        q = Signals(**{unknown: self._unknowns[unknown] for unknown in effect.unknowns})
        return lambda s: effect.laws[name](law, s.but(**states), q)

    def state(self, name: str, start: Number = 0.0) -> Any:
        """A state's current value; the first call declares it, with its start value.

        ``start`` may be an expression of parameters, of inputs (their first sample) and of states declared before
        (their starts), so that, for example, a wheel starts rolling at the vehicle's start speed.
        """
        return self._read(name, start)

    def integrate(self, **rates: Number) -> None:
        """The time derivatives of states."""
        self.rates.update(rates)

    def sensor(self, name: str, true: Number, rate: Number | None = None, **about: Number) -> None:
        """Declare a sensor; effects can correct its value law and its clock law.

        The value law has the signal ``sensor``, the sensor's name; the law of an input does not have it and maps from
        the reading to the true value. The clock law ``<name>_clock`` is the time shift in s at which the true value is
        read (0 without effects). ``rate``, the time derivative of the true value, is only needed where the value
        depends directly on an input and the model's derivative is better than differences of the simulated trace.
        ``about`` : further signals of both laws, on which a reading may depend.
        """
        clock = self(f"{name}_clock", value=0.0, sensor=name, **about)
        self.outputs[name] = (self(name, value=true, sensor=name, **about), rate, clock)

    def rate(self, name: str, of: Number) -> None:
        """Declare a sensor for the time derivative of an expression, such as jerk.

        The derivative follows the states with constant inputs, because their course between samples is not known.
        It is evaluated after all other sensors, when every state has its rate.
        """
        self._sought[name] = of

    def finish(self, derivative: Callable[[Number], Number]) -> None:
        """Add the sensors that ``rate`` declared; ``derivative`` returns the time derivative of an expression."""
        for name, of in self._sought.items():
            self.sensor(name, derivative(of))
