"""Inputs that were logged late: the simulation reads them ahead by a lead, which may be an unknown.

An input's lead law ``<input>_lead`` (0 without effects) gives the seconds by which the truth is ahead of the reading.
The reading at t + lead enters the model as value + slope (lead - now): the simulator shifts the log itself and sets
``now`` to the lead in force, so that the bracket is zero and only passes on the derivative.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np

from vdyn_cli.engine.drive import Drive
from vdyn_cli.engine.model_builder import ModelBuilder, Number


@dataclass(frozen=True, eq=False)
class Leads:
    """The inputs that are read ahead.

    Parameters
    ----------
    law : of each, the lead in seconds, from constants alone.
    slope, now : of each, the symbols of the input's time derivative and of the lead in force.
    """

    law: Mapping[str, Number]
    slope: Mapping[str, Number]
    now: Mapping[str, Number]

    def seen(self, inputs: Mapping[str, Number]) -> dict[str, Number]:
        """The inputs with their leads, as the model reads them."""
        return {
            name: value + self.slope[name] * (self.law[name] - self.now[name]) if name in self.law else value
            for name, value in inputs.items()
        }


def slope_of(name: str) -> str:
    """Name of the further input that holds an input's time derivative."""
    return f"{name}_slope"


def now_of(name: str) -> str:
    """Name of the constant that holds the lead in force."""
    return f"{name}_lead_now"


def leads_of(builder: ModelBuilder, inputs: tuple[str, ...]) -> Leads:
    """The leads of all inputs; inputs that no effect corrects have none."""
    law = {name: builder(f"{name}_lead", value=0.0) for name in inputs}
    law = {name: lead for name, lead in law.items() if not ca.SX(lead).is_zero()}
    slope = {name: ca.SX.sym(slope_of(name)) for name in law}
    return Leads(law, slope, {name: ca.SX.sym(now_of(name)) for name in law})


def read_ahead(drive: Drive, leads: Mapping[str, float]) -> Drive:
    """The drive with inputs shifted by their leads (s), with their slopes; beyond the log they stay as they are.

    Between samples they follow cubics: straight lines would take away 7 % of what swings at 12 Hz at half a sample of
    10 ms, which is then missed in the half-shafts. (Akima's slopes, modified, do not swing beside steps.)
    """
    from scipy.interpolate import Akima1DInterpolator

    inputs, between = dict(drive.inputs), dict(drive.between)
    for name, lead in leads.items():
        at = drive.time + lead
        inside = np.clip(at, drive.time[0], drive.time[-1])
        curve = Akima1DInterpolator(*drive.line(name), method="makima")
        inputs[name] = curve(inside)
        inputs[slope_of(name)] = np.where(inside == at, curve(inside, 1), 0.0)
        if name in between:
            times, values = between[name]
            early = times - lead
            there = (early > drive.time[0]) & (early < drive.time[-1]) & ~np.isin(early, drive.time)
            between[name] = early[there], values[there]
    now = {now_of(name): lead for name, lead in leads.items()}
    return Drive(drive.time, inputs, drive.start, {**drive.parameters, **now}, drive.context, between)
