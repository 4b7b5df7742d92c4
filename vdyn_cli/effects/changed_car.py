from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


def _drag(drag: Law, s: Signals, q: Signals) -> Number:
    return drag(s.but(drag_area=s.drag_area * (1.0 + s.changed * q.changed_drag)))


@effect(
    on="rolling",
    also={"air": _drag, "gust_drag": _drag},
    unknowns=(
        Quantity("changed_rolling", "", "relative change of rolling resistance between two runs", "", -0.5, 1.0),
        Quantity("changed_drag", "", "relative change of drag area between two runs", "", -0.5, 1.0),
    ),
    reference="pumped tires and roof boxes: 10 to 25 %; trailers: drag area 20 to 60 % larger, and mass up to 50 %, by "
    "which the resistance per stated mass decreases",
    label="a car that was changed between two runs",
    signature="From one run on, or in two runs, the car slows down faster or more slowly than before, both ways.",
    alike=("tire_warmup", "temperature_rolling", "headwind", "mass_error"),
    confirm="Ask what was changed before that run (trailer, load, tires, roof box), and undo it for two more runs.",
    tags={"test_only", "coasting"},
)
def changed_car(rolling: Law, s: Signals, q: Signals) -> Number:
    """A car with another resistance from one run on, or in two: a trailer, a load, other tires, a roof box, a brake.

    Rr = frr (1 + k) Fz, N, and Cd A (1 + d), m^2, in the runs with the change; Fz the load, N. A load that is not in
    the stated mass M decreases both by its share of the inertia. The step finds the runs from the data.
    """
    return rolling(s.but(rolling_resistance=s.rolling_resistance * (1.0 + s.changed * q.changed_rolling)))
