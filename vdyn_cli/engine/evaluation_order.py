"""Order of evaluation of a graph: values needed once for all steps, in every stage of a step, or only for readings."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import casadi as ca

from vdyn_cli.engine.dual import instructions

# Operations that C and LLVM IR compute by functions of libm, with their names.
LIBM = {
    ca.OP_SIN: "sin",
    ca.OP_COS: "cos",
    ca.OP_TAN: "tan",
    ca.OP_ASIN: "asin",
    ca.OP_ACOS: "acos",
    ca.OP_ATAN: "atan",
    ca.OP_ATAN2: "atan2",
    ca.OP_TANH: "tanh",
    ca.OP_EXP: "exp",
    ca.OP_LOG: "log",
    ca.OP_POW: "pow",
    ca.OP_CONSTPOW: "pow",
}


@dataclass(frozen=True)
class Instruction:
    """One value of a graph.

    Parameters
    ----------
    op : CasADi's operation.
    of : places of its arguments in the order; for an input, index of the function argument and of its element.
    value : of a constant.
    """

    op: int
    of: tuple[int, ...]
    value: float


@dataclass(frozen=True)
class EvaluationOrder:
    """The values of a field (x, u, p) -> (rates, readings); a value's place is its index.

    Parameters
    ----------
    values : in an order in which the arguments of each one come before it.
    rates, readings : places of the results.
    once : places of values that depend on constants only.
    kept : places of those that other values or the results use; numbers in the field itself are not among them.
    moving, reading : places to compute for the rates, and those needed for the readings only; in order.
    uses : how often each value is used.
    """

    values: tuple[Instruction, ...]
    rates: tuple[int, ...]
    readings: tuple[int, ...]
    once: tuple[int, ...]
    kept: tuple[int, ...]
    moving: tuple[int, ...]
    reading: tuple[int, ...]
    uses: tuple[int, ...]


def ordered(field: ca.Function) -> EvaluationOrder:
    """Order and classify the instructions of a field.

    Parameters
    ----------
    field : rates and readings as functions of states, inputs and parameters.
    """
    values: list[Instruction] = []
    results: list[list[int]] = [[0] * int(field.size1_out(k)) for k in range(2)]
    slots: dict[int, int] = {}  # place of the value in each memory slot of the graph, which are reused
    for op, to, of, value in instructions(field):
        if op == ca.OP_OUTPUT:
            results[to[0]][to[1]] = slots[of[0]]
            continue
        made_of = tuple(of) if op in (ca.OP_INPUT, ca.OP_CONST) else tuple(slots[k] for k in of)
        slots[to[0]] = len(values)
        values.append(Instruction(op, made_of, value))
    once = _once(values)
    moving = _needed(values, results[0], once)
    reading = _needed(values, results[1], once) - moving
    used = {k for place in moving | reading for k in _parts(values[place])} | {k for row in results for k in row}
    counts = Counter(k for value in values for k in _parts(value)) + Counter(k for row in results for k in row)
    return EvaluationOrder(
        values=tuple(values),
        rates=tuple(results[0]),
        readings=tuple(results[1]),
        once=tuple(sorted(_needed(values, sorted(used & once), set()))),
        kept=tuple(sorted(used & once)),
        moving=tuple(sorted(moving)),
        reading=tuple(sorted(reading)),
        uses=tuple(counts[place] for place in range(len(values))),
    )


def _parts(value: Instruction) -> tuple[int, ...]:
    return () if value.op in (ca.OP_INPUT, ca.OP_CONST) else value.of


def _once(values: list[Instruction]) -> set[int]:
    """Places of the values computed from the constants p only, without the constants and numbers themselves."""
    still: set[int] = set()
    found: set[int] = set()
    for place, value in enumerate(values):
        plain = value.op in (ca.OP_INPUT, ca.OP_CONST)
        if value.op == ca.OP_CONST or (value.op == ca.OP_INPUT and value.of[0] == 2):
            still.add(place)
        elif not plain and all(k in still for k in value.of):
            still.add(place)
            found.add(place)
    return found


def _needed(values: list[Instruction], results: list[int], known: set[int]) -> set[int]:
    """Places of all values that the results depend on and that are not known."""
    found: set[int] = set()
    todo = list(results)
    while todo:
        place = todo.pop()
        if place not in found and place not in known:
            found.add(place)
            todo += _parts(values[place])
    return found
