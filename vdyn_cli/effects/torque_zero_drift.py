from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


def drifting(torque: Law, s: Signals, q: Signals) -> Number:
    """Reading of a torque sensor whose zero drifts, N m."""
    return torque(s) + q.torque_zero_drift * s.run_time


@effect(
    on="hub_torque",
    also={"shaft_torque": drifting},
    unknowns=Quantity("torque_zero_drift", "N m/s", "rate of the torque sensor's zero in each run", "r", -2, 2),
    reference="strain gauges drift by up to 0.02 % of full scale per K, 0.6 N m/K at 3000 N m; telemetry that is "
    "switched on for the run, or a brake, heats a hub or shaft by up to 3 K/s",
    possible={"torque_zero_drift": (-10.0, 10.0)},  # 30 N m, 1 % of full scale, within a tip-in of 3 s
    label="a torque sensor with a drifting zero",
    signature="The torque residual increases steadily from the start of each run, whatever speed and torque are.",
    alike=("brake_drag_fading", "hub_torque_offset"),
    confirm="Read the torque at rest without torque directly before and after a run.",
    sense="since the start of the run",
    tags={"sensor", "wheel_spin", "shaft_twist"},
)
def torque_zero_drift(hub_torque: Law, s: Signals, q: Signals) -> Number:
    """A torque sensor at a hub or half-shaft whose zero drifts from the start of each run.

    T = T_read - r t, N m, t the time since the start of the run's log, s. Assumes the same rate in all runs.
    """
    return hub_torque(s) - q.torque_zero_drift * s.run_time
