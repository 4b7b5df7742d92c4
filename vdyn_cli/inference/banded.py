"""Noise that is correlated between neighbors only: Cholesky factor of its banded covariance C = L L', and solving."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array


def factored(band: Array) -> Array:
    """The Cholesky factor L of a banded covariance, in lower band form like the covariance.

    Parameters
    ----------
    band : (b, n), row k holds the k-th diagonal below the main one.

    Returns
    -------
    (b, n).

    Raises
    ------
    ArithmeticError : the covariance is not finite or not positive definite.
    """
    from scipy.linalg import cholesky_banded

    try:
        return np.asarray(cholesky_banded(band, lower=True))
    except ValueError as error:  # not finite, or not positive definite
        raise ArithmeticError("the covariance of the noise is not finite or not positive definite") from error


def whitened(factor: Array, values: Array) -> Array:
    """L^-1 v, the values in units of their noise; (n,) or (n, k).

    Parameters
    ----------
    factor : banded Cholesky factor L of the noise covariance C = L L', lower form. values : (n,) or (n, k).

    Raises
    ------
    ValueError : the lengths of factor and values differ. ArithmeticError : C is singular.
    """
    return _solved(factor, values, "N")


def weighed(factor: Array, values: Array) -> Array:
    """L'^-1 v; of whitened values L^-1 y it gives the weighted C^-1 y.

    Parameters
    ----------
    factor : (b, n) banded Cholesky factor L, lower form. values : (n,) or (n, k).

    Raises
    ------
    ValueError : the lengths of factor and values differ. ArithmeticError : C is singular.
    """
    return _solved(factor, values, "T")


def _solved(factor: Array, values: Array, turned: str) -> Array:
    from scipy.linalg.lapack import dtbtrs

    if len(values) != factor.shape[1]:
        raise ValueError(f"{len(values)} values for a factor of {factor.shape[1]}")
    solved, singular = dtbtrs(factor, values, uplo="L", trans=turned)
    if singular:
        raise ArithmeticError("the covariance of the noise is singular")
    return np.asarray(solved)
