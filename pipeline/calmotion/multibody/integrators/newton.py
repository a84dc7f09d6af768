"""One implicit step by Newton's method; compiled.

The first correction of a step uses the tangent at its state. Later ones keep the factors while the corrections shrink
fast, as they cost a residual each and no factorisation; the remaining error is estimated from the rate of shrinking.

Corrections are taken whole, with a new tangent where the factors do not do: where rotations meet stiff springs, shorter
ones lead astray. Where they grow, or do not end, the step begins again with a safeguard: a correction that the next
one, by the same factors, does not confirm (the natural monotonicity test: Deuflhard, Newton Methods for Nonlinear
Problems, 2004, section 2.1.3) is taken back and halved.
"""

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.integrators import bdf2, newmark
from calmotion.multibody.integrators.coefficients import predict, remember_missed
from calmotion.multibody.integrators.workspace import Scratch, Workspace
from calmotion.multibody.kernels.assembly import assemble
from calmotion.multibody.kernels.sliders import LENGTH, slides_freely
from calmotion.multibody.kernels.so3 import inverse_right_jacobian, matrix_of, turn
from calmotion.multibody.linear_solver.closed_chains import copy_rows, factor_closed_chains, solve_with_border
from calmotion.multibody.linear_solver.elimination import factor
from calmotion.multibody.linear_solver.least_multipliers import least_multipliers
from calmotion.multibody.linear_solver.step_matrix import StepMatrix
from calmotion.multibody.model.system import (
    BACKWARD_DIFFERENCE,
    JOINT_ROWS,
    Blocks,
    Instants,
    Integrator,
    State,
    System,
)
from calmotion.support.compilation import NO, YES, inlined_kernel, kernel, shared_kernel

CONVERGED, SINGULAR, NOT_CONVERGED = 0, 1, 2
LIMIT = 40
# Sizes of corrections are in `System.unit`.
QUADRATIC = 1e-8  # a correction by a fresh tangent below this leaves an error of about its square
LEFT = 1e-13  # acceptable error where factors were kept
FLOOR = 1e-12  # corrections below this are rounding
ROUNDING = 2.0**-46  # of the distance from the origin, that corrections cannot be smaller than
SLOW = 0.1  # shrinking of the corrections by less than this asks for a new tangent
WHOLE = 30  # most iterations with whole corrections
GROWN = 30.0  # times the first correction, above which whole ones are given up
SMALLEST = 1.0 / 256.0  # part of a correction below which the step is given up
HUGE = 1e6


@kernel
def correct(system: System, before: State, now: State, R: Array, x: Array, lam: Array, part: float, T: Array) -> None:
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
def worst_component(system: System, x: Array) -> int:
    """Component with the largest (or a non-finite) correction, in `System.unit`."""
    worst = 0
    big = -1.0
    for b in range(len(system.parent)):
        for i in range(6 + system.elastic[b]):
            t = abs(x[b, i]) / system.unit[b, i]
            if not np.isfinite(t):
                return b
            if t > big:
                big = t
                worst = b
    return worst


@inlined_kernel
def _start(system: System, h: float, before: State, now: State, memory: Array) -> None:
    """The new instant as it is predicted, with the multipliers of the one before."""
    predict(system, h, before, now, memory)
    copy_rows(before.lam, now.lam)
    for joint in range(len(system.parent), len(system.rows)):
        if system.rows[joint] == 0:  # a contact that no longer holds
            for i in range(JOINT_ROWS):
                now.lam[joint, i] = 0.0


@kernel
def _copy_positions(source: State, out: State) -> None:
    """Everything of a state but its velocities."""
    copy_rows(source.c, out.c)
    copy_rows(source.q, out.q)
    copy_rows(source.u, out.u)
    copy_rows(source.turn, out.turn)
    copy_rows(source.lam, out.lam)


@kernel
def _velocities(system: System, integrator: Integrator, instants: Instants, scratch: Scratch) -> None:
    """Velocities and accelerations of the new instant from its positions."""
    if integrator.family == BACKWARD_DIFFERENCE:
        bdf2.velocities(system, integrator.h, instants, scratch.J, scratch.Vd)
    else:
        newmark.velocities(system, integrator, instants, scratch.memory, scratch.Vd)


@shared_kernel
def _linearize(
    system: System, integrator: Integrator, instants: Instants, angle: Array, rate: Array, ws: Workspace
) -> int:
    """Residual, tangent and factors at the new state; returns -1 or the component that is singular."""
    scratch, now = ws.scratch, instants.now
    if integrator.family == BACKWARD_DIFFERENCE:
        bdf2.position_to_velocity(system, integrator.h, instants, scratch.T, scratch.Wt, scratch.Hv)
    else:
        newmark.position_to_velocity(system, integrator, now, scratch.T, scratch.Hv)
    assemble(system, integrator, now, scratch.Vd, angle, rate, scratch.Hv, YES, ws.work, ws.blocks)
    bad = factor(system, ws.blocks, ws.matrix, scratch.solution.block)
    if bad < 0 and len(system.rows) > len(system.parent):
        factor_closed_chains(system, ws.matrix, scratch.border)
    return bad


@shared_kernel
def solve_correction(system: System, blocks: Blocks, matrix: StepMatrix, scratch: Scratch) -> None:
    """Newton's correction from the residual in the blocks, by the present factors, into scratch.x and scratch.lam."""
    x, lam = scratch.x, scratch.lam
    for b in range(len(system.parent)):
        for i in range(6 + system.elastic[b]):
            x[b, i] = -blocks.res[b, i]
    for j in range(len(system.rows)):
        for i in range(JOINT_ROWS):
            lam[j, i] = -blocks.gap[j, i]
    solve_with_border(system, matrix, scratch.border, x, lam, scratch.solution)


@kernel
def largest_entry(system: System, x: Array) -> float:
    """Largest entry of a correction in `System.unit`, NaN where one is not a number."""
    largest = 0.0
    for b in range(len(system.parent)):
        for i in range(6 + system.elastic[b]):
            t: float = abs(x[b, i]) / system.unit[b, i]
            if not (t <= largest):
                largest = t
                if np.isnan(t):
                    return t
    return largest


@kernel
def rounding_floor(system: System, state: State) -> float:
    """Size of corrections, in `System.unit`, that is rounding at this state."""
    far = 0.0
    for b in range(len(system.parent)):
        for i in range(3):
            far = max(far, abs(state.c[b, i]) / system.unit[b, i])
    return max(FLOOR, ROUNDING * far)


@kernel
def _correction(
    system: System, integrator: Integrator, instants: Instants, angle: Array, rate: Array, fresh: bool, ws: Workspace
) -> tuple[int, float]:
    """Newton's correction of the new state into scratch.x and scratch.lam, by a new tangent or by the present factors;
    returns -1 or the component that is singular, and the size of the correction."""
    scratch = ws.scratch
    _velocities(system, integrator, instants, scratch)
    if fresh:
        bad = _linearize(system, integrator, instants, angle, rate, ws)
        if bad >= 0:
            return bad, np.inf
    else:
        assemble(system, integrator, instants.now, scratch.Vd, angle, rate, scratch.Hv, NO, ws.work, ws.blocks)
    solve_correction(system, ws.blocks, ws.matrix, scratch)
    return -1, largest_entry(system, scratch.x)


@inlined_kernel
def _is_enough(size: float, last: float, fresh: bool, first: bool, floor: float) -> bool:
    """Whether the state is exact after a correction, by its size and that of the one before.

    The first correction by factors that are kept tells nothing: where these are those of a state whose stiff directions
    are far from rest, it takes what is left in them, and hides that the soft ones hardly move.
    """
    if fresh:
        return size < QUADRATIC
    ratio = size / last
    return size < floor or (not first and ratio * size < (1.0 - ratio) * LEFT)


@shared_kernel
def step(
    system: System, integrator: Integrator, instants: Instants, angle: Array, rate: Array, predicted: bool,
    ws: Workspace,
) -> tuple[int, int, int, int]:  # fmt: skip
    """One implicit step from two instants to the next.

    Args:
        instants: `now` is filled. Newmark's family does not read `before2`.
        angle, rate: Angle (or length) and rate of each joint's motor at the new instant, shape [J].
        predicted: Whether `now` already contains positions and multipliers to start from.
        ws: The memory of its scratch is that of `before`, and of `now` afterwards.

    Returns:
        (code, factorisations, residuals, component): CONVERGED, or the reason for the failure and its component.
    """
    scratch, before, now = ws.scratch, instants.before, instants.now
    if not predicted:
        _start(system, integrator.h, before, now, scratch.memory)
    _copy_positions(now, scratch.start)
    floor = rounding_floor(system, before)
    found, factorisations, residuals = _whole(system, integrator, instants, angle, rate, floor, ws)
    code, component = CONVERGED, -1
    if not found:
        _copy_positions(scratch.start, now)
        code, more, others, component = _safeguarded(system, integrator, instants, angle, rate, floor, ws)
        factorisations, residuals = factorisations + more, residuals + others
    if code == CONVERGED:
        _finish(system, integrator, instants, scratch)
    return code, factorisations, residuals, component


@kernel
def _whole(
    system: System, integrator: Integrator, instants: Instants, angle: Array, rate: Array, floor: float, ws: Workspace
) -> tuple[bool, int, int]:
    """Whole corrections; whether they ended, factorisations and residuals."""
    scratch = ws.scratch
    fresh = True  # whether to linearise here
    taken_fresh = True  # whether the correction taken last came from a tangent at its own state
    first, last = np.inf, np.inf  # sizes of the first correction and of the one taken last
    factorisations = 0
    for iteration in range(WHOLE):
        factorisations += fresh
        bad, size = _correction(system, integrator, instants, angle, rate, fresh, ws)
        if iteration == 0:
            first = size
        if bad >= 0 or fresh and not (size < HUGE and size <= GROWN * first):
            return False, factorisations, iteration + 1
        slow = not (size <= SLOW * last or size < floor)
        if slow and not fresh:
            fresh = True
            continue
        correct(system, instants.before, instants.now, ws.work.R, scratch.x, scratch.lam, 1.0, scratch.T)
        if _is_enough(size, last, fresh, taken_fresh, floor):
            return True, factorisations, iteration + 1
        # where new tangents converge slowly, factors that are kept would not do
        last, taken_fresh, fresh = size, fresh, slow
    return False, factorisations, WHOLE


@kernel
def _safeguarded(
    system: System, integrator: Integrator, instants: Instants, angle: Array, rate: Array, floor: float, ws: Workspace
) -> tuple[int, int, int, int]:
    """Corrections that the next one confirms; as `step` returns it."""
    scratch, before, now = ws.scratch, instants.before, instants.now
    fresh = True  # whether to linearise here
    taken_fresh = False  # whether the correction taken last came from a tangent at its own state
    part, last = 1.0, np.inf  # how much of it was taken, and its size
    factorisations = 0
    for iteration in range(LIMIT):
        factorisations += fresh
        bad, size = _correction(system, integrator, instants, angle, rate, fresh, ws)
        if bad >= 0:
            return SINGULAR, factorisations, iteration + 1, bad
        if fresh:
            if not (size < HUGE):
                return NOT_CONVERGED, factorisations, iteration + 1, worst_component(system, scratch.x)
        elif size <= (1.0 - 0.25 * part) * last or size < floor:
            if part < 1.0 or (size > SLOW * last and size > floor):
                fresh, part = True, 1.0
                continue
        else:
            # not confirmed: back to the state before it
            _copy_positions(scratch.kept, now)
            if not taken_fresh:
                fresh = True
                continue
            part *= 0.5
            if part < SMALLEST:
                return NOT_CONVERGED, factorisations, iteration + 1, worst_component(system, scratch.x)
            for b in range(len(system.parent)):
                matrix_of(now.q[b], ws.work.R[b])
            correct(system, before, now, ws.work.R, scratch.taken, scratch.taken_lam, part, scratch.T)
            continue
        _copy_positions(now, scratch.kept)
        copy_rows(scratch.x, scratch.taken)
        copy_rows(scratch.lam, scratch.taken_lam)
        correct(system, before, now, ws.work.R, scratch.x, scratch.lam, 1.0, scratch.T)
        if _is_enough(size, last, fresh, taken_fresh, floor):
            return CONVERGED, factorisations, iteration + 1, -1
        taken_fresh, last, fresh = fresh, size, False
    return NOT_CONVERGED, factorisations, LIMIT, worst_component(system, scratch.x)


@inlined_kernel
def _finish(system: System, integrator: Integrator, instants: Instants, scratch: Scratch) -> None:
    """Velocities of the converged instant, the memory of the next step, and multipliers of least norm."""
    remember_missed(system, integrator.h, instants.before, instants.now, scratch.memory)
    _velocities(system, integrator, instants, scratch)
    copy_rows(scratch.Vd, scratch.memory[0])
    copy_rows(scratch.memory[2], scratch.memory[1])
    if len(system.rows) > len(system.parent):
        least_multipliers(system, scratch.border, instants.now.lam)
