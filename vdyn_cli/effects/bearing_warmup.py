from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import exp


@effect(
    on="bearing",
    unknowns=(
        Quantity("bearing_warmup", "N m", "additional drag torque of the cold bearing", "Tw", 0.0, 30.0),
        Quantity("bearing_warmup_time", "s", "time in which it falls to 37 %", "", 5.0, 300.0),
    ),
    nominal={"bearing_warmup_time": 20.0},
    reference="wheel bearings with grease and seals: 0.5 to 2 N m warm, several times that cold",
    label="a bearing that warms up",
    signature="The drag torque is larger when a run begins, and decays within seconds to minutes of rotation.",
    alike=("brake_drag_fading", "torque_zero_drift", "hub_torque_offset"),
    confirm="Push the brake's pads back, and turn the wheel for some minutes before a run begins.",
    tags={"begins_with_run", "wheel_spin"},
)
def bearing_warmup(bearing: Law, s: Signals, q: Signals) -> Number:
    """Grease and seals of a bearing that is cold when a run begins.

    T = sense (Tb + Tw exp(-t/T0))

    with Tw in N m, t the time since the start of the run's log and T0 the time constant, s. T0 is 20 s where the data
    do not determine it. Independent of the speed, as the drag of thick grease at low speed. Source: Palmgren, Ball and
    Roller Bearing Engineering (SKF 1959), the load-independent moment at small speed times viscosity.
    """
    cold = q.bearing_warmup * exp(-s.run_time / q.bearing_warmup_time)
    return bearing(s.but(bearing_torque=s.bearing_torque + s.sense * cold))
