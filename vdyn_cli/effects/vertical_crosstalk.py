from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import fmax

LEAST = 1.0  # N of load, so that a wheel without load has a friction


@effect(
    on="force_x",
    unknowns=Quantity(
        "vertical_crosstalk", "", "share of the longitudinal force that the vertical load includes", "k", -0.06, 0.06
    ),
    reference="wheel force sensors: crosstalk of the longitudinal force 0.5 to 2 %; a sensor tilted by 1 deg: 1.7 %",
    label="a vertical load that includes a share of the longitudinal force",
    signature="Friction reads too low in driving and too high in braking, or the reverse, and right at zero slip.",
    alike=("braking_friction", "rolling_force"),
    confirm="Brake the standing wheel and push the car: a load that changes with the force is crosstalk.",
    tags={"sensor", "slip_sweep"},
)
def vertical_crosstalk(force_x: Law, s: Signals, q: Signals) -> Number:
    """A load channel that reads a share of the longitudinal force: crosstalk, or a sensor that is tilted.

    F = F0 / (1 + k F0 / Fz), N, with Fz = Fz0 + k F the load read, N, Fz0 the true one and F0 the force by the curve at
    the load read. Assumes a force in proportion to the load. The slope at zero slip does not change.
    """
    force = force_x(s)
    return force / (1.0 + q.vertical_crosstalk * force / fmax(s.load, LEAST))
