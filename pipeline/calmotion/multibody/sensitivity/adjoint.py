"""The discrete adjoint (vector-Jacobian product) of a linearised simulation; compiled.

It is the exact transpose of the tangent's recursion, the static start included, so that gradients are exact to
rounding: Seed (39) for the discretised system.
"""

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.kernels.so3 import exponential, inverse_right_jacobian, right_jacobian
from calmotion.multibody.linear_solver.closed_chains import solve_system_transposed
from calmotion.multibody.linear_solver.step_matrix import matrix_at
from calmotion.multibody.model.system import JOINT_ROWS, System
from calmotion.multibody.sensitivity.linearization import Linearization
from calmotion.multibody.sensitivity.sweep import (
    SweepMemory,
    SweepScratch,
    Window,
    add_constraint_velocities,
    allocate_memory,
    allocate_sweep,
    effort_adjoint,
    motor_gradient,
    parts_of,
)
from calmotion.multibody.statics.regularized_statics import solve_statics_transposed
from calmotion.support.compilation import inlined_kernel, kernel


@inlined_kernel
def _right_hand_side(
    system: System, window: Window, n: int, memory: SweepMemory, Xbar: Array, scratch: SweepScratch
) -> None:
    """Derivatives by the coordinates of instant n into x, those by its velocities into hV."""
    at = n - window.first
    R, Hv = window.steps.R[at], window.steps.Hv[at]
    cbar, nubar, thbar = memory.shift, memory.velocity, memory.turn
    x, hV, tmp, J = scratch.x, scratch.hV, scratch.tmp, scratch.J
    for b in range(len(system.parent)):
        m = 6 + system.elastic[b]
        if n > 0:
            # velocities: dV = (beta dc, H dphi, beta du) + h_V
            for i in range(3):
                cbar[n, b, i] += Hv[b, 0, 0] * nubar[n, b, i]
                t = 0.0
                for k in range(3):
                    t += R[b, k, i] * nubar[n, b, k]
                    Xbar[n, b, 3 + i] += Hv[b, 1 + k, 1 + i] * nubar[n, b, 3 + k]
                hV[b, i] = t
                hV[b, 3 + i] = nubar[n, b, 3 + i]
            for i in range(6, m):
                Xbar[n, b, i] += Hv[b, 0, 0] * nubar[n, b, i]
                hV[b, i] = nubar[n, b, i]
            # dtheta = J_r^-1 (dphi_n - exp^T dphi_{n-1})
            inverse_right_jacobian(window.turn[n, b], J)
            for i in range(3):
                tmp[i] = J[0, i] * thbar[n, b, 0] + J[1, i] * thbar[n, b, 1] + J[2, i] * thbar[n, b, 2]
            exponential(window.turn[n, b], J)
            for i in range(3):
                Xbar[n, b, 3 + i] += tmp[i]
                Xbar[n - 1, b, 3 + i] -= J[i, 0] * tmp[0] + J[i, 1] * tmp[1] + J[i, 2] * tmp[2]
        for i in range(3):
            t = Xbar[n, b, i]
            for k in range(3):
                t += R[b, k, i] * cbar[n, b, k]
            x[b, i] = t
        for i in range(3, m):
            x[b, i] = Xbar[n, b, i]


@inlined_kernel
def _add_to_history(
    system: System, window: Window, n: int, memory: SweepMemory, Xbar: Array, scratch: SweepScratch
) -> None:
    """Adds the derivatives of instant n >= 1 by the instants before it, from its solution x and hV."""
    at, back = n - window.first, n - 2 if n > 1 and not window.restarts else n - 1
    R, Hv, P, D = window.steps.R[at], window.steps.Hv[at], window.steps.P[at], window.steps.D[at]
    cbar, nubar, thbar = memory.shift, memory.velocity, memory.turn
    x, hV, hA, tmp, J = scratch.x, scratch.hV, scratch.hA, scratch.tmp, scratch.J
    c1, c2, half = 2.0 / window.h, 0.5 / window.h, 0.0 if window.restarts else 0.5 / window.h
    for b in range(len(system.parent)):
        m = 6 + system.elastic[b]
        for i in range(m):
            t = x[b, i]
            for k in range(m):
                hV[b, k] -= P[b, i, k] * t
        # h_A = (nu_{n-2} - 4 nu_{n-1}) / 2h, translation in body axes
        for k in range(m):
            hA[b, k] = 0.0
        for i in range(m):
            t = x[b, i]
            for k in range(m):
                hA[b, k] -= D[b, i, k] * t
        for i in range(3):
            a = 0.0
            v = 0.0
            for k in range(3):
                a += R[b, i, k] * hA[b, k]
                v += R[b, i, k] * hV[b, k]
            nubar[n - 1, b, i] -= c1 * a
            nubar[back, b, i] += c2 * a
            cbar[n - 1, b, i] -= c1 * v
            cbar[back, b, i] += c2 * v
        for i in range(3, m):
            nubar[n - 1, b, i] -= c1 * hA[b, i]
            nubar[back, b, i] += c2 * hA[b, i]
        for i in range(6, m):
            Xbar[n - 1, b, i] -= c1 * hV[b, i]
            Xbar[back, b, i] += c2 * hV[b, i]
        for k in range(3):
            tmp[k] = 0.0
            for i in range(3):
                tmp[k] -= Hv[b, 1 + i, 1 + k] * hV[b, 3 + i]
        exponential(window.turn[n, b], J)
        for i in range(3):
            Xbar[n - 1, b, 3 + i] += J[i, 0] * tmp[0] + J[i, 1] * tmp[1] + J[i, 2] * tmp[2]
        right_jacobian(window.turn[n, b], J)
        for k in range(3):
            for i in range(3):
                thbar[n - 1, b, k] -= half * J[i, k] * hV[b, 3 + i]


@kernel
def _adjoint(
    system: System, window: Window, effort_bar: Array, load_bar: Array, memory: SweepMemory, Xbar: Array,
    g_angle: Array, g_rate: Array, scratch: SweepScratch,
) -> None:  # fmt: skip
    """Transpose of `tangent._tangent`; Xbar (body axes) and the memory, of all instants, are overwritten."""
    x, lam, solution = scratch.x, scratch.lam, scratch.solution
    for n in range(window.last - 1, window.first - 1, -1):
        at = n - window.first
        matrix = matrix_at(window.steps.matrix, at)
        _right_hand_side(system, window, n, memory, Xbar, scratch)
        lam[:] = 0.0
        if len(load_bar):
            for j in range(len(system.rows)):
                for i in range(JOINT_ROWS):
                    lam[j, i] = load_bar[n, j, i]
        if len(effort_bar):
            for j in range(len(system.rows)):
                effort_adjoint(system, j, window.axes[n], window.lam[n], matrix.Jp, effort_bar[n, j], x, lam)
        if n > 0:
            solve_system_transposed(system, matrix, x, lam, solution)
        else:
            solve_statics_transposed(system, matrix, x, lam, solution)
        motor_gradient(system, window.steps, at, 1.0, x, lam, g_angle[n], g_rate[n])
        if n == 0:
            continue
        add_constraint_velocities(system, matrix.Lc, matrix.Lp, lam, 1.0, scratch.hV)
        _add_to_history(system, window, n, memory, Xbar, scratch)
        if n == 1:
            # before the start the system rests: velocity and last rotation of instant 0 are zero, whatever the start
            memory.velocity[0] = 0.0
            memory.turn[0] = 0.0


def adjoint(
    lin: Linearization, gradient: Array, effort_gradient: Array | None = None, load_gradient: Array | None = None
) -> tuple[Array, Array]:
    """Gradient of an objective by the joint angles.

    Args:
        gradient: Its derivative by (R^T dc, dphi, du) of each component at each instant, shape [T, B, N].
        effort_gradient: Its derivative by the efforts of the joints, shape [T, J]; None where it has none.
        load_gradient: That by the joints' multipliers, shape [T, J, 6], zero where a row is absent; None where it
            has none.

    Returns:
        Its derivatives by angle and rate of each joint's motor, shape [T, J] each; zero before the linearisation
        begins.
    """
    return sweep_adjoint(
        lin, gradient.copy(), effort_gradient, allocate_memory(lin.system, len(gradient)), load_gradient
    )


def sweep_adjoint(
    lin: Linearization,
    Xbar: Array,
    effort_gradient: Array | None,
    memory: SweepMemory,
    load_gradient: Array | None = None,
) -> tuple[Array, Array]:
    """The transpose of `tangent.sweep_tangent`; derivatives by angle and rate of each joint's motor, shape [T, J] each.

    Args:
        Xbar: Derivative by the components' coordinates, shape [T, B, N]; overwritten.
        memory: Derivatives by translation, velocity and rotation vector of all instants; overwritten.
        load_gradient: As of `adjoint`.
    """
    total, joints = len(Xbar), len(lin.system.rows)
    efforts, scratch = effort_gradient is not None, allocate_sweep(lin.system)
    effort_bar = np.zeros((0, joints)) if effort_gradient is None else effort_gradient
    load_bar = np.zeros((0, joints, JOINT_ROWS)) if load_gradient is None else load_gradient
    g_angle, g_rate = np.zeros((total, joints)), np.zeros((total, joints))
    for first, last in reversed(lin.windows()):
        for system, window in reversed(parts_of(lin, first, last, efforts)):
            _adjoint(system, window, effort_bar, load_bar, memory, Xbar, g_angle, g_rate, scratch)
    return g_angle, g_rate
