"""The adjoint differential-algebraic equations of the continuous system, integrated backwards by BDF2; compiled.

With xi = (dc, R dphi, du) and nu = (dw, domega, dv) a perturbation of the motion obeys (Seed (25)-(28))

    xi' = A nu,   D B^T nu' + P B^T nu + K S^T xi + L dlambda + r_theta dtheta = 0,   H_v B^T nu + H_x S^T xi + ... = 0

with A = diag(1, R, 1), B = diag(R, 1, 1), S = diag(R, R, 1): translation in world axes and rotation R dphi need no
transport term. An objective int g dt has the gradient - int (mu . r_theta + mu_lambda . h_theta) dt, where

    mu_xi' = S (K^T mu + H_x^T mu_lambda) - g_xi                                                   Seed (29), (30)
    (B D mu)' = B (P^T mu + H_v^T mu_lambda) - A^T mu_xi,   L^T mu = 0,   mu = mu_xi = 0 at the end

(Seed (39); its sign of g is wrong, see the design's formulation). Eliminating mu_xi leaves the transpose of a step
matrix whose velocities follow positions by 3/2h alone. At the start the system rests, so that mu_xi there is the
right-hand side of the transposed static equations.
"""

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.linear_solver.closed_chains import solve_system_transposed
from calmotion.multibody.linear_solver.step_matrix import matrix_at
from calmotion.multibody.model.system import System
from calmotion.multibody.sensitivity.linearization import Linearization
from calmotion.multibody.sensitivity.linearized_steps import LinearizedSteps
from calmotion.multibody.sensitivity.sweep import (
    SweepScratch,
    Window,
    add_constraint_velocities,
    allocate_sweep,
    motor_gradient,
    window_of,
)
from calmotion.multibody.statics.regularized_statics import solve_statics_transposed
from calmotion.support.compilation import inlined_kernel, kernel


@kernel
def _add_rotated(R: Array, x: Array, y: Array) -> None:
    """y[:3] += R x[:3]."""
    for i in range(3):
        for k in range(3):
            y[i] += R[i, k] * x[k]


@inlined_kernel
def _right_hand_side(
    system: System, window: Window, n: int, density: Array, momentum: Array, mu_xi: Array, scratch: SweepScratch
) -> None:
    """Right-hand side of the transposed step into x, and its part by the momentum into hA."""
    x, old, h, R = scratch.x, scratch.hA, window.h, window.steps.R[n - window.first]
    one, two = (n + 1) % 3, (n + 2) % 3
    beta, c1, c2 = 1.5 / h, 2.0 / h, 0.5 / h
    for b in range(len(system.parent)):
        m = 6 + system.elastic[b]
        for i in range(3):
            t = 0.0
            a = 0.0
            e = 0.0
            for k in range(3):
                t += R[b, k, i] * (c1 * momentum[one, b, k] - c2 * momentum[two, b, k])
                a += R[b, k, i] * (c1 * mu_xi[one, b, k] - c2 * mu_xi[two, b, k])
                e += R[b, k, i] * (c1 * mu_xi[one, b, 3 + k] - c2 * mu_xi[two, b, 3 + k])
            old[b, i] = t
            x[b, i] = a
            x[b, 3 + i] = e
        for i in range(3, m):
            old[b, i] = c1 * momentum[one, b, i] - c2 * momentum[two, b, i]
        for i in range(6, m):
            x[b, i] = c1 * mu_xi[one, b, i] - c2 * mu_xi[two, b, i]
        for i in range(m):
            x[b, i] += density[n, b, i] / h + beta * old[b, i]


@kernel
def _sweep(
    system: System, window: Window, density: Array, momentum: Array, mu_xi: Array, g_angle: Array, g_rate: Array,
    scratch: SweepScratch,
) -> None:  # fmt: skip
    """The instants of a window, without instant 0.

    Args:
        density: g_xi with its weights in time, in body axes, shape [T, B, N].
        momentum, mu_xi: B D mu and mu_xi of three instants, n at n % 3, shapes [3, B, N]; rotations in world axes where
            the formulas have them so.
    """
    x, lam, mu, old = scratch.x, scratch.lam, scratch.hV, scratch.hA
    count = len(system.parent)
    for n in range(window.last - 1, max(window.first, 1) - 1, -1):
        at, now = n - window.first, n % 3
        matrix = matrix_at(window.steps.matrix, at)
        R, P, D = window.steps.R[at], window.steps.P[at], window.steps.D[at]
        _right_hand_side(system, window, n, density, momentum, mu_xi, scratch)
        lam[:] = 0.0
        solve_system_transposed(system, matrix, x, lam, scratch.solution)
        motor_gradient(system, window.steps, at, window.h, x, lam, g_angle[n], g_rate[n])
        # S^T mu_xi = P^T mu + H_v^T mu_lambda - old, in body axes; P contains beta D
        for b in range(count):
            m = 6 + system.elastic[b]
            for k in range(m):
                t = -old[b, k]
                d = 0.0
                for i in range(m):
                    t += P[b, i, k] * x[b, i]
                    d += D[b, i, k] * x[b, i]
                mu[b, k] = t
                old[b, k] = d
        add_constraint_velocities(system, matrix.Lc, matrix.Lp, lam, -1.0, mu)
        for b in range(count):
            m = 6 + system.elastic[b]
            for i in range(m):
                momentum[now, b, i] = old[b, i] if i >= 3 else 0.0
                mu_xi[now, b, i] = mu[b, i] if i >= 6 else 0.0
            _add_rotated(R[b], old[b], momentum[now, b])
            _add_rotated(R[b], mu[b], mu_xi[now, b])
            _add_rotated(R[b], mu[b, 3:], mu_xi[now, b, 3:])


@kernel
def _start(
    system: System, steps: LinearizedSteps, mu_xi: Array, g_angle: Array, g_rate: Array, scratch: SweepScratch
) -> None:
    """The static start: transposed equations of instant 0 with mu_xi (world axes, shape [B, N])."""
    x, lam, R = scratch.x, scratch.lam, steps.R[0]
    x[:] = 0.0
    lam[:] = 0.0
    for b in range(len(system.parent)):
        for i in range(3):
            for k in range(3):
                x[b, i] += R[b, k, i] * mu_xi[b, k]
                x[b, 3 + i] += R[b, k, i] * mu_xi[b, 3 + k]
        for i in range(6, 6 + system.elastic[b]):
            x[b, i] = mu_xi[b, i]
    solve_statics_transposed(system, matrix_at(steps.matrix, 0), x, lam, scratch.solution)
    motor_gradient(system, steps, 0, 1.0, x, lam, g_angle, g_rate)


def continuous_adjoint(lin: Linearization, gradient: Array) -> tuple[Array, Array]:
    """Gradient of an objective by the joint angles, from the adjoint of the continuous equations: Seed (39).

    It differs from `adjoint.adjoint` by terms of second order in the step.

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
        raise ValueError("the continuous adjoint needs a linearisation made with continuous=True")
    if total < 5:
        raise ValueError("the continuous adjoint needs five instants")
    joints, scratch = len(lin.system.rows), allocate_sweep(lin.system)
    g_angle, g_rate = np.zeros((total, joints)), np.zeros((total, joints))
    # mu and mu_xi are zero at the end and beyond it; the half weight of the last instant makes that second order
    momentum, mu_xi = np.zeros((3, count, size)), np.zeros((3, count, size))
    for first, last in reversed(lin.windows()):
        window = window_of(lin, first, last, efforts=False)
        _sweep(lin.system, window, gradient, momentum, mu_xi, g_angle, g_rate, scratch)
    # to the start from the three instants after it
    start = 3.0 * (mu_xi[1] - mu_xi[2]) + mu_xi[0]
    for g in (g_angle, g_rate):
        g[0] = 0.5 * (3.0 * (g[1] - g[2]) + g[3])
    by_angle, by_rate = np.zeros(joints), np.zeros(joints)
    _start(lin.system, lin.steps, start, by_angle, by_rate, scratch)
    g_angle[0] += by_angle
    g_rate[0] += by_rate
    return g_angle, g_rate
