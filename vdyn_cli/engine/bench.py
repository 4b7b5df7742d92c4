"""The bench on which a model is assembled: it calls element laws with their effects, keeps states and sensors.

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
    """A law or an effect asked for a signal that the model does not have: the effect is not offered."""


class Signals(SimpleNamespace):
    """Named numbers or symbols that a law sees; copied with changes, never edited."""

    def but(self, **changed: Number) -> Signals:
        return Signals(**{**self.__dict__, **changed})

    def __getattr__(self, name: str) -> Any:
        raise MissingSignalError(name)


class Correction(Protocol):
    """What the bench needs to know of an effect."""

    @property
    def name(self) -> str: ...
    @property
    def on(self) -> str: ...
    @property
    def law(self) -> Callable[[Law, Signals, Signals], Number]: ...
    @property
    def unknowns(self) -> Mapping[str, Any]: ...
    @property
    def states(self) -> Mapping[str, Callable[[Signals], Number]]: ...


class Bench:
    """Assembles one model: ``e(law, at, **signals)`` is the law with every effect that corrects it.

    Parameters
    ----------
    read : gives a state's value (or symbol) from its name and start value.
    parameters, unknowns, context : named numbers or symbols.
    effects : the corrections to apply, in this order; several on one law nest.
    """

    def __init__(
        self,
        read: Callable[[str, float], Number],
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
        self.outputs: dict[str, tuple[Number, Number, Number]] = {}
        self.met: set[str] = set()
        self.p = self("parameters", **parameters)

    def __call__(self, law: Law | str, at: str = "", **signals: Number) -> Any:
        """The law's value; ``law`` may name an identity ("parameters", an input, a sensor) that effects can correct."""
        if isinstance(law, str):
            name = law
            value: Law = (lambda s: s) if law == "parameters" else (lambda s: s.value)
        else:
            name, value = law.__name__, law
        s = Signals(**{**self._context, **signals})
        for effect in self._effects:
            if effect.on != name:
                continue
            self.met.add(effect.name)
            for state, rate in effect.states.items():
                key = f"{effect.name}.{state}{at}"
                s = s.but(**{state: self.state(key)})
                self.rates[key] = rate(s)
            value = self._wrap(effect, value)
        return value(s)

    def _wrap(self, effect: Correction, law: Law) -> Law:
        q = Signals(**{name: self._unknowns[name] for name in effect.unknowns})
        return lambda s: effect.law(law, s, q)

    def state(self, name: str, start: float = 0.0) -> Any:
        """A state's value now; the first touch declares it, with its start value."""
        return self._read(name, start)

    def integrate(self, **rates: Number) -> None:
        """The time derivatives of states."""
        self.rates.update(rates)

    def sensor(self, name: str, true: Number, rate: Number) -> None:
        """A reading: its value law and its clock law are elements that effects can correct.

        ``rate`` is the time derivative of the true value, needed to read it at a shifted time.
        """
        self.outputs[name] = (self(name, value=true), rate, self(f"{name}_clock", value=0.0))
