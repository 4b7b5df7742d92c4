from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="parameters",
    unknowns=Quantity(
        "slip_stiffness_error", "", "share by which the tires' slip stiffness exceeds that of the model", "", -0.5, 1.0
    ),
    reference="tires of one size differ by a factor of two between winter and worn summer treads; pressure, "
    "temperature and a wet road change the slip stiffness by up to 30 %",
    label="slip stiffness of the tires that differs from the given one",
    signature="Driven wheels turn faster, or slower, than simulated in proportion to the drive force.",
    alike=("wheel_radius", "speed_scale", "torque_gain", "tire_relaxation"),
    confirm="Measure the slip of the driven wheels at several torques, on this road and on that of the tire test.",
    possible={"slip_stiffness_error": (-0.8, 3.0)},
    tags={"driving"},
)
def slip_stiffness(parameters: Law, s: Signals, q: Signals) -> Number:
    """Tires that slip more, or less, per force than in the tire test; their peak friction is that of the test.

    B (1 + q) in place of B in the magic formula, which changes its slope at zero slip, B C D, by the same factor.
    """
    return parameters(s.but(tire_B=s.tire_B * (1.0 + q.slip_stiffness_error)))
