"""The tire's curve as a static model: longitudinal force from slip and load."""

from __future__ import annotations

from math import atan, pi, tan

from vdyn_cli.engine import maths
from vdyn_cli.engine.maths import sqrt
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import ModelBuilder, Number, Signals
from vdyn_cli.physics.laws.tire_forces import friction, tire

SHAPE = ("tire_B", "tire_C", "tire_D", "tire_E")
SHIFTS = ("tire_Sh", "tire_Sv")  # of slip and friction, 0 unless they are unknown
BRAKING = ("braking_B", "braking_D")  # relative excess of B and D in braking over driving, 0 unless they are unknown
DEPARTURE = tuple(f"tire_shape_{k}" for k in (2, 3, 4, 5, 6))  # 0 unless they are unknown
KEPT_SLOPE = "tire_kept_slope"  # 0 unless it is unknown
RIM_SHARE = "tire_rim_share"  # 0 unless it is unknown
LEAST_TURN = 0.02  # ratio of the rim's to the hub's speed, below which a wheel counts as locked
LEAST_GRIP = 0.1  # share of D, below which the curve keeps its shape
STILL = 1e-2  # m/s, of sliding, below which the tread counts as adhering
TURN = 1e-4  # slip over which the curve changes from braking to driving


def _force(e: ModelBuilder, u: Signals, read: Number, **sliding: Number) -> None:
    """The curve with shifts, and separate B and D in braking; load and |sliding speed| change the peak friction.

    Fx = Fz (D' sin(C atan(B' s - E (B' s - atan(B' s)))) + Sv),  s = slip + Sh,  B' and D' by the sign of s

    ``static_load`` is the load to which D refers. Where the friction changes from D' to D'', B' becomes
    B' (1 + k (D' / D'' - 1)): with k = 0 the slope at zero slip changes as the friction does, with k = 1 it stays
    (similarity method, Pacejka, Tire and Vehicle Dynamics, 3rd ed., 2012, section 4.2), as in the brush model.

    The curve is odd in s (1 + s)^(-q): with q = 0 in the slip, relative to the hub's speed; with q = 1 in s / (1 + s),
    relative to the rim's speed, with which tread enters the contact patch (section 3.2), so that the force in braking
    rises and falls within less slip than in driving.
    """
    p, load = e.p, e("force_z", value=u.load)
    slip = read + p.tire_Sh
    slip = slip * maths.fmax(1 + slip, LEAST_TURN) ** (-p.tire_rim_share)
    braking = (1 - slip / sqrt(slip * slip + TURN**2)) / 2
    peak = p.tire_D * (1 + p.braking_D * braking)
    grip = e(
        friction,
        load=load,
        static_load=p.static_load,
        tire_D=peak,
        tire_load_sensitivity=0.0,
        elapsed=u.elapsed,
        swept=u.swept,
        **sliding,
    )
    stiff = p.tire_B * (1 + p.braking_B * braking)
    stiff = stiff * (1 + p.tire_kept_slope * (peak / maths.fmax(grip, LEAST_GRIP * peak) - 1))
    history = {"elapsed": u.elapsed, "returning": u.returning, "braking": braking}
    history["departure"] = _departure(p, stiff * slip) * (1 - 2 * braking)
    force = e(tire, slip=slip, load=load, tire_B=stiff, tire_C=p.tire_C, tire_D=grip, tire_E=p.tire_E, **history)
    e.sensor("force_x", force + load * p.tire_Sv, 0.0, load=load)


def _departure(p: Signals, x: Number) -> Number:
    """A smooth departure from the magic formula, over |x| = |B s|, as a share of the peak friction.

    sum_k c_k sin^2(k atan x), k = 2 to 6. Its slope at zero is 0, so that B C D remains the slope of the curve; near
    zero it is quadratic in |s|, as the brush model is (Pacejka, Tire and Vehicle Dynamics, 3rd ed., 2012, section 3.2)
    and the magic formula, which is odd and analytic, is not.
    """
    angle, total = maths.atan(x), 0.0
    for k, name in enumerate(DEPARTURE, 2):
        total = total + getattr(p, name) * maths.sin(k * angle) ** 2
    return total


def _driven(e: ModelBuilder, u: Signals, **differing: Number) -> None:
    # To first order about the slip that ``BinnedSweep.lagged`` computes.
    read = (1 + u.slip) * (1 + e.p.radius_error) - 1 - e.p.tire_relaxation_length * u.slip_gradient
    slip = e("slip", value=read, slip_rate=u.slip_rate, speed_growth=u.speed_growth, **differing)
    _force(e, u, slip, **({"sliding": maths.soft_abs(slip * u.speed, STILL)} if differing else {}))


def _at_speeds(e: ModelBuilder, u: Signals) -> None:
    _driven(e, u, speed=u.speed)


def _slipped(e: ModelBuilder, u: Signals) -> None:
    _force(e, u, e("slip", value=(1 + u.slip) * (1 + e.p.radius_error) - 1, slip_rate=u.slip_rate))


_CONSTANTS = (*SHAPE, *SHIFTS, *BRAKING, *DEPARTURE, KEPT_SLOPE, RIM_SHARE, "radius_error", "static_load")

# ``slip_gradient``, 1/m, and ``slip_rate``, 1/s, are the decrease of the slip that acts per lag in distance and in time
# (in a slow sweep its change); ``elapsed`` is the time since the sweep began, s; ``swept`` is the same with the
# durations of the sweeps before it, s; 0 where there is only one sweep;
# ``returning`` is the slip while its magnitude decreases, and zero while it increases;
# ``speed_growth`` is the relative rate of the speed, 1/s.
_INPUTS = ("slip", "load", "elapsed", "swept", "returning", "slip_rate")
_OF_SPEED = ("speed", "slip_gradient", "speed_growth")
_WITH_SPEED = (*_CONSTANTS, "tire_relaxation_length"), (*_INPUTS, *_OF_SPEED)
TIRE_CURVE = Model("tire_curve", _at_speeds, *_WITH_SPEED)

# At one speed, a slip that depends on the speed is a slip with a wrong radius, and a friction that depends on the
# sliding speed is a curve of another form over the slip.
_SPEEDS = "sweeps at different speeds"
ONE_SPEED_CURVE = Model("one_speed_curve", _driven, *_WITH_SPEED, unvaried=(("speed", _SPEEDS), ("sliding", _SPEEDS)))

# Where slip was logged but not the speed, nothing can depend on the sliding speed or on distance.
SLIP_CURVE = Model("slip_curve", _slipped, _CONSTANTS, _INPUTS)


def peak_slip(b: float, c: float, e: float) -> float:
    """Slip s of the maximum of the magic formula (``physics.laws.tire_forces.tire``), by bisection.

    B s - E (B s - atan(B s)) = tan(pi / (2 C)); infinite for C <= 1 and where no slip solves it

    Parameters
    ----------
    b, c, e : factors B, C, E, without unit.
    """
    if c <= 1:
        return float("inf")
    target = tan(pi / (2 * c))
    low, high = 0.0, 1.0

    def inner(x: float) -> float:
        return x - e * (x - atan(x))

    while inner(high) < target:
        high *= 2
        if high > 1e6:
            return float("inf")
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if inner(middle) < target else (low, middle)
    return (low + high) / 2 / b
