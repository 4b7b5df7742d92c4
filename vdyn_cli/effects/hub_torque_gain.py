from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="hub_torque",
    unknowns=Quantity("hub_torque_gain", "", "share by which the hub's torque reads too high", "g", -0.1, 0.1),
    reference="wheel force sensors: 0.1 to 0.5 % between the gains of torque and force",
    label="a hub torque with a wrong gain",
    signature="The torque residual is proportional to the torque and to the longitudinal force.",
    alike=("wheel_radius", "wheel_mass", "wheel_inertia"),
    confirm="Compare torque and force under a static load: weights on a lever arm of known length.",
    tags={"sensor", "wheel_spin"},
)
def hub_torque_gain(hub_torque: Law, s: Signals, q: Signals) -> Number:
    """A torque sensor at the hub whose gain differs from that of the force sensor.

    T = T_read / (1 + g), N m. In steady driving it is equivalent to a radius that is 1 + g times as large.
    """
    return hub_torque(s) / (1 + q.hub_torque_gain)
