from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="dry_loss",
    unknowns=Quantity(
        "driveline_dry_loss", "N m", "constant loss of the driveline, at the driven wheels", "T0", 0.0, 100.0
    ),
    reference="seals, preloaded bearings and oil of a final drive and its machines: 5 to 30 N m at the wheels of a "
    "passenger car",
    label="a driveline with a constant torque loss",
    signature="The drive torque exceeds that of the half-shafts by the same amount at every speed and load.",
    alike=("torque_offset", "driveline_drag", "rolling_resistance", "driveline_viscous"),
    confirm="Turn the driven wheels on stands with a torque wrench, and read the torque channel at rest.",
    tags={"of_a_car", "driving"},
)
def driveline_dry_loss(dry_loss: Law, s: Signals, q: Signals) -> Number:
    """A constant loss of the driveline between the torque's sensor and the half-shafts.

    T = T0, N m, at the driven wheels together, against the motion. A torque channel with a wrong zero has the same
    effect while the car moves forward.
    """
    return dry_loss(s.but(dry_loss=s.dry_loss + q.driveline_dry_loss))
