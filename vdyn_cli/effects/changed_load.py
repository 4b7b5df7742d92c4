from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="parameters",
    unknowns=Quantity("changed_load", "", "relative change of the mass between two drives", "", -0.4, 1.0),
    reference="passengers and freight: 5 to 30 % of a car, half of a van or a cargo bike; trailers up to its own mass",
    label="a load that was taken on or off between two drives",
    signature="From one drive on, the car accelerates and rolls as if it were heavier or lighter, both ways.",
    alike=("mass_error", "payload", "torque_gain", "wheel_radius"),
    confirm="Ask what was loaded or unloaded before that drive, weigh the car in both states, calibrate the torque.",
    tags={"test_only", "driving"},
)
def changed_load(parameters: Law, s: Signals, q: Signals) -> Number:
    """A car that is heavier or lighter from one drive on.

    M (1 + q), kg, wherever mass enters in the drives with the change: inertia, weight on the tires, slope. The step
    finds the drives from the data.
    """
    return parameters(s.but(mass=s.mass * (1.0 + s.changed * q.changed_load)))
