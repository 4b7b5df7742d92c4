from vdyn_cli.effects import Law, Number, Quantity, Signals, effect

# Gauss and Legendre's nodes and weights for a mean over [-1/2, 1/2], the nodes in pairs about the middle.
NODES = ((0.119309593041598, 0.467913934572691), (0.330604693233132, 0.360761573048139),
         (0.466234757101576, 0.171324492379170))  # fmt: skip


@effect(
    on="road",
    unknowns=Quantity("tire_enveloping", "m", "length of road over which the tire averages", "p", 0, 0.3),
    reference="contact patches of 0.1 to 0.2 m; averaging after Zegelaar, The Dynamic Response of Tyres, Delft 1998",
    # A short patch changes a bump by p^2/24 times its curvature, so the derivative at zero vanishes
    probes=(0.06, 0.12, 0.2),
    label="tires that average the road over their contact patch",
    signature="The peak load on the bump is lower and its edges are smoother than simulated.",
    alike=("bump height", "bump width", "tire_damping"),
    confirm="Cross a long ramp and a short step of the same height: only the short one is smoothed.",
    tags={"bump_crossing"},
)
def tire_enveloping(road: Law, s: Signals, q: Signals) -> Number:
    """A contact patch that bridges shorter irregularities: the tire follows the mean height under the patch.

    u_t(x) = 1/p integral of u(x + y) dy from y = -p/2 to p/2, by six nodes: u_t the height under the tire, u the
    road's, p the length of the patch, m.
    """
    middle = road(s)
    total = middle
    for node, weight in NODES:
        way = node * q.tire_enveloping
        around = road(s.but(position=s.position + way)) + road(s.but(position=s.position - way))
        total = total + weight / 2 * (around - 2 * middle)
    return total
