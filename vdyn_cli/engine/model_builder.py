"""The builder of a model: it calls element laws with their effects, and keeps states and sensors.

Contract, for ``s`` the frozen signals that a law sees and ``q`` the unknowns of an effect::

    element   law(s) -> number
    effect    law'(law, s, q) -> number        equals law(s), bit for bit, when q = 0
    model     model(e, u) -> None              calls e(law, ...), e.state(...), e.integrate(...), e.sensor(...)

The arithmetic is plain, so the same law runs on floats and on symbols.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import SimpleNamespace
from typing import Any, Protocol

Number = Any  # a float, or a symbol of the graph
Law = Callable[["Signals"], Number]


class MissingSignalError(AttributeError):
    """A law or an effect needs a signal that the model does not have: the effect is not applicable."""


class Signals(SimpleNamespace):
    """Named numbers or symbols, the arguments of a law; copied with changes, never edited."""

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
        """Value of each unknown that is not zero without the effect, SI."""

    @property
    def states(self) -> Mapping[str, Callable[[Signals], Number]]:
        """Start value by state that the effect adds to the model, as a law of the signals."""

    @property
    def probes(self) -> tuple[float, ...]:
        """Amplitudes, SI, at which an effect without a slope at zero is tried; empty for others."""


class ModelBuilder:
    """Assembles one model: ``e(law, at, **signals)`` is the law with every effect that corrects it.

    Parameters
    ----------
    read : gives a state's value (or symbol) from its name and start value.
    parameters, unknowns, context : named numbers or symbols.
    effects : the corrections to apply, in this order; several on one law nest.
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
        """The law's value; ``law`` may name an identity ("parameters", an input, a sensor) that effects can correct."""
        if isinstance(law, str):
            name = law
            value: Law = (lambda s: s) if law == "parameters" else (lambda s: s.value)
        else:
            name, value = law.__name__, law
        s = Signals(**{**self._context, "place": at, **signals})
        for effect in self._effects:
            if name in effect.laws:
                self.met.add(effect.name)
                value = self._wrap(effect, name, value, self._states(effect, at, s))
        return value(s)

    def _states(self, effect: Correction, at: str, s: Signals) -> dict[str, Number]:
        """The effect's own states; their rates see the law's signals, the effect's states and its unknowns."""
        states = {name: self.state(f"{effect.name}.{name}{at}") for name in effect.states}
        if states:
            seen = s.but(**states, **{name: self._unknowns[name] for name in effect.unknowns})
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

    def sensor(self, name: str, true: Number, rate: Number | None = None) -> None:
        """A reading: its value law and its clock law are elements that effects can correct.

        The value law sees ``sensor``, its name; an input's law does not, and leads the other way, from the reading
        back to the truth. The clock law ``<name>_clock`` gives the shift in seconds at which the true value is read (0
        without effects). ``rate``, the time derivative of the true value, is only needed where the value depends on an
        input directly and the model knows better than differences of the simulated trace.
        """
        self.outputs[name] = (self(name, value=true, sensor=name), rate, self(f"{name}_clock", value=0.0))

    def rate(self, name: str, of: Number) -> None:
        """A reading of the time derivative of an expression, such as jerk.

        Along the states; inputs are held, since what they do between samples is the log's choice and not the model's.
        It is read after all other sensors, when every state has its rate.
        """
        self._sought[name] = of

    def finish(self, derivative: Callable[[Number], Number]) -> None:
        """Add the readings that ``rate`` requested; ``derivative`` gives the time derivative of an expression."""
        for name, of in self._sought.items():
            self.sensor(name, derivative(of))
