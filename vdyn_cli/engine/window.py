"""The part of a long simulation that sensors with shifted clocks still need, when it is simulated in chunks."""

from __future__ import annotations

import numpy as np

from vdyn_cli.engine.drive import Simulated
from vdyn_cli.engine.integrator import GridReadings
from vdyn_cli.quantities.arrays import Array


class Window:
    """Samples kept while a shifted clock can reach them; a sample is complete once all samples within reach exist.

    Interpolation at a shifted time needs the two samples around it and, for their slopes, one more on either side.

    Parameters
    ----------
    reach : s, the largest shift.
    shifted : number of clock shifts; they are the last readings.
    """

    def __init__(self, reach: float, shifted: int) -> None:
        self._reach, self._shifted = reach, shifted
        nothing = np.empty((0, 0))
        self.time, self.seen = np.empty(0), GridReadings(nothing, np.empty((0, 0, 0)), nothing, np.empty(0))
        self.ready = slice(0, 0)

    def add(self, time: Array, seen: GridReadings, last: bool) -> None:
        """Append the samples simulated next, and drop those out of every clock's reach.

        Raises
        ------
        ValueError : a clock is shifted by more than the reach.
        """
        done = self.ready.stop
        if self.time.size:
            oldest = np.searchsorted(self.time, self._at(done, time) - self._reach, side="right") - 2
            keep = max(int(oldest), 0)
            time = np.concatenate([self.time[keep:], time])
            readings = np.concatenate([self.seen.readings[:, keep:], seen.readings], axis=1)
            tangents = np.concatenate([self.seen.tangents[:, keep:], seen.tangents], axis=1)
            seen = GridReadings(readings, tangents, seen.trajectory, seen.final)
            done -= keep
        far = float(np.max(np.abs(seen.readings[-self._shifted :, done:])))
        if not far <= self._reach:
            raise ValueError(f"a clock is shifted by {far:.3g} s, beyond the limit of {self._reach:.3g} s")
        self.time, self.seen = time, seen
        end = time.size if last else 0
        if not last and time.size >= 3:
            end = int(np.searchsorted(time, time[-3] - self._reach, side="right"))
        self.ready = slice(done, max(end, done))

    def _at(self, index: int, following: Array) -> float:
        """Time of the first sample that is not complete yet; it may be the first of the following chunk."""
        return float(self.time[index] if index < self.time.size else following[0])

    def complete(self, whole: Simulated) -> Simulated:
        """The complete samples of a result over all kept samples."""
        outputs = {name: value[self.ready] for name, value in whole.outputs.items()}
        sensitivities = {name: value[self.ready] for name, value in whole.sensitivities.items()}
        return Simulated(whole.time[self.ready], outputs, sensitivities, whole.final, {})
