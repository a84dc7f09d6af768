"""Closed loops: joints beyond those of the tree, as a border of the tree's linear system; compiled.

A loop's joint adds nine unknowns y: its multipliers, and the turning s of its parent-side marker (through which the
force on the other side depends on the parent). With A the tree's matrix,

    A x + E y = r,    E y = (Lc lambda + Nc s on the component, Lp lambda on the parent)
    F x + G y = g,    F x = (Hc x_c + Hp x_p, -Jp x_p),  G = 1 on s and on rows that the joint does not have

so y = S^+ (g - F A^-1 r) with the small dense S = G - F A^-1 E. Redundant constraints (a planar four-bar of hinges has
three) leave S without full rank: its pseudo-inverse gives the motion, which is unique, and of the multipliers those of
least norm. The transposed system uses the same matrices.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from calmotion.multibody.kernels.sliders import has_row
from calmotion.multibody.linear_solver.elimination import solve, solve_transposed
from calmotion.multibody.linear_solver.pseudo_inverse import pseudo_inverse
from calmotion.multibody.model.system import JOINT_ROWS, System
from calmotion.shot.character import Array, IntArray
from calmotion.support.compilation import kernel

UNKNOWNS = JOINT_ROWS + 3


class Border(NamedTuple):
    """What the loops of a system need: the pseudo-inverse of S, its null space and rank, and scratch.

    Attributes:
        inverse: S^+, shape [9 L, 9 L] for L loops.
        null: Columns of the null space of S, shape [9 L, 9 L].
        rank: Shape [1].
        margin: How far S is from losing one more rank: its smallest pivot over the largest, shape [1].
        S, left, right, order, v, x, y: Scratch of `pseudo_inverse` and of the solutions.
        X, lam: Scratch of one tree solution, shapes [B, N] and [J, 6].
        free: Multipliers of the tree's joints for each unknown of the border, shape [9 L, J, 6].
        sets: Scratch of `least_multipliers`, same shape.
    """

    inverse: Array
    null: Array
    rank: IntArray
    margin: Array
    S: Array
    left: Array
    right: Array
    order: IntArray
    v: Array
    x: Array
    y: Array
    X: Array
    lam: Array
    free: Array
    sets: Array


def allocate_border(system: System) -> Border:
    """Scratch for one system; empty where it has no loops."""
    joints, count = len(system.rows), len(system.parent)
    n = UNKNOWNS * (joints - count)
    return Border(
        np.zeros((n, n)), np.zeros((n, n)), np.zeros(1, np.int64), np.zeros(1), np.zeros((n, n)), np.zeros((n, n)),
        np.zeros((n, n)),
        np.zeros(n, np.int64), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros((count, system.size)),
        np.zeros((joints, JOINT_ROWS)), np.zeros((n, joints, JOINT_ROWS)), np.zeros((n, joints, JOINT_ROWS)),
    )  # fmt: skip


@kernel
def copy_rows(source, out):
    """out = source, both two-dimensional (an assignment of arrays would allocate)."""
    for i in range(source.shape[0]):
        for k in range(source.shape[1]):
            out[i, k] = source[i, k]


@kernel
def _add_border(system, Lc, Lp, Nc, y, sign, x):
    """x += sign E y."""
    count = len(system.parent)
    for joint in range(count, len(system.rows)):
        at = UNKNOWNS * (joint - count)
        p = system.side[joint, 0]
        b = system.side[joint, 1]
        for k in range(JOINT_ROWS):
            t = sign * y[at + k]
            if t == 0.0:
                continue
            for i in range(6 + system.elastic[b]):
                x[b, i] += Lc[joint, i, k] * t
            if p >= 0:
                for i in range(6 + system.elastic[p]):
                    x[p, i] += Lp[joint, i, k] * t
        if p >= 0:
            for k in range(3):
                t = sign * y[at + JOINT_ROWS + k]
                for i in range(6 + system.elastic[b]):
                    x[b, i] += Nc[joint, i, k] * t


@kernel
def _border_transposed(system, Lc, Lp, Nc, x, y):
    """y -= E^T x."""
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
def _closing_rows(system, Hc, Hp, Jp, x, y):
    """y -= F x; Hc holds the loops' joints alone."""
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
def _closing_rows_transposed(system, Hc, Hp, Jp, y, x):
    """x -= F^T y."""
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


@kernel
def factor_loops(system, Lc, Lp, Hc, Hp, Nc, Jp, lu, piv, Z, border, block):
    """S^+ of the loops, after the tree has been eliminated."""
    count = len(system.parent)
    n = UNKNOWNS * (len(system.rows) - count)
    y = border.y
    for column in range(n):
        for i in range(n):
            y[i] = 0.0
        y[column] = 1.0
        border.X[:] = 0.0
        border.lam[:] = 0.0
        _add_border(system, Lc, Lp, Nc, y, 1.0, border.X)
        solve(system, Lp, Hp, Nc, Jp, lu, piv, Z, border.X, border.lam, block)
        # G - F A^-1 E
        joint, k = count + column // UNKNOWNS, column % UNKNOWNS
        y[column] = 1.0 if k >= JOINT_ROWS or not has_row(system, joint, k) else 0.0
        _closing_rows(system, Hc, Hp, Jp, border.X, y)
        for i in range(n):
            border.S[i, column] = y[i]
        for b in range(count):
            for i in range(JOINT_ROWS):
                border.free[column, b, i] = -border.lam[b, i]
    # Whether a constraint is redundant shows in S only if its own rows are not blown up: one scale for all lengths and
    # forces, and turns and moments by a length of the mechanism. A firm Baumgarte term makes all constraint rows large
    # against those of s.
    length = 0.0
    for joint in range(len(system.rows)):
        for k in range(2):
            t = 0.0
            for i in range(3):
                t += system.position[joint, k, i] ** 2
            length = max(length, t)
    length = np.sqrt(length) if length > 0.0 else 1.0
    largest = 0.0
    rows = 1.0
    for i in range(n):
        for k in range(n):
            if i % UNKNOWNS < JOINT_ROWS and k % UNKNOWNS < JOINT_ROWS:
                border.S[i, k] *= _unit(i, length) * _unit(k, length)
                largest = max(largest, abs(border.S[i, k]))
            elif i % UNKNOWNS < JOINT_ROWS:
                border.S[i, k] *= _unit(i, length)
                rows = max(rows, abs(border.S[i, k]))
            elif k % UNKNOWNS < JOINT_ROWS:
                border.S[i, k] *= _unit(k, length)
    largest = largest / rows if largest > 0.0 else 1.0
    for i in range(n):
        for k in range(n):
            if i % UNKNOWNS < JOINT_ROWS:
                border.S[i, k] /= rows
            if k % UNKNOWNS < JOINT_ROWS:
                border.S[i, k] /= largest
    border.rank[0] = pseudo_inverse(
        n, border.S, border.inverse, border.null, border.left, border.right, border.order, border.v, border.x
    )
    least, most = 0.0, 0.0
    for k in range(border.rank[0]):
        pivot = abs(border.S[k, k])
        least = pivot if k == 0 else min(least, pivot)
        most = max(most, pivot)
    border.margin[0] = least / most if most > 0.0 else 1.0
    for i in range(n):
        for k in range(n):
            t = border.inverse[i, k] * _unit(k, length)
            if k % UNKNOWNS < JOINT_ROWS:
                t /= rows
            border.inverse[i, k] = t * _unit(i, length) / largest if i % UNKNOWNS < JOINT_ROWS else t
            t = border.null[i, k]
            border.null[i, k] = t * _unit(i, length) / largest if i % UNKNOWNS < JOINT_ROWS else t


@kernel
def _unit(i, length):
    """What the rows and columns of turns and moments are scaled by; 1 for the others."""
    return length if 3 <= i % UNKNOWNS < JOINT_ROWS else 1.0


@kernel
def solve_system(system, Lc, Lp, Hc, Hp, Nc, Jp, lu, piv, Z, inverse, x, lam, X, tree, y, g, block):
    """(x, lam) <- solution of the whole linear system, loops included; lam of shape [J, 6].

    Args:
        inverse: S^+ of `factor_loops`.
        X, tree, y, g: Scratch, shapes [B, N], [J, 6], [9 L], [9 L].
        block: Scratch of `elimination.solve`.
    """
    count = len(system.parent)
    joints = len(system.rows)
    if joints > count:
        n = UNKNOWNS * (joints - count)
        copy_rows(x, X)
        copy_rows(lam, tree)
        solve(system, Lp, Hp, Nc, Jp, lu, piv, Z, X, tree, block)
        for i in range(n):
            joint, k = count + i // UNKNOWNS, i % UNKNOWNS
            g[i] = lam[joint, k] if k < JOINT_ROWS else 0.0
        _closing_rows(system, Hc, Hp, Jp, X, g)
        for i in range(n):
            t = 0.0
            for k in range(n):
                t += inverse[i, k] * g[k]
            y[i] = t
        _add_border(system, Lc, Lp, Nc, y, -1.0, x)
        for i in range(n):
            joint, k = count + i // UNKNOWNS, i % UNKNOWNS
            if k < JOINT_ROWS:
                lam[joint, k] = y[i]
    solve(system, Lp, Hp, Nc, Jp, lu, piv, Z, x, lam, block)


@kernel
def solve_system_transposed(system, Lc, Lp, Hc, Hp, Nc, Jp, lu, piv, Z, inverse, x, lam, X, tree, y, g, block):
    """(x, lam) <- solution of the transposed system; same arguments as `solve_system`."""
    count = len(system.parent)
    joints = len(system.rows)
    if joints > count:
        n = UNKNOWNS * (joints - count)
        copy_rows(x, X)
        copy_rows(lam, tree)
        solve_transposed(system, Lp, Hp, Nc, Jp, lu, piv, Z, X, tree, block)
        for i in range(n):
            joint, k = count + i // UNKNOWNS, i % UNKNOWNS
            g[i] = lam[joint, k] if k < JOINT_ROWS else 0.0
        _border_transposed(system, Lc, Lp, Nc, X, g)
        for i in range(n):
            t = 0.0
            for k in range(n):
                t += inverse[k, i] * g[k]
            y[i] = t
        _closing_rows_transposed(system, Hc, Hp, Jp, y, x)
        for i in range(n):
            joint, k = count + i // UNKNOWNS, i % UNKNOWNS
            if k < JOINT_ROWS:
                lam[joint, k] = y[i]
    solve_transposed(system, Lp, Hp, Nc, Jp, lu, piv, Z, x, lam, block)
