from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="wheel_force",
    unknowns=(
        Quantity("load_crosstalk", "", "share of its longitudinal force that a load cell reads", "k", -0.06, 0.06),
        Quantity("load_crosstalk_balance", "", "front less rear share, over their sum", "b", -1.1, 1.1),
        Quantity("drive_share_front", "", "share of the driving force at the front axle", "s", -0.2, 1.2),
    ),
    # A drive share as of the brakes: from there the search finds the sign of k.
    nominal={"load_crosstalk_balance": 0.0, "drive_share_front": 0.67},
    reference="wheel force sensors: crosstalk of the longitudinal force 0.5 to 2 %; a sensor tilted by 1 deg: 1.7 %",
    label="wheel loads that include a share of the longitudinal force",
    signature="The sum of the loads changes in proportion to the acceleration; the weight does not.",
    alike=("wheel_force_gain", "cg_height", "a part of the moment over acceleration"),
    confirm="Push the parked car forward with the wheels braked: the sum of the loads has to stay the same.",
    tags={"sensor", "pitching"},
)
def load_crosstalk(wheel_force: Law, s: Signals, q: Signals) -> Number:
    """Wheel load cells that read a share of the longitudinal force: crosstalk, or a sensor that is tilted.

    F_read = F + k (1 + b) X, N, in front, F + k (1 - b) X at the rear, with X the longitudinal force of the axle: of
    the driving force the share s at the front axle, of the braking force the front share of the brakes. The sum of both
    axles' loads determines k, as far as a gain error of one axle allows, and the difference between driving and braking
    s, or b where the cells of one axle are wrong. An error of the brakes' share is collinear with the height of the
    center of gravity.
    """
    share = s.braking * s.brake_share_front + (1 - s.braking) * q.drive_share_front
    own = share + s.rear * (1 - 2 * share)
    read = q.load_crosstalk * (1 + q.load_crosstalk_balance * (1 - 2 * s.rear))
    return wheel_force(s) - read * own * s.push
