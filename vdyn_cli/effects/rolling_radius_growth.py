from vdyn_cli.effects import Law, Number, Quantity, Signals, effect

SPEED = 100.0 / 3.6  # m/s, at which the growth is stated


@effect(
    on="slip",
    unknowns=Quantity(
        "rolling_radius_growth", "", "relative growth of the rolling radius at 100 km/h", "q_V", -0.002, 0.03
    ),
    reference="Pacejka, 3rd ed., 2012, ch. 4: R0 (1 + q_V1 (V/V0)^2); belted tires 0.1 to 0.5 %, bias tires more",
    label="a rolling radius that grows with speed",
    signature="The slip at zero force falls with the square of the speed; sweeps at low speed agree with the radius.",
    alike=("slip_offset", "wheel_radius", "ground_speed_delay"),
    confirm="Let the wheel roll freely at the lowest and the highest speed of the sweeps, and compare its radius.",
    tags={"slip_sweep"},
)
def rolling_radius_growth(slip: Law, s: Signals, q: Signals) -> Number:
    """A tire whose belt grows by centrifugal force, so that its rolling radius increases with the square of the speed.

    s = (1 + s_read) (1 + q (V / V0)^2) - 1, s the slip, V the vehicle speed, m/s, and V0 = 100 km/h; the given radius
    is that at rest. Sweeps at one speed cannot tell it from a wrong radius.
    """
    read = slip(s)
    return read + (1 + read) * q.rolling_radius_growth * (s.speed / SPEED) ** 2
