from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="stated_rolling",
    unknowns=Quantity(
        "rolling_error", "", "share by which the true rolling resistance exceeds the stated one", "e", -0.4, 0.6
    ),
    reference="tires of one size differ by a factor of 2 (classes A to E of EU 2020/740: 6.5 to 10.5 kg/t), and "
    "rough asphalt, low pressure or cold adds up to a half",
    label="a wrong rolling resistance",
    signature="The resistance residual is proportional to the weight, at every speed and in both directions.",
    alike=("brake_drag", "driveline_drag", "torque_offset", "speed_dependent_rolling"),
    confirm="Coast down on the same road with the same tires, and use the rolling resistance of that test.",
    tags={"driving"},
    corrects="rolling_resistance",
)
def rolling_error(stated_rolling: Law, s: Signals, q: Signals) -> Number:
    """Tires or a road with another rolling resistance than stated.

    frr (1 + e), or F0 (1 + e) where the resistance is stated as a force, N, at standstill.
    """
    return stated_rolling(s.but(value=s.value * (1.0 + q.rolling_error)))
