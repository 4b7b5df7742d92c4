from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="parameters",
    unknowns=Quantity("tire_relaxation", "m", "relaxation length minus that of the model", "sigma", -0.3, 1.0),
    reference="Pacejka, Tire and Vehicle Dynamics, 3rd ed., 2012: 0.1 to 0.5 m lengthwise; more if worn, hot or soft",
    label="a tire relaxation length that differs from the given one",
    signature="After a torque step the tire force lags; the lag is inversely proportional to speed.",
    alike=("shaft_stiffness", "speed_delay", "torque_delay", "clock_offset"),
    confirm="Step the torque at a third of the speed: a fixed delay stays the same, a relaxation length makes "
    "the delay three times as long.",
    tags={"driving", "slip_sweep"},
)
def tire_relaxation(parameters: Law, s: Signals, q: Signals) -> Number:
    """A tire that must roll farther, or less far, than in the model until its slip has built up.

    (sigma + q) s' = (r om - V) - |V| s, sigma the stated relaxation length, m, s the slip, r om the rim's speed and V
    the hub's, m/s. Where the slip is measured, it is relaxed likewise.
    """
    return parameters(s.but(tire_relaxation_length=s.tire_relaxation_length + q.tire_relaxation))
