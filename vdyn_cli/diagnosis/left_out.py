"""What is left of a linearized system without one run, or one block, at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.diagnosis.linearized_system import LinearizedSystem
from vdyn_cli.inference.qr_factors import qr_factor
from vdyn_cli.quantities.arrays import Array

Fold = tuple[int, NDArray[np.bool_]]  # the run that is left out (-1: a block), and its rows


@dataclass(frozen=True, eq=False)
class LeftOut:
    """A system with what is left out of it in turn: every run, or every block where runs are few.

    Parameters
    ----------
    fewest : number of runs from which runs are left out.
    """

    system: LinearizedSystem
    fewest: int

    @cached_property
    def folds(self) -> Sequence[Fold]:
        """Each run or block that is left out, with its rows."""
        system = self.system
        runs = np.unique(system.run[system.run >= 0])
        of_row = system.run[system.label]
        if runs.size >= self.fewest:
            return [(int(k), of_row == k) for k in runs]
        return [(-1, system.label == u) for u in np.flatnonzero(system.run >= 0)]

    def rest(self, fold: int) -> LinearizedSystem:
        """All rows but those of a fold; where runs are the units, as one QR factor, whose products are the same."""
        if self.system.kind == "run" and not self.system.own:
            factor = self._factors[fold]
            label, one = np.zeros(len(factor), dtype=np.int64), np.ones(1, dtype=np.int64)
            return LinearizedSystem(self.system.names, factor[:, :-1], factor[:, -1], label, 0 * one, one, "run")
        return self.kept(fold)

    def kept(self, fold: int) -> LinearizedSystem:
        """All rows but those of a fold, unit by unit."""
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
        """QR factor of the rows of all other folds, for each: from those before it and those after, in linear time."""
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
