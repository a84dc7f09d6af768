"""Moore-Penrose inverse of a small square matrix that may be singular; compiled.

A complete orthogonal decomposition: A P = Q [T 0; 0 0] Z^T, by Householder reflections with column pivoting from the
left and, where the rank falls short, further ones from the right. Source: Golub and Van Loan, Matrix Computations,
sections 5.4-5.5.
"""

import math
from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.model.system import CountArray
from calmotion.support.by_reference import by_reference
from calmotion.support.compilation import inlined_kernel, kernel, shared_kernel

RANK = 1e-9  # pivots below this fraction of the largest count as zero


@by_reference
class Decomposition(NamedTuple):
    """Scratch of the decomposition of a matrix of n rows.

    Attributes:
        left, right: Reflectors, one a row, shape [n, n].
        order: Column of each pivot, shape [n].
        v, x: Vectors, shape [n].
    """

    left: Array
    right: Array
    order: CountArray
    v: Array
    x: Array


def allocate_decomposition(n: int) -> Decomposition:
    """Scratch for matrices of n rows."""
    return Decomposition(np.zeros((n, n)), np.zeros((n, n)), np.zeros(n, np.int64), np.zeros(n), np.zeros(n))


@kernel
def _reflector(n: int, start: int, x: Array, v: Array) -> float:
    """v with (E - v v^T) x zero beyond `start`, entries from `start`; returns the entry that remains."""
    size = 0.0
    for i in range(start, n):
        size += x[i] * x[i]
    size = math.sqrt(size)
    for i in range(n):
        v[i] = x[i] if i >= start else 0.0
    if size == 0.0:
        for i in range(start, n):
            v[i] = 0.0
        return 0.0
    kept = -size if x[start] >= 0.0 else size
    v[start] -= kept
    norm = 0.0
    for i in range(start, n):
        norm += v[i] * v[i]
    # (E - 2 v v^T / |v|^2)
    scale = math.sqrt(2.0 / norm)
    for i in range(start, n):
        v[i] *= scale
    return kept


@inlined_kernel
def _reflect_from_left(n: int, A: Array, scratch: Decomposition) -> int:
    """A P = Q [R11 R12; 0 0] in place, Q by reflectors, with column pivoting; returns the rank."""
    left, order, v, x = scratch.left, scratch.order, scratch.v, scratch.x
    for k in range(n):
        order[k] = k
    first = 0.0
    for k in range(n):
        best, size = k, -1.0
        for c in range(k, n):
            t = 0.0
            for i in range(k, n):
                t += A[i, c] * A[i, c]
            if t > size:
                best, size = c, t
        if k == 0:
            first = size
        if size <= RANK * RANK * first or not (size > 0.0):
            return k
        if best != k:
            for i in range(n):
                t = A[i, k]
                A[i, k] = A[i, best]
                A[i, best] = t
            swapped = order[k]
            order[k] = order[best]
            order[best] = swapped
        for i in range(n):
            x[i] = A[i, k]
        kept = _reflector(n, k, x, v)
        for i in range(n):
            left[k, i] = v[i]
        for c in range(k, n):
            t = 0.0
            for i in range(k, n):
                t += v[i] * A[i, c]
            for i in range(k, n):
                A[i, c] -= v[i] * t
        A[k, k] = kept
        for i in range(k + 1, n):
            A[i, k] = 0.0
    return n


@inlined_kernel
def _reflect_from_right(n: int, rank: int, A: Array, scratch: Decomposition) -> None:
    """[R11 R12] = [T 0] Z^T in place, Z by reflectors; rows rank - 1 .. 0."""
    right, v = scratch.right, scratch.v
    for k in range(rank - 1, -1, -1):
        # reflect in the entries k and rank .. n - 1
        size = A[k, k] * A[k, k]
        for c in range(rank, n):
            size += A[k, c] * A[k, c]
        size = math.sqrt(size)
        kept = -size if A[k, k] >= 0.0 else size
        for c in range(n):
            v[c] = A[k, c] if c >= rank else 0.0
        v[k] = A[k, k] - kept
        norm = 0.0
        for c in range(n):
            norm += v[c] * v[c]
        scale = math.sqrt(2.0 / norm) if norm > 0.0 else 0.0
        for c in range(n):
            v[c] *= scale
            right[k, c] = v[c]
        for i in range(k + 1):
            t = A[i, k] * v[k]
            for c in range(rank, n):
                t += A[i, c] * v[c]
            A[i, k] -= t * v[k]
            for c in range(rank, n):
                A[i, c] -= t * v[c]


@inlined_kernel
def _solve_unit_vector(n: int, rank: int, A: Array, column: int, scratch: Decomposition) -> None:
    """x <- Z [T^-1 0; 0 0] Q^T e of a unit vector e, before the columns are put in order."""
    left, x = scratch.left, scratch.x
    for i in range(n):
        x[i] = 0.0
    x[column] = 1.0
    for k in range(rank):
        t = 0.0
        for i in range(k, n):
            t += left[k, i] * x[i]
        for i in range(k, n):
            x[i] -= left[k, i] * t
    for k in range(rank - 1, -1, -1):
        t = x[k]
        for c in range(k + 1, rank):
            t -= A[k, c] * x[c]
        x[k] = t / A[k, k]
    for k in range(rank, n):
        x[k] = 0.0
    _apply_right(n, rank, scratch.right, x)


@shared_kernel
def pseudo_inverse(n: int, A: Array, out: Array, null: Array, scratch: Decomposition) -> int:
    """The inverse of A[:n, :n] on its range into `out`, and its null space.

    Args:
        A: Overwritten; its first diagonal entries are the pivots then.
        out: Result, shape [n, n].
        null: Orthonormal basis of the null space in its first n - rank columns, shape [n, n].

    Returns:
        The rank.
    """
    order, x = scratch.order, scratch.x
    rank = _reflect_from_left(n, A, scratch)
    if rank < n:
        _reflect_from_right(n, rank, A, scratch)
    for column in range(n):
        _solve_unit_vector(n, rank, A, column, scratch)
        for k in range(n):
            out[order[k], column] = x[k]
    for column in range(n - rank):
        for i in range(n):
            x[i] = 0.0
        x[rank + column] = 1.0
        _apply_right(n, rank, scratch.right, x)
        for k in range(n):
            null[order[k], column] = x[k]
    return rank


@kernel
def _apply_right(n: int, rank: int, right: Array, x: Array) -> None:
    """x <- Z x."""
    if rank == n:
        return
    for k in range(rank):
        t = right[k, k] * x[k]
        for c in range(rank, n):
            t += right[k, c] * x[c]
        x[k] -= right[k, k] * t
        for c in range(rank, n):
            x[c] -= right[k, c] * t
