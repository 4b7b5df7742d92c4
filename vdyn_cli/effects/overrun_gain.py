from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import where


@effect(
    on=("drive_torque", "drive_torque_left", "drive_torque_right"),
    unknowns=Quantity("overrun_gain", "", "share by which a drive torque below zero reads too high", "e", -0.3, 0.3),
    reference="a torque computed with one efficiency (0.85 to 0.95 of motor and inverter) for both directions of power "
    "errs by up to twice the loss in recuperation; the drag torque of engines is known to 10 to 30 %",
    label="a drive torque whose values below zero have a wrong gain",
    signature="The simulated car decelerates too much or too little in proportion to a negative torque; both agree "
    "while it is driven.",
    alike=("torque_gain", "driveline_loss", "brake_drag"),
    confirm="Hold recuperation at two levels from the same speed on a level road, and compare the decelerations.",
    tags={"sensor", "driving"},
)
def overrun_gain(drive_torque: Law, s: Signals, q: Signals) -> Number:
    """A drive torque channel with a wrong gain while the car drives the motor.

    T = T_read / (1 + e) for T_read < 0, T_read for T_read >= 0

    with T the torque on the car and T_read its reading, N m.
    """
    return drive_torque(s.but(value=where(s.value < 0, s.value / (1.0 + q.overrun_gain), s.value)))
