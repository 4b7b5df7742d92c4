"""Response of the driveline to tip-in and back-out: jerk and oscillation of the half-shaft torque."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.physics.models.vehicle import Driven, vehicle
from vdyn_cli.physics.models.vehicle_axle import Differential
from vdyn_cli.physics.models.vibration_modes import cruise
from vdyn_cli.quantities.arrays import Array

INTEGRATION_STEP = 1e-3  # s
BEFORE = 0.2  # s of cruise before the pedal moves
RISE = 0.05  # s, duration of a torque ramp
HOLD = 2.0  # s of constant torque after each movement
RINGING = 0.6  # s after the pedal has moved from which frequency and damping are estimated
SPARSE = 5  # every fifth sample is used for that
SLOWEST = 2.0  # Hz, below which the oscillation is that of the body


@dataclass(frozen=True)
class Swing:
    """A decaying oscillation: damped frequency, Hz, and damping ratio."""

    frequency: float
    damping: float


@dataclass(frozen=True)
class Phase:
    """Response to one movement of the pedal.

    Parameters
    ----------
    jerk_peak : m/s^3, largest magnitude, with its sign.
    swing : oscillation of each half-shaft's torque, by side; None where there is none.
    """

    jerk_peak: float
    swing: Mapping[str, Swing | None]


@dataclass(frozen=True, eq=False)
class TipIn:
    """A tip-in followed by a back-out.

    Parameters
    ----------
    time : (n,) s, 0 where the pedal first moves.
    traces : each (n,), SI: drive_torque and all outputs of the vehicle.
    tip_in, back_out : the two movements.
    """

    time: Array
    traces: Mapping[str, Array]
    tip_in: Phase
    back_out: Phase


def tip_in(
    parameters: Mapping[str, float],
    speed: float,
    torque_step: float,
    driven: Driven = "front",
    differential: Differential = "open",
) -> TipIn:
    """Simulate a tip-in from a steady cruise, and the back-out after it.

    Parameters
    ----------
    parameters : values of all parameters of ``models.vehicle``.
    speed : m/s, of the cruise.
    torque_step : N m at the planetary output, in addition to the torque of the cruise.
    driven, differential : as of ``models.vehicle``; where both axles are driven the half-shafts are the front axle's.

    Raises
    ------
    ResultError : the car cannot cruise at this speed, or the simulation diverges.

    Notes
    -----
    Flat road, no wind. Frequency and damping are estimated from the simulated torque alone (``ringing``), so that for
    small steps they can be compared with the eigenmodes.
    """
    state, model = cruise(parameters, speed, driven, differential), vehicle(driven, differential=differential)
    moves = (BEFORE, BEFORE + RISE + HOLD)
    n = round((moves[1] + RISE + HOLD) / INTEGRATION_STEP) + 1
    time: Array = np.linspace(0.0, (n - 1) * INTEGRATION_STEP, n)
    knots = [moves[0], moves[0] + RISE, moves[1], moves[1] + RISE]
    torque = state.inputs["drive_torque"] + np.interp(time, knots, [0.0, torque_step, torque_step, 0.0])
    context = {"heading": 1.0, "temperature": 293.15}
    run = Drive(time, {**state.inputs, "drive_torque": torque}, state.states, {}, context)
    outputs = Simulator(model, {name: parameters[name] for name in model.parameters})(run).outputs
    phases = [_phase(time, outputs, begin) for begin in moves]
    return TipIn(time - BEFORE, {"drive_torque": torque, **outputs}, *phases)


def _phase(time: Array, outputs: Mapping[str, Array], begin: float) -> Phase:
    """The response from the beginning of a pedal movement to the end of the constant torque, s."""
    moved = begin + RISE
    there = (time > begin - INTEGRATION_STEP / 2) & (time < moved + HOLD + INTEGRATION_STEP / 2)
    rung = (time > moved + INTEGRATION_STEP / 2) & (time < moved + RINGING)
    swing = {
        side: ringing(outputs[f"shaft_torque_{side}"][rung][::SPARSE], SPARSE * INTEGRATION_STEP)
        for side in ("left", "right")
    }
    jerk = outputs["jerk"][there]
    return Phase(float(jerk[np.argmax(np.abs(jerk))]), swing)


def ringing(trace: Array, step: float) -> Swing | None:
    """The strongest decaying oscillation of a trace, by the matrix pencil method: y_k = sum a exp(s k step).

    Parameters
    ----------
    trace : (n,) evenly spaced; step : s.

    Returns
    -------
    The oscillation above 2 Hz with the largest energy |a|^2 / -2 Re s; None where there is none.

    Notes
    -----
    Source: Hua and Sarkar, IEEE Trans. Acoust. Speech Signal Process. 38(5), 1990, doi:10.1109/29.56027.
    """
    n = trace.size
    rows = np.lib.stride_tricks.sliding_window_view(trace, n // 2)
    _, sizes, right = np.linalg.svd(rows, full_matrices=False)
    kept = right[: int(np.sum(sizes > 1e-5 * sizes[0]))].T
    poles = np.linalg.eigvals(np.linalg.lstsq(kept[:-1], kept[1:], rcond=None)[0])
    poles = poles[np.abs(poles) > 1e-3]
    amplitudes = np.linalg.lstsq(poles[None, :] ** np.arange(n)[:, None], trace.astype(complex), rcond=None)[0]
    roots = np.log(poles) / step
    swinging = (roots.imag > 2 * np.pi * SLOWEST) & (roots.imag < 0.8 * np.pi / step) & (roots.real < 0)
    if not swinging.any():
        return None
    energy = np.where(swinging, np.abs(amplitudes) ** 2 / np.maximum(-2 * roots.real, 1e-9), 0.0)
    s = roots[np.argmax(energy)]
    return Swing(float(s.imag / (2 * np.pi)), float(-s.real / np.abs(s)))
