from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import exp


@effect(
    on="friction",
    unknowns=(
        Quantity("tread_wear", "1/s", "relative change of the friction per time swept on the day", "w", -0.02, 0.02),
        Quantity("tread_wear_time", "s", "time swept in which that change falls to 37 %", "", 5.0, 3000.0),
    ),
    nominal={"tread_wear_time": 1000.0},
    reference="a tread loses, or gains until it is warm, 5 to 20 % of its friction in the first minute of sweeping",
    label="friction that changes from sweep to sweep",
    signature="The same slip gives a smaller, or a larger, force in every later sweep.",
    alike=("friction_drift", "load_sensitivity", "load_offset"),
    confirm="Repeat the first sweep at the end of the day, and with a new tire.",
    tags={"test_only", "slip_sweep"},
)
def tread_wear(friction: Law, s: Signals, q: Signals) -> Number:
    """Friction of a tread that wears, or warms up, over the sweeps in the listed order.

    mu = D (1 + w T (1 - exp(-t/T))), mu the peak friction and t the time swept on the day, s: since the start of the
    sweep and in the sweeps before it. D is that at the start of the first sweep, w the change there, 1/s, and w T that
    of a warm tread. T is 1000 s, in which the change is nearly linear, where the data do not determine it.
    """
    time = q.tread_wear_time
    return friction(s) * (1.0 + q.tread_wear * time * (1.0 - exp(-s.swept / time)))
