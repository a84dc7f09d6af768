"""Solution of the step's linear system along the tree, leaf to root; compiled, cost linear in the components.

A component with its joint is the block D_b = [[K, Lc], [Hc, 0]]. It touches its parent through
F = [[Nc Jp], [Hp]] (its rows, parent's columns) and through [0, Lp] (parent's rows, its multipliers), so
eliminating it changes the parent's K by -Lp (D_b^-1)_multiplier-rows F. With Z = D_b^-T [0; E] that is
-Lp (Z_x^T Nc Jp + Z_m^T Hp), and the same Z serves every later solve, plain or transposed.

Within a block the elastic coordinates come first, then those of the rigid body, then the multipliers: a component's
frame is fixed to it at its joint, so that the joint's rows are zero at the elastic coordinates, and so are the factors.
"""

from calmotion.arrays import Array, IntArray
from calmotion.multibody.kernels.sliders import has_row
from calmotion.multibody.linear_solver.step_matrix import StepMatrix
from calmotion.multibody.model.system import JOINT_ROWS, Blocks, System
from calmotion.support.compilation import kernel, shared_kernel


@kernel
def place(i: int, r: int) -> int:
    """Where coordinate i of a component with r elastic ones stands in its block."""
    return r + i if i < 6 else i - 6


@shared_kernel
def lu_factor(n: int, A: Array, piv: IntArray) -> bool:
    """In-place LU with partial pivoting of A[:n, :n]; False when a pivot is zero or not finite."""
    for k in range(n):
        p = k
        big = abs(A[k, k])
        for i in range(k + 1, n):
            t = abs(A[i, k])
            if t > big:
                big = t
                p = i
        piv[k] = p
        if not (big > 0.0 and big < 1e300):
            return False
        if p != k:
            for j in range(n):
                t = A[k, j]
                A[k, j] = A[p, j]
                A[p, j] = t
        inv = 1.0 / A[k, k]
        for i in range(k + 1, n):
            if A[i, k] == 0.0:
                continue
            f = A[i, k] * inv
            A[i, k] = f
            for j in range(k + 1, n):
                A[i, j] -= f * A[k, j]
    return True


@kernel
def lu_solve(n: int, A: Array, piv: IntArray, x: Array) -> None:
    """x <- A^-1 x with the factors of `lu_factor`."""
    for k in range(n):
        p = piv[k]
        if p != k:
            t = x[k]
            x[k] = x[p]
            x[p] = t
    for i in range(1, n):
        t = x[i]
        for j in range(i):
            t -= A[i, j] * x[j]
        x[i] = t
    for i in range(n - 1, -1, -1):
        t = x[i]
        for j in range(i + 1, n):
            t -= A[i, j] * x[j]
        x[i] = t / A[i, i]


@kernel
def lu_solve_transposed(n: int, A: Array, piv: IntArray, x: Array) -> None:
    """x <- A^-T x with the factors of `lu_factor`."""
    for i in range(n):
        x[i] /= A[i, i]
        t = x[i]
        for j in range(i + 1, n):
            x[j] -= A[i, j] * t
    for i in range(n - 1, 0, -1):
        t = x[i]
        for j in range(i):
            x[j] -= A[i, j] * t
    for k in range(n - 1, -1, -1):
        p = piv[k]
        if p != k:
            t = x[k]
            x[k] = x[p]
            x[p] = t


@kernel
def _multiplier_rows(n: int, m: int, A: Array, piv: IntArray, Z: Array) -> None:
    """Z <- the last m columns of A^-T, shape [n + m, m]; row by row, which is contiguous in memory."""
    for i in range(n + m):
        for k in range(m):
            Z[i, k] = 0.0
    # U^T Y = E: of the lower triangle only the last m rows are not zero
    for k in range(m):
        Z[n + k, k] = 1.0
    for i in range(n, n + m):
        pivot = 1.0 / A[i, i]
        for k in range(m):
            Z[i, k] *= pivot
        for j in range(i + 1, n + m):
            f = A[i, j]
            for k in range(m):
                Z[j, k] -= f * Z[i, k]
    for i in range(n + m - 1, 0, -1):
        for j in range(i):
            f = A[i, j]
            if f != 0.0:
                for k in range(m):
                    Z[j, k] -= f * Z[i, k]
    for i in range(n + m - 1, -1, -1):
        p = piv[i]
        if p != i:
            for k in range(m):
                t = Z[i, k]
                Z[i, k] = Z[p, k]
                Z[p, k] = t


@shared_kernel
def factor(system: System, blocks: Blocks, matrix: StepMatrix, row: Array) -> int:
    """Eliminate all components; `blocks.K` of parents is overwritten by their Schur complements.

    Args:
        matrix: That of the blocks; `lu`, `pivots` and `Z` are results.
        row: Scratch, shape [N] or longer.

    Returns:
        -1, or the index of the component whose block is singular.
    """
    m = JOINT_ROWS
    lu, piv, Z = matrix.lu, matrix.pivots, matrix.Z
    for b in range(len(system.parent) - 1, -1, -1):
        r = system.elastic[b]
        n = 6 + r
        A = lu[b]
        for i in range(n):
            at = place(i, r)
            for k in range(6):
                A[at, r + k] = blocks.K[b, i, k]
            for k in range(r):
                A[at, k] = blocks.K[b, i, 6 + k]
            for k in range(m):
                A[at, n + k] = blocks.Lc[b, i, k]
                A[n + k, at] = blocks.Hc[b, k, i]
        for i in range(m):
            for k in range(m):
                A[n + i, n + k] = 0.0
        # multipliers of rows that this joint does not have are zero
        for i in range(m):
            if not has_row(system, b, i):
                A[n + i, n + i] = 1.0
        if not lu_factor(n + m, A, piv[b]):
            return b
        p = system.parent[b]
        if p < 0:
            continue
        _multiplier_rows(n, m, A, piv[b], Z[b])
        np_ = 6 + system.elastic[p]
        for k in range(m):
            x0 = 0.0
            x1 = 0.0
            x2 = 0.0
            for i in range(n):
                z = Z[b, place(i, r), k]
                x0 += z * blocks.Nc[b, i, 0]
                x1 += z * blocks.Nc[b, i, 1]
                x2 += z * blocks.Nc[b, i, 2]
            for a in range(np_):
                row[a] = x0 * blocks.Jp[b, 0, a] + x1 * blocks.Jp[b, 1, a] + x2 * blocks.Jp[b, 2, a]
            for i in range(m):
                f = Z[b, n + i, k]
                for a in range(np_):
                    row[a] += f * blocks.Hp[b, i, a]
            for i in range(np_):
                f = blocks.Lp[b, i, k]
                if f != 0.0:
                    for a in range(np_):
                        blocks.K[p, i, a] -= f * row[a]
    return -1


@shared_kernel
def solve(system: System, matrix: StepMatrix, x: Array, lam: Array, block: Array) -> None:
    """(x, lam) <- K^-1 (x, lam): x of shape [B, N], lam of shape [B, 6]; `block` is scratch, shape [N + 6]."""
    m = JOINT_ROWS
    Lp, Hp, Nc, Jp, Z = matrix.Lp, matrix.Hp, matrix.Nc, matrix.Jp, matrix.Z
    count = len(system.parent)
    for b in range(count - 1, -1, -1):
        p = system.parent[b]
        if p < 0:
            continue
        r = system.elastic[b]
        n = 6 + r
        for k in range(m):
            t = 0.0
            for i in range(n):
                t += Z[b, place(i, r), k] * x[b, i]
            for i in range(m):
                t += Z[b, n + i, k] * lam[b, i]
            for i in range(6 + system.elastic[p]):
                x[p, i] -= Lp[b, i, k] * t
    for b in range(count):
        p = system.parent[b]
        r = system.elastic[b]
        n = 6 + r
        for i in range(n):
            block[place(i, r)] = x[b, i]
        for i in range(m):
            block[n + i] = lam[b, i]
        if p >= 0:
            np_ = 6 + system.elastic[p]
            for k in range(3):
                t = 0.0
                for a in range(np_):
                    t += Jp[b, k, a] * x[p, a]
                for i in range(n):
                    block[place(i, r)] -= Nc[b, i, k] * t
            for i in range(m):
                t = 0.0
                for a in range(np_):
                    t += Hp[b, i, a] * x[p, a]
                block[n + i] -= t
        lu_solve(n + m, matrix.lu[b], matrix.pivots[b], block)
        for i in range(n):
            x[b, i] = block[place(i, r)]
        for i in range(m):
            lam[b, i] = block[n + i]


@shared_kernel
def solve_transposed(system: System, matrix: StepMatrix, x: Array, lam: Array, block: Array) -> None:
    """(x, lam) <- K^-T (x, lam), same shapes as `solve`."""
    m = JOINT_ROWS
    Lp, Hp, Nc, Jp, Z = matrix.Lp, matrix.Hp, matrix.Nc, matrix.Jp, matrix.Z
    count = len(system.parent)
    for b in range(count - 1, -1, -1):
        p = system.parent[b]
        r = system.elastic[b]
        n = 6 + r
        for i in range(n):
            block[place(i, r)] = x[b, i]
        for i in range(m):
            block[n + i] = lam[b, i]
        lu_solve_transposed(n + m, matrix.lu[b], matrix.pivots[b], block)
        for i in range(n):
            x[b, i] = block[place(i, r)]
        for i in range(m):
            lam[b, i] = block[n + i]
        if p < 0:
            continue
        np_ = 6 + system.elastic[p]
        for k in range(3):
            t = 0.0
            for i in range(n):
                t += Nc[b, i, k] * x[b, i]
            for a in range(np_):
                x[p, a] -= Jp[b, k, a] * t
        for i in range(m):
            for a in range(np_):
                x[p, a] -= Hp[b, i, a] * lam[b, i]
    for b in range(count):
        p = system.parent[b]
        if p < 0:
            continue
        r = system.elastic[b]
        n = 6 + r
        for k in range(m):
            t = 0.0
            for i in range(6 + system.elastic[p]):
                t += Lp[b, i, k] * x[p, i]
            for i in range(n):
                x[b, i] -= Z[b, place(i, r), k] * t
            for i in range(m):
                lam[b, i] -= Z[b, n + i, k] * t
