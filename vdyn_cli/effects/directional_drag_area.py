"""Drag area that differs between the directions."""

from __future__ import annotations

from vdyn_cli.effects import effect
from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.quantities.quantity import Quantity


@effect(
    on="air",
    unknowns=(
        Quantity("directional_drag_area", "m^2", "half of drag area out less drag area back", "dCdAh", -0.1, 0.1),
    ),
    reference="doi:10.4271/2017-01-1574 (what is open or outside changes the drag); range: windows open on one way "
    "raise the drag area of a car by up to 10 % of 1 m^2, a quartering crosswind at 10 deg of yaw likewise",
    label="a drag area that differs between the directions",
    signature="Runs out and back differ by a force that increases with the square of the speed.",
    alike=("headwind", "road_grade"),
    confirm="Repeat the runs with all windows closed, flaps and equipment alike both ways, and on a day without wind.",
    sense="more on the way out than on average",
    tags={"of_a_car", "test_only", "turns_with_heading", "coasting"},
)
def directional_drag_area(air: Law, s: Signals, q: Signals) -> Number:
    """Drag area that is larger on the way out than on the way back: open windows, flaps, a crosswind.

    F = 1/2 rho (Cd A + h dCdA) (v + w) |v + w| with heading h = +1 out, -1 back; Cd A is the mean of both.
    """
    return air(s.but(drag_area=s.drag_area + s.heading * q.directional_drag_area))
