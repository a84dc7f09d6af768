"""The tangent (Jacobian-vector product) of a linearised simulation; compiled.

A linearisation that begins later does not contain the instants before: nothing changes there, so that the tangent
starts from zero.
"""

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.kernels.sliders import has_row
from calmotion.multibody.kernels.so3 import exponential, inverse_right_jacobian, right_jacobian
from calmotion.multibody.linear_solver.closed_chains import solve_system
from calmotion.multibody.linear_solver.step_matrix import matrix_at
from calmotion.multibody.model.system import JOINT_ROWS, System
from calmotion.multibody.sensitivity.linearization import Linearization
from calmotion.multibody.sensitivity.sweep import (
    SweepMemory,
    SweepScratch,
    Window,
    allocate_memory,
    allocate_sweep,
    effort_tangent,
    parts_of,
)
from calmotion.multibody.statics.regularized_statics import solve_statics
from calmotion.support.compilation import inlined_kernel, kernel


@inlined_kernel
def _history(system: System, window: Window, n: int, memory: SweepMemory, dX: Array, scratch: SweepScratch) -> None:
    """hV and hA of instant n >= 1 from the instants before it, and the components' right-hand sides into x."""
    at = n - window.first
    R, Hv, P, D = window.steps.R[at], window.steps.Hv[at], window.steps.P[at], window.steps.D[at]
    dc, nu, dth = memory.shift, memory.velocity, memory.turn
    x, hV, hA, tmp, J = scratch.x, scratch.hV, scratch.hA, scratch.tmp, scratch.J
    one, two = (n + 2) % 3, (n + 1) % 3
    c1, c2, half = 2.0 / window.h, 0.5 / window.h, 0.5 / window.h
    if n == 1 or window.restarts:
        two = one
    if window.restarts:
        half = 0.0
    for b in range(len(system.parent)):
        m = 6 + system.elastic[b]
        for i in range(3):
            v = 0.0
            a = 0.0
            for k in range(3):
                v += R[b, k, i] * (c2 * dc[two, b, k] - c1 * dc[one, b, k])
                a += R[b, k, i] * (c2 * nu[two, b, k] - c1 * nu[one, b, k])
            hV[b, i] = v
            hA[b, i] = a
        exponential(window.turn[n, b], J)
        for i in range(3):
            tmp[i] = J[0, i] * dX[n - 1, b, 3] + J[1, i] * dX[n - 1, b, 4] + J[2, i] * dX[n - 1, b, 5]
        right_jacobian(window.turn[n, b], J)
        for i in range(3):
            t = 0.0
            for k in range(3):
                t -= Hv[b, 1 + i, 1 + k] * tmp[k] + half * J[i, k] * dth[one, b, k]
            hV[b, 3 + i] = t
            hA[b, 3 + i] = c2 * nu[two, b, 3 + i] - c1 * nu[one, b, 3 + i]
        back = n - 2 if n > 1 and not window.restarts else n - 1
        for i in range(6, m):
            hV[b, i] = c2 * dX[back, b, i] - c1 * dX[n - 1, b, i]
            hA[b, i] = c2 * nu[two, b, i] - c1 * nu[one, b, i]
        for i in range(m):
            t = 0.0
            for k in range(m):
                t -= P[b, i, k] * hV[b, k] + D[b, i, k] * hA[b, k]
            x[b, i] = t


@inlined_kernel
def _joint_right_hand_sides(
    system: System, window: Window, n: int, d_angle: Array, d_rate: Array, scratch: SweepScratch
) -> None:
    """Right-hand sides of the joints' rows into lam, and those of the components by their motors into x."""
    steps, at = window.steps, n - window.first
    x, lam, hV, Lc, Lp = scratch.x, scratch.lam, scratch.hV, steps.matrix.Lc[at], steps.matrix.Lp[at]
    for j in range(len(system.rows)):
        p = system.side[j, 0]
        b = system.side[j, 1]
        for i in range(6):
            t = 0.0
            if n > 0 and has_row(system, j, i):
                for k in range(6 + system.elastic[b]):
                    t += Lc[j, k, i] * hV[b, k]
                if p >= 0:
                    for k in range(6 + system.elastic[p]):
                        t += Lp[j, k, i] * hV[p, k]
            lam[j, i] = t - steps.by_angle[at, j, i] * d_angle[n, j] - steps.by_rate[at, j, i] * d_rate[n, j]
        if p >= 0 and system.sliding[j]:
            for i in range(6 + system.elastic[p]):
                x[p, i] -= steps.on_parent[at, j, i] * d_angle[n, j]
        if system.rotor[j] >= 0:
            by = steps.on_rotor[at, j]
            x[b, 6 + system.rotor[j]] -= by[0] * d_angle[n, j] + by[1] * d_rate[n, j]


@inlined_kernel
def _remember(system: System, window: Window, n: int, memory: SweepMemory, dX: Array, scratch: SweepScratch) -> None:
    """Solution of instant n into dX and the memory."""
    at = n - window.first
    R, Hv, now = window.steps.R[at], window.steps.Hv[at], n % 3
    dc, nu, dth = memory.shift, memory.velocity, memory.turn
    x, hV, tmp, J = scratch.x, scratch.hV, scratch.tmp, scratch.J
    for b in range(len(system.parent)):
        m = 6 + system.elastic[b]
        for i in range(m):
            dX[n, b, i] = x[b, i]
        for i in range(3):
            dc[now, b, i] = R[b, i, 0] * x[b, 0] + R[b, i, 1] * x[b, 1] + R[b, i, 2] * x[b, 2]
        if n == 0:
            continue
        for i in range(3):
            v = 0.0
            w = 0.0
            for k in range(3):
                v += R[b, i, k] * (Hv[b, 0, 0] * x[b, k] + hV[b, k])
                w += Hv[b, 1 + i, 1 + k] * x[b, 3 + k]
            nu[now, b, i] = v
            nu[now, b, 3 + i] = w + hV[b, 3 + i]
        for i in range(6, m):
            nu[now, b, i] = Hv[b, 0, 0] * x[b, i] + hV[b, i]
        exponential(window.turn[n, b], J)
        for i in range(3):
            tmp[i] = x[b, 3 + i]
            for k in range(3):
                tmp[i] -= J[k, i] * dX[n - 1, b, 3 + k]
        inverse_right_jacobian(window.turn[n, b], J)
        for i in range(3):
            dth[now, b, i] = J[i, 0] * tmp[0] + J[i, 1] * tmp[1] + J[i, 2] * tmp[2]


@kernel
def _tangent(
    system: System, window: Window, d_angle: Array, d_rate: Array, memory: SweepMemory, dX: Array, d_effort: Array,
    d_load: Array, scratch: SweepScratch,
) -> None:  # fmt: skip
    """The instants of a window; instant n is entry n % 3 of the memory."""
    x, lam, solution = scratch.x, scratch.lam, scratch.solution
    for n in range(window.first, window.last):
        matrix = matrix_at(window.steps.matrix, n - window.first)
        if n > 0:
            _history(system, window, n, memory, dX, scratch)
        else:
            x[:] = 0.0
        _joint_right_hand_sides(system, window, n, d_angle, d_rate, scratch)
        if n > 0:
            solve_system(system, matrix, x, lam, solution)
        else:
            solve_statics(system, matrix, x, lam, solution)
        if len(d_effort):
            for j in range(len(system.rows)):
                d_effort[n, j] = effort_tangent(system, j, window.axes[n], window.lam[n], matrix.Jp, x, lam)
        if len(d_load):
            for j in range(len(system.rows)):
                for i in range(JOINT_ROWS):
                    d_load[n, j, i] = lam[j, i]
        _remember(system, window, n, memory, dX, scratch)


def tangent(
    lin: Linearization, d_angle: Array, d_rate: Array, efforts: bool = False, d_load: Array | None = None
) -> tuple[Array, Array]:
    """Change of the motion by a change of the joint angles.

    Args:
        d_angle, d_rate: Change of angle [rad] (or length [m]) and rate of each joint's motor, shape [T, J]; those
            before the linearisation begins are not read.
        efforts: Whether to compute the change of the motors' efforts.
        d_load: As of `sweep_tangent`.

    Returns:
        (R^T dc, dphi, du) of each component, shape [T, B, N], and the change of what driven joints transmit
        (what their gears transmit), shape [T, J], or [0, J] without `efforts`.
    """
    dX = np.zeros((len(d_angle), len(lin.system.parent), lin.system.size))
    return dX, sweep_tangent(lin, d_angle, d_rate, efforts, allocate_memory(lin.system, 3), dX, d_load)


def sweep_tangent(
    lin: Linearization, d_angle: Array, d_rate: Array, efforts: bool, memory: SweepMemory, dX: Array,
    d_load: Array | None = None,
) -> Array:  # fmt: skip
    """The tangent over all windows, into dX, shape [T, B, N]; the change of the efforts, as `tangent` returns it.

    Args:
        memory: Three instants, n at n % 3; those before the first window on entry, the last ones on return.
        d_load: Filled with the change of the joints' multipliers, shape [T, J, 6]; None where it is not wanted.
    """
    loads = np.zeros((0, len(lin.system.rows), JOINT_ROWS)) if d_load is None else d_load
    d_effort, scratch = np.zeros((len(d_angle) if efforts else 0, len(lin.system.rows))), allocate_sweep(lin.system)
    for first, last in lin.windows():
        for system, window in parts_of(lin, first, last, efforts):
            _tangent(system, window, d_angle, d_rate, memory, dX, d_effort, loads, scratch)
    return d_effort
