"""Keys of a file for another program, each with its value, its source, and the limits of that program."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from vdyn_cli.export.parameter_file import ParameterFile
from vdyn_cli.quantities.errors import Finding, raise_all
from vdyn_cli.quantities.quantity import from_si


@dataclass(frozen=True)
class ReceiverKey:
    """One key.

    Parameters
    ----------
    name : in the receiver's spelling. value : in the receiver's unit, or a word.
    why : source of the value. lower, upper : limits of the receiver.
    """

    name: str
    value: float | int | str
    why: str
    lower: float = -math.inf
    upper: float = math.inf

    @property
    def line(self) -> str:
        """The key as a line of YAML, with its source as a comment."""
        value = self.value if isinstance(self.value, (int, str)) else f"{self.value:.7g}"
        return f"{self.name}: {value}  # {self.why}"


def source_of(parameter_file: ParameterFile, name: str, unit: str) -> str:
    """Value, standard deviation and source of a parameter in a unit: ``61.2 +- 1.1 N, measured (coastdown)``."""
    one = parameter_file.parameters[name]
    value, std = from_si(one.value, unit, one.unit), abs(from_si(one.std, unit, one.unit))
    spread = f" +- {std:.2g}" if std else ""
    source = "stated" if one.source == "given" else f"measured ({one.source})"
    return f"{name} {value:.6g}{spread} {unit}".rstrip() + f", {source}"


def refuse_outside(parameter_file: ParameterFile, keys: Iterable[ReceiverKey], receiver: str) -> None:
    """Refuse values that the receiver does not accept.

    Raises
    ------
    InputError : lists all of them.
    """
    found = []
    for key in keys:
        if isinstance(key.value, str) or key.lower <= key.value <= key.upper:
            continue
        span = f"{key.lower:g} to {key.upper:g}" if math.isfinite(key.upper) else f"{key.lower:g} or more"
        what = f"{key.name} is outside the range of {receiver}, {span}"
        remedy = f"check the test that estimated it ({key.why})"
        found.append(Finding(parameter_file.name, what, f"{key.value:.6g}", remedy))
    raise_all(found)


def left_out(parameter_file: ParameterFile, receiver: str) -> tuple[str, ...]:
    """A note for each effect of the parameter file, because the receiver has no key for effects."""
    return tuple(f"left out {one.effect}: {receiver} has no key for it" for one in parameter_file.effects)
