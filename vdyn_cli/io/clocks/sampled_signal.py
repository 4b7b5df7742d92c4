"""A channel as samples: averages and smoothing without phase shift, and gaps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import Array, Mask, cumulative_integral

FINE = 8  # cells per narrowest smoothing width
_GAP = 2.6  # median steps; a longer step is a gap, in which no value is interpolated


@dataclass(frozen=True)
class Signal:
    """A channel's recorded samples: ``time`` (n,), s, and ``values`` (n,)."""

    time: Array
    values: Array

    @property
    def step(self) -> float:
        """Median time between samples, s."""
        return float(np.median(np.diff(self.time)))

    def averages(self, grid: Array, width: float) -> Array:
        """Means of the linearly interpolated channel over cells of ``width``, s, centered on ``grid``.

        NaN where a cell reaches into a gap or beyond an end.
        """
        area = cumulative_integral(self.time, self.values)
        mean = (self._area(area, grid + width / 2.0) - self._area(area, grid - width / 2.0)) / width
        mean[self.gap_within(grid, width / 2.0)] = np.nan
        return mean

    def _area(self, area: Array, t: Array) -> Array:
        i = np.clip(np.searchsorted(self.time, t, "right") - 1, 0, self.time.size - 2)
        into = t - self.time[i]
        slope = (self.values[i + 1] - self.values[i]) / (self.time[i + 1] - self.time[i])
        return np.asarray(area[i] + into * (self.values[i] + slope * into / 2.0))

    def gaps_at(self, at: Array) -> Mask:
        """Whether each of some sorted times lies inside a gap or beyond an end."""
        wide = np.flatnonzero(np.diff(self.time) > _GAP * self.step)
        inside = np.zeros(at.size + 1, dtype=np.int64)
        np.add.at(inside, np.searchsorted(at, self.time[wide], "right"), 1)
        np.add.at(inside, np.searchsorted(at, self.time[wide + 1], "left"), -1)
        first, last = np.searchsorted(at, self.time[0], "left"), np.searchsorted(at, self.time[-1], "right")
        flags = np.cumsum(inside[:-1]) > 0
        flags[:first] = flags[last:] = True
        return np.asarray(flags)

    def gap_within(self, grid: Array, reach: float) -> Mask:
        """Whether each grid point is closer than ``reach``, s, to a gap or an end."""
        wide = np.concatenate([[0], np.cumsum(np.diff(self.time) > _GAP * self.step)])
        last = self.time.size - 1
        left = np.searchsorted(self.time, grid - reach, "right") - 1
        right = np.searchsorted(self.time, grid + reach, "left")
        outside = (left < 0) | (right > last)
        return np.asarray(outside | (wide[np.clip(right, 0, last)] > wide[np.clip(left, 0, last)]))


def smoothed(cells: Array, widths: float) -> Array:
    """Cell values (n,) smoothed with a Hann window of sum one; NaN where it reaches over an end or a gap.

    Parameters
    ----------
    cells : means over consecutive cells of equal width, NaN in a gap. widths : half of the window's length, in
        narrowest widths of `FINE` cells.
    """
    half = round(widths * FINE)
    kernel = np.hanning(2 * half + 3)[1:-1]
    if kernel.size > cells.size:
        return np.full(cells.size, np.nan)
    missing = np.isnan(cells)
    center = float(np.mean(cells[~missing])) if not missing.all() else 0.0
    smooth = center + _convolved(np.where(missing, 0.0, cells - center), kernel / kernel.sum())
    reached = _convolved(missing.astype(float), np.ones(kernel.size)) > 0.5
    reached[:half] = reached[-half:] = True
    smooth[reached] = np.nan
    return smooth


def _convolved(values: Array, kernel: Array) -> Array:
    """The middle part of the convolution, as long as the values, by FFT; the kernel's length is odd."""
    size = 1 << int(values.size + kernel.size - 1).bit_length()
    whole = np.fft.irfft(np.fft.rfft(values, size) * np.fft.rfft(kernel, size), size)
    return np.asarray(whole[kernel.size // 2 :][: values.size])
