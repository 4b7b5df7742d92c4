from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="turning_engine",
    unknowns=Quantity("engine_inertia", "kg m^2", "moment of inertia of engine, flywheel and clutch", "J", 0.0, 0.6),
    reference="engine, flywheel and clutch of passenger cars 0.1 to 0.5 kg m^2 (Gillespie, Fundamentals of Vehicle "
    "Dynamics, 1992, chapter 2), of trucks to 3",
    label="the inertia of the engine through its gears",
    signature="The car accelerates less than the torque requires, most in the lowest gear; at steady speed both agree.",
    alike=("rotating_mass", "torque_gain", "mass_error", "driveline_loss"),
    confirm="Accelerate with the same torque in two gears: the inertia acts by the square of the ratio.",
    tags={"driving", "of_a_car"},
)
def engine_inertia(engine: Law, s: Signals, q: Signals) -> Number:
    """An engine that takes part of the torque to accelerate itself, by the square of the ratio of its gear.

    (M + mr + J n^2) V' = F, with n = om/V = i/r, rad/m, of the logged engine speed om; n = 0 while the clutch is open
    or the converter slips.

    Applies where the torque is that of the combustion: an engine torque of the CAN bus, also times the ratio. A torque
    measured behind the clutch or at the half-shafts does not contain what accelerates the engine; J is then zero. With
    one fixed ratio it is a part of the rotating mass, and no candidate. A stated rotating mass that contains the engine
    in one gear is reduced by it within its uncertainty. Requires the channel motor_speed, and the model of a mass on a
    road.
    """
    return engine(s.but(engine_inertia=s.engine_inertia + q.engine_inertia))
