"""Lift that takes load off the axles at speed."""

from __future__ import annotations

from vdyn_cli.effects import effect
from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.quantities.quantity import Quantity


@effect(
    on="lift",
    unknowns=(Quantity("aero_lift", "m^2", "lift coefficient times area, half on each axle", "Cl A", -1.0, 1.0),),
    reference="Hucho, Aerodynamics of Road Vehicles, 4th ed. 1998, chapter 4: lift coefficients of 0 to 0.3 an axle",
    label="aerodynamic lift",
    signature="The axle loads decrease with the square of the speed.",
    alike=("drag_height", "drag_area"),
    confirm="Hold a high speed on a level road and compare the axle loads with the loads at walking speed.",
    tags={"pitching"},
)
def aero_lift(lift: Law, s: Signals, q: Signals) -> Number:
    """Air that lifts the body, as much at the front axle as at the rear.

    F = 1/2 rho Cl A V |V| upward. With both axles' loads measured it shows only as far as the center of gravity lies
    off the middle between the axles.
    """
    return lift(s.but(lift_area=s.lift_area + q.aero_lift))
