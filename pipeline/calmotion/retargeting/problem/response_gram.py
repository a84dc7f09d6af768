"""The Gauss-Newton matrix of flexible robots from their responses to all unknowns: a preconditioner for later ones.

The rigid robot's matrix knows neither the vibration that an offset leaves nor what it does where many motors move few
targets; there a system takes a hundred products. The responses to all unknowns, many at once, cost as much as some
twenty products, and their matrix serves for many iterations: it hardly changes with the curves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calmotion.multibody.parallel import in_parallel
from calmotion.multibody.sensitivity.linearization import spare_memory
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.retargeting.problem.robot import Robot
from calmotion.shot.character import Array, BoolArray, IntArray

COST = 1 / 64  # of a response, in products: half of the instants, at a sixteenth of the time of a sweep
LEAST = 24  # products: the matrix is not made for less; few robots need its kernels, which take seconds to compile
LARGE = 800  # unknowns from which the kernels are worth their compiling; of all samples, first systems need 15 or more
_BLOCK = 64  # responses at once
_LARGEST = 6000  # unknowns: the factor takes seconds
_SHARE = 0.5  # of the memory for a linearisation


def products_worth(robots: Sequence[Robot], space: OffsetSpace, first: bool = False) -> int | None:
    """Number of products of one system from which the matrix pays; None where it cannot be made, or not be stored.

    Args:
        first: Whether there is none yet. Many unknowns then need it before the first product, unless it costs more than
            the products that would be tried.
    """
    if space.size > _LARGEST or not all(robot.simulator.can_be_blocked() for robot in robots):
        return None
    # robots follow one after the other: the responses of one are in memory at a time
    rows = len(robots[0].residuals) * np.count_nonzero(_varying(robots[0]))
    if 8.0 * space.size * (rows + 3 * space.size) > _SHARE * spare_memory():
        return None
    if first and space.size >= LARGE and COST * space.size <= LEAST:
        return 0
    return max(LEAST, round(COST * space.size))


def response_gram(robots: Sequence[Robot], space: OffsetSpace) -> Array:
    """Matrix of the squared weighted residuals of all robots, linearised where they are, shape [n, n].

    Args:
        robots: Whose linearisations can be blocked.
        space: The n unknowns.
    """
    gram = np.zeros((space.size, space.size))
    for robot in robots:
        _add_products(gram, _responses(robot, space))
    return gram


@dataclass(frozen=True, eq=False)
class _Responses:
    """Changes of the weighted residuals that are not always zero, by some unknowns.

    Attributes:
        unknowns: Which.
        first: Instant before which nothing changes.
        changes: Shape [T, r, unknowns], of single precision: the matrix of products of rounded responses is as definite
            as any, and near enough for a preconditioner.
    """

    unknowns: slice
    first: int
    changes: NDArray[np.float32]

    def since(self, instant: int) -> Array:
        """The changes from an instant on, shape [n, unknowns]."""
        return self.changes[instant:].reshape(-1, self.changes.shape[2]).astype(float)


def _responses(robot: Robot, space: OffsetSpace) -> list[_Responses]:
    """The responses to all unknowns, in blocks."""
    component, jacobian = _rows(robot)
    motors, basis = len(space.motors), space.basis
    values, rates = basis.values.tocsc(), basis.rates.tocsc()
    step = max(1, _BLOCK // max(motors, 1))
    # of zeros that nobody writes, before the first instant of a block, the system holds no memory: half of all
    rows = jacobian.shape[:2]
    held = np.zeros((-(-basis.count // step), rows[0] * rows[1] * step * motors), np.float32)

    def made(k: int) -> _Responses:
        start, stop = k * step, min((k + 1) * step, basis.count)
        curves = values[:, start:stop].toarray(), rates[:, start:stop].toarray()
        first, found = robot.simulator.responses(*curves, space.coupling, component, jacobian)
        changes = held[k, : rows[0] * rows[1] * found.shape[2]].reshape(*rows, -1)
        changes[first:] = found
        return _Responses(slice(start * motors, stop * motors), first, changes)

    return in_parallel(made, range(len(held)))


def _add_products(gram: Array, blocks: Sequence[_Responses]) -> None:
    """Add the products of all responses with each other to a matrix."""

    def add(k: int) -> None:
        one = blocks[k]
        own = one.since(one.first)
        for other in blocks[: k + 1]:
            others = other.since(max(one.first, other.first))
            product = own[len(own) - len(others) :].T @ others
            gram[one.unknowns, other.unknowns] += product
            if other is not one:
                gram[other.unknowns, one.unknowns] += product.T

    in_parallel(add, range(len(blocks)))


def _rows(robot: Robot) -> tuple[IntArray, Array]:
    """The component and the derivatives of each residual that is not always zero, shapes [r] and [T, r, N]."""
    jacobian = robot.jacobian
    target, row = np.nonzero(_varying(robot))
    component = np.asarray(robot.model.targets.component)[target].astype(np.int32)
    return component, np.ascontiguousarray(jacobian[:, target, row])


def _varying(robot: Robot) -> BoolArray:
    """Which weighted residuals depend on the motion at any instant, shape [K, 6]."""
    return np.asarray(np.any(robot.jacobian, axis=(0, 3)))
