"""A model: its name, the function that assembles its laws, and the names of its parameters, inputs and context."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from vdyn_cli.engine.model_builder import ModelBuilder, Signals


@dataclass(frozen=True)
class Model:
    """An assembly of element laws.

    Parameters
    ----------
    name : the model's name in messages.
    assemble : ``assemble(e, u)`` calls laws on the builder ``e`` with inputs ``u`` and defines rates and sensors.
    parameters : names of its constants, read as ``e.p.<name>``.
    inputs : names of its input signals, read as ``u.<name>``; linear between samples.
    context : names of constants of a run that every law can read, such as ``heading`` (+1 out, -1 back).
    outputs : names of the sensors to compute, for models that cost less with fewer; empty: all.
    unvaried : signals that laws cannot read because the runs hardly vary them, each with what would have to vary.

    Notes
    -----
    States and outputs need no list: ``e.state(...)`` and ``e.sensor(...)`` declare them.
    A model without states is a static map from inputs to outputs.
    """

    name: str
    assemble: Callable[[ModelBuilder, Signals], None]
    parameters: tuple[str, ...]
    inputs: tuple[str, ...]
    context: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    unvaried: tuple[tuple[str, str], ...] = ()
