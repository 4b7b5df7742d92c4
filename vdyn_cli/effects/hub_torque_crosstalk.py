from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="hub_torque",
    unknowns=Quantity(
        "hub_torque_crosstalk", "m", "torque read per unit of the hub's vertical force", "c", -0.02, 0.02
    ),
    reference="wheel force sensors: crosstalk of forces into moments up to 1 % of full scale, 4 to 12 N m per kN; a "
    "sensor mounted 2 mm off the axle: 2 N m per kN",
    label="a hub torque with crosstalk from the vertical force",
    signature="The torque residual follows the wheel load: bumps, braking and cornering, also without torque.",
    alike=("hub_torque_offset", "wheel_mass", "rolling_resistance"),
    confirm="Load the standing wheel vertically, by the jack or by ballast, and read the torque.",
    sense="(1 mm: 1 N m per kN)",
    tags={"sensor", "rolling_wheel_spin"},
)
def hub_torque_crosstalk(hub_torque: Law, s: Signals, q: Signals) -> Number:
    """A torque sensor at the hub that reads a share of the vertical force: crosstalk, or a lever arm of its mounting.

    T = T_read - c Fz, N m. Its mean is collinear with the zero of the torque, and its change by the load transfer with
    the wheel's mass; an uneven road separates them.
    """
    return hub_torque(s) - q.hub_torque_crosstalk * s.vertical_force
