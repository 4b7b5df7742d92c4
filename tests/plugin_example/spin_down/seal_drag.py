"""A seal whose drag rises with the wheel's speed."""

from __future__ import annotations

from vdyn_cli.effects import effect
from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.quantities.quantity import Quantity


@effect(
    on="spin_friction",
    unknowns=(Quantity("seal_drag", "N m s/rad", "torque of the seal per angular speed", "c", -0.1, 0.1),),
    reference="viscous friction of radial shaft seals: 1 to 20 mN m s/rad",
    label="a seal that drags with speed",
    signature="The wheel slows down faster at high speed than at low speed.",
    alike=("spin_torque",),
    confirm="Take the seal out and spin the wheel again.",
    tags={"free_spin"},
)
def seal_drag(spin_friction: Law, s: Signals, q: Signals) -> Number:
    """A seal whose torque is proportional to the angular speed.

    T = T0 + c om.
    """
    return spin_friction(s) + q.seal_drag * s.wheel_speed
