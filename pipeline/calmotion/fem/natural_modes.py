"""Natural frequencies and modes of the full model."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..shot.character import Array
from .assembly import FEModel
from .tetrahedra import Indices


def vector_mass(mass: Any) -> Any:
    """m (x) E, sparse CSR, shape [3n, 3n], from the scalar mass matrix m, shape [n, n]."""
    from scipy.sparse import identity, kron

    return kron(mass, identity(3), format="csr")


class SparseSolver:
    """A factorised symmetric positive definite matrix: `solve(b)` for b of shape [n] or [n, k]."""

    def __init__(self, matrix: Any):
        from scipy.sparse.linalg import splu

        # symmetric mode keeps the fill of a symmetric ordering: no row exchanges are needed here
        self._lu = splu(
            matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )

    def solve(self, b: Array) -> Array:
        """x with matrix @ x = b."""
        return self._lu.solve(np.ascontiguousarray(b))


def lowest_modes(
    K: Any, M: Any, count: int, *, shift: float = 0.0, solver: SparseSolver | None = None
) -> tuple[Array, Array]:
    """Lowest eigenpairs of K x = omega^2 M x.

    Args:
        K, M: Sparse symmetric, shape [n, n]; K + shift M positive definite.
        count: How many, at most n.
        shift: [1/s^2], positive where K alone is singular.
        solver: Of K + shift M, when it is there already.

    Returns:
        omega^2 [1/s^2], ascending, shape [count], and M-orthonormal modes, shape [n, count].
    """
    from scipy.linalg import eigh
    from scipy.sparse.linalg import LinearOperator, eigsh

    n = K.shape[0]
    count = min(count, n)
    if count == 0:
        return np.zeros(0), np.zeros((n, 0))
    if n <= 60 or count >= n - 1:
        values, vectors = eigh(K.toarray(), M.toarray(), subset_by_index=(0, count - 1))
        return values, vectors
    solver = solver or SparseSolver(K + shift * M if shift else K)
    inverse = LinearOperator((n, n), matvec=solver.solve, matmat=solver.solve, dtype=float)
    start = np.random.default_rng(20190712).standard_normal(n)  # fixed, so that a run repeats to the last bit
    values, vectors = eigsh(K, k=count, M=M, sigma=-shift, OPinv=inverse, v0=start, which="LM", tol=0.0)
    order = np.argsort(values)
    return values[order], vectors[:, order]


def frequencies(model: FEModel, count: int, clamped: Indices | None = None) -> Array:
    """Lowest natural frequencies of the full model [Hz], shape [count].

    Args:
        model: Its matrices.
        count: How many; for a free body the six rigid ones (zero) come first.
        clamped: Nodes that are held, or None for a free body.
    """
    n = len(model.mesh.nodes)
    free = np.ones(n, dtype=bool)
    shift = 0.0
    M = vector_mass(model.mass)
    if clamped is None or len(clamped) == 0:
        # far below the first elastic frequency, far above rounding of the rigid ones
        shift = 1e-4 * float(model.stiffness.diagonal().sum() / M.diagonal().sum())
    else:
        free[clamped] = False
    dofs = np.flatnonzero(np.repeat(free, 3))
    K, M = model.stiffness[dofs][:, dofs], M[dofs][:, dofs]
    values, _ = lowest_modes(K, M, count, shift=shift)
    return np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi)
