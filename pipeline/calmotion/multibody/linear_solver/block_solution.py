"""Solution of the step's linear system for many right-hand sides at once, closed chains included; compiled.

Right-hand sides stand last in all arrays, so that the innermost loops are over them and vectorised. The equations are
those of `elimination` and `closed_chains`.
"""

from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.multibody.linear_solver.elimination import place
from calmotion.multibody.linear_solver.step_matrix import UNKNOWNS, StepMatrix
from calmotion.multibody.model.system import JOINT_ROWS, System
from calmotion.support.by_reference import by_reference
from calmotion.support.compilation import kernel, shared_kernel


@by_reference
class BlockSolution(NamedTuple):
    """Scratch of solutions for Q right-hand sides; L is the number of joints that close chains.

    Attributes:
        X, lam: Solution of the tree, shapes [B, N, Q] and [J, 6, Q]; empty without closed chains.
        y, g: Unknowns and right-hand side of the closed chains, shape [9 L, Q].
        block: Unknowns of one component with its joint, shape [N + 6, Q].
    """

    X: Array
    lam: Array
    y: Array
    g: Array
    block: Array


def allocate_block_solution(system: System, columns: int) -> BlockSolution:
    """Scratch for one system and so many right-hand sides."""
    bodies, joints, size = len(system.parent), len(system.rows), system.size
    border = UNKNOWNS * (joints - bodies)
    used = 1 if border else 0
    return BlockSolution(
        X=np.zeros((used * bodies, size, columns)),
        lam=np.zeros((used * joints, JOINT_ROWS, columns)),
        y=np.zeros((border, columns)),
        g=np.zeros((border, columns)),
        block=np.zeros((size + JOINT_ROWS, columns)),
    )


@kernel
def add(factor: float, source: Array, out: Array) -> None:
    """out += factor source, shape [Q]."""
    for q in range(out.shape[0]):
        out[q] += factor * source[q]


@kernel
def _swap(a: Array, b: Array) -> None:
    for q in range(a.shape[0]):
        t = a[q]
        a[q] = b[q]
        b[q] = t


@shared_kernel
def solve_tree(system: System, matrix: StepMatrix, x: Array, lam: Array, block: Array) -> None:
    """`elimination.solve` for all columns; `block` is scratch, shape [N + 6, Q]."""
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
            t = block[0]
            for q in range(t.shape[0]):
                t[q] = 0.0
            for i in range(n):
                if Z[b, place(i, r), k] != 0.0:
                    add(Z[b, place(i, r), k], x[b, i], t)
            for i in range(m):
                if Z[b, n + i, k] != 0.0:
                    add(Z[b, n + i, k], lam[b, i], t)
            for i in range(6 + system.elastic[p]):
                if Lp[b, i, k] != 0.0:
                    add(-Lp[b, i, k], t, x[p, i])
    for b in range(count):
        p = system.parent[b]
        r = system.elastic[b]
        n = 6 + r
        if p >= 0:
            np_ = 6 + system.elastic[p]
            for k in range(3):
                t = block[0]
                for q in range(t.shape[0]):
                    t[q] = 0.0
                for a in range(np_):
                    if Jp[b, k, a] != 0.0:
                        add(Jp[b, k, a], x[p, a], t)
                for i in range(n):
                    if Nc[b, i, k] != 0.0:
                        add(-Nc[b, i, k], t, x[b, i])
            for i in range(m):
                for a in range(np_):
                    if Hp[b, i, a] != 0.0:
                        add(-Hp[b, i, a], x[p, a], lam[b, i])
        for i in range(n):
            for q in range(block.shape[1]):
                block[place(i, r), q] = x[b, i, q]
        for i in range(m):
            for q in range(block.shape[1]):
                block[n + i, q] = lam[b, i, q]
        _lu_solve(n + m, matrix.lu[b], matrix.pivots[b], block)
        for i in range(n):
            for q in range(block.shape[1]):
                x[b, i, q] = block[place(i, r), q]
        for i in range(m):
            for q in range(block.shape[1]):
                lam[b, i, q] = block[n + i, q]


@kernel
def _lu_solve(n: int, A: Array, pivots: IntArray, x: Array) -> None:
    """`elimination.lu_solve` for all columns of x, shape [n, Q] or larger."""
    for k in range(n):
        if pivots[k] != k:
            _swap(x[k], x[pivots[k]])
    for i in range(1, n):
        for j in range(i):
            if A[i, j] != 0.0:
                add(-A[i, j], x[j], x[i])
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            if A[i, j] != 0.0:
                add(-A[i, j], x[j], x[i])
        inverse = 1.0 / A[i, i]
        for q in range(x.shape[1]):
            x[i, q] *= inverse


@kernel
def _copy(source: Array, out: Array) -> None:
    """out = source, both three-dimensional."""
    for i in range(source.shape[0]):
        for k in range(source.shape[1]):
            for q in range(source.shape[2]):
                out[i, k, q] = source[i, k, q]


@shared_kernel
def closing_rows(system: System, matrix: StepMatrix, x: Array, y: Array) -> None:
    """y -= F x, as in `closed_chains`."""
    count = len(system.parent)
    for joint in range(count, len(system.rows)):
        at = UNKNOWNS * (joint - count)
        p = system.side[joint, 0]
        b = system.side[joint, 1]
        for k in range(JOINT_ROWS):
            for i in range(6 + system.elastic[b]):
                add(-matrix.Hc[joint - count, k, i], x[b, i], y[at + k])
            if p >= 0:
                for i in range(6 + system.elastic[p]):
                    add(-matrix.Hp[joint, k, i], x[p, i], y[at + k])
        if p >= 0:
            for k in range(3):
                for i in range(6 + system.elastic[p]):
                    add(matrix.Jp[joint, k, i], x[p, i], y[at + JOINT_ROWS + k])


@shared_kernel
def subtract_border(system: System, matrix: StepMatrix, y: Array, x: Array) -> None:
    """x -= E y, as in `closed_chains`."""
    count = len(system.parent)
    for joint in range(count, len(system.rows)):
        at = UNKNOWNS * (joint - count)
        p = system.side[joint, 0]
        b = system.side[joint, 1]
        for k in range(JOINT_ROWS):
            for i in range(6 + system.elastic[b]):
                add(-matrix.Lc[joint, i, k], y[at + k], x[b, i])
            if p >= 0:
                for i in range(6 + system.elastic[p]):
                    add(-matrix.Lp[joint, i, k], y[at + k], x[p, i])
        if p >= 0:
            for k in range(3):
                for i in range(6 + system.elastic[b]):
                    add(-matrix.Nc[joint, i, k], y[at + JOINT_ROWS + k], x[b, i])


@kernel
def solve_block(system: System, matrix: StepMatrix, x: Array, lam: Array, scratch: BlockSolution) -> None:
    """`closed_chains.solve_system` for all columns; shapes [B, N, Q] and [J, 6, Q]."""
    count, joints = len(system.parent), len(system.rows)
    if joints > count:
        n = UNKNOWNS * (joints - count)
        X, y, g = scratch.X, scratch.y, scratch.g
        _copy(x, X)
        _copy(lam, scratch.lam)
        solve_tree(system, matrix, X, scratch.lam, scratch.block)
        for i in range(n):
            joint, k = count + i // UNKNOWNS, i % UNKNOWNS
            for q in range(g.shape[1]):
                y[i, q] = 0.0
                g[i, q] = lam[joint, k, q] if k < JOINT_ROWS else 0.0
        closing_rows(system, matrix, X, g)
        for i in range(n):
            for k in range(n):
                add(matrix.inverse[i, k], g[k], y[i])
        subtract_border(system, matrix, y, x)
        for i in range(n):
            joint, k = count + i // UNKNOWNS, i % UNKNOWNS
            if k < JOINT_ROWS:
                for q in range(g.shape[1]):
                    lam[joint, k, q] = y[i, q]
    solve_tree(system, matrix, x, lam, scratch.block)
