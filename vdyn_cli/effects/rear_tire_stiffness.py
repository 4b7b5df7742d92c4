from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="tire_vertical",
    unknowns=Quantity("rear_tire_stiffness", "", "relative difference of the rear tires' stiffness", "eK", -0.4, 0.6),
    reference="a tire's vertical stiffness increases by some 3 % per 0.1 bar and with its width: rear tires of sports "
    "cars and loaded vans are up to 40 % stiffer. Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, chapter 9",
    label="rear tires of another stiffness than the front tires",
    signature="Wheel hop of the rear axle is faster than simulated and that of the front axle slower, or the reverse.",
    alike=("unsprung masses", "rear_load_gain"),
    confirm="Compare size and pressure of front and rear tires, or press a wheel of each axle with a known load.",
    sense="of the front tires' stiffness",
    tags={"bump_crossing"},
)
def rear_tire_stiffness(tire_vertical: Law, s: Signals, q: Signals) -> Number:
    """Rear tires that are stiffer or softer than the front tires, which keep ``tire_vertical_stiffness``.

    Kt_rear = Kt (1 + eK), N/m, with Kt the vertical stiffness of the front axle's tires (N/m) and eK dimensionless.
    """
    return tire_vertical(s.but(stiffness=s.stiffness * (1.0 + s.rear * q.rear_tire_stiffness)))
