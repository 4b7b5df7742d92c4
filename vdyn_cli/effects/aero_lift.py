from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="lift",
    unknowns=(
        Quantity("aero_lift", "m^2", "lift coefficient times area, of both axles together", "Cl A", -5.0, 1.5),
        Quantity("aero_lift_front", "", "share of the lift at the front axle", "f", -1.0, 2.0),
    ),
    nominal={"aero_lift_front": 0.5},
    reference=(
        "Hucho, Aerodynamics of Road Vehicles, 4th ed. 1998, chapter 4: lift coefficients of 0 to 0.3 an axle; Katz, "
        "Race Car Aerodynamics, 1995: Cl A down to -5 m^2"
    ),
    label="aerodynamic lift",
    signature="The sum of both axle loads decreases with the square of the speed.",
    alike=("drag_height", "drag_area"),
    confirm="Hold a high speed on a level road and compare the axle loads with the loads at walking speed.",
    tags={"pitching"},
)
def aero_lift(lift: Law, s: Signals, q: Signals) -> Number:
    """Aerodynamic lift of the body, with a share f at the front axle.

    F = 1/2 rho Cl A V |V|, N upward: f F at the front axle, (1 - f) F at the rear one. With both axle loads measured,
    their sum determines Cl A and their moment f; with one, only f Cl A is determined, and f stays at 1/2.
    """
    share = (1 - s.rear) * q.aero_lift_front + s.rear * (1 - q.aero_lift_front)
    return lift(s.but(lift_area=s.lift_area + share * q.aero_lift))
