"""Inputs that are logged with a delay or a first-order lag: the simulation reads the true input instead.

An input's lead law ``<input>_lead`` (0 without effects) is the delay in s of the reading behind the true input; its
lag law ``<input>_lag`` is the time constant in s with which the true input follows the reading (negative: the reading
follows the true input). The model reads value + slope (lead - now), and the same for the lag: the simulator shifts the
logged signal itself and sets ``now`` to the current lead, so that the bracket is zero but has the correct derivative.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np

from vdyn_cli.engine.drive import Drive
from vdyn_cli.engine.lag import lagged_rate
from vdyn_cli.engine.model_builder import ModelBuilder, Number

LEAD, LAG = "lead", "lag"


@dataclass(frozen=True, eq=False)
class Leads:
    """The leads and lags of the inputs that have any.

    Parameters
    ----------
    law : the lead or lag in s of each pair (input, LEAD or LAG), a function of constants only.
    slope, now : symbols of the input's derivative to it, and of its current value.
    """

    law: Mapping[tuple[str, str], Number]
    slope: Mapping[tuple[str, str], Number]
    now: Mapping[tuple[str, str], Number]

    def applied(self, inputs: Mapping[str, Number]) -> dict[str, Number]:
        """The inputs as the model reads them, with their leads and lags."""
        read = dict(inputs)
        for key, law in self.law.items():
            read[key[0]] = read[key[0]] + self.slope[key] * (law - self.now[key])
        return read


def slope_of(name: str, kind: str) -> str:
    """Name of the additional input that holds the derivative of input ``name`` to its LEAD or LAG (``kind``)."""
    return f"{name}_{kind}_slope"


def now_of(name: str, kind: str) -> str:
    """Name of the constant that holds the current LEAD or LAG (``kind``) of input ``name``, s."""
    return f"{name}_{kind}_now"


def leads_of(builder: ModelBuilder, inputs: tuple[str, ...]) -> Leads:
    """The leads and lags of the inputs that an effect corrects."""
    law = {(name, kind): builder(f"{name}_{kind}", value=0.0) for name in inputs for kind in (LEAD, LAG)}
    law = {key: value for key, value in law.items() if not ca.SX(value).is_zero()}
    slope = {key: ca.SX.sym(slope_of(*key)) for key in law}
    return Leads(law, slope, {key: ca.SX.sym(now_of(*key)) for key in law})


def read_ahead(drive: Drive, leads: Mapping[tuple[str, str], float]) -> Drive:
    """The drive with its true inputs and their slopes: shifted by the lead, then lagged; constant beyond the log.

    Interpolation is cubic: linear interpolation at half a sample of 10 ms would attenuate an oscillation at 12 Hz (of
    half-shafts) by 7 %. Modified Akima slopes do not overshoot beside steps.

    Parameters
    ----------
    leads : s, of each pair (input, LEAD or LAG).
    """
    from scipy.interpolate import Akima1DInterpolator

    inputs, between = dict(drive.inputs), dict(drive.between)
    for name in dict.fromkeys(name for name, _ in leads):
        lead = leads.get((name, LEAD), 0.0)
        curve = Akima1DInterpolator(*drive.line(name), method="makima")
        early = between[name][0] - lead if name in between else np.zeros(0)
        early = early[(early > drive.time[0]) & (early < drive.time[-1]) & ~np.isin(early, drive.time)]
        where = np.searchsorted(drive.time, early)
        at = np.insert(drive.time, where, early)
        sample = np.isin(at, drive.time)
        inside = np.clip(at + lead, drive.time[0], drive.time[-1])
        moves = inside == at + lead
        value, rate = curve(inside), np.where(moves, curve(inside, 1), 0.0)
        if (name, LAG) in leads:
            lag = leads[name, LAG]
            bend = np.where(moves, curve(inside, 2), 0.0)
            rates, changes = lagged_rate(at, np.column_stack([value, rate]), np.column_stack([rate, bend]), lag)
            inputs[slope_of(name, LAG)] = (-rates[:, 0] - lag * changes[:, 0])[sample]
            value, rate = value - lag * rates[:, 0], rate - lag * rates[:, 1]
        if (name, LEAD) in leads:
            inputs[slope_of(name, LEAD)] = rate[sample]
        inputs[name] = value[sample]
        if name in between:
            # Points that the lead moved onto a sample or out of the log are dropped.
            between[name] = early, value[~sample]
    now = {now_of(*key): lead for key, lead in leads.items()}
    return Drive(drive.time, inputs, drive.start, {**drive.parameters, **now}, drive.context, between)
