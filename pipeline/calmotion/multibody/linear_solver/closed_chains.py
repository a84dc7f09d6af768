"""Closed chains: joints beyond those of the tree, as a border of the tree's linear system; compiled.

A joint that closes a chain adds nine unknowns y: its multipliers, and the rotation s of its parent-side marker (through
which the force on the other side depends on the parent). With A the tree's matrix,

    A x + E y = r,    E y = (Lc lambda + Nc s on the component, Lp lambda on the parent)
    F x + G y = g,    F x = (Hc x_c + Hp x_p, -Jp x_p),  G = 1 on s and on rows that the joint does not have

so y = S^+ (g - F A^-1 r) with the small dense S = G - F A^-1 E. Redundant constraints (a planar four-bar of hinges has
three) leave S without full rank: its pseudo-inverse gives the motion, which is unique, and of the multipliers those of
least norm. The transposed system uses the same matrices.
"""

from calmotion.arrays import Array
from calmotion.multibody.kernels.sliders import has_row
from calmotion.multibody.linear_solver.block_solution import closing_rows, solve_tree, subtract_border
from calmotion.multibody.linear_solver.elimination import solve, solve_transposed
from calmotion.multibody.linear_solver.pseudo_inverse import pseudo_inverse
from calmotion.multibody.linear_solver.step_matrix import UNKNOWNS, Border, SolutionScratch, StepMatrix
from calmotion.multibody.model.system import JOINT_ROWS, System
from calmotion.support.compilation import inlined_kernel, kernel, shared_kernel


@kernel
def copy_rows(source: Array, out: Array) -> None:
    """out = source, both two-dimensional (an assignment of arrays would allocate)."""
    for i in range(source.shape[0]):
        for k in range(source.shape[1]):
            out[i, k] = source[i, k]


@kernel
def _subtract_border(system: System, matrix: StepMatrix, y: Array, x: Array) -> None:
    """x -= E y."""
    Lc, Lp, Nc = matrix.Lc, matrix.Lp, matrix.Nc
    count = len(system.parent)
    for joint in range(count, len(system.rows)):
        at = UNKNOWNS * (joint - count)
        p = system.side[joint, 0]
        b = system.side[joint, 1]
        for k in range(JOINT_ROWS):
            t = y[at + k]
            if t == 0.0:
                continue
            for i in range(6 + system.elastic[b]):
                x[b, i] -= Lc[joint, i, k] * t
            if p >= 0:
                for i in range(6 + system.elastic[p]):
                    x[p, i] -= Lp[joint, i, k] * t
        if p >= 0:
            for k in range(3):
                t = y[at + JOINT_ROWS + k]
                for i in range(6 + system.elastic[b]):
                    x[b, i] -= Nc[joint, i, k] * t


@kernel
def _border_transposed(system: System, matrix: StepMatrix, x: Array, y: Array) -> None:
    """y -= E^T x."""
    Lc, Lp, Nc = matrix.Lc, matrix.Lp, matrix.Nc
    count = len(system.parent)
    for joint in range(count, len(system.rows)):
        at = UNKNOWNS * (joint - count)
        p = system.side[joint, 0]
        b = system.side[joint, 1]
        for k in range(JOINT_ROWS):
            t = 0.0
            for i in range(6 + system.elastic[b]):
                t += Lc[joint, i, k] * x[b, i]
            if p >= 0:
                for i in range(6 + system.elastic[p]):
                    t += Lp[joint, i, k] * x[p, i]
            y[at + k] -= t
        if p >= 0:
            for k in range(3):
                t = 0.0
                for i in range(6 + system.elastic[b]):
                    t += Nc[joint, i, k] * x[b, i]
                y[at + JOINT_ROWS + k] -= t


@kernel
def _closing_rows(system: System, matrix: StepMatrix, x: Array, y: Array) -> None:
    """y -= F x."""
    Hc, Hp, Jp = matrix.Hc, matrix.Hp, matrix.Jp
    count = len(system.parent)
    for joint in range(count, len(system.rows)):
        at = UNKNOWNS * (joint - count)
        p = system.side[joint, 0]
        b = system.side[joint, 1]
        for k in range(JOINT_ROWS):
            t = 0.0
            for i in range(6 + system.elastic[b]):
                t += Hc[joint - count, k, i] * x[b, i]
            if p >= 0:
                for i in range(6 + system.elastic[p]):
                    t += Hp[joint, k, i] * x[p, i]
            y[at + k] -= t
        if p >= 0:
            for k in range(3):
                t = 0.0
                for i in range(6 + system.elastic[p]):
                    t += Jp[joint, k, i] * x[p, i]
                y[at + JOINT_ROWS + k] += t


@kernel
def _closing_rows_transposed(system: System, matrix: StepMatrix, y: Array, x: Array) -> None:
    """x -= F^T y."""
    Hc, Hp, Jp = matrix.Hc, matrix.Hp, matrix.Jp
    count = len(system.parent)
    for joint in range(count, len(system.rows)):
        at = UNKNOWNS * (joint - count)
        p = system.side[joint, 0]
        b = system.side[joint, 1]
        for k in range(JOINT_ROWS):
            t = y[at + k]
            for i in range(6 + system.elastic[b]):
                x[b, i] -= Hc[joint - count, k, i] * t
            if p >= 0:
                for i in range(6 + system.elastic[p]):
                    x[p, i] -= Hp[joint, k, i] * t
        if p >= 0:
            for k in range(3):
                t = y[at + JOINT_ROWS + k]
                for i in range(6 + system.elastic[p]):
                    x[p, i] += Jp[joint, k, i] * t


@inlined_kernel
def _schur_complement(system: System, matrix: StepMatrix, border: Border) -> None:
    """S = G - F A^-1 E and A^-1 E into the border."""
    count = len(system.parent)
    n = UNKNOWNS * (len(system.rows) - count)
    S = border.S
    border.moved[:] = 0.0
    border.forces[:] = 0.0
    for i in range(n):
        for k in range(n):
            S[i, k] = -1.0 if i == k else 0.0
    subtract_border(system, matrix, S, border.moved)
    solve_tree(system, matrix, border.moved, border.forces, border.block)
    for i in range(n):
        joint, k = count + i // UNKNOWNS, i % UNKNOWNS
        S[i, i] = 1.0 if k >= JOINT_ROWS or not has_row(system, joint, k) else 0.0
    closing_rows(system, matrix, border.moved, S)


@inlined_kernel
def _scale(n: int, length: float, S: Array) -> tuple[float, float]:
    """Scale S so that redundant constraints show in its rank; returns the scales of constraint rows and of forces.

    A redundant constraint shows only if its rows are not much larger than the others: one scale for all lengths and
    forces, and rotations and moments by a length of the mechanism. A large Baumgarte coefficient makes all constraint
    rows large against those of s.
    """
    largest = 0.0
    rows = length
    for i in range(n):
        for k in range(n):
            if i % UNKNOWNS < JOINT_ROWS and k % UNKNOWNS < JOINT_ROWS:
                S[i, k] *= _unit(i, length) * _unit(k, length)
                largest = max(largest, abs(S[i, k]))
            elif i % UNKNOWNS < JOINT_ROWS:
                S[i, k] *= _unit(i, length)
                rows = max(rows, abs(S[i, k]))
            elif k % UNKNOWNS < JOINT_ROWS:
                S[i, k] *= _unit(k, length)
    largest = largest / rows if largest > 0.0 else 1.0
    for i in range(n):
        for k in range(n):
            if i % UNKNOWNS < JOINT_ROWS:
                S[i, k] /= rows
            if k % UNKNOWNS < JOINT_ROWS:
                S[i, k] /= largest
    return rows, largest


@kernel
def _of_contact(system: System, i: int) -> bool:
    """Whether row i of S is one of a contact that holds."""
    joint = len(system.parent) + i // UNKNOWNS
    return system.contact[joint] != 0 and i % UNKNOWNS < JOINT_ROWS and has_row(system, joint, i % UNKNOWNS)


@inlined_kernel
def _scale_contacts(system: System, n: int, S: Array) -> float:
    """Scale the rows of contacts, which have no Baumgarte term, to the size of those of other joints; returns by how
    much."""
    own, others = 0.0, 0.0
    for i in range(n):
        for k in range(n):
            if i % UNKNOWNS < JOINT_ROWS and k % UNKNOWNS < JOINT_ROWS:
                if _of_contact(system, i):
                    own = max(own, abs(S[i, k]))
                else:
                    others = max(others, abs(S[i, k]))
    if own == 0.0 or others == 0.0:
        return 1.0
    for i in range(n):
        if _of_contact(system, i):
            for k in range(n):
                S[i, k] *= others / own
    return others / own


@shared_kernel
def factor_closed_chains(system: System, matrix: StepMatrix, border: Border) -> None:
    """S^+ of the closed chains into matrix.inverse, after the tree has been eliminated."""
    n = UNKNOWNS * (len(system.rows) - len(system.parent))
    _schur_complement(system, matrix, border)
    length = system.unit[0, 0]
    contacts = _scale_contacts(system, n, border.S)
    rows, largest = _scale(n, length, border.S)
    inverse = matrix.inverse
    rank = pseudo_inverse(n, border.S, inverse, border.null, border.decomposition)
    border.rank[0] = rank
    least, most = 0.0, 0.0
    for k in range(rank):
        pivot = abs(border.S[k, k])
        least = pivot if k == 0 else min(least, pivot)
        most = max(most, pivot)
    border.margin[0] = least / most if most > 0.0 else 1.0
    for i in range(n):
        for k in range(n):
            t = inverse[i, k] * _unit(k, length)
            if k % UNKNOWNS < JOINT_ROWS:
                t /= rows
            if _of_contact(system, k):
                t *= contacts
            inverse[i, k] = t * _unit(i, length) / largest if i % UNKNOWNS < JOINT_ROWS else t
            t = border.null[i, k]
            border.null[i, k] = t * _unit(i, length) / largest if i % UNKNOWNS < JOINT_ROWS else t


@kernel
def _unit(i: int, length: float) -> float:
    """Scale of the rows and columns of rotations and moments; 1 for the others."""
    return length if 3 <= i % UNKNOWNS < JOINT_ROWS else 1.0


@kernel
def _closing_part(system: System, lam: Array, g: Array) -> None:
    """Right-hand side of the border from that of all constraint rows, shape [J, 6]."""
    count = len(system.parent)
    for joint in range(count, len(system.rows)):
        at = UNKNOWNS * (joint - count)
        for k in range(UNKNOWNS):
            g[at + k] = lam[joint, k] if k < JOINT_ROWS else 0.0


@kernel
def _unknowns(n: int, inverse: Array, g: Array, y: Array) -> None:
    """y = S^+ g."""
    for i in range(n):
        t = 0.0
        for k in range(n):
            t += inverse[i, k] * g[k]
        y[i] = t


@kernel
def _set_closing_part(system: System, y: Array, lam: Array) -> None:
    """Multipliers of the joints that close chains, from the unknowns of the border."""
    count = len(system.parent)
    for joint in range(count, len(system.rows)):
        for k in range(JOINT_ROWS):
            lam[joint, k] = y[UNKNOWNS * (joint - count) + k]


@shared_kernel
def solve_system(system: System, matrix: StepMatrix, x: Array, lam: Array, scratch: SolutionScratch) -> None:
    """(x, lam) <- solution of the whole linear system, closed chains included; shapes [B, N] and [J, 6]."""
    count = len(system.parent)
    joints = len(system.rows)
    if joints > count:
        n = UNKNOWNS * (joints - count)
        X, y, g = scratch.X, scratch.y, scratch.g
        copy_rows(x, X)
        copy_rows(lam, scratch.lam)
        solve(system, matrix, X, scratch.lam, scratch.block)
        _closing_part(system, lam, g)
        _closing_rows(system, matrix, X, g)
        _unknowns(n, matrix.inverse, g, y)
        _subtract_border(system, matrix, y, x)
        _set_closing_part(system, y, lam)
    solve(system, matrix, x, lam, scratch.block)


@shared_kernel
def solve_with_border(
    system: System, matrix: StepMatrix, border: Border, x: Array, lam: Array, scratch: SolutionScratch
) -> None:
    """`solve_system` where the border is that of the matrix: one solution of the tree in place of two."""
    count, joints = len(system.parent), len(system.rows)
    solve(system, matrix, x, lam, scratch.block)
    if joints == count:
        return
    n = UNKNOWNS * (joints - count)
    y, g = scratch.y, scratch.g
    _closing_part(system, lam, g)
    _closing_rows(system, matrix, x, g)
    _unknowns(n, matrix.inverse, g, y)
    for b in range(count):
        for i in range(6 + system.elastic[b]):
            t = 0.0
            for k in range(n):
                t += border.moved[b, i, k] * y[k]
            x[b, i] -= t
        for i in range(JOINT_ROWS):
            t = 0.0
            for k in range(n):
                t += border.forces[b, i, k] * y[k]
            lam[b, i] -= t
    _set_closing_part(system, y, lam)


@shared_kernel
def solve_system_transposed(system: System, matrix: StepMatrix, x: Array, lam: Array, scratch: SolutionScratch) -> None:
    """(x, lam) <- solution of the transposed system; same arguments as `solve_system`."""
    count = len(system.parent)
    joints = len(system.rows)
    if joints > count:
        n = UNKNOWNS * (joints - count)
        X, y, g = scratch.X, scratch.y, scratch.g
        copy_rows(x, X)
        copy_rows(lam, scratch.lam)
        solve_transposed(system, matrix, X, scratch.lam, scratch.block)
        _closing_part(system, lam, g)
        _border_transposed(system, matrix, X, g)
        for i in range(n):
            t = 0.0
            for k in range(n):
                t += matrix.inverse[k, i] * g[k]
            y[i] = t
        _closing_rows_transposed(system, matrix, y, x)
        _set_closing_part(system, y, lam)
    solve_transposed(system, matrix, x, lam, scratch.block)
