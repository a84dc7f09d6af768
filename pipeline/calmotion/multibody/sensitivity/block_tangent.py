"""The tangent of a linearised simulation along many directions at once; compiled.

A single sweep spends most of its time reading the step matrices of all instants from memory. Here each is read once for
a block of directions, which stand last in all arrays, so that the innermost loops are over them and vectorised: the
time for each direction falls to a tenth. The equations are those of `tangent`.
"""

from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.multibody.kernels.sliders import has_row
from calmotion.multibody.kernels.so3 import exponential, inverse_right_jacobian, right_jacobian
from calmotion.multibody.linear_solver.block_solution import BlockSolution, add, allocate_block_solution, solve_block
from calmotion.multibody.linear_solver.step_matrix import StepMatrix, matrix_at
from calmotion.multibody.model.system import JOINT_ROWS, System
from calmotion.multibody.sensitivity.linearization import Linearization
from calmotion.multibody.sensitivity.linearized_steps import LinearizedSteps
from calmotion.multibody.sensitivity.sweep import SweepScratch, Window, allocate_sweep, effort_tangent, parts_of
from calmotion.multibody.statics.regularized_statics import solve_statics
from calmotion.support.by_reference import by_reference
from calmotion.support.compilation import inlined_kernel, kernel

_NONE = np.zeros(0, np.int32)


@by_reference
class BlockScratch(NamedTuple):
    """Perturbations of the last three instants (n at n % 3), and scratch of a step; Q directions.

    Attributes:
        dX: Solutions, shape [3, B, N, Q].
        shift, velocity, turn: As of `sweep.SweepMemory`, shapes [3, B, 3, Q], [3, B, N, Q] and [3, B, 3, Q].
        x, lam: Right-hand side and solution, shapes [B, N, Q] and [J, 6, Q].
        hV, hA: As of `sweep.SweepScratch`, shape [B, N, Q].
        tmp, J: Shapes [6, Q] and [3, 3].
        solution: Scratch of the linear system.
        single: Scratch of one direction.
    """

    dX: Array
    shift: Array
    velocity: Array
    turn: Array
    x: Array
    lam: Array
    hV: Array
    hA: Array
    tmp: Array
    J: Array
    solution: BlockSolution
    single: SweepScratch


@inlined_kernel
def _histories(system: System, window: Window, n: int, scratch: BlockScratch) -> None:
    """hV and hA of instant n >= 1 from the instants before it, and the components' right-hand sides into x."""
    at = n - window.first
    R, Hv, P, D = window.steps.R[at], window.steps.Hv[at], window.steps.P[at], window.steps.D[at]
    dX, dc, nu, dth = scratch.dX, scratch.shift, scratch.velocity, scratch.turn
    x, hV, hA, tmp, J = scratch.x, scratch.hV, scratch.hA, scratch.tmp, scratch.J
    one, two = (n + 2) % 3, (n + 1) % 3
    c1, c2, half = 2.0 / window.h, 0.5 / window.h, 0.5 / window.h
    if n == 1 or window.restarts:
        two = one
    if window.restarts:
        half = 0.0
    count = tmp.shape[1]
    for b in range(len(system.parent)):
        m = 6 + system.elastic[b]
        for i in range(m):
            for q in range(count):
                hA[b, i, q] = c2 * nu[two, b, i, q] - c1 * nu[one, b, i, q]
        for i in range(6, m):
            for q in range(count):
                hV[b, i, q] = c2 * dX[two, b, i, q] - c1 * dX[one, b, i, q]
        for i in range(3):
            for q in range(count):
                tmp[i, q] = c2 * dc[two, b, i, q] - c1 * dc[one, b, i, q]
                tmp[3 + i, q] = hA[b, i, q]
        for i in range(6):
            for q in range(count):
                hV[b, i, q] = 0.0
        for i in range(3):
            for q in range(count):
                hA[b, i, q] = 0.0
            for k in range(3):
                add(R[b, k, i], tmp[k], hV[b, i])
                add(R[b, k, i], tmp[3 + k], hA[b, i])
        exponential(window.turn[n, b], J)
        for i in range(3):
            for q in range(count):
                tmp[i, q] = 0.0
            for k in range(3):
                add(J[k, i], dX[one, b, 3 + k], tmp[i])
        right_jacobian(window.turn[n, b], J)
        for i in range(3):
            for k in range(3):
                add(-Hv[b, 1 + i, 1 + k], tmp[k], hV[b, 3 + i])
                add(-half * J[i, k], dth[one, b, k], hV[b, 3 + i])
        for i in range(m):
            for q in range(count):
                x[b, i, q] = 0.0
            for k in range(m):
                p, d = -P[b, i, k], -D[b, i, k]
                if p != 0.0 or d != 0.0:
                    for q in range(count):
                        x[b, i, q] += p * hV[b, k, q] + d * hA[b, k, q]


@inlined_kernel
def _right_hand_sides(
    system: System, steps: LinearizedSteps, at: int, n: int, d_angle: Array, d_rate: Array, scratch: BlockScratch
) -> None:
    """Right-hand sides of the joints' rows into lam, and those of the components by their motors into x.

    Args:
        d_angle, d_rate: Of this instant, shape [J, Q].
    """
    x, lam, hV, Lc, Lp = scratch.x, scratch.lam, scratch.hV, steps.matrix.Lc[at], steps.matrix.Lp[at]
    for j in range(len(system.rows)):
        p = system.side[j, 0]
        b = system.side[j, 1]
        for i in range(JOINT_ROWS):
            by_angle, by_rate = steps.by_angle[at, j, i], steps.by_rate[at, j, i]
            for q in range(lam.shape[2]):
                lam[j, i, q] = -by_angle * d_angle[j, q] - by_rate * d_rate[j, q]
            if n > 0 and has_row(system, j, i):
                for k in range(6 + system.elastic[b]):
                    if Lc[j, k, i] != 0.0:
                        add(Lc[j, k, i], hV[b, k], lam[j, i])
                if p >= 0:
                    for k in range(6 + system.elastic[p]):
                        if Lp[j, k, i] != 0.0:
                            add(Lp[j, k, i], hV[p, k], lam[j, i])
        if p >= 0 and system.sliding[j]:
            for i in range(6 + system.elastic[p]):
                add(-steps.on_parent[at, j, i], d_angle[j], x[p, i])
        if system.rotor[j] >= 0:
            turned = x[b, 6 + system.rotor[j]]
            add(-steps.on_rotor[at, j, 0], d_angle[j], turned)
            add(-steps.on_rotor[at, j, 1], d_rate[j], turned)


@inlined_kernel
def _solve_statics(system: System, matrix: StepMatrix, scratch: BlockScratch) -> None:
    """`solve_statics`, one direction after the other."""
    x, lam = scratch.single.x, scratch.single.lam
    for q in range(scratch.x.shape[2]):
        for b in range(x.shape[0]):
            for i in range(x.shape[1]):
                x[b, i] = scratch.x[b, i, q]
        for j in range(lam.shape[0]):
            for i in range(JOINT_ROWS):
                lam[j, i] = scratch.lam[j, i, q]
        solve_statics(system, matrix, x, lam, scratch.single.solution)
        for b in range(x.shape[0]):
            for i in range(6 + system.elastic[b]):
                scratch.x[b, i, q] = x[b, i]
        for j in range(lam.shape[0]):
            for i in range(JOINT_ROWS):
                scratch.lam[j, i, q] = lam[j, i]


@inlined_kernel
def _remember(system: System, window: Window, n: int, scratch: BlockScratch) -> None:
    """Solution of instant n into the memory."""
    at, now, before = n - window.first, n % 3, (n + 2) % 3
    R, Hv = window.steps.R[at], window.steps.Hv[at]
    dX, dc, nu, dth = scratch.dX, scratch.shift[now], scratch.velocity[now], scratch.turn[now]
    x, hV, tmp, J = scratch.x, scratch.hV, scratch.tmp, scratch.J
    count = tmp.shape[1]
    for b in range(len(system.parent)):
        m = 6 + system.elastic[b]
        for i in range(m):
            for q in range(count):
                dX[now, b, i, q] = x[b, i, q]
        for i in range(3):
            for q in range(count):
                dc[b, i, q] = 0.0
            for k in range(3):
                add(R[b, i, k], x[b, k], dc[b, i])
        if n == 0:
            continue
        rate = Hv[b, 0, 0]
        for i in range(3):
            for q in range(count):
                tmp[i, q] = rate * x[b, i, q] + hV[b, i, q]
        for i in range(3):
            for q in range(count):
                nu[b, i, q] = 0.0
                nu[b, 3 + i, q] = hV[b, 3 + i, q]
            for k in range(3):
                add(R[b, i, k], tmp[k], nu[b, i])
                add(Hv[b, 1 + i, 1 + k], x[b, 3 + k], nu[b, 3 + i])
        for i in range(6, m):
            for q in range(count):
                nu[b, i, q] = rate * x[b, i, q] + hV[b, i, q]
        exponential(window.turn[n, b], J)
        for i in range(3):
            for q in range(count):
                tmp[i, q] = x[b, 3 + i, q]
            for k in range(3):
                add(-J[k, i], dX[before, b, 3 + k], tmp[i])
        inverse_right_jacobian(window.turn[n, b], J)
        for i in range(3):
            for q in range(count):
                dth[b, i, q] = 0.0
            for k in range(3):
                add(J[i, k], tmp[k], dth[b, i])


@inlined_kernel
def _effort(system: System, window: Window, n: int, joint: int, Jp: Array, scratch: BlockScratch, out: Array) -> None:
    """Changes of what a joint transmits, shape [Q]."""
    parent, single = system.side[joint, 0], scratch.single
    for q in range(out.shape[0]):
        for i in range(JOINT_ROWS):
            single.lam[joint, i] = scratch.lam[joint, i, q]
        if parent >= 0:
            for a in range(6 + system.elastic[parent]):
                single.x[parent, a] = scratch.x[parent, a, q]
        out[q] = effort_tangent(system, joint, window.axes[n], window.lam[n], Jp, single.x, single.lam)


@kernel
def _block_tangent(
    system: System, window: Window, first: int, d_angle: Array, d_rate: Array, component: IntArray, jacobian: Array,
    joints: IntArray, scratch: BlockScratch, out: Array,
) -> None:  # fmt: skip
    """The instants of a window from `first` on; arguments as of `block_tangent`."""
    for n in range(max(first, window.first), window.last):
        at = n - window.first
        matrix = matrix_at(window.steps.matrix, at)
        if n > 0:
            _histories(system, window, n, scratch)
        else:
            scratch.x[:] = 0.0
        _right_hand_sides(system, window.steps, at, n, d_angle[n - first], d_rate[n - first], scratch)
        if n > 0:
            solve_block(system, matrix, scratch.x, scratch.lam, scratch.solution)
        else:
            _solve_statics(system, matrix, scratch)
        _remember(system, window, n, scratch)
        for row in range(len(component)):
            b = component[row]
            read = out[n - first, row]
            for q in range(read.shape[0]):
                read[q] = 0.0
            for a in range(6 + system.elastic[b]):
                if jacobian[n, row, a] != 0.0:
                    add(jacobian[n, row, a], scratch.x[b, a], read)
        for k in range(len(joints)):
            _effort(system, window, n, joints[k], matrix.Jp, scratch, out[n - first, len(component) + k])


def can_be_blocked(lin: Linearization) -> bool:
    """Whether `block_tangent` takes a linearisation: with all instants in memory."""
    return len(lin.windows()) == 1


def block_tangent(
    lin: Linearization, first: int, d_angle: Array, d_rate: Array, component: IntArray, jacobian: Array,
    joints: IntArray = _NONE,
) -> Array:  # fmt: skip
    """Changes of quantities that depend on the components' coordinates, along many changes of the joint angles, and of
    what joints transmit.

    Args:
        lin: See `can_be_blocked`.
        first: Instant before which nothing changes; the linearisation begins there or earlier.
        d_angle, d_rate: Changes of angle [rad] (or length [m]) and rate of each joint's motor at the n instants from
            that one on, shape [n, J, Q].
        component: On whose coordinates each quantity depends, shape [r].
        jacobian: Derivatives of the quantities by (R^T c, phi, u) of their component, shape [T, r, N].
        joints: Whose efforts (what their gears transmit) are wanted as well, shape [e].

    Returns:
        Shape [n, r + e, Q].
    """
    system, count = lin.system, d_angle.shape[2]
    bodies, size = len(system.parent), system.size
    scratch = BlockScratch(
        dX=np.zeros((3, bodies, size, count)),
        shift=np.zeros((3, bodies, 3, count)),
        velocity=np.zeros((3, bodies, size, count)),
        turn=np.zeros((3, bodies, 3, count)),
        x=np.zeros((bodies, size, count)),
        lam=np.zeros((len(system.rows), JOINT_ROWS, count)),
        hV=np.zeros((bodies, size, count)),
        hA=np.zeros((bodies, size, count)),
        tmp=np.zeros((6, count)),
        J=np.zeros((3, 3)),
        solution=allocate_block_solution(system, count),
        single=allocate_sweep(system),
    )
    out = np.empty((len(d_angle), len(component) + len(joints), count))
    end = first + len(d_angle)
    for held, window in parts_of(lin, *lin.windows()[0], len(joints) > 0):
        window = window._replace(last=min(window.last, end))
        _block_tangent(held, window, first, d_angle, d_rate, component, jacobian, joints, scratch, out)
    return out
