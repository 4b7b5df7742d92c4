"""The whitened rows of the moment balance, with noise and estimated true channels held constant."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from vdyn_cli.engine.simulate import Drive, Simulated, Simulator
from vdyn_cli.inference import Regression, Rows
from vdyn_cli.inference.banded import whitened
from vdyn_cli.inference.restrict import restricted
from vdyn_cli.physics.models.load_transfer import CARRIED, SPEED_RATE
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.added_effects import AddedEffects

if TYPE_CHECKING:
    from vdyn_cli.steps.cg.load_fit import LoadFit


@dataclass(frozen=True)
class BalanceInputs:
    """One run's channels as inputs of the balance: without pitch acceleration, and with 1 rad/s^2."""

    still: Drive
    turning: Drive
    pitch_rate: Array


@dataclass(frozen=True)
class WhitenedRun:
    """Quantities of one run that are held constant while its unknowns change.

    Parameters
    ----------
    true : the most probable true channels at the reference values of the unknowns, smoothed.
    factor : (b, k) banded Cholesky factor of the covariance of the integrated balances.
    residual : (k,) whitened balances of the measured channels.
    at : (u,), the reference values of the run's local unknowns.
    expected, slopes : (k,) balances of the true channels there, and their derivatives (k, j).
    """

    true: BalanceInputs
    factor: Array
    residual: Array
    at: Array
    expected: Array
    slopes: Array


@dataclass(frozen=True, eq=False)
class BalanceRows:
    """The rows of all runs.

    Parameters
    ----------
    fit : with the effects in the balance.
    at : all unknowns (s + g m) of the fit at which noise and true channels were computed.
    runs : constant quantities of each run. heave : autocovariance of the heave in their noise, N^2.
    """

    fit: LoadFit
    at: Array
    runs: tuple[WhitenedRun, ...]
    heave: Array
    _last: dict[int, tuple[Array, Rows]] = field(default_factory=dict, init=False, repr=False)

    def __call__(self, run: int, theta: Array) -> Rows:
        """One run's rows at its local unknowns (k,), shared first."""
        last = self._last.get(run)
        if last is None or not np.array_equal(last[0], theta):  # the intervals need the rows of the last step again
            last = self._last[run] = theta, self._rows(run, theta)
        return last[1]

    def _rows(self, run: int, theta: Array) -> Rows:
        fit, here, windows = self.fit, self.runs[run], self.fit.runs[run]
        known = np.array_equal(theta, here.at)
        balance, slopes = (here.expected, here.slopes) if known else fit.balance(windows, here.true, theta)
        residual = here.residual + whitened(here.factor, balance - here.expected)
        rows = [np.column_stack([residual, whitened(here.factor, slopes[:, : theta.size])])]
        times = [windows.middle]
        speed = fit.speeds[run] if fit.speeds else None
        carried = fit.carried[run] if fit.carried else None
        if speed is not None or carried is not None:
            read = simulated(fit.simulators[2], fit.measured[run].still, theta)
            columns = {n: np.column_stack([v, read.sensitivities[n][:, : theta.size]]) for n, v in read.outputs.items()}
        if speed is not None:
            rows.append(speed.rows(columns[SPEED_RATE]))
            times.append(speed.time[speed.at])
        if carried is not None:
            rows.append(carried.rows(columns[CARRIED]))
            times.append(carried.middle)
        whole = np.vstack(rows)
        return Rows(whole[:, 0], whole[:, 1:], time=np.concatenate(times))

    @property
    def misfit(self) -> float:
        """Mean square of the whitened balances at ``at``: 1 where only noise is left."""
        return float(np.mean(np.concatenate([r.residual for r in self.runs]) ** 2))

    def unknowns_in(self, other: LoadFit) -> Array:
        """``at`` as unknowns (s + g m) of another fit; unknowns that this fit lacks have their start values."""
        before = [u.name for u in self.fit.unknowns if not u.per_run]
        values = dict(zip(before, self.at.tolist(), strict=False))
        shared = [values.get(u.name, u.start) for u in other.unknowns if not u.per_run]
        return np.concatenate([shared, self.at[len(before) :]])


def simulated(simulator: Simulator, drive: Drive, theta: Array) -> Simulated:
    """A simulation at a run's local unknowns ``theta`` (u,), with all zeros of the channels equal to zero."""
    return simulator(drive, np.append(theta, np.zeros(len(simulator.unknowns) - theta.size)))


def narrowed(whole: Regression, names: Sequence[str]) -> Callable[[int, Array], Rows]:
    """Rows of a regression for these shared unknowns, without the effects of the others (``Regression.narrow``).

    Parameters
    ----------
    whole : with ``BalanceRows``, in which the effects of the others are zero. names : of the shared unknowns that stay.
    """
    rows = whole.rows
    assert isinstance(rows, BalanceRows)
    added = rows.fit.added
    unknowns = tuple(u for u in added.unknowns if u.name in names)
    effects = tuple(e for e in added.effects if any(u.name in e.unknowns for u in unknowns))
    rows = replace(rows, fit=replace(rows.fit, added=AddedEffects(effects, unknowns)))
    held = {u.name: u.start for u in whole.shared if u.name not in (*names, *added.names)}
    return restricted(replace(whole, unknowns=rows.fit.unknowns, rows=rows, narrow=None), held).rows
