"""Input and output of a simulation: a drive on any time grid; outputs and sensitivities at each sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

Points = tuple[NDArray[np.float64], NDArray[np.float64]]  # times, values


@dataclass(frozen=True, eq=False)
class Drive:
    """One run to simulate.

    Parameters
    ----------
    time : (n,) s, increasing; any grid.
    inputs : each (n,), or one number for the whole run; linear between samples.
    start : initial states; those neither given nor among the unknowns start as the model declares.
    parameters : values that differ from the simulator's in this run only, such as air_density; not for unknowns.
    context : the model's context in this run, such as heading.
    between : further points of an input, (times, values), each (c,), strictly between samples: the input is linear
        from point to point, so that a corner need not lie at a sample. It is evaluated at the ends of each step.

    Raises
    ------
    ValueError : the time does not increase, a length differs, or an input is not finite.
    """

    time: NDArray[np.float64]
    inputs: Mapping[str, ArrayLike]
    start: Mapping[str, float] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    context: Mapping[str, float] = field(default_factory=dict)
    between: Mapping[str, Points] = field(default_factory=dict)

    def __post_init__(self) -> None:
        time = np.array(self.time, dtype=np.float64)
        if time.ndim != 1 or not time.size or not np.all(np.isfinite(time)) or not np.all(np.diff(time) > 0):
            raise ValueError("the time of a drive must be one increasing row of finite numbers")
        inputs = {}
        for name, value in self.inputs.items():
            signal = np.array(value, dtype=np.float64)
            if signal.shape not in ((), time.shape):
                raise ValueError(f"input {name!r} has shape {signal.shape}, the time {time.shape}")
            if not np.all(np.isfinite(signal)):
                raise ValueError(f"input {name!r} has values that are not finite")
            inputs[name] = signal
        for name, (at, values) in self.between.items():
            inside = np.all((at > time[0]) & (at < time[-1])) and not np.isin(at, time).any()
            if at.shape != values.shape or not inside or not np.all(np.diff(at) > 0):
                raise ValueError(f"input {name!r}: its points must lie between the samples, in increasing order")
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "inputs", inputs)

    def line(self, name: str) -> Points:
        """Times and values of an input's samples and of the points between them, (n + c,) each."""
        values = np.broadcast_to(self.inputs[name], self.time.shape)
        at, further = self.between.get(name, (np.zeros(0), np.zeros(0)))
        where = np.searchsorted(self.time, at)
        return np.insert(self.time, where, at), np.insert(values, where, further)


@dataclass(frozen=True, eq=False)
class Simulated:
    """Outputs of a simulation at every sample of the drive.

    Parameters
    ----------
    time : (n,) s.
    outputs : each (n,).
    sensitivities : each (n, k), derivatives of the outputs to the unknowns, in their order; k = 0 unless requested.
    states : each (n,); empty unless requested.
    """

    time: NDArray[np.float64]
    outputs: Mapping[str, NDArray[np.float64]]
    sensitivities: Mapping[str, NDArray[np.float64]]
    states: Mapping[str, NDArray[np.float64]]
