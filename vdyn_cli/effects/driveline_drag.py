from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="driveline",
    unknowns=Quantity("driveline_drag", "N", "spin loss of the driven axle, at the road", "F0", 0.0, 300.0),
    reference="oil churning, seals and bearings of a final drive and its machines: 20 to 100 N for a passenger car",
    label="a driveline that drags",
    signature="The drive force exceeds the road load by the same force at every speed.",
    alike=("brake_drag", "rolling_resistance", "torque_offset", "torque_gain"),
    confirm="Turn the driven wheels on stands with a torque wrench; coast without half-shafts only if the hub bearings "
    "need no stub axles.",
    tags={"of_a_car", "open_road"},
)
def driveline_drag(driveline: Law, s: Signals, q: Signals) -> Number:
    """Spin losses of the driven axle, independent of the torque.

    F = F0, N, on the driven wheels. A loss that increases with speed is collinear with such a rolling resistance.
    """
    return driveline(s.but(driveline_drag=s.driveline_drag + s.share * q.driveline_drag))
