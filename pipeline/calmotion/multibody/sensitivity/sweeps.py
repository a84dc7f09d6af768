"""Tangent and discrete adjoint sweeps of a linearised simulation; compiled.

The adjoint is the exact transpose of the tangent's recursion, the static start included, so gradients hold to
rounding: Seed (39) for the discretised system. A linearisation that begins later leaves out what comes before: nothing
moves there, so that the tangent starts from zero.
"""

from __future__ import annotations

import numpy as np

from calmotion.multibody.kernels.sliders import has_row
from calmotion.multibody.kernels.so3 import exponential, inverse_right_jacobian, right_jacobian
from calmotion.multibody.linear_solver.closed_chains import UNKNOWNS, solve_system, solve_system_transposed
from calmotion.multibody.model.system import JOINT_ROWS
from calmotion.multibody.sensitivity.linearization import Linearization
from calmotion.multibody.statics.regularized_statics import solve_statics, solve_statics_transposed
from calmotion.shot.character import Array
from calmotion.support.compilation import allocating_kernel, kernel


@kernel
def _effort_change(system, j, axes, lam_of, Jp, x, lam):
    """Change of a driven joint's effort with the coordinates x and the multipliers lam; 0 for other joints."""
    if system.rows[j] < JOINT_ROWS:
        return 0.0
    if not system.sliding[j]:
        return lam[j, 5]
    t = axes[j, 0, 2] * lam[j, 0] + axes[j, 1, 2] * lam[j, 1] + axes[j, 2, 2] * lam[j, 2]
    p = system.side[j, 0]
    if p >= 0:
        # the axis turns with the marker: (turn x z) . f = turn_y f_x - turn_x f_y in marker axes
        fx, fy = _across(axes, lam_of, j)
        for a in range(6 + system.elastic[p]):
            t += (Jp[j, 1, a] * fx - Jp[j, 0, a] * fy) * x[p, a]
    return t


@kernel
def _effort_pull(system, j, axes, lam_of, Jp, bar, x, lam):
    """Transpose of `_effort_change`."""
    if system.rows[j] < JOINT_ROWS:
        return
    if not system.sliding[j]:
        lam[j, 5] += bar
        return
    for i in range(3):
        lam[j, i] += axes[j, i, 2] * bar
    p = system.side[j, 0]
    if p >= 0:
        fx, fy = _across(axes, lam_of, j)
        for a in range(6 + system.elastic[p]):
            x[p, a] += (Jp[j, 1, a] * fx - Jp[j, 0, a] * fy) * bar


@kernel
def _across(axes, lam, j):
    """Components of a joint's force along the first two axes of its parent-side marker."""
    fx = 0.0
    fy = 0.0
    for i in range(3):
        fx += axes[j, i, 0] * lam[j, i]
        fy += axes[j, i, 1] * lam[j, i]
    return fx, fy


@kernel
def pull_on_motors(system, x, lam, weight, by_angle, by_rate, on_parent, g_angle, g_rate):
    """Derivatives by angle and rate of each motor, shape [J], from the multipliers of a transposed step: minus a weight
    times the parts of its equations by them."""
    for j in range(len(system.rows)):
        p = system.side[j, 0]
        ga = 0.0
        gr = 0.0
        for i in range(6):
            ga -= by_angle[j, i] * lam[j, i]
            gr -= by_rate[j, i] * lam[j, i]
        if p >= 0 and system.sliding[j]:
            for i in range(6 + system.elastic[p]):
                ga -= on_parent[j, i] * x[p, i]
        g_angle[j] = weight * ga
        g_rate[j] = weight * gr


@kernel
def pull_on_velocities(system, Lc, Lp, lam, sign, y):
    """y += sign L lam, shape [B, N]: L is minus the transpose of the constraints by velocity."""
    for j in range(len(system.rows)):
        p = system.side[j, 0]
        b = system.side[j, 1]
        for i in range(6):
            if not has_row(system, j, i):
                continue
            t = sign * lam[j, i]
            for k in range(6 + system.elastic[b]):
                y[b, k] += Lc[j, k, i] * t
            if p >= 0:
                for k in range(6 + system.elastic[p]):
                    y[p, k] += Lp[j, k, i] * t


@allocating_kernel
def _tangent(system, h, turns, d_angle, d_rate, first, last, data, pivots, axes, lam_of, dc, nu, dth, dX, d_effort):
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
        if n > 0:
            solve_system(
                system, Lc[at], Lp[at], Hc[at], Hp[at], Nc[at], Jp[at], lu[at], pivots[at], Z[at], inverse[at], x, lam,
                X, tree, y, g, block,
            )  # fmt: skip
        else:
            solve_statics(
                system, D[at], Lc[at], Lp[at], Hc[at], Hp[at], Nc[at], Jp[at], lu[at], pivots[at], Z[at], inverse[at],
                x, lam, X, tree, y, g, block, hV, np.zeros((joints, 6)),
            )  # fmt: skip
        if len(d_effort):
            for j in range(joints):
                d_effort[n, j] = _effort_change(system, j, axes[n], lam_of[n], Jp[at], x, lam)
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
def _adjoint(
    system, h, turns, Xbar, effort_bar, first, last, data, pivots, axes, lam_of, g_angle, g_rate, cbar, nubar, thbar
):  # fmt: skip
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
        if len(effort_bar):
            for j in range(joints):
                _effort_pull(system, j, axes[n], lam_of[n], Jp[at], effort_bar[n, j], x, lam)
        if n > 0:
            solve_system_transposed(
                system, Lc[at], Lp[at], Hc[at], Hp[at], Nc[at], Jp[at], lu[at], pivots[at], Z[at], inverse[at], x, lam,
                X, tree, y, g, block,
            )  # fmt: skip
        else:
            solve_statics_transposed(
                system, D[at], Lc[at], Lp[at], Hc[at], Hp[at], Nc[at], Jp[at], lu[at], pivots[at], Z[at], inverse[at],
                x, lam, X, tree, y, g, block, hV, np.zeros((joints, 6)),
            )  # fmt: skip
        pull_on_motors(system, x, lam, 1.0, by_angle[at], by_rate[at], on_parent[at], g_angle[n], g_rate[n])
        if n == 0:
            continue
        pull_on_velocities(system, Lc[at], Lp[at], lam, 1.0, hV)
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


def tangent(lin: Linearization, d_angle: Array, d_rate: Array, efforts: bool = False) -> tuple[Array, Array]:
    """How the motion follows a change of the joint angles.

    Args:
        d_angle, d_rate: Change of angle [rad] (or length [m]) and rate of each joint's motor, shape [T, J]; what comes
            before the linearisation begins does not count.
        efforts: Whether the change of the motors' efforts is wanted.

    Returns:
        (R^T dc, dphi, du) of each component, shape [T, B, N], and the change of the efforts of driven joints
        (`reactions.Reactions`), shape [T, J], or [0, J] where they are not wanted.
    """
    total, count, size = len(d_angle), len(lin.system.parent), lin.system.size
    dX = np.zeros((total, count, size))
    memory = np.zeros((3, count, 3)), np.zeros((3, count, size)), np.zeros((3, count, 3))
    return dX, sweep_forth(lin, d_angle, d_rate, efforts, memory, dX)


def sweep_forth(
    lin: Linearization, d_angle: Array, d_rate: Array, efforts: bool, memory: tuple[Array, Array, Array], dX: Array
) -> Array:
    """The tangent over all windows, into dX, shape [T, B, N]; the change of the efforts, as `tangent` returns it.

    Args:
        memory: Translation in world axes, velocity and turn of three instants, by turns, shapes [3, B, 3], [3, B, N],
            [3, B, 3]; what comes before the first window on entry, what the last one leaves on return.
    """
    d_effort = np.zeros((len(d_angle) if efforts else 0, len(lin.system.rows)))
    for first, last in lin.windows():
        lin.load(first)
        _tangent(
            lin.system, lin.trajectory.h, lin.trajectory.states.turn, d_angle, d_rate, first, last, lin.data,
            lin.pivots, lin.axes(efforts), lin.trajectory.states.lam, *memory, dX, d_effort,
        )  # fmt: skip
    return d_effort


def adjoint(lin: Linearization, gradient: Array, effort_gradient: Array | None = None) -> tuple[Array, Array]:
    """How an objective follows the joint angles.

    Args:
        gradient: Its derivative by (R^T dc, dphi, du) of each component at each instant, shape [T, B, N].
        effort_gradient: Its derivative by the efforts of the joints, shape [T, J]; None where it has none.

    Returns:
        Its derivatives by angle and rate of each joint's motor, shape [T, J] each; zero before the linearisation
        begins.
    """
    Xbar = gradient.copy()
    total, count, size = Xbar.shape
    memory = np.zeros((total, count, 3)), np.zeros((total, count, size)), np.zeros((total, count, 3))
    return sweep_back(lin, Xbar, effort_gradient, memory)


def sweep_back(
    lin: Linearization, Xbar: Array, effort_gradient: Array | None, memory: tuple[Array, Array, Array]
) -> tuple[Array, Array]:
    """The transpose of `sweep_forth`; derivatives by angle and rate of each joint's motor, shape [T, J] each.

    Args:
        Xbar: Derivative by the components' coordinates, shape [T, B, N]; overwritten.
        memory: Derivatives by translation, velocity and turn of all instants, shapes [T, B, 3], [T, B, N], [T, B, 3];
            overwritten.
    """
    total, joints = len(Xbar), len(lin.system.rows)
    efforts = effort_gradient is not None
    effort_bar = np.zeros((0, joints)) if effort_gradient is None else effort_gradient
    g_angle, g_rate = np.zeros((total, joints)), np.zeros((total, joints))
    for first, last in reversed(lin.windows()):
        lin.load(first)
        _adjoint(
            lin.system, lin.trajectory.h, lin.trajectory.states.turn, Xbar, effort_bar, first, last, lin.data,
            lin.pivots, lin.axes(efforts), lin.trajectory.states.lam, g_angle, g_rate, *memory,
        )  # fmt: skip
    return g_angle, g_rate
