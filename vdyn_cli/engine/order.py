"""What of a graph has to be computed when: once for all steps, in every stage of a step, or for the readings alone."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import casadi as ca

from vdyn_cli.engine.dual import instructions


@dataclass(frozen=True)
class Instruction:
    """One value of a graph.

    Parameters
    ----------
    op : CasADi's operation.
    of : the values it is made of, by their place in the order; for an input, which argument and which element of it.
    value : of a constant.
    """

    op: int
    of: tuple[int, ...]
    value: float


@dataclass(frozen=True)
class Order:
    """The values of a field (x, u, p) -> (rates, readings), each with a place of its own.

    Parameters
    ----------
    values : in an order in which each one finds what it is made of.
    rates, readings : the places of the results.
    once : places of what is made of constants alone.
    kept : of those, what others are made of; constants of the field itself are not among them.
    moving, reading : places to compute for the rates, and those that only the readings need besides; in order.
    uses : how often each value is asked for.
    """

    values: tuple[Instruction, ...]
    rates: tuple[int, ...]
    readings: tuple[int, ...]
    once: tuple[int, ...]
    kept: tuple[int, ...]
    moving: tuple[int, ...]
    reading: tuple[int, ...]
    uses: tuple[int, ...]


def ordered(field: ca.Function) -> Order:
    """Sort out the instructions of a field.

    Parameters
    ----------
    field : rates and readings over states, inputs and parameters.

    Returns
    -------
    The instructions in order of evaluation, and the slots of the results.
    """
    values: list[Instruction] = []
    results: list[list[int]] = [[0] * int(field.size1_out(k)) for k in range(2)]
    slots: dict[int, int] = {}  # the graph's own memory is used again and again
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
    return Order(
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
    """What follows from the constants p; inputs and numbers themselves are at hand anyway."""
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
    """All that the results are made of and that is not known."""
    found: set[int] = set()
    todo = list(results)
    while todo:
        place = todo.pop()
        if place not in found and place not in known:
            found.add(place)
            todo += _parts(values[place])
    return found
