from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import sqrt

CORNER = 2e-5  # rad, over which the flanks come into contact
APART = 1e-5  # rad of play above which flanks can separate
SOFT = 0.1  # N m, over which a sign is smoothed


def on_a_flank(rest_twist: Law, s: Signals, q: Signals) -> Number:
    """Initial twist of a shaft: on the flank that its torque loads, or in the middle of the gap without a torque."""
    return rest_twist(s) + q.backlash * s.torque / sqrt(s.torque * s.torque + SOFT**2)


@effect(
    on="shaft",
    also={"rest_twist": on_a_flank},
    unknowns=Quantity("backlash", "rad", "free play of each half-shaft to either side", "b", 0.0, 0.06),
    reference="free play of final drive and joints at the wheel: 0.5 to 3 deg in all",
    probes=(
        *(1e-4, 1.8e-4, 3e-4, 5e-4, 7e-4, 1e-3, 1.4e-3, 2e-3, 2.8e-3, 4e-3),
        *(5.7e-3, 8e-3, 1.1e-2, 1.6e-2, 2.2e-2, 3.1e-2, 4.4e-2, 6e-2),
    ),
    label="free play in the half-shafts",
    signature="When the torque changes sign, the shaft torque is zero for a moment, then rises abruptly.",
    alike=("shaft_stiffness", "shaft_damping", "torque_delay"),
    confirm="Turn the inner end back and forth by hand with the wheel held, or tip in and back out slowly.",
    sense="to either side",
    tags={"driving", "shaft_twist"},
)
def backlash(shaft: Law, s: Signals, q: Signals) -> Number:
    """Free play: no contact within it, twist of the shaft minus the play beyond it; flanks transmit no tension.

    T = k d + c d', N m; d, rad, is the part of the twist phi beyond +-b, with the free play 2 b. T = 0 where damping
    would pull the flanks together. The corners are smoothed over 2e-5 rad. The derivative at zero gives no information
    on relevant play, so start values are tried.
    """
    above, below = s.twist - q.backlash, s.twist + q.backlash
    far_above, far_below = sqrt(above * above + CORNER**2), sqrt(below * below + CORNER**2)
    touching = 1.0 + 0.5 * (above / far_above - below / far_below)
    beyond = s.twist + 0.5 * (far_above - far_below)
    torque = shaft(s.but(twist=beyond, twist_rate=s.twist_rate * touching))
    side = s.twist / sqrt(s.twist * s.twist + APART**2)
    pulled = 0.5 * (torque - side * sqrt(torque * torque + SOFT**2))
    return torque - pulled * q.backlash * q.backlash / (q.backlash * q.backlash + APART**2)
