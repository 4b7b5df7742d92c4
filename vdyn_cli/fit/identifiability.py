"""What the data determine, and what they do not, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.fit.triangles import Array

NEGLIGIBLE_PART = 0.02  # of a direction's largest component: a smaller one is not worth a word
SINGULAR = 1e-7  # of the largest singular value with columns of unit length: sensitivities are no better than that


def undetermined(triangle: Array, scale: Array) -> Array:
    """Directions along which the data do not hold the unknowns.

    Parameters
    ----------
    triangle : (s, s), triangle of the whitened Jacobian, per-run unknowns eliminated.
    scale : (s,), the physical range of each unknown; infinite where there is none.

    Returns
    -------
    (s, d), columns span the directions, in units of the unknowns. A direction is not determined where the
    sensitivities are parallel to 1e-7, or where one standard deviation exceeds the whole physical range.
    """
    norms = np.linalg.norm(triangle, axis=0)
    blind = norms == 0
    unit = np.where(blind, 1.0, norms)
    _, values, axes = np.linalg.svd(triangle / unit)
    parallel: Array = axes[values <= SINGULAR * max(values.max(initial=0.0), 1e-300)].T / unit[:, None]
    finite = np.where(np.isfinite(scale), scale, np.inf)
    bounded = np.isfinite(finite)
    if not bounded.any():
        return parallel
    ranged = np.where(bounded, finite, 1.0 / unit)
    _, values, axes = np.linalg.svd(triangle * ranged)
    loose = axes[values < 1.0].T * ranged[:, None]
    keep = [v for v in loose.T if np.max(np.abs(v[bounded] / finite[bounded]), initial=0.0) > 0.3]
    return np.array(keep).T if len(keep) > parallel.shape[1] else parallel


def combinations(names: Sequence[str], directions: Array, scale: Array) -> tuple[list[str], list[Array], list[str]]:
    """The combinations that are determined although their members are not.

    For directions N (s, d), d free members F are chosen and each other member i gives the row
    p_i - N_i N_F^-1 p_F, which no direction changes.

    Returns
    -------
    Words and coefficients (s,) of each combination, and the members that are not determined alone.
    """
    from scipy.linalg import qr

    parts = directions / scale[:, None]
    sizes = np.max(np.abs(parts) / np.max(np.abs(parts), axis=0), axis=1)
    members = [i for i in range(len(names)) if sizes[i] > NEGLIGIBLE_PART]
    order = [members[i] for i in qr(parts[members].T, pivoting=True, mode="r")[1]]
    free = sorted(order[: directions.shape[1]])
    words, rows = [], []
    for i in (i for i in members if i not in free):
        row = np.zeros(len(names))
        row[i] = 1.0
        row[free] = -np.linalg.solve(directions[free].T, directions[i])
        large = np.abs(row) * scale > NEGLIGIBLE_PART * scale[i]
        large[i] = True
        if large.sum() > 1:
            words.append(phrase(names, np.where(large, row, 0.0)))
            rows.append(row)
    return words, rows, [names[i] for i in members]


def phrase(names: Sequence[str], row: Array) -> str:
    """A linear combination in words: ``rolling_resistance + 0.8 x drag_area``."""
    text = ""
    for name, factor in sorted(((n, f) for n, f in zip(names, row, strict=True) if f), key=lambda p: p[1] != 1.0):
        size = float(f"{abs(factor):.2g}")
        term = name if size == 1.0 else f"{size:g} x {name}"
        text += f" {'-' if factor < 0 else '+'} {term}" if text else f"{'-' if factor < 0 else ''}{term}"
    return text
