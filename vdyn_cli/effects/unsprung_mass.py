from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="load_moment",
    unknowns=Quantity("unsprung_mass", "kg", "unsprung mass of each axle", "m", -30, 200),
    reference="70 to 100 kg per axle of a passenger car; tires deflect by 17 to 25 mm under its weight",
    label="unsprung mass that the description leaves out",
    signature="The residual is proportional to the second derivative of the axle loads: largest at fast pedal steps.",
    alike=("clock_offset", "pitch_inertia"),
    confirm="Weigh a wheel with its carrier, and add half of the links and shafts.",
    tags={"pitching"},
)
def unsprung_mass(load_moment: Law, s: Signals, q: Signals) -> Number:
    """Axles that are heavier than stated (or than zero, if not stated), and move vertically on the tires.

    mf + m and mr + m replace the unsprung masses of ``load_moment``. The axles move with z'' = -F''/Kt, where F'' is
    the second derivative of the axle's load and Kt the tires' vertical stiffness, if known, else that of tires that
    deflect by 17 mm under the car, with a standard deviation of 40 %.
    """
    m = q.unsprung_mass
    return load_moment(s.but(unsprung_front=s.unsprung_front + m, unsprung_rear=s.unsprung_rear + m))
