"""Lowest eigenpairs from rough ones, with an approximate inverse in place of factors (LOBPCG).

Each step takes the best vectors in the span of the present ones, of their residuals times the approximate inverse, and
of the step before. With vectors of a slightly coarser mesh and a multigrid cycle a few steps are enough, at a fraction
of the time and memory of factors.

Source: Knyazev, Toward the Optimal Preconditioned Eigensolver: Locally Optimal Block Preconditioned Conjugate Gradient
Method, SIAM Journal on Scientific Computing 23(2), 2001.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from calmotion.arrays import Array
from calmotion.linear_algebra.blas_threads import one_blas_thread

_STEPS = 40
_DEPENDENT = 1e-6  # relative norm of linearly dependent vectors: the step before is nearly in the span of the others


def improved_modes(
    stiffness: Any, mass: Callable[[Array], Array], inverse: Callable[[Array], Array], start: Array, count: int,
    accuracy: float,
) -> tuple[Array, Array] | None:  # fmt: skip
    """Lowest eigenpairs of K x = value M x.

    Args:
        stiffness: K, symmetric and positive definite; `@` multiplies vectors of the shape of `start`.
        mass: The product with M.
        inverse: Roughly the product with the inverse of K; symmetric and positive definite.
        start: Rough vectors, shape [n, k].
        count: Number of pairs that count, less than k: with more vectors they converge faster.
        accuracy: Relative error of the values.

    Returns:
        Values, ascending, shape [k], and M-orthonormal vectors, shape [n, k], the first `count` of them as accurate as
        asked; None if they do not become so.
    """
    with one_blas_thread():
        return _improved(stiffness, mass, inverse, start, count, accuracy)


def _improved(
    stiffness: Any, mass: Callable[[Array], Array], inverse: Callable[[Array], Array], start: Array, count: int,
    accuracy: float,
) -> tuple[Array, Array] | None:  # fmt: skip
    width = start.shape[1]
    X = start / np.linalg.norm(start, axis=0)
    KX, MX = stiffness @ X, mass(X)
    values, share = _lowest(X.T @ KX, X.T @ MX, width)
    if share.shape[1] < width:
        return None
    X, KX, MX = X @ share, KX @ share, MX @ share
    P = KP = MP = np.zeros((len(X), 0))
    for _ in range(_STEPS):
        R = KX - MX * values
        W = inverse(R)
        # the energy of the error is at most that of the correction by the exact inverse
        errors = np.einsum("ij,ij->j", W, R)[:count] / values[:count]
        if not np.isfinite(errors).all():
            return None
        if (np.abs(errors) <= accuracy).all():
            return values, X
        W -= X @ (MX.T @ W)
        W /= np.maximum(np.linalg.norm(W, axis=0), np.finfo(float).tiny)
        KW, MW = stiffness @ W, mass(W)
        S, KS, MS = np.hstack([X, W, P]), np.hstack([KX, KW, KP]), np.hstack([MX, MW, MP])
        values, share = _lowest(S.T @ KS, S.T @ MS, width)
        X, KX, MX = S @ share, KS @ share, MS @ share
        step = share.copy()
        step[:width] = 0.0
        size = np.linalg.norm(step, axis=0)
        step = step[:, size > 0.0] / size[size > 0.0]
        P, KP, MP = S @ step, KS @ step, MS @ step
    return None


def _lowest(K: Array, M: Array, count: int) -> tuple[Array, Array]:
    """Lowest eigenpairs of small matrices, M positive but for rounding: values and vectors, at most `count`."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(M), np.finfo(float).tiny))
    sizes, basis = np.linalg.eigh(0.5 * (M + M.T) * scale * scale[:, None])
    keep = sizes > _DEPENDENT**2 * sizes[-1]
    basis = scale[:, None] * basis[:, keep] / np.sqrt(sizes[keep])
    values, vectors = np.linalg.eigh(basis.T @ (0.5 * (K + K.T)) @ basis)
    return values[:count], basis @ vectors[:, :count]
