from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.quantities.constants import GRAVITY


@effect(
    on="load_moment",
    unknowns=Quantity("unsprung_mass", "kg", "unsprung mass of each axle", "m", -10, 200),
    reference="70 to 100 kg per axle of a passenger car; tires deflect by 18 to 20 mm under its weight",
    label="unsprung mass that is not in the model",
    signature="The residual is proportional to the second derivative of the axle loads: largest at fast pedal steps.",
    alike=("clock_offset", "pitch_inertia"),
    confirm="Weigh a wheel with its carrier, half of the links and shafts added.",
    tags={"pitching"},
)
def unsprung_mass(load_moment: Law, s: Signals, q: Signals) -> Number:
    """Axles whose mass moves vertically on the tires while the body pitches.

    The force on the body is F - m (g + z'') at either axle, N, z'' = -F''/Kt, and the body's center lies
    lr' = (M lr - m L)/(M - 2 m) ahead of the rear axle, with the car's mass M (kg), its center lr (m) ahead of the
    rear axle and the wheelbase L (m). Kt is the tires' vertical stiffness, if known, else that of
    tires that deflect by 19.5 mm under the car.
    """
    m = q.unsprung_mass
    return load_moment(
        s.but(
            front_load=s.front_load - m * (GRAVITY + s.front_axle_acceleration),
            rear_load=s.rear_load - m * (GRAVITY + s.rear_axle_acceleration),
            cg_to_rear=s.cg_to_rear + m * (2 * s.cg_to_rear - s.wheelbase) / (s.mass - 2 * m),
        )
    )
