from vdyn_cli.effects import Law, Number, Quantity, Signals, effect, reads
from vdyn_cli.quantities.unit_mistakes import SPEED_MISTAKES


def steeper(risen_grade: Law, s: Signals, q: Signals) -> Number:
    """Grade of a logged elevation over the true distance, which is shorter than that of a speed that reads too high."""
    return risen_grade(s) * (1.0 + q.speed_scale_error)


@effect(
    on=("speed", "measured_speed"),
    also={"risen_grade": steeper},
    unknowns=Quantity("speed_scale_error", "", "share by which the speed reads too high", "e", -0.1, 0.1),
    reference="wheel-based speeds change by 1 to 4 % with the assumed radius; GPS and optical sensors: 0.2 %",
    label="a speed with a wrong gain",
    signature="The relative error of the speed is constant; in a coast-down this is collinear with rolling "
    "resistance and drag.",
    alike=("rolling_resistance", "drag_area", "wheel_radius", "mass_error", "torque_gain"),
    confirm="Compare the speed, integrated, with a measured distance: kilometer markers, GPS positions.",
    # Units (km/h, mph, kn read as m/s or as each other: 1.15 to 3.6 times), pulses a turn, a gear ratio left out.
    possible={"speed_scale_error": (-0.93, 14.0)},
    mistakes=(
        *SPEED_MISTAKES,
        (2.0, "a diameter taken for the wheel's radius, or half the pulses a turn"),
        (0.5, "a radius taken for the wheel's diameter, or twice the pulses a turn"),
    ),
    gain_of="speed",
    tags={"sensor", "open_road"},
)
def speed_scale(speed: Law, s: Signals, q: Signals) -> Number:
    """A speed channel with a wrong gain.

    V_read = (1 + e) V, m/s; where the measured speed drives the model, V = V_read / (1 + e). A grade computed from a
    logged elevation is (1 + e) times as steep, because the distance is that of the speed.
    """
    scale = 1.0 + q.speed_scale_error
    return speed(s) * scale if reads(s) else speed(s.but(value=s.value / scale))
