"""The sections of a body: bands of cells that are as far from the root, way measured inside the body.

A band that falls into several parts has several sections: branches, the cheeks of a fork, both sides of a window. Their
centers are the nodes of a frame, whose beams join sections of neighbouring bands that touch.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from calmotion.arrays import Array, BoolArray, Indices
from calmotion.reduction.sections.cells import Cells

_BANDS, _CELLS = 40, 2.0  # bands of the way to the farthest cell, and least width of one in cells
_WAY = 0.95  # of a way along a grid, that is straight on the average
_FEW = 8  # cells of a part that is no section of its own


@dataclass(frozen=True, eq=False)
class Bands:
    """The sections of a body, the cells that are held as the first one.

    Attributes:
        section: That of each cell, shape [n].
        width: Along the way, of each section [m], shape [s].
        pairs: Sections that touch, shape [p, 2].
        directions: From the first to the second of each pair, by the cells that touch: unit vectors, or zero where they
            face all ways, shape [p, 3].
        touch: Where the two of a pair touch [m], shape [p, 3].
    """

    section: Indices
    width: Array
    pairs: Indices
    directions: Array
    touch: Array


def bands_of(cells: Cells, root: BoolArray) -> Bands:
    """The sections of a body.

    Args:
        root: Cells that are held, at least one, shape [n].
    """
    first, second, length = _neighbours(cells)
    first, second, length = _joined(cells, first, second, length)
    graph = _graph(len(root), first, second, length)
    starts = np.flatnonzero(root)
    way = _WAY * dijkstra(graph, directed=False, indices=starts, min_only=True)
    width = max(float(way.max()) / _BANDS, _CELLS * cells.side, _WAY * float(cells.sides.max()))
    band = np.floor(way / width).astype(int) + 1
    band[root] = 0
    section = _parts(band, first, second)
    section = _without_scraps(section, root, first, second)
    across = section[first] != section[second]
    return _bands(cells, section, way, width, first[across], second[across])


def _neighbours(cells: Cells) -> tuple[Indices, Indices, Array]:
    """Pairs of neighbouring cells, those across edges and corners as well, and their distances [m]."""
    counts = cells.grid.max(axis=0) + 3
    number = np.full(tuple(counts), -1)
    at = cells.grid + 1
    number[tuple(at.T)] = np.arange(len(at))
    steps = [s for s in np.ndindex(3, 3, 3) if s > (1, 1, 1)]
    first, second, length = [], [], []
    for step in steps:
        move = np.array(step) - 1
        other = number[tuple((at + move).T)]
        found = np.flatnonzero(other >= 0)
        first.append(found)
        second.append(other[found])
        length.append(np.full(len(found), float(np.linalg.norm(move * cells.sides))))
    return np.concatenate(first), np.concatenate(second), np.concatenate(length)


def _graph(count: int, first: Indices, second: Indices, length: Array) -> object:
    return coo_matrix((length, (first, second)), shape=(count, count)).tocsr()


def _joined(cells: Cells, first: Indices, second: Indices, length: Array) -> tuple[Indices, Indices, Array]:
    """The pairs, with those that join loose parts to the largest one, where they are nearest."""
    count, label = connected_components(_graph(len(cells.places), first, second, length), directed=False)
    if count == 1:
        return first, second, length
    sizes = np.bincount(label)
    main = label == int(sizes.argmax())
    for part in np.argsort(-sizes)[1:]:
        own = np.flatnonzero(label == part)
        rest = np.flatnonzero(main)
        away, nearest = cKDTree(cells.places[rest]).query(cells.places[own])
        near = away <= 1.2 * away.min() + float(cells.sides.max())
        first = np.concatenate([first, own[near]])
        second = np.concatenate([second, rest[nearest[near]]])
        length = np.concatenate([length, away[near]])
        main[own] = True
    return first, second, length


def _parts(band: Indices, first: Indices, second: Indices) -> Indices:
    """Number of the connected part of its band to which each cell belongs, the held cells one, number 0."""
    same = (band[first] == band[second]) & (band[first] > 0)
    held = np.flatnonzero(band == 0)
    a = np.concatenate([first[same], held[:-1]])
    b = np.concatenate([second[same], held[1:]])
    label = connected_components(_graph(len(band), a, b, np.ones(len(a))), directed=False)[1]
    zero = label[held[0]]
    return np.where(label == zero, 0, np.where(label < zero, label + 1, label))


def _without_scraps(section: Indices, root: BoolArray, first: Indices, second: Indices) -> Indices:
    """The sections, those of few cells merged into the neighbour that they touch most."""
    for _ in range(3):
        sizes = np.bincount(section)
        small = (sizes < _FEW) & (np.arange(len(sizes)) > 0)
        across = section[first] != section[second]
        a = np.concatenate([section[first][across], section[second][across]])
        b = np.concatenate([section[second][across], section[first][across]])
        use = small[a] & ~small[b] & (b > 0)
        if not use.any():
            break
        keys, counts = np.unique(a[use] * len(sizes) + b[use], return_counts=True)
        touching = np.stack(np.divmod(keys, len(sizes)), axis=1)
        into = np.arange(len(sizes))
        for part, other in touching[np.argsort(counts, kind="stable")]:  # the last one is that which it touches most
            into[part] = other
        section = into[section]
    return np.unique(section, return_inverse=True)[1]


def _bands(cells: Cells, section: Indices, way: Array, width: float, first: Indices, second: Indices) -> Bands:
    count = int(section.max()) + 1
    low, high = np.full(count, np.inf), np.zeros(count)
    np.minimum.at(low, section, way)
    np.maximum.at(high, section, way)
    turned = section[first] > section[second]
    first, second = np.where(turned, second, first), np.where(turned, first, second)
    keys, which = np.unique(section[first] * count + section[second], return_inverse=True)
    pairs = np.stack(np.divmod(keys, count), axis=1)
    moves, touch, counts = np.zeros((len(pairs), 3)), np.zeros((len(pairs), 3)), np.bincount(which)
    np.add.at(moves, which, cells.places[second] - cells.places[first])
    np.add.at(touch, which, 0.5 * (cells.places[first] + cells.places[second]))
    size = np.linalg.norm(moves, axis=1, keepdims=True)
    directions = np.where(size > 1e-9 * counts[:, None], moves / np.maximum(size, np.finfo(float).tiny), 0.0)
    # a whole band is as wide as the bands are, whatever the centers of its cells span
    widths = np.clip(high - low + cells.side, cells.side, width)
    return Bands(section, widths, pairs, directions, touch / counts[:, None])
