"""How far apart causes would be after a manoeuvre that nobody has driven yet, from the Cramer-Rao bound.

With the traces of all unknowns in the runs that were driven stacked on those in the manoeuvre's simulated runs, the
trace s q of a cause of size q leaves s' beside what is fitted anyway and the rival. Its length is the number of
standard errors by which the cause would be missed: t^2 = q' (I_cc - I_cb I_bb^-1 I_bc) q, with the information I of
all runs together. The wind, the road and the car are taken to be as they were, but for what the manoeuvre changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import sqrt

import numpy as np

from vdyn_cli.diagnosis.detect import STATED, VISIBLE
from vdyn_cli.diagnosis.sheet import Sheet, linearise, orthonormal
from vdyn_cli.diagnosis.workbench import Workbench
from vdyn_cli.inference.qr_factors import Array, qr_factor
from vdyn_cli.inference.regression import prior_rows
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.manoeuvre import Manoeuvre

SAFE = 6.0  # standard errors apart at which a name is safe
ROUNDING = 1e-6  # of a trace's length


@dataclass(frozen=True)
class Asked:
    """Would a cause of these sizes (by unknown) be seen while the unknowns ``beside`` it are fitted?"""

    sizes: Mapping[str, float]
    beside: tuple[str, ...]


@dataclass(frozen=True)
class Plan:
    """A manoeuvre driven with ``runs`` runs, and how far apart the causes would then be."""

    manoeuvre: Manoeuvre
    runs: int
    t: float


@dataclass
class Designer:
    """The information of a case's runs and, made when first asked for, of its manoeuvres."""

    bench: Workbench
    _made: list[tuple[Manoeuvre, Array]] | None = field(default=None)

    @cached_property
    def names(self) -> list[str]:
        return [u.name for u in self.bench.full.shared]

    @cached_property
    def sheet(self) -> Sheet:
        base = self.bench.fitted(())
        assert base is not None
        return base.sheet

    @cached_property
    def driven(self) -> tuple[Array, Array]:
        """Rows over the shared unknowns: of the runs, their own unknowns eliminated, and of what was known before."""
        sheet, s = self.sheet, len(self.names)
        own = sheet.columns[:, s:]
        known = (sheet.run[sheet.label] < 0) & ~own.any(axis=1)
        seen = np.column_stack([own[~known], sheet.columns[~known, :s]])
        return _eliminated(seen, own.shape[1]), sheet.columns[known, :s]

    @property
    def manoeuvres(self) -> list[tuple[Manoeuvre, Array]]:
        """Each with the rows over the shared unknowns that its runs would give."""
        if self._made is None:
            self._made = []
            base = self.bench.fitted(())
            assert base is not None
            for one in self.bench.case.manoeuvres(self.bench.full, base.values):
                try:
                    self._made.append((one, self._simulated(one, base.values)))
                except (ResultError, ArithmeticError):
                    continue
        return self._made

    def _simulated(self, one: Manoeuvre, values: Mapping[str, float]) -> Array:
        regression = one.regression()
        own = regression.own
        starts = {u.name: regression.run_starts.get(u.name, np.full(len(regression.runs), u.start)) for u in own}
        linear = linearise(regression, values, starts, self.bench.secants(()))
        s, m = len(regression.shared), len(own)
        parts = []
        for rows, at in zip(linear.rows, linear.own, strict=True):
            known = prior_rows(own, at)[:, :m]
            known = np.column_stack([known, np.zeros((len(known), s))])
            parts.append(_eliminated(np.vstack([_turned(rows.jacobian, s), known]), m))
        whole = np.vstack(parts)
        anew = np.array([u.name in one.anew for u in regression.shared])
        left = _eliminated(np.column_stack([whole[:, anew], whole[:, ~anew]]), int(anew.sum()))
        rows_left = np.zeros((len(left), s))
        rows_left[:, ~anew] = left
        return rows_left

    def now(self, asked: Sequence[Asked]) -> float:
        """Standard errors that the driven runs tell, of the least that is asked."""
        return self._t(self.driven[0], asked)

    def more(self, asked: Sequence[Asked], times: float) -> float:
        """Were so many times the runs driven."""
        return self._t(self.driven[0] * sqrt(times), asked)

    def best(self, asked: Sequence[Asked]) -> Plan | None:
        """The manoeuvre that settles it with the fewest runs, the least effort counting next; else what tells most."""
        found = [plan for one, rows in self.manoeuvres if (plan := self._plan(one, rows, asked)) is not None]
        enough = [plan for plan in found if plan.t >= SAFE]
        return min(enough, key=lambda p: p.runs) if enough else max(found, key=lambda p: round(p.t, 1), default=None)

    def _plan(self, one: Manoeuvre, rows: Array, asked: Sequence[Asked]) -> Plan | None:
        plan = None
        for times in range(1, one.most + 1):
            plan = Plan(one, times * one.each, self._t(np.vstack([self.driven[0], sqrt(times) * rows]), asked))
            if plan.t >= SAFE:
                break
        return plan

    def _t(self, seen: Array, asked: Sequence[Asked]) -> float:
        known = self.driven[1]
        rows = np.vstack([seen, known])
        return min((self._stands_out(rows, len(known), one) for one in asked), default=0.0)

    def _stands_out(self, rows: Array, known: int, asked: Asked) -> float:
        """The length that is left of the trace; nothing where the diagnosis would not believe in so small a part."""
        at = {n: i for i, n in enumerate(self.names)}
        trace = rows[:, [at[n] for n in asked.sizes]] @ np.array(list(asked.sizes.values()))
        basis = orthonormal(rows[:, [at[n] for n in asked.beside]])
        left = trace - basis @ (basis.T @ trace)
        whole, remains = float(np.linalg.norm(trace)), float(np.linalg.norm(left))
        if remains <= ROUNDING * whole:
            return 0.0
        stated = float(left[len(left) - known :] @ left[len(left) - known :]) / remains**2
        return remains if remains > VISIBLE * whole or stated > STATED else 0.0


def _turned(jacobian: Array, shared: int) -> Array:
    """Columns [shared | own] as [own | shared]."""
    return np.column_stack([jacobian[:, shared:], jacobian[:, :shared]])


def _eliminated(rows: Array, first: int) -> Array:
    """Rows that tell as much about the other columns once the first ones are fitted."""
    return qr_factor(rows)[first:, first:]
