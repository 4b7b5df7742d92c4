"""An engine that turns with the wheels through one of several gears."""

from __future__ import annotations

from vdyn_cli.engine.model_builder import Number, Signals


def turning_engine(s: Signals) -> Number:
    """Mass at the tire contacts that has the inertia of the engine, kg.

    m = J n^2, from the kinetic energy J om^2 / 2 at om = n V

    Parameters
    ----------
    s : engine_inertia J in kg m^2, engine_turns n in rad/m: the angle by which the engine turns per distance, i/r in a
        gear of the ratio i; zero while the clutch is open.
    """
    return s.engine_inertia * s.engine_turns * s.engine_turns
