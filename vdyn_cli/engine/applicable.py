"""Which effects apply to a model: those whose law it calls with the signals that they need."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeVar

from vdyn_cli.engine.graph import constants_of, symbols
from vdyn_cli.engine.lead import leads_of
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import Correction, Law, MissingSignalError, ModelBuilder, Number, Signals

E = TypeVar("E", bound=Correction)


class _Probe(ModelBuilder):
    """A model builder that records which effects find their signals."""

    def __init__(self, model: Model, effects: tuple[Correction, ...]) -> None:
        self.lacking: set[str] = set()
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
        except MissingSignalError:
            self.lacking.add(effect.name)
            return {}

    def _wrap(self, effect: Correction, name: str, law: Law, states: Mapping[str, Number]) -> Law:
        corrected = super()._wrap(effect, name, law, states)

        def attempt(s: Signals) -> Number:
            try:
                return corrected(s)
            except MissingSignalError:
                self.lacking.add(effect.name)
                return law(s)  # raises again where the law itself lacks a signal

        return attempt


def applicable(model: Model, catalogue: Iterable[E]) -> tuple[E, ...]:
    """The effects of a catalogue that apply to a model, in its order; one pass, without simulation.

    Raises
    ------
    MissingSignalError : an element of the model itself lacks a signal.
    """
    effects = tuple(catalogue)
    builder = _Probe(model, effects)
    model.assemble(builder, Signals(**leads_of(builder, model.inputs).seen(symbols(model.inputs))))
    builder.finish(lambda of: of)
    return tuple(e for e in effects if e.name in builder.met and e.name not in builder.lacking)
