from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="spin_loss",
    unknowns=Quantity(
        "driveline_viscous", "N m s", "viscous loss of the driveline, at the driven wheels", "c", 0.0, 1.0
    ),
    # The viscosity of oil below 0 degC is ten times that at working temperature.
    possible={"driveline_viscous": (0.0, 5.0)},
    reference="oil churning of gears and drag of coupled machines: 0.05 to 0.5 N m s at the wheels when warm",
    label="a driveline drag that increases with speed",
    signature="The drive torque exceeds the torque behind the gears in proportion to speed, with and without load.",
    alike=("speed_dependent_rolling", "driveline_drag", "torque_gain", "torque_offset", "extra_drag_area"),
    confirm="Turn the driven wheels on stands at several speeds with a torque wrench, cold and warm.",
    tags={"of_a_car", "driving"},
)
def driveline_viscous(spin_loss: Law, s: Signals, q: Signals) -> Number:
    """A torque loss in proportion to speed, between the torque's sensor and the half-shafts.

    T = c V / r, N m at the driven wheels together, V the speed, m/s, and r the wheel radius, m.
    """
    return spin_loss(s.but(viscous=s.viscous + q.driveline_viscous))
