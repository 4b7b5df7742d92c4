"""Candidate effects, each a file that the catalog finds by its name and that needs no other import than this one.

An installed package adds an effect with the entry point ``vdyn.effects: NAME = package.module:NAME``.
"""

from vdyn_cli.effects.definition.catalog import candidates, catalog, extensions_in_si, refused_effects
from vdyn_cli.effects.definition.effect import PROPERTIES, SITUATIONS, Effect, effect, enlarged, in_other_form, reads
from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.quantities.quantity import Quantity

__all__ = [
    "PROPERTIES",
    "SITUATIONS",
    "Effect",
    "Law",
    "Number",
    "Quantity",
    "Signals",
    "candidates",
    "catalog",
    "effect",
    "enlarged",
    "extensions_in_si",
    "in_other_form",
    "reads",
    "refused_effects",
]
