"""The Gauss-Newton matrix of flexible robots from their responses to all unknowns: a preconditioner for later ones.

The rigid robot's matrix knows neither the vibration that an offset leaves nor what it does where many motors move few
targets; there a system takes a hundred products. The responses to all unknowns, many at once, cost as much as some
twenty products, and their matrix serves for many iterations: it hardly changes with the curves.

Of a long shot the matrix of all unknowns with all others would be too large. What an unknown changes dies away, so its
response is followed for some seconds alone, and the matrix of these has a band of entries.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.multibody.parallel import in_parallel
from calmotion.multibody.sensitivity.linearization import spare_memory
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.retargeting.problem.robot import LinearRobot
from calmotion.retargeting.solver.dense_preconditioner import DensePreconditioner
from calmotion.retargeting.solver.preconditioner import Preconditioner, banded_preconditioner

RESPONSE_COST = 1 / 64  # of a response, in products: half of the instants, at a sixteenth of the time of a sweep
OF_PART = 1 / 22  # the same of one that is followed for a part of the shot, over that part
LASTING = 8.0  # for which responses of long shots are followed [s]: over 40 s, 14 products; with 4 s more than 60
LEAST_PRODUCTS = 24  # the matrix is not made for less; few robots need its kernels, which take seconds to compile
MANY_UNKNOWNS = 800  # from which the kernels are worth their compiling; of all samples, first systems need 15 or more
_BLOCK = 64  # responses at once
_TOGETHER = 8  # blocks that are worked out before their products
DENSE_UNKNOWNS = 6000  # unknowns up to which responses are followed to the end: the factor takes seconds
_OPERATIONS = 7e10  # of the factor of a matrix with bands: as many as with the most unknowns without
SHARE_OF_MEMORY = 0.5  # of the memory for a linearisation


def products_worth(robots: Sequence[LinearRobot], space: OffsetSpace, first: bool = False) -> int | None:
    """Number of products of one system from which the matrix pays; None where it cannot be made, or not be stored.

    Args:
        first: Whether there is none yet. Many unknowns then need it before the first product, unless it costs more than
            the products that would be tried.
    """
    if not all(robot.linear.can_be_blocked() for robot in robots):
        return None
    if is_whole(robots, space):
        cost = RESPONSE_COST * space.size
        at_once = first and space.size >= MANY_UNKNOWNS and cost <= LEAST_PRODUCTS
        return 0 if at_once else max(LEAST_PRODUCTS, round(cost))
    instants, lasting = len(robots[0].at.errors), _lasting(robots[0])
    bands = _bandwidth(space, lasting)
    slow = space.size * bands**2 > _OPERATIONS
    if 2 * lasting > instants or slow or 24.0 * space.size * bands > SHARE_OF_MEMORY * spare_memory():
        return None
    # without it each system of a long shot takes as many products as it may
    return 0 if first else max(LEAST_PRODUCTS, round(OF_PART * space.size * lasting / instants))


def response_preconditioner(robots: Sequence[LinearRobot], space: OffsetSpace) -> Preconditioner:
    """The preconditioner from the responses, with all entries of their matrix or with bands of them."""
    basis = space.basis
    if is_whole(robots, space):
        return DensePreconditioner(response_gram(robots, space), space.penalty, basis.wraps)
    return banded_preconditioner(response_bands(robots, space), basis, space.penalty)


def is_whole(robots: Sequence[LinearRobot], space: OffsetSpace) -> bool:
    """Whether the matrix may hold the entries of all unknowns with all others."""
    # robots follow one after the other: the responses of one are in memory at a time
    rows = len(robots[0].at.errors) * np.count_nonzero(_varying(robots[0]))
    size = 8.0 * space.size * (rows + 3 * space.size)
    return space.size <= DENSE_UNKNOWNS and bool(size <= SHARE_OF_MEMORY * spare_memory())


def response_gram(robots: Sequence[LinearRobot], space: OffsetSpace) -> Array:
    """Matrix of the squared weighted residuals of all robots, linearised where they are, shape [n, n].

    Args:
        robots: Whose linearisations can be blocked.
    """
    gram = np.zeros((space.size, space.size))
    for robot in robots:
        _add_products(gram, _responses(robot, space))
    return gram


def dense_responses(
    robot: LinearRobot, space: OffsetSpace, instants: IntArray, motors: Sequence[int] = ()
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Changes by the unknowns of the weighted residuals at some instants, shape [t, K, 6, n], and of the efforts of
    some motors at all instants, shape [T, e, n]."""
    places = _varying(robot)
    count = np.count_nonzero(places)
    changes = np.zeros((len(instants), *places.shape, space.size), np.float32)
    efforts = np.zeros((len(robot.at.errors), len(motors), space.size), np.float32)
    for part in _responses(robot, space, motors):
        after = np.flatnonzero(instants >= part.first)
        begun = np.zeros((len(after), *places.shape, part.changes.shape[2]), np.float32)
        begun[:, places] = part.changes[instants[after] - part.first, :count]
        changes[after[:, None], :, :, np.arange(part.unknowns.start, part.unknowns.stop)] = np.moveaxis(begun, 3, 1)
        efforts[part.first :, :, part.unknowns] = part.changes[:, count:]
    return changes, efforts


def response_bands(robots: Sequence[LinearRobot], space: OffsetSpace, lasting: int | None = None) -> Array:
    """The same where each response ends some time after its unknown has acted, as lower bands, shape [bands, n].

    It is as definite as the whole matrix, since it is that of changes, although these are cut.

    Args:
        robots, space: As of `response_gram`.
        lasting: Instants for which responses are followed; None: for `LASTING`.
    """
    lasting = lasting or _lasting(robots[0])
    bands = np.zeros((_bandwidth(space, lasting), space.size))
    for robot in robots:
        _add_bands(bands, robot, space, lasting)
    return bands


def _lasting(robot: LinearRobot) -> int:
    """Instants for which responses of long shots are followed."""
    return round(LASTING / robot.linear.h)


def _spans(space: OffsetSpace, lasting: int) -> tuple[IntArray, IntArray]:
    """First instant at which each function acts, and the one after the last to which its response is followed."""
    values = space.basis.values.tocsc()
    starts, last = values.indices[values.indptr[:-1]], values.indices[values.indptr[1:] - 1]
    return starts, np.minimum(last + 1 + lasting, values.shape[0])


def _bandwidth(space: OffsetSpace, lasting: int) -> int:
    """Number of bands of the unknowns whose responses overlap; those of a block end together."""
    starts, ends = _spans(space, lasting)
    step = _step(space)
    apart = 0
    for k in range(0, len(starts), step):
        apart = max(apart, int(np.searchsorted(starts, ends[k : k + step].max())) - k)
    return min(apart, len(starts)) * len(space.motors)


def _step(space: OffsetSpace) -> int:
    """Functions of a block."""
    return max(1, _BLOCK // max(len(space.motors), 1))


@dataclass(frozen=True, eq=False)
class _Responses:
    """Changes of the weighted residuals that are not always zero, by some unknowns.

    Attributes:
        unknowns: Which.
        first: Instant before which nothing changes.
        changes: From there on, shape [n, r, unknowns], of single precision: the matrix of products of rounded responses
            is as definite as any, and near enough for a preconditioner.
    """

    unknowns: slice
    first: int
    changes: NDArray[np.float32]

    @property
    def end(self) -> int:
        """The instant after the last at which the changes are known."""
        return self.first + len(self.changes)

    def between(self, begin: int, end: int) -> Array:
        """The changes from an instant to before another one, shape [(end - begin) r, unknowns]; none before `first`."""
        part = self.changes[begin - self.first : max(begin, end) - self.first]
        return part.reshape(-1, self.changes.shape[2]).astype(float)


def _responses(robot: LinearRobot, space: OffsetSpace, efforts: Sequence[int] = ()) -> list[_Responses]:
    """The responses to all unknowns, in blocks; with those of the efforts of some motors."""
    component, jacobian = _rows(robot)
    motors, basis = len(space.motors), space.basis
    values, rates = basis.values.tocsc(), basis.rates.tocsc()
    step = _step(space)
    # of zeros that nobody writes, before the first instant of a block, the system holds no memory: half of all
    rows = len(jacobian), len(component) + len(efforts)
    held = np.zeros((-(-basis.count // step), rows[0] * rows[1] * step * motors), np.float32)

    def made(k: int) -> _Responses:
        start, stop = k * step, min((k + 1) * step, basis.count)
        curves = values[:, start:stop].toarray(), rates[:, start:stop].toarray()
        first, found = robot.linear.responses(*curves, 0, space.coupling, component, jacobian, efforts)
        changes = held[k, : rows[0] * rows[1] * found.shape[2]].reshape(*rows, -1)[first:]
        changes[:] = found
        return _Responses(slice(start * motors, stop * motors), first, changes)

    return in_parallel(made, range(len(held)))


def _add_products(gram: Array, blocks: Sequence[_Responses]) -> None:
    """Add the products of all responses with each other to a matrix."""

    def add(k: int) -> None:
        one = blocks[k]
        for other in blocks[: k + 1]:
            both = max(one.first, other.first), one.end
            product = one.between(*both).T @ other.between(*both)
            gram[one.unknowns, other.unknowns] += product
            if other is not one:
                gram[other.unknowns, one.unknowns] += product.T

    in_parallel(add, range(len(blocks)))


def _add_bands(bands: Array, robot: LinearRobot, space: OffsetSpace, lasting: int) -> None:
    """Add the products of responses that are followed for a time with each other to lower bands.

    A few blocks are worked on at once, and blocks that have ended are forgotten: memory does not grow with the shot.
    """
    component, jacobian = _rows(robot)
    motors, basis, step = len(space.motors), space.basis, _step(space)
    values, rates = basis.values.tocsc(), basis.rates.tocsc()
    starts, ends = _spans(space, lasting)

    def made(start: int) -> _Responses:
        stop = min(start + step, basis.count)
        begin, end = max(0, int(starts[start:stop].min()) - 1), int(ends[start:stop].max())
        curves = tuple(part[:, start:stop][begin:end].toarray() for part in (values, rates))
        first, found = robot.linear.responses(curves[0], curves[1], begin, space.coupling, component, jacobian)
        return _Responses(slice(start * motors, stop * motors), first, found.astype(np.float32))

    def add(pair: tuple[_Responses, _Responses]) -> None:
        earlier, later = pair
        begin, end = max(earlier.first, later.first), min(earlier.end, later.end)
        product = later.between(begin, end).T @ earlier.between(begin, end)
        rows, columns = (np.arange(part.unknowns.start, part.unknowns.stop) for part in (later, earlier))
        apart, at = np.broadcast_arrays(rows[:, None] - columns, columns)
        lower = (apart >= 0) & (apart < len(bands))  # beyond, a response ends before the other begins
        bands[apart[lower], at[lower]] += product[lower]

    active: list[_Responses] = []
    blocks = range(0, basis.count, step)
    for k in range(0, len(blocks), _TOGETHER):
        new = in_parallel(made, blocks[k : k + _TOGETHER])
        active = [*(part for part in active if part.end > new[0].first), *new]
        in_parallel(add, [(one, part) for part in new for one in active if one.unknowns.start <= part.unknowns.start])


def _rows(robot: LinearRobot) -> tuple[IntArray, Array]:
    """The component and the derivatives of each residual that is not always zero, shapes [r] and [T, r, N]."""
    jacobian = robot.errors.jacobian
    target, row = np.nonzero(_varying(robot))
    component = np.asarray(robot.linear.model.targets.component)[target].astype(np.int32)
    return component, np.ascontiguousarray(jacobian[:, target, row])


def _varying(robot: LinearRobot) -> BoolArray:
    """Which weighted residuals depend on the motion at any instant, shape [K, 6]."""
    return np.asarray(np.any(robot.errors.jacobian, axis=(0, 3)))
