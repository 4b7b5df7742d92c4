"""A model: a name, the function that assembles it on a builder, and the names of everything that goes in."""

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
    assemble : ``assemble(e, u)`` calls elements on builder ``e`` with inputs ``u``, states rates and sensors.
    parameters : names of its constants, read as ``e.p.<name>``.
    inputs : names of its signals in time, read as ``u.<name>``; linear between samples.
    context : names of constants of a run that every law sees, such as ``heading`` (+1 out, -1 back).
    outputs : those that are read, for models that cost less with fewer; none: all.

    Notes
    -----
    States and outputs need no list: the first ``e.state(...)`` and ``e.sensor(...)`` declare them.
    A model without states is a static map from inputs to outputs.
    """

    name: str
    assemble: Callable[[ModelBuilder, Signals], None]
    parameters: tuple[str, ...]
    inputs: tuple[str, ...]
    context: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
