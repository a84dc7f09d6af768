"""Tangent and discrete adjoint sweeps of a linearised simulation; compiled.

The adjoint is the exact transpose of the tangent's recursion, the static start included, so gradients hold to
rounding: Seed (39) for the discretised system.
"""

from __future__ import annotations

import numpy as np

from ..kernels import allocating_kernel
from ..shot.character import Array
from .linearization import Linearization
from .loops import UNKNOWNS, solve_system, solve_system_transposed
from .sliders import has_row
from .so3 import exponential, inverse_right_jacobian, right_jacobian


@allocating_kernel
def _tangent(system, h, turns, d_angle, d_rate, first, last, data, pivots, dc, nu, dth, dX):
    """Instants first..last-1, whose blocks the data hold; dc, nu, dth remember three instants, by turns."""
    P, D, Lc, Lp, Hc, Hp, Nc, Jp, by_angle, by_rate, on_parent, lu, Z, inverse, R, Hv = data
    joints = len(system.rows)
    _, count, size = dX.shape
    x = np.zeros((count, size))
    lam = np.zeros((joints, 6))
    block = np.zeros(size + 6)
    border = UNKNOWNS * (joints - count)
    X, tree, y, g = np.zeros((count, size)), np.zeros((joints, 6)), np.zeros(border), np.zeros(border)
    hV = np.zeros((count, size))
    hA = np.zeros((count, size))
    tmp = np.zeros(3)
    J = np.zeros((3, 3))
    c1, c2 = 2.0 / h, 0.5 / h
    for n in range(first, last):
        at = n - first
        now, one, two = n % 3, (n + 2) % 3, (n + 1) % 3
        if n == 1:
            two = one
        for b in range(count):
            m = 6 + system.elastic[b]
            for i in range(m):
                x[b, i] = 0.0
            if n > 0:
                for i in range(3):
                    v = 0.0
                    a = 0.0
                    for k in range(3):
                        v += R[at, b, k, i] * (c2 * dc[two, b, k] - c1 * dc[one, b, k])
                        a += R[at, b, k, i] * (c2 * nu[two, b, k] - c1 * nu[one, b, k])
                    hV[b, i] = v
                    hA[b, i] = a
                exponential(turns[n, b], J)
                for i in range(3):
                    tmp[i] = J[0, i] * dX[n - 1, b, 3] + J[1, i] * dX[n - 1, b, 4] + J[2, i] * dX[n - 1, b, 5]
                right_jacobian(turns[n, b], J)
                for i in range(3):
                    t = 0.0
                    for k in range(3):
                        t -= Hv[at, b, 1 + i, 1 + k] * tmp[k] + 0.5 / h * J[i, k] * dth[one, b, k]
                    hV[b, 3 + i] = t
                    hA[b, 3 + i] = c2 * nu[two, b, 3 + i] - c1 * nu[one, b, 3 + i]
                back = n - 2 if n > 1 else 0
                for i in range(6, m):
                    hV[b, i] = c2 * dX[back, b, i] - c1 * dX[n - 1, b, i]
                    hA[b, i] = c2 * nu[two, b, i] - c1 * nu[one, b, i]
                for i in range(m):
                    t = 0.0
                    for k in range(m):
                        t -= P[at, b, i, k] * hV[b, k] + D[at, b, i, k] * hA[b, k]
                    x[b, i] = t
        for j in range(joints):
            p = system.side[j, 0]
            b = system.side[j, 1]
            for i in range(6):
                t = 0.0
                if n > 0 and has_row(system, j, i):
                    for k in range(6 + system.elastic[b]):
                        t += Lc[at, j, k, i] * hV[b, k]
                    if p >= 0:
                        for k in range(6 + system.elastic[p]):
                            t += Lp[at, j, k, i] * hV[p, k]
                lam[j, i] = t - by_angle[at, j, i] * d_angle[n, j] - by_rate[at, j, i] * d_rate[n, j]
            if p >= 0 and system.sliding[j]:
                for i in range(6 + system.elastic[p]):
                    x[p, i] -= on_parent[at, j, i] * d_angle[n, j]
        solve_system(
            system, Lc[at], Lp[at], Hc[at], Hp[at], Nc[at], Jp[at], lu[at], pivots[at], Z[at], inverse[at], x, lam, X,
            tree, y, g, block,
        )  # fmt: skip
        for b in range(count):
            m = 6 + system.elastic[b]
            for i in range(m):
                dX[n, b, i] = x[b, i]
            for i in range(3):
                dc[now, b, i] = R[at, b, i, 0] * x[b, 0] + R[at, b, i, 1] * x[b, 1] + R[at, b, i, 2] * x[b, 2]
            if n == 0:
                continue
            for i in range(3):
                v = 0.0
                w = 0.0
                for k in range(3):
                    v += R[at, b, i, k] * (Hv[at, b, 0, 0] * x[b, k] + hV[b, k])
                    w += Hv[at, b, 1 + i, 1 + k] * x[b, 3 + k]
                nu[now, b, i] = v
                nu[now, b, 3 + i] = w + hV[b, 3 + i]
            for i in range(6, m):
                nu[now, b, i] = Hv[at, b, 0, 0] * x[b, i] + hV[b, i]
            exponential(turns[n, b], J)
            for i in range(3):
                tmp[i] = x[b, 3 + i]
                for k in range(3):
                    tmp[i] -= J[k, i] * dX[n - 1, b, 3 + k]
            inverse_right_jacobian(turns[n, b], J)
            for i in range(3):
                dth[now, b, i] = J[i, 0] * tmp[0] + J[i, 1] * tmp[1] + J[i, 2] * tmp[2]


@allocating_kernel
def _adjoint(system, h, turns, Xbar, first, last, data, pivots, g_angle, g_rate, cbar, nubar, thbar):
    """Transpose of `_tangent`; Xbar (body axes), cbar (world axes), nubar, thbar are overwritten."""
    P, D, Lc, Lp, Hc, Hp, Nc, Jp, by_angle, by_rate, on_parent, lu, Z, inverse, R, Hv = data
    joints = len(system.rows)
    _, count, size = Xbar.shape
    x = np.zeros((count, size))
    lam = np.zeros((joints, 6))
    block = np.zeros(size + 6)
    border = UNKNOWNS * (joints - count)
    X, tree, y, g = np.zeros((count, size)), np.zeros((joints, 6)), np.zeros(border), np.zeros(border)
    hV = np.zeros((count, size))
    tmp = np.zeros(3)
    J = np.zeros((3, 3))
    c1, c2 = 2.0 / h, 0.5 / h
    for n in range(last - 1, first - 1, -1):
        at = n - first
        back = n - 2 if n > 1 else 0
        for b in range(count):
            m = 6 + system.elastic[b]
            if n > 0:
                # velocities: dV = (beta dc, H dphi, beta du) + h_V
                for i in range(3):
                    cbar[n, b, i] += Hv[at, b, 0, 0] * nubar[n, b, i]
                    t = 0.0
                    for k in range(3):
                        t += R[at, b, k, i] * nubar[n, b, k]
                        Xbar[n, b, 3 + i] += Hv[at, b, 1 + k, 1 + i] * nubar[n, b, 3 + k]
                    hV[b, i] = t
                    hV[b, 3 + i] = nubar[n, b, 3 + i]
                for i in range(6, m):
                    Xbar[n, b, i] += Hv[at, b, 0, 0] * nubar[n, b, i]
                    hV[b, i] = nubar[n, b, i]
                # dtheta = J_r^-1 (dphi_n - exp^T dphi_{n-1})
                inverse_right_jacobian(turns[n, b], J)
                for i in range(3):
                    tmp[i] = J[0, i] * thbar[n, b, 0] + J[1, i] * thbar[n, b, 1] + J[2, i] * thbar[n, b, 2]
                exponential(turns[n, b], J)
                for i in range(3):
                    Xbar[n, b, 3 + i] += tmp[i]
                    Xbar[n - 1, b, 3 + i] -= J[i, 0] * tmp[0] + J[i, 1] * tmp[1] + J[i, 2] * tmp[2]
            for i in range(3):
                t = Xbar[n, b, i]
                for k in range(3):
                    t += R[at, b, k, i] * cbar[n, b, k]
                x[b, i] = t
            for i in range(3, m):
                x[b, i] = Xbar[n, b, i]
        lam[:] = 0.0
        solve_system_transposed(
            system, Lc[at], Lp[at], Hc[at], Hp[at], Nc[at], Jp[at], lu[at], pivots[at], Z[at], inverse[at], x, lam, X,
            tree, y, g, block,
        )  # fmt: skip
        for j in range(joints):
            p = system.side[j, 0]
            ga = 0.0
            gr = 0.0
            for i in range(6):
                ga -= by_angle[at, j, i] * lam[j, i]
                gr -= by_rate[at, j, i] * lam[j, i]
            if p >= 0 and system.sliding[j]:
                for i in range(6 + system.elastic[p]):
                    ga -= on_parent[at, j, i] * x[p, i]
            g_angle[n, j] = ga
            g_rate[n, j] = gr
        if n == 0:
            continue
        for j in range(joints):
            p = system.side[j, 0]
            b = system.side[j, 1]
            for i in range(6):
                if not has_row(system, j, i):
                    continue
                t = lam[j, i]
                for k in range(6 + system.elastic[b]):
                    hV[b, k] += Lc[at, j, k, i] * t
                if p >= 0:
                    for k in range(6 + system.elastic[p]):
                        hV[p, k] += Lp[at, j, k, i] * t
        for b in range(count):
            m = 6 + system.elastic[b]
            for i in range(m):
                t = x[b, i]
                for k in range(m):
                    hV[b, k] -= P[at, b, i, k] * t
            # h_A = (nu_{n-2} - 4 nu_{n-1}) / 2h, translation turned into body axes
            for k in range(m):
                block[k] = 0.0
            for i in range(m):
                t = x[b, i]
                for k in range(m):
                    block[k] -= D[at, b, i, k] * t
            for i in range(3):
                a = 0.0
                v = 0.0
                for k in range(3):
                    a += R[at, b, i, k] * block[k]
                    v += R[at, b, i, k] * hV[b, k]
                nubar[n - 1, b, i] -= c1 * a
                nubar[back, b, i] += c2 * a
                cbar[n - 1, b, i] -= c1 * v
                cbar[back, b, i] += c2 * v
            for i in range(3, m):
                nubar[n - 1, b, i] -= c1 * block[i]
                nubar[back, b, i] += c2 * block[i]
            for i in range(6, m):
                Xbar[n - 1, b, i] -= c1 * hV[b, i]
                Xbar[back, b, i] += c2 * hV[b, i]
            for k in range(3):
                tmp[k] = 0.0
                for i in range(3):
                    tmp[k] -= Hv[at, b, 1 + i, 1 + k] * hV[b, 3 + i]
            exponential(turns[n, b], J)
            for i in range(3):
                Xbar[n - 1, b, 3 + i] += J[i, 0] * tmp[0] + J[i, 1] * tmp[1] + J[i, 2] * tmp[2]
            right_jacobian(turns[n, b], J)
            for k in range(3):
                for i in range(3):
                    thbar[n - 1, b, k] -= 0.5 / h * J[i, k] * hV[b, 3 + i]
        if n == 1:
            # before the start the system rests: velocity and last turn of instant 0 are zero, whatever the start
            nubar[0] = 0.0
            thbar[0] = 0.0


def tangent(lin: Linearization, d_angle: Array, d_rate: Array) -> Array:
    """How the motion follows a change of the joint angles.

    Args:
        d_angle, d_rate: Change of angle [rad] (or length [m]) and rate of each joint's motor, shape [T, J].

    Returns:
        (R^T dc, dphi, du) of each component, shape [T, B, N].
    """
    total, count, size = len(d_angle), len(lin.system.parent), lin.system.size
    dX = np.zeros((total, count, size))
    # of three instants: translation in world axes, velocity, turn
    memory = np.zeros((3, count, 3)), np.zeros((3, count, size)), np.zeros((3, count, 3))
    for first, last in lin.windows():
        lin.load(first)
        _tangent(
            lin.system, lin.trajectory.h, lin.trajectory.states.turn, d_angle, d_rate, first, last, lin.data,
            lin.pivots, *memory, dX,
        )  # fmt: skip
    return dX


def adjoint(lin: Linearization, gradient: Array) -> tuple[Array, Array]:
    """How an objective follows the joint angles.

    Args:
        gradient: Its derivative by (R^T dc, dphi, du) of each component at each instant, shape [T, B, N].

    Returns:
        Its derivatives by angle and rate of each joint's motor, shape [T, J] each.
    """
    Xbar = gradient.copy()
    total, count, size = Xbar.shape
    g_angle, g_rate = np.zeros((total, len(lin.system.rows))), np.zeros((total, len(lin.system.rows)))
    memory = np.zeros((total, count, 3)), np.zeros((total, count, size)), np.zeros((total, count, 3))
    for first, last in reversed(lin.windows()):
        lin.load(first)
        _adjoint(
            lin.system, lin.trajectory.h, lin.trajectory.states.turn, Xbar, first, last, lin.data, lin.pivots,
            g_angle, g_rate, *memory,
        )  # fmt: skip
    return g_angle, g_rate
