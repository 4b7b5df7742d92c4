"""Comparison of two parameter files: the parameters that changed by more than both uncertainties."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping

from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.parameter_json import ParameterDocument, in_si
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.quantity import Quantity, UnitError
from vdyn_cli.quantities.result_schema import ComparedEntry, ComparisonDocument

MOST_NAMED = 4  # parameters that a message lists for each file
_ROUNDING = 1e-9  # relative difference of two numbers that are the same except for their last digits
ASSUMED = (
    "The errors of both files are taken as independent: standard error of the difference = sqrt(old^2 + new^2), each "
    "from the end of the 95 % interval on the side of the other value. Changed: the difference exceeds 1.96 standard "
    "errors, which happens to one in 20 parameters by chance."
)
_SHARED = (
    " {}{} of the input files {} in both: if their errors are shared, the true standard error is smaller, and a "
    "parameter that counts as not changed may have changed."
)


def compare_documents(old: ParameterDocument, new: ParameterDocument, names: tuple[str, str]) -> ComparisonDocument:
    """Compare the parameters, and the unknowns of the effects that extend the model, of two files::

        z = (new - old) / sqrt(s_old^2 + s_new^2),   moved: |z| > 1.96

    s is the distance from the value to the end of its 95 % interval on the side of the other value, over 1.96; so it
    includes the uncertainty that the diagnosis leaves open and the skewness of an interval.

    Assumes : the errors of both files are independent. A value given as exact has no error, so that any change counts.

    Parameters
    ----------
    old, new : the documents. names : of the two files.

    Raises
    ------
    InputError : the files have no parameter in common, or units with different dimensions for one.
    """
    earlier, later = _entries(old.parameters), _entries(new.parameters)
    both = [name for name in earlier if name in later]
    if not both:
        got = "; ".join(f"{name}: {_first_names(one)}" for name, one in zip(names, (earlier, later), strict=True))
        remedy = "compare two results of one step, or two parameters.json"
        raise InputError(Finding(" and ".join(names), "have no parameter in common", got, remedy))
    rows = [_compared(name, earlier[name], later[name], names[1]) for name in both]
    moved = [row.name for row in rows if row.moved]
    pipeline = "At least " if "pipeline" in (old.content.get("step"), new.content.get("step")) else ""  # lists no logs
    shared = len(set(_digests(old)) & set(_digests(new)))
    return ComparisonDocument(
        format="vdyn/comparison/1",
        old=names[0],
        new=names[1],
        sentence=_sentence(rows, moved),
        moved=bool(moved),
        parameters=rows,
        only_old=[name for name in earlier if name not in later],
        only_new=[name for name in later if name not in earlier],
        verdicts=list(_verdicts(old, new)),
        assumed=ASSUMED + (_SHARED.format(pipeline, shared, "is" if shared == 1 else "are") if shared else ""),
    )


def _entries(parameters: Parameters) -> dict[str, Estimate]:
    """All estimates of a file by name; the unknowns of effects as ``effect.unknown``."""
    extended = {f"{e}.{n}": one for e, unknowns in parameters.extensions.items() for n, one in unknowns.items()}
    return {**parameters, **extended}


def _first_names(parameters: Mapping[str, object]) -> str:
    more = len(parameters) - MOST_NAMED
    return (", ".join(list(parameters)[:MOST_NAMED]) or "no parameters") + (f" and {more} more" if more > 0 else "")


def _compared(name: str, old: Estimate, new: Estimate, where: str) -> ComparedEntry:
    try:
        new = in_si(new, Quantity(name, old.unit, old.meaning))
    except UnitError as error:
        raise InputError(Finding(f"{where}, '{name}'", str(error), remedy="correct the unit in the file")) from None
    difference = new.value - old.value
    combined = math.hypot(_facing(old, difference), _facing(new, -difference))
    exact = abs(difference) <= _ROUNDING * max(abs(old.value), abs(new.value))
    return ComparedEntry(
        name=name,
        unit=old.unit,
        meaning=old.meaning,
        old=old.value,
        old_interval95=old.interval95,
        new=new.value,
        new_interval95=new.interval95,
        difference=difference,
        standard_error=combined,
        z=0.0 if exact else difference / combined if combined else None,
        moved=not exact and abs(difference) > NORMAL95 * combined,
    )


def _facing(estimate: Estimate, toward: float) -> float:
    """Standard error on the side of ``toward``, from the end of the 95 % interval."""
    low, high = estimate.interval95
    return max((high - estimate.value if toward > 0 else estimate.value - low) / NORMAL95, 0.0)


def _sentence(rows: list[ComparedEntry], moved: list[str]) -> str:
    if not moved:
        return f"No parameter changed significantly ({len(rows)} compared)."
    noun = "parameter" if len(moved) == 1 else "parameters"
    return f"{len(moved)} of {len(rows)} {noun} changed significantly: {', '.join(moved)}."


def _digests(document: ParameterDocument) -> Iterable[str]:
    provenance = document.content.get("provenance")
    inputs = provenance.get("inputs") if isinstance(provenance, dict) else None
    return map(str, inputs.values()) if isinstance(inputs, dict) else ()


def _verdicts(old: ParameterDocument, new: ParameterDocument) -> Iterator[str]:
    """Texts of the diagnosis verdicts that differ, of a step's result or of the steps of a pipeline."""
    before, after = _verdict_of(old), _verdict_of(new)
    for step in before:
        if step in after and before[step] != after[step]:
            yield f"{step}: {before[step]} -> {after[step]}"


def _verdict_of(document: ParameterDocument) -> dict[str, str]:
    content = document.content
    steps = content.get("steps")
    parts = steps if isinstance(steps, dict) else {str(content.get("step")): content.get("diagnosis")}
    return {str(n): str(one["verdict"]) for n, one in parts.items() if isinstance(one, dict) and one.get("verdict")}
