"""The adjoint differential-algebraic equations of the continuous system, integrated backwards by BDF2; compiled.

With xi = (dc, R dphi, du) and nu = (dw, domega, dv) a perturbation of the motion obeys (Seed (25)-(28))

    xi' = A nu,   D B^T nu' + P B^T nu + K S^T xi + L dlambda + r_theta dtheta = 0,   H_v B^T nu + H_x S^T xi + ... = 0

with A = diag(1, R, 1), B = diag(R, 1, 1), S = diag(R, R, 1): translation in world axes and turning R dphi need no
transport term. An objective int g dt has the gradient - int (mu . r_theta + mu_lambda . h_theta) dt, where

    mu_xi' = S (K^T mu + H_x^T mu_lambda) - g_xi                                                   Seed (29), (30)
    (B D mu)' = B (P^T mu + H_v^T mu_lambda) - A^T mu_xi,   L^T mu = 0,   mu = mu_xi = 0 at the end

(Seed (39); its sign of g is wrong, see the design's formulation). Eliminating mu_xi leaves the transpose of a step
matrix whose velocities follow positions by 3/2h alone. At the start the system rests, so that mu_xi there is the
right-hand side of the transposed static equations.
"""

from __future__ import annotations

import numpy as np

from calmotion.multibody.linear_solver.closed_chains import UNKNOWNS, solve_system_transposed
from calmotion.multibody.sensitivity.linearization import Linearization
from calmotion.multibody.sensitivity.sweeps import pull_on_motors, pull_on_velocities
from calmotion.multibody.statics.regularized_statics import solve_statics_transposed
from calmotion.shot.character import Array
from calmotion.support.compilation import allocating_kernel, kernel


@kernel
def _turned(R, x, y):
    """y[:3] += R x[:3]."""
    for i in range(3):
        for k in range(3):
            y[i] += R[i, k] * x[k]


@allocating_kernel
def _sweep(system, h, density, first, last, data, pivots, g_angle, g_rate, momentum, mu_xi):
    """Instants last-1..max(first, 1); density is g_xi with its weights in time, in body axes, shape [T, B, N].

    `momentum` (B D mu) and `mu_xi` remember instants by turns, shapes [3, B, N]: rotations in world axes where the
    formulas have them so.
    """
    P, D, Lc, Lp, Hc, Hp, Nc, Jp, by_angle, by_rate, on_parent, lu, Z, inverse, R, _ = data
    joints = len(system.rows)
    _, count, size = density.shape
    beta, c1, c2 = 1.5 / h, 2.0 / h, 0.5 / h
    x, mu, lam = np.zeros((count, size)), np.zeros((count, size)), np.zeros((joints, 6))
    old = np.zeros((count, size))
    block = np.zeros(size + 6)
    border = UNKNOWNS * (joints - count)
    X, tree, y, g = np.zeros((count, size)), np.zeros((joints, 6)), np.zeros(border), np.zeros(border)
    for n in range(last - 1, max(first, 1) - 1, -1):
        at = n - first
        now, one, two = n % 3, (n + 1) % 3, (n + 2) % 3
        for b in range(count):
            m = 6 + system.elastic[b]
            for i in range(3):
                t = 0.0
                a = 0.0
                e = 0.0
                for k in range(3):
                    t += R[at, b, k, i] * (c1 * momentum[one, b, k] - c2 * momentum[two, b, k])
                    a += R[at, b, k, i] * (c1 * mu_xi[one, b, k] - c2 * mu_xi[two, b, k])
                    e += R[at, b, k, i] * (c1 * mu_xi[one, b, 3 + k] - c2 * mu_xi[two, b, 3 + k])
                old[b, i] = t
                x[b, i] = a
                x[b, 3 + i] = e
            for i in range(3, m):
                old[b, i] = c1 * momentum[one, b, i] - c2 * momentum[two, b, i]
            for i in range(6, m):
                x[b, i] = c1 * mu_xi[one, b, i] - c2 * mu_xi[two, b, i]
            for i in range(m):
                x[b, i] += density[n, b, i] / h + beta * old[b, i]
        lam[:] = 0.0
        solve_system_transposed(
            system, Lc[at], Lp[at], Hc[at], Hp[at], Nc[at], Jp[at], lu[at], pivots[at], Z[at], inverse[at], x, lam, X,
            tree, y, g, block,
        )  # fmt: skip
        pull_on_motors(system, x, lam, h, by_angle[at], by_rate[at], on_parent[at], g_angle[n], g_rate[n])
        # S^T mu_xi = P^T mu + H_v^T mu_lambda - old, in body axes; P holds beta D
        for b in range(count):
            m = 6 + system.elastic[b]
            for k in range(m):
                t = -old[b, k]
                d = 0.0
                for i in range(m):
                    t += P[at, b, i, k] * x[b, i]
                    d += D[at, b, i, k] * x[b, i]
                mu[b, k] = t
                old[b, k] = d
        pull_on_velocities(system, Lc[at], Lp[at], lam, -1.0, mu)
        for b in range(count):
            m = 6 + system.elastic[b]
            for i in range(m):
                momentum[now, b, i] = old[b, i] if i >= 3 else 0.0
                mu_xi[now, b, i] = mu[b, i] if i >= 6 else 0.0
            _turned(R[at, b], old[b], momentum[now, b])
            _turned(R[at, b], mu[b], mu_xi[now, b])
            _turned(R[at, b], mu[b, 3:], mu_xi[now, b, 3:])


@allocating_kernel
def _start(system, data, pivots, mu_xi, g_angle, g_rate):
    """The static start: transposed equations of instant 0 with mu_xi (world axes, shape [B, N])."""
    P, D, Lc, Lp, Hc, Hp, Nc, Jp, by_angle, by_rate, on_parent, lu, Z, inverse, R, _ = data
    joints = len(system.rows)
    count, size = mu_xi.shape
    x, lam, block = np.zeros((count, size)), np.zeros((joints, 6)), np.zeros(size + 6)
    border = UNKNOWNS * (joints - count)
    X, tree, y, g = np.zeros((count, size)), np.zeros((joints, 6)), np.zeros(border), np.zeros(border)
    for b in range(count):
        for i in range(3):
            for k in range(3):
                x[b, i] += R[0, b, k, i] * mu_xi[b, k]
                x[b, 3 + i] += R[0, b, k, i] * mu_xi[b, 3 + k]
        for i in range(6, 6 + system.elastic[b]):
            x[b, i] = mu_xi[b, i]
    solve_statics_transposed(
        system, D[0], Lc[0], Lp[0], Hc[0], Hp[0], Nc[0], Jp[0], lu[0], pivots[0], Z[0], inverse[0], x, lam, X, tree, y,
        g, block, np.zeros((count, size)), np.zeros((joints, 6)),
    )  # fmt: skip
    pull_on_motors(system, x, lam, 1.0, by_angle[0], by_rate[0], on_parent[0], g_angle, g_rate)


def continuous_adjoint(lin: Linearization, gradient: Array) -> tuple[Array, Array]:
    """How an objective follows the joint angles, by the adjoint of the continuous equations: Seed (39).

    It differs from `sweeps.adjoint` by terms of second order in the step.

    Args:
        lin: Made with `continuous`.
        gradient: The derivative of the objective by (R^T dc, dphi, du) of each component at each instant, its weights
            in time (of the trapezoidal rule) included, shape [T, B, N].

    Returns:
        Its derivatives by angle and rate of each joint's motor, shape [T, J] each.

    Raises:
        ValueError: Fewer than five instants, or a linearisation for the discrete adjoint.
    """
    total, count, size = gradient.shape
    if not lin.continuous:
        raise ValueError("the continuous adjoint needs a linearisation of its own")
    if total < 5:
        raise ValueError("the continuous adjoint needs five instants")
    joints, h = len(lin.system.rows), lin.trajectory.h
    g_angle, g_rate = np.zeros((total, joints)), np.zeros((total, joints))
    # mu and mu_xi are zero at the end and beyond it; the half weight of the last instant makes that second order
    momentum, mu_xi = np.zeros((3, count, size)), np.zeros((3, count, size))
    for first, last in reversed(lin.windows()):
        lin.load(first)
        _sweep(
            lin.system, h, gradient, first, last, lin.data, lin.pivots, g_angle, g_rate, momentum, mu_xi
        )  # fmt: skip
    # to the start from the three instants after it
    start = 3.0 * (mu_xi[1] - mu_xi[2]) + mu_xi[0]
    for g in (g_angle, g_rate):
        g[0] = 0.5 * (3.0 * (g[1] - g[2]) + g[3])
    by_angle, by_rate = np.zeros(joints), np.zeros(joints)
    _start(lin.system, lin.data, lin.pivots, start, by_angle, by_rate)
    g_angle[0] += by_angle
    g_rate[0] += by_rate
    return g_angle, g_rate
