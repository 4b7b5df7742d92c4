from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on=("drive_torque", "drive_torque_left", "drive_torque_right"),
    unknowns=Quantity("torque_drift", "N m/s", "rate of the drive torque's zero in each run", "r", -0.5, 0.5),
    reference="30 N m, the plausible zero of a drive torque, within one minute: strain gauges drift by up to 0.02 % of "
    "full scale per K, 0.6 N m/K at 3000 N m, and a shaft or hub warms by up to 50 K in a run",
    label="a zero drift of the drive torque",
    signature="A force that is the same at every speed and torque increases steadily from the start of each run.",
    alike=("torque_offset", "brake_drag_fading", "tire_warmup", "grade_profile"),
    confirm="Read the torque channel at rest without torque directly before and after a run.",
    sense="since the start of the run",
    tags={"of_a_car", "sensor", "driving"},
)
def torque_drift(drive_torque: Law, s: Signals, q: Signals) -> Number:
    """A drive torque channel whose zero drifts from the start of each run.

    T = reading - r t

    with T the torque on the car, N m, t the time since the start of the run's log, s, and r the rate, N m/s. Assumes
    that the sensor is zeroed before each run and drifts alike in all of them. Two half-shaft sensors have the same r.
    """
    return drive_torque(s.but(value=s.value - q.torque_drift * s.run_time))
