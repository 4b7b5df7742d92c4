"""Axes of matplotlib without its ticks. The only module that imports matplotlib when it is loaded."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.axis import Tick, XAxis, YAxis


class _TicklessX(XAxis):
    majorTicks: list[Tick] = []  # noqa: N815, RUF012  (the names of matplotlib)
    minorTicks: list[Tick] = []  # noqa: N815, RUF012


class _TicklessY(YAxis):
    majorTicks: list[Tick] = []  # noqa: N815, RUF012
    minorTicks: list[Tick] = []  # noqa: N815, RUF012


class TicklessAxes(Axes):
    """Axes whose scales are drawn apart.

    Matplotlib creates its first ticks with the axes, also where it draws none: a quarter of the time of a page.
    """

    def _init_axis(self) -> None:  # the method that projections with other axes override
        self.xaxis, self.yaxis = _TicklessX(self, clear=False), _TicklessY(self, clear=False)
        for side, axis in (("bottom", self.xaxis), ("top", self.xaxis), ("left", self.yaxis), ("right", self.yaxis)):
            self.spines[side].register_axis(axis)
