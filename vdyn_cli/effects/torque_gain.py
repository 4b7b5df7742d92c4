from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on=("drive_torque", "drive_torque_left", "drive_torque_right"),
    unknowns=Quantity("torque_gain", "", "share by which the drive torque reads too high", "e", -0.15, 0.15),
    reference="torque from motor current has an error of 1 to 5 %, torque from strain gauges of 0.1 to 0.5 %",
    label="a drive torque with a wrong gain",
    signature="The simulated car becomes faster than the real one in proportion to the torque; they agree in coasts.",
    alike=("wheel_radius", "mass_error", "wheel_inertia", "driveline_drag", "driveline_efficiency"),
    confirm="Hang a known weight on a lever at the hub, or drive up a known slope slowly.",
    # A wrong motor constant (peak for rms current, line for phase), a unit, or the torque before or behind the gears.
    possible={"torque_gain": (-0.9, 9.0)},
    mistakes=(
        (1.35582, "N m read as lbf ft"),
        (1 / 1.35582, "lbf ft read as N m"),
        (2**0.5, "peak current taken for rms"),
        (0.5**0.5, "rms current taken for peak"),
        (3**0.5, "line current taken for phase current"),
        (3**-0.5, "phase current taken for line current"),
        (2.0, "two motors counted for one"),
        (0.5, "one of two motors counted"),
    ),
    tags={"sensor", "open_road"},
)
def torque_gain(drive_torque: Law, s: Signals, q: Signals) -> Number:
    """A drive torque channel with a wrong gain.

    T_read = (1 + e) T: the torque on the car is T = T_read / (1 + e), N m.
    """
    return drive_torque(s.but(value=s.value / (1.0 + q.torque_gain)))
