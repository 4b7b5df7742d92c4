"""Values computed once, in every stage, and only for the readings."""

from __future__ import annotations

import casadi as ca

from vdyn_cli.engine.evaluation_order import ordered
from vdyn_cli.engine.graph import trace
from vdyn_cli.engine.maths import cos, sin
from vdyn_cli.engine.model import Model


def order():
    def assemble(e, u):
        x = e.state("x")
        pull = sin(e.p.a / e.p.b) * x  # the sine and its argument: from constants alone
        e.integrate(x=pull + u.push)
        e.sensor("tone", cos(pull))  # for the reading alone

    return ordered(trace(Model("sorted", assemble, ("a", "b"), ("push",))).field)


def test_each_value_has_its_time():
    found = order()
    ops = {name: [found.values[place].op for place in getattr(found, name)] for name in ("once", "moving", "reading")}
    assert {ca.OP_DIV, ca.OP_SIN} <= set(ops["once"])
    assert ca.OP_SIN not in ops["moving"] + ops["reading"]
    assert ops["reading"] == [ca.OP_COS]
    assert ca.OP_MUL in ops["moving"]
    assert ca.OP_ADD in ops["moving"]


def test_what_others_are_made_of_is_kept_and_nothing_else():
    found = order()
    assert [found.values[place].op for place in found.kept] == [ca.OP_SIN]
    pull = next(place for place in found.moving if found.values[place].op == ca.OP_MUL)
    assert found.uses[pull] == 2


def test_values_come_after_what_they_are_made_of():
    found = order()
    known = set(found.once)
    for place in (*found.moving, *found.reading):
        value = found.values[place]
        assert value.op in (ca.OP_INPUT, ca.OP_CONST) or set(value.of) <= known
        known.add(place)
