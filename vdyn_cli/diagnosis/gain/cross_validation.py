"""A linearized system with one run, or one block, left out at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.diagnosis.strategies.linearized_system import LinearizedSystem
from vdyn_cli.inference.qr_factors import qr_factor
from vdyn_cli.quantities.arrays import Array

Fold = tuple[int, NDArray[np.bool_]]  # the run that is left out (-1: a block), and its rows


@dataclass(frozen=True, eq=False)
class CrossValidation:
    """The folds of a system: every run is left out in turn, or every block if runs are few.

    Parameters
    ----------
    fewest : number of runs from which whole runs are left out.
    """

    system: LinearizedSystem
    fewest: int

    @cached_property
    def folds(self) -> Sequence[Fold]:
        """The run (-1: a block) and the rows (a mask) that each fold leaves out."""
        system = self.system
        runs = np.unique(system.run[system.run >= 0])
        of_row = system.run[system.label]
        if runs.size >= self.fewest:
            return [(int(k), of_row == k) for k in runs]
        return [(-1, system.label == u) for u in np.flatnonzero(system.run >= 0)]

    @property
    def leaves_blocks(self) -> bool:
        """Whether blocks, not whole runs, are left out."""
        return self.folds[0][0] < 0

    def training(self, fold: int) -> LinearizedSystem:
        """The system without the rows of a fold; if runs are the units, compressed to one QR factor."""
        if self.system.kind == "run" and not self.system.own:
            factor = self._factors[fold]
            label, one = np.zeros(len(factor), dtype=np.int64), np.ones(1, dtype=np.int64)
            return LinearizedSystem(self.system.names, factor[:, :-1], factor[:, -1], label, 0 * one, one, "run")
        return self.training_by_unit(fold)

    def training_by_unit(self, fold: int) -> LinearizedSystem:
        """The system without the rows of a fold, with its units."""
        system, kept = self.system, ~self.folds[fold][1]
        units, label = np.unique(system.label[kept], return_inverse=True)
        return LinearizedSystem(
            system.names,
            system.columns[kept],
            system.y[kept],
            label.astype(np.int64),
            system.run[units],
            system.counts[units],
            system.kind,
        )

    @cached_property
    def _factors(self) -> Sequence[Array]:
        """QR factor of all rows outside each fold, in linear time from the factors of the folds before and after it."""
        whole = np.column_stack([self.system.columns, self.system.y])
        parts = [qr_factor(whole[rows]) for _, rows in self.folds]
        after = [np.zeros((0, whole.shape[1]))]
        for part in reversed(parts[1:]):
            after.append(qr_factor(np.vstack([part, after[-1]])))
        always = ~np.any([rows for _, rows in self.folds], axis=0)
        before, found = whole[always], []
        for part, rest in zip(parts, reversed(after), strict=True):
            found.append(qr_factor(np.vstack([before, rest])))
            before = qr_factor(np.vstack([before, part]))
        return found
