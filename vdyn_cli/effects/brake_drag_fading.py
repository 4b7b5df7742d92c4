from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import exp


def _hyperbolic(brake: Law, s: Signals, q: Signals) -> Number:
    """F = Fb / (1 + t/T): the mean of pads and discs that release with times of many sizes."""
    rubbing = q.brake_drag_fading / (1.0 + s.run_time / q.brake_drag_fading_time)
    return brake(s.but(brake_force=s.brake_force + s.share * rubbing))


@effect(
    on="brake",
    unknowns=(
        Quantity("brake_drag_fading", "N", "brake drag when a run begins, at the road", "Fb", 0.0, 300.0),
        Quantity("brake_drag_fading_time", "s", "time in which it falls to 37 %", "", 5.0, 60.0),
    ),
    nominal={"brake_drag_fading_time": 20.0},
    reference="pads retract and discs cool within tens of seconds of braking; size as for residual brake torque",
    label="brakes that release slowly",
    signature="Every run slows down too fast in its first tens of seconds, in both directions.",
    alike=("extra_drag_area", "drag_area", "tire_warmup"),
    confirm="Do not touch the brakes for a minute before a run, or start coasts from different speeds.",
    tags={"begins_with_run", "of_a_car", "test_only", "open_road", "wheel_spin"},
    other_law=_hyperbolic,
)
def brake_drag_fading(brake: Law, s: Signals, q: Signals) -> Number:
    """Pads that still rub after braking, and then release.

    F = Fb exp(-t/T)

    with F and Fb in N, all wheels together (for a wheel with a force sensor: at its rim), t the time since the start of
    the run's log and T the time constant, s. T is 20 s where the data do not determine it.
    Where coasts begin at one speed, a slower decay, F = Fb / (1 + t/T), differs from it like a drag area: intervals
    include it.
    """
    rubbing = q.brake_drag_fading * exp(-s.run_time / q.brake_drag_fading_time)
    return brake(s.but(brake_force=s.brake_force + s.share * rubbing))
