from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import fabs


@effect(
    on="drive",
    unknowns=Quantity("driveline_loss", "", "share of the drive force lost behind the torque", "e", 0.0, 0.25),
    reference="a helical stage under load loses 1 to 2 %, a final drive 2 to 5 %, and a torque computed from "
    "currents omits the motor's iron and friction losses: 2 to 8 %",
    label="a driveline loss that is proportional to the torque",
    signature="The simulated car becomes faster than the real one in proportion to the drive torque, of either sign; "
    "they agree while coasting.",
    alike=("torque_gain", "wheel_radius", "mass_error", "driveline_efficiency", "driveline_drag"),
    confirm="Weigh the car, then measure the torque at the hubs or the pull of the car against a load cell.",
    tags={"driving"},
)
def driveline_loss(drive: Law, s: Signals, q: Signals) -> Number:
    """A loss of drive force: F = F0 - e |F0|, N, where F0 is the force of the law that is corrected.

    The loss opposes the motion: less force acts while the car is driven, and it decelerates more while the wheels drive
    the driveline, as under recuperation. Only for the model of a mass on a road, whose call states ``whole`` = 1; in
    the full vehicle a loss before the half-shafts is equivalent to a gain of the torque's reading.
    """
    force = drive(s)
    return force - s.whole * q.driveline_loss * fabs(force)
