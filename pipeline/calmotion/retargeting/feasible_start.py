"""Curves within the limits of the curves themselves, close to others: where a search under limits begins.

These limits are linear in the coefficients of the offsets, and so is the rigid robot's error at its targets at first
order: the nearest curves within the limits are the minimum of a quadratic program. Where locked intervals or kept ends
leave no such curves, the limits are widened to what is exceeded least, so that the search has something to keep.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.sparse import csr_matrix, diags, eye, kron, vstack

from calmotion.arrays import Array, BoolArray
from calmotion.model.limits.base import CurveLimit
from calmotion.model.limits.bounds import Bounds
from calmotion.model.limits.kinds import kinds_of_limits
from calmotion.retargeting.problem.adaptive_knots import converted, halved
from calmotion.retargeting.problem.limits import MARGIN
from calmotion.retargeting.problem.offset_basis import OffsetBasis, basis_on
from calmotion.retargeting.problem.problem import Evaluation, RetargetProblem
from calmotion.retargeting.solver.elastic_program import elastic_minimum
from calmotion.simulation.inputs.curves import Curves

INSIDE = 1.5 * MARGIN  # share of a limit by which the curves stay within it
COST = 1e4  # of an excess of a limit by itself, over the objective of an offset of 1 rad for a second
WIDENED = 1e-3  # smallest excess that counts as unavoidable


def with_moving_end(at: Evaluation, start: Array) -> tuple[RetargetProblem, Array]:
    """The problem and its start with offsets whose slope and curvature may change at the end of the shot, where a point
    exceeds limits there; else as they are."""
    problem = at.problem
    limits, grid, basis = problem.limits, problem.grid, problem.space.basis
    if limits is None or basis.wraps or basis.kept_ends:
        return problem, start
    late = limits.judged & (grid.times >= basis.knots[-3 if len(basis.knots) > 2 else 0])
    over = [np.max(_excess(limits.bounds[name], v[late]), initial=0.0) for name, v in at.limited.items()]
    if max(over, default=0.0) <= MARGIN:
        return problem, start
    moving = basis_on(grid, basis.breaks, basis.kept_ends, moving_end=True)
    x = converted(basis, moving, start, len(problem.space.motors))
    return problem.on_basis(moving), x


def on_sufficient_knots(
    problem: RetargetProblem, start: Array, fixed_on: Callable[[OffsetBasis], BoolArray]
) -> tuple[RetargetProblem, Array]:
    """The problem and its start on knots close enough for offsets that keep the limits of the curves, where there are
    such offsets at all: corners of higher derivatives stand where knots are.

    Args:
        fixed_on: Maps a basis to its coefficients that stay zero, shape [n], bool.
    """
    while _unavoidable(problem, fixed_on(problem.space.basis)):
        space, grid = problem.space, problem.grid
        finer = space.basis.on(grid, halved(grid, space.basis.breaks))
        if finer.count == space.basis.count:
            break
        start = converted(space.basis, finer, start, len(space.motors))
        problem = problem.on_basis(finer)
    return problem, start


def with_possible_limits(problem: RetargetProblem, fixed: BoolArray) -> RetargetProblem:
    """The problem with limits that no offsets can keep widened to what is exceeded least.

    Args:
        fixed: Coefficients that stay zero, shape [n], bool.
    """
    limits, excess = problem.limits, _unavoidable(problem, fixed)
    if limits is None or not excess:
        return problem
    wider = {name: _widened(limits.bounds[name], by) for name, by in excess.items()}
    return replace(problem, limits=replace(limits, bounds=limits.bounds | wider))


def _unavoidable(problem: RetargetProblem, fixed: BoolArray) -> dict[str, Array]:
    """What the nearest curves exceed limits by that these exceed, as shares of the scale, shape [M] each."""
    limits = problem.limits
    if limits is None or not np.any(_exceeding(problem, problem.curves)):
        return {}
    x = _nearest(problem, np.zeros(problem.size), fixed)[0]
    nearest = problem.space.changed(problem.curves, x)
    found = {name: _excess(b, _values(nearest, name)[limits.judged]) for name, b in _bounds(problem).items()}
    return {name: excess for name, excess in found.items() if np.any(excess > WIDENED)}


def onto_limits(at: Evaluation, fixed: BoolArray) -> tuple[RetargetProblem, Array]:
    """The nearest point whose curves keep the limits, and the problem with the multipliers of the way there; the same
    ones where they do already.

    Args:
        at: A minimum without limits.
        fixed: Coefficients that keep their values, shape [n], bool.
    """
    problem, limits, x = at.problem, at.problem.limits, at.x
    if limits is None or not np.any(_exceeding(problem, at.curves)):
        return problem, x
    moved, required, found = _nearest(problem, x, fixed)
    # the robot may have almost no error without limits, so that their penalty follows from the error that they require
    rho = max(limits.rho, limits.penalty_beside(required))
    multipliers = {name: y.copy() for name, y in limits.multipliers.items()}
    for (name, motor, side), values in found.items():
        multipliers[name][side, limits.judged, motor] = values / (rho * limits.h)
    return replace(problem, limits=replace(limits, rho=rho, multipliers=multipliers)), moved


def _bounds(problem: RetargetProblem) -> dict[str, Bounds]:
    """The limits of the curves themselves."""
    assert problem.limits is not None
    return {name: bound for name, bound in problem.limits.bounds.items() if name in problem.space.splines}


def _exceeding(problem: RetargetProblem, curves: Curves) -> BoolArray:
    """Motors whose curves exceed their limits, shape [M]."""
    assert problem.limits is not None
    exceeding = np.zeros(len(problem.space.coupling), bool)
    for name, bound in _bounds(problem).items():
        exceeding |= _excess(bound, _values(curves, name)[problem.limits.judged]) > MARGIN
    return exceeding


def _nearest(
    problem: RetargetProblem, x: Array, fixed: BoolArray
) -> tuple[Array, float, dict[tuple[str, int, int], Array]]:
    """The point within the limits to which the rigid robot's targets move least from x, the error of the way there, and
    the multipliers of the limits by quantity, motor and side."""
    space, curves = problem.space, problem.space.changed(problem.curves, x)
    # only motors whose limits are exceeded move, and what is geared to them
    turned = np.any(space.coupling[_exceeding(problem, curves)] != 0.0, axis=0)
    free = ~fixed & np.tile(turned, space.basis.count)
    if not np.any(free):
        return x, 0.0, {}
    moved = np.flatnonzero(np.any(space.coupling[:, turned] != 0.0, axis=1))
    sides = [
        (name, int(motor), side)
        for name, bound in _bounds(problem).items()
        for motor in moved
        for side in (0, 1)
        if np.isfinite((bound.upper, bound.lower)[side][motor])
    ]
    parts = [_constraint(problem, curves, *side) for side in sides]
    H = csr_matrix(_metric(problem)[free][:, free])
    scale = float(np.mean(H.diagonal()))
    H = csr_matrix(H + 1e-9 * scale * eye(H.shape[0]))
    G, room = csr_matrix(vstack([rows for rows, _ in parts]))[:, free], np.concatenate([room for _, room in parts])
    solved = elastic_minimum(H, np.zeros(H.shape[0]), G, room, COST * scale)
    found = x.copy()
    found[free] += solved.x
    multipliers = dict(zip(sides, np.split(solved.multipliers, len(sides)), strict=True))
    return found, 0.5 * float(solved.x @ (H @ solved.x)), multipliers


def _values(curves: Curves, name: str) -> Array:
    kind = kinds_of_limits()[name]
    assert isinstance(kind, CurveLimit)
    return curves.derivatives[kind.order]


def _excess(bound: Bounds, values: Array) -> Array:
    """Largest excess of each motor, as a share of the scale, shape [M]."""
    beyond = np.maximum(values - bound.upper, bound.lower - values) / bound.scale
    return np.asarray(np.max(beyond, axis=0))


def _widened(bound: Bounds, excess: Array) -> Bounds:
    by = np.where(excess > WIDENED, 1.01 * excess, 0.0) * bound.scale
    return replace(bound, lower=bound.lower - by, upper=bound.upper + by)


def _constraint(problem: RetargetProblem, curves: Curves, name: str, motor: int, side: int) -> tuple[csr_matrix, Array]:
    """`rows x <= room` at all judged instants for the upper (0) or lower side of one limit, as shares of its scale."""
    space, limits = problem.space, problem.limits
    assert limits is not None
    bound, sign = limits.bounds[name], -1.0 if side else 1.0
    spline, values = space.splines[name][limits.judged], _values(curves, name)[limits.judged, motor]
    rows = kron(spline, csr_matrix(space.coupling[motor : motor + 1]))
    room = sign * ((bound.lower if side else bound.upper)[motor] - values) / bound.scale[motor] - INSIDE
    return csr_matrix(sign / bound.scale[motor] * rows), room


def _metric(problem: RetargetProblem) -> csr_matrix:
    """Second derivatives of the rigid robot's objective by the coefficients, shape [n, n]."""
    space = problem.space
    gram = problem.rigid.metric(problem.objective.weights)
    spline, motors = space.basis.values, gram.shape[1]
    parts = [
        kron(spline.T @ diags(gram[:, a, b]) @ spline, csr_matrix(([1.0], ([a], [b])), shape=(motors, motors)))
        for a in range(motors)
        for b in range(motors)
        if np.any(gram[:, a, b])
    ]
    regularized = kron(space.penalty, eye(motors))
    return csr_matrix(sum(parts, start=csr_matrix(regularized)))
