"""Noise in which only neighbors share anything: the factor of its banded covariance C = L L', and solving with it."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array


def factored(band: Array) -> Array:
    """L as a lower band, (b, n), of a covariance given as one: row k holds the k-th diagonal below.

    Raises
    ------
    ArithmeticError : no noise has that covariance.
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
    """L'^-1 v; of whitened values it makes C^-1 times what they were.

    Parameters
    ----------
    factor : as in ``whitened``. values : (n,) or (n, k).

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
