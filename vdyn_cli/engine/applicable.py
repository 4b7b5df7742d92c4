"""The effects that apply to a model: those whose law it calls with the signals that they need."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeVar

from vdyn_cli.engine.graph import constants_of, symbols
from vdyn_cli.engine.lead import leads_of
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import Correction, Law, MissingSignalError, ModelBuilder, Number, Signals

E = TypeVar("E", bound=Correction)


class _Probe(ModelBuilder):
    """A model builder that records which effects have all their signals, and which signal the others lack."""

    def __init__(self, model: Model, effects: tuple[Correction, ...]) -> None:
        self.lacking: dict[str, str] = {}
        states: dict[str, Number] = {}
        super().__init__(
            lambda name, start: states.setdefault(name, next(iter(symbols([name]).values()))),
            symbols(model.parameters),
            symbols(constants_of(model, effects)),
            effects,
            symbols(model.context),
        )

    def _states(self, effect: Correction, at: str, s: Signals) -> dict[str, Number]:
        try:
            return super()._states(effect, at, s)
        except MissingSignalError as missing:
            self.lacking.setdefault(effect.name, str(missing))
            return {}

    def _wrap(self, effect: Correction, name: str, law: Law, states: Mapping[str, Number]) -> Law:
        corrected = super()._wrap(effect, name, law, states)

        def attempt(s: Signals) -> Number:
            try:
                return corrected(s)
            except MissingSignalError as missing:
                self.lacking.setdefault(effect.name, str(missing))
                return law(s)  # raises again where the law itself lacks a signal

        return attempt


def applicable(model: Model, catalog: Iterable[E]) -> tuple[E, ...]:
    """The effects of a catalog that apply to a model, in its order; one pass, without simulation.

    Raises
    ------
    MissingSignalError : an element of the model itself lacks a signal.
    """
    effects = tuple(catalog)
    found = _probed(model, effects)
    return tuple(e for e in effects if e.name in found.met and e.name not in found.lacking)


def missing_signals(model: Model, catalog: Iterable[Correction]) -> dict[str, str]:
    """Of the effects that correct a law of the model but lack a signal: that signal, by name of the effect."""
    return dict(_probed(model, tuple(catalog)).lacking)


def _probed(model: Model, effects: tuple[Correction, ...]) -> _Probe:
    """The builder of a model assembled with every effect; effects that lack a signal are recorded and left out."""
    builder = _Probe(model, effects)
    model.assemble(builder, Signals(**leads_of(builder, model.inputs).applied(symbols(model.inputs))))
    builder.finish(lambda of: of)
    return builder
