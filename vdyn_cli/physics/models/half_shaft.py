"""One half-shaft: its torque from the measured twist of its ends and the rate of twist."""

from __future__ import annotations

from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import ModelBuilder, Number, Signals
from vdyn_cli.physics.laws.torsion_shaft import shaft
from vdyn_cli.physics.laws.twist_friction import NEEDED


def _twisted(e: ModelBuilder, u: Signals, **differing: Number) -> None:
    p = e.p
    torque = e(
        shaft,
        twist=e("twist", value=u.twist) - p.twist_zero,
        twist_rate=e("twist_rate", value=u.twist_rate) - p.rate_zero,
        stiffness=p.shaft_stiffness,
        damping=p.shaft_damping,
        **differing,
    )
    about = {"run_time": u.run_time, "motor_acceleration": u.motor_acceleration}
    e.sensor("shaft_torque", torque + p.torque_zero, **about)


def _rubbing(e: ModelBuilder, u: Signals) -> None:
    _twisted(e, u, turned_twist=u.turned_twist)


# ``turned_twist`` is the sense of dry friction, -1 to 1, from the logged twist.
_PARAMETERS = ("shaft_stiffness", "shaft_damping", "twist_zero", "rate_zero", "torque_zero")
_SIGNALS = _PARAMETERS, ("twist", "twist_rate", "turned_twist", "run_time", "motor_acceleration")
HALF_SHAFT = Model("half shaft", _rubbing, *_SIGNALS)

# A twist whose noise hides its reversals does not show friction.
NOISY_HALF_SHAFT = Model("noisy half shaft", _twisted, *_SIGNALS, unvaried=(("turned_twist", NEEDED),))
