"""One implicit step by Newton's method, safeguarded; compiled.

The first correction of a step uses its own tangent. Later ones keep its factors while the corrections shrink fast, as
they cost a residual each and no factorisation; what is left then is estimated from the rate of shrinking. A correction
that the next one, by the same factors, does not confirm (the natural monotonicity test: Deuflhard, Newton Methods for
Nonlinear Problems, 2004, section 2.1.3) is taken back and halved.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from calmotion.multibody.integrators import bdf2, newmark
from calmotion.multibody.kernels.assembly import assemble
from calmotion.multibody.kernels.sliders import LENGTH, slides_freely
from calmotion.multibody.kernels.so3 import inverse_right_jacobian, matrix_of, turn
from calmotion.multibody.linear_solver.closed_chains import (
    Border,
    allocate_border,
    copy_rows,
    factor_loops,
    solve_system,
)
from calmotion.multibody.linear_solver.elimination import factor
from calmotion.multibody.linear_solver.least_multipliers import least_multipliers
from calmotion.multibody.model.system import BACKWARD_DIFFERENCE, JOINT_ROWS, State, System, allocate_state
from calmotion.shot.character import Array
from calmotion.support.compilation import NO, YES, inlined_kernel, kernel

CONVERGED, SINGULAR, NOT_CONVERGED = 0, 1, 2
LIMIT = 40
QUADRATIC = 1e-8  # a correction by a fresh tangent below this leaves about its square [m, rad]
LEFT = 1e-13  # error that may be left where factors were kept [m, rad]
FLOOR = 1e-12  # corrections below this are rounding
SLOW = 0.1  # shrinking of the corrections by less than this asks for a new tangent
SMALLEST = 1.0 / 256.0  # part of a correction below which the step is given up
HUGE = 1e6


class Scratch(NamedTuple):
    """What a step writes to, besides `Work`, `Blocks` and `Factors`.

    Attributes:
        J, T, Wt: Small matrices.
        Hv: How velocities follow positions, shape [B, 4, 4].
        Vd: Accelerations, shape [B, N].
        x, lam: Correction, shapes [B, N] and [J, 6].
        block, border: Scratch of `elimination` and `loops`.
        memory: Accelerations of the instant before: those of the motion, those of Newmark's formulas, and room for the
            new ones of these, shape [3, B, N]. Zero before a start at rest.
        kept: The state before a correction.
        taken, taken_lam: That correction.
    """

    J: Array
    T: Array
    Wt: Array
    Hv: Array
    Vd: Array
    x: Array
    lam: Array
    block: Array
    border: Border
    memory: Array
    kept: State
    taken: Array
    taken_lam: Array


def allocate_scratch(system: System) -> Scratch:
    """Scratch for one system."""
    count, size, joints = len(system.parent), system.size, len(system.rows)
    square = (3, 3)
    return Scratch(
        np.zeros(square), np.zeros(square), np.zeros(square), np.zeros((count, 4, 4)), np.zeros((count, size)),
        np.zeros((count, size)), np.zeros((joints, JOINT_ROWS)), np.zeros(size + JOINT_ROWS), allocate_border(system),
        np.zeros((3, count, size)), allocate_state(system), np.zeros((count, size)), np.zeros((joints, JOINT_ROWS)),
    )  # fmt: skip


@kernel
def correct(system, before, now, R, x, lam, part, T):
    """Add a part of a Newton correction (x, shape [B, N], and lam) to a state of rotation matrices R."""
    for b in range(len(system.parent)):
        inverse_right_jacobian(now.turn[b], T)
        for i in range(3):
            d = 0.0
            e = 0.0
            for k in range(3):
                d += R[b, i, k] * x[b, k]
                e += T[i, k] * x[b, 3 + k]
            now.c[b, i] += part * d
            now.turn[b, i] += part * e
        for j in range(system.elastic[b]):
            now.u[b, j] += part * x[b, 6 + j]
        turn(before.q[b], now.turn[b], now.q[b])
    for j in range(len(system.rows)):
        for i in range(JOINT_ROWS):
            if not (i == LENGTH and slides_freely(system, j)):
                now.lam[j, i] += part * lam[j, i]


@kernel
def worst_component(system, x):
    """Component with the largest (or a non-finite) correction."""
    worst = 0
    big = -1.0
    for b in range(len(system.parent)):
        for i in range(6 + system.elastic[b]):
            t = abs(x[b, i])
            if not np.isfinite(t):
                return b
            if t > big:
                big = t
                worst = b
    return worst


@inlined_kernel
def _predict(system, h, before, now, memory):
    """The new instant by Taylor's formula."""
    for b in range(len(system.parent)):
        for i in range(3):
            now.c[b, i] = before.c[b, i] + h * (before.V[b, i] + 0.5 * h * memory[0, b, i])
            now.turn[b, i] = h * (before.V[b, 3 + i] + 0.5 * h * memory[0, b, 3 + i])
        for j in range(system.elastic[b]):
            now.u[b, j] = before.u[b, j] + h * (before.V[b, 6 + j] + 0.5 * h * memory[0, b, 6 + j])
        turn(before.q[b], now.turn[b], now.q[b])
    copy_rows(before.lam, now.lam)


@kernel
def _copy_positions(source, out):
    """Everything of a state but its velocities."""
    copy_rows(source.c, out.c)
    copy_rows(source.q, out.q)
    copy_rows(source.u, out.u)
    copy_rows(source.turn, out.turn)
    copy_rows(source.lam, out.lam)


@kernel
def _velocities(system, scheme, h, before2, before, now, scratch):
    if scheme.family == BACKWARD_DIFFERENCE:
        bdf2.velocities(system, h, now, before, before2, scratch.J, scratch.Vd)
    else:
        newmark.velocities(system, scheme, h, now, before, scratch.memory, scratch.Vd)


@inlined_kernel
def _linearize(system, scheme, h, before, now, angle, rate, work, blocks, factors, scratch):
    """Residual, tangent and factors at a state; returns -1 or the component that is singular."""
    if scheme.family == BACKWARD_DIFFERENCE:
        bdf2.position_to_velocity(system, h, now, before, scratch.J, scratch.T, scratch.Wt, scratch.Hv)
    else:
        newmark.position_to_velocity(system, scheme, h, now, scratch.T, scratch.Hv)
    assemble(
        system, scheme, now.c, now.q, now.u, now.V, scratch.Vd, now.lam, angle, rate, scratch.Hv, YES, work, blocks
    )
    bad = factor(system, blocks, factors.lu, factors.pivots, factors.Z, scratch.block)
    if bad < 0 and len(system.rows) > len(system.parent):
        factor_loops(
            system, blocks.Lc, blocks.Lp, blocks.Hc[len(system.parent) :], blocks.Hp, blocks.Nc, blocks.Jp, factors.lu,
            factors.pivots, factors.Z, scratch.border, scratch.block,
        )  # fmt: skip
    return bad


@kernel
def solve_correction(system, blocks, factors, scratch):
    """Newton's correction from the residual in the blocks, by the factors at hand, into scratch.x and scratch.lam."""
    x, lam, border = scratch.x, scratch.lam, scratch.border
    for b in range(len(system.parent)):
        for i in range(6 + system.elastic[b]):
            x[b, i] = -blocks.res[b, i]
    for j in range(len(system.rows)):
        for i in range(JOINT_ROWS):
            lam[j, i] = -blocks.gap[j, i]
    solve_system(
        system, blocks.Lc, blocks.Lp, blocks.Hc[len(system.parent) :], blocks.Hp, blocks.Nc, blocks.Jp, factors.lu,
        factors.pivots, factors.Z, border.inverse, x, lam, border.X, border.lam, border.y, border.x, scratch.block,
    )  # fmt: skip


@kernel
def largest_entry(system, x):
    """Largest entry of a correction, NaN where one is not a number."""
    largest = 0.0
    for b in range(len(system.parent)):
        for i in range(6 + system.elastic[b]):
            t = abs(x[b, i])
            if not (t <= largest):
                largest = t
                if np.isnan(t):
                    return t
    return largest


@inlined_kernel
def step(system, scheme, h, before2, before, now, angle, rate, predicted, work, blocks, factors, scratch):
    """One implicit step from two instants to the next.

    Args:
        before2, before, now: States; `now` is filled. Newmark's family does not look at `before2`.
        angle, rate: Angle (or length) and rate of each joint's motor at the new instant, shape [J].
        predicted: Whether `now` already holds positions and multipliers to start from.
        scratch: Its `memory` is that of `before`, and of `now` afterwards.

    Returns:
        (code, factorisations, residuals, component): CONVERGED, or why not and at which component.
    """
    x, lam = scratch.x, scratch.lam
    if not predicted:
        _predict(system, h, before, now, scratch.memory)
    fresh = True  # whether to linearise here
    taken_fresh = False  # whether the correction taken last came from a tangent of its own
    part, last = 1.0, np.inf  # how much of it was taken, and its size
    factorisations = 0
    for iteration in range(LIMIT):
        _velocities(system, scheme, h, before2, before, now, scratch)
        if fresh:
            factorisations += 1
            bad = _linearize(system, scheme, h, before, now, angle, rate, work, blocks, factors, scratch)
            if bad >= 0:
                return SINGULAR, factorisations, iteration + 1, bad
        else:
            assemble(
                system, scheme, now.c, now.q, now.u, now.V, scratch.Vd, now.lam, angle, rate, scratch.Hv, NO, work,
                blocks,
            )  # fmt: skip
        solve_correction(system, blocks, factors, scratch)
        size = largest_entry(system, x)
        if fresh:
            if not (size < HUGE):
                return NOT_CONVERGED, factorisations, iteration + 1, worst_component(system, x)
        elif size <= (1.0 - 0.25 * part) * last or size < FLOOR:
            if part < 1.0 or (size > SLOW * last and size > FLOOR):
                fresh, part = True, 1.0
                continue
        else:
            # not confirmed: back to where it was taken from
            _copy_positions(scratch.kept, now)
            if not taken_fresh:
                fresh = True
                continue
            part *= 0.5
            if part < SMALLEST:
                return NOT_CONVERGED, factorisations, iteration + 1, worst_component(system, x)
            for b in range(len(system.parent)):
                matrix_of(now.q[b], work.R[b])
            correct(system, before, now, work.R, scratch.taken, scratch.taken_lam, part, scratch.T)
            continue
        ratio = 0.0 if fresh else size / last
        _copy_positions(now, scratch.kept)
        copy_rows(x, scratch.taken)
        copy_rows(lam, scratch.taken_lam)
        correct(system, before, now, work.R, x, lam, part, scratch.T)
        enough = size < QUADRATIC if fresh else (size < FLOOR or ratio * size < (1.0 - ratio) * LEFT)
        if enough:
            _finish(system, scheme, h, before2, before, now, scratch)
            return CONVERGED, factorisations, iteration + 1, -1
        taken_fresh, last, fresh = fresh, size, False
    return NOT_CONVERGED, factorisations, LIMIT, worst_component(system, x)


@inlined_kernel
def _finish(system, scheme, h, before2, before, now, scratch):
    """Velocities of the converged instant, what the next step remembers, and multipliers of least norm."""
    _velocities(system, scheme, h, before2, before, now, scratch)
    copy_rows(scratch.Vd, scratch.memory[0])
    copy_rows(scratch.memory[2], scratch.memory[1])
    if len(system.rows) > len(system.parent):
        least_multipliers(system, scratch.border, now.lam)
