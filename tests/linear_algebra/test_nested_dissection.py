"""Nested dissection."""

import numpy as np
import pytest
from calmotion.linear_algebra.nested_dissection import dissect
from scipy.sparse import block_diag, csr_matrix, identity
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree


def grid_graph(*counts):
    """Neighbours in a box of points, diagonals included, and the points."""
    points = np.stack(np.meshgrid(*(np.arange(c) for c in counts), indexing="ij"), axis=-1).reshape(-1, len(counts))
    pairs = cKDTree(points).query_pairs(1.01 * np.sqrt(len(counts)), output_type="ndarray")
    i, j = np.concatenate([pairs, pairs[:, ::-1]]).T
    return csr_matrix((np.ones(len(i)), (i, j)), shape=(len(points), len(points))), points.astype(float)


def random_graph(n, degree, seed=0):
    rng = np.random.default_rng(seed)
    i, j = rng.integers(n, size=(2, degree * n))
    return csr_matrix((np.ones(2 * len(i)), (np.concatenate([i, j]), np.concatenate([j, i]))), shape=(n, n))


def star(n):
    i = np.arange(1, n)
    zero = np.zeros(n - 1, dtype=int)
    return csr_matrix((np.ones(2 * n - 2), (np.concatenate([zero, i]), np.concatenate([i, zero]))), shape=(n, n))


GRAPHS = {
    "plane": lambda: grid_graph(40, 30),
    "box": lambda: grid_graph(12, 11, 10),
    "plane by distances": lambda: (grid_graph(40, 30)[0], None),
    "parts": lambda: (block_diag([grid_graph(15, 15)[0]] * 3, format="csr"), None),
    "expander": lambda: (random_graph(400, 4), None),
    "star": lambda: (star(500), None),
    "no edges": lambda: (csr_matrix((200, 200)), None),
    "points that coincide": lambda: (grid_graph(20, 20)[0], np.zeros((400, 3))),
    "one": lambda: (csr_matrix((1, 1)), None),
    "none": lambda: (csr_matrix((0, 0)), None),
}


@pytest.mark.parametrize("name", GRAPHS)
def test_every_node_is_in_one_piece_and_neighbours_are_above_each_other(name):
    graph, points = GRAPHS[name]()
    cut = dissect(graph, points)
    n = graph.shape[0]
    assert sorted(cut.order) == list(range(n))
    count = len(cut.parent)
    piece = np.empty(n, dtype=int)
    for k in range(count):
        piece[cut.order[cut.start[k] : cut.start[k + 1]]] = k
    assert cut.start[-1] == n and (np.diff(cut.start) > 0).all()
    assert all(parent == -1 or parent > k for k, parent in enumerate(cut.parent))
    above = np.eye(count, dtype=bool)
    for k in range(count - 1, -1, -1):
        if cut.parent[k] >= 0:
            above[k] |= above[cut.parent[k]]
    i, j = graph.nonzero()
    assert (above[piece[i], piece[j]] | above[piece[j], piece[i]]).all()


def test_children_come_right_before_their_parents():
    """Pieces below a piece fill the places before it without a gap: their results can be kept on a stack."""
    cut = dissect(*grid_graph(40, 30))
    size = np.ones(len(cut.parent), dtype=int)
    for k, parent in enumerate(cut.parent):
        if parent >= 0:
            size[parent] += size[k]
    for k, parent in enumerate(cut.parent):
        if parent >= 0:
            assert parent - size[parent] < k - size[k] + 1 <= k < parent


def fill(graph, cut):
    """Entries of the factor, counted by elimination of a dense pattern."""
    A = (graph[cut.order][:, cut.order].toarray() != 0) | np.eye(graph.shape[0], dtype=bool)
    for k in range(len(A)):
        later = np.flatnonzero(A[k + 1 :, k]) + k + 1
        A[np.ix_(later, later)] = True
    return int(np.tril(A).sum())


@pytest.mark.parametrize("with_points", [True, False])
def test_fill_is_far_less_than_without_and_close_to_that_of_minimum_degree(with_points):
    graph, points = grid_graph(28, 28)
    cut = dissect(graph, points if with_points else None)
    n = graph.shape[0]
    plain = fill(graph, type(cut)(np.arange(n), np.array([0, n]), np.array([-1])))
    degree = splu(
        (graph * -1.0 + 50.0 * identity(n)).tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}
    ).L.nnz
    assert fill(graph, cut) < 0.8 * plain
    assert fill(graph, cut) < 1.5 * degree


@pytest.mark.parametrize("counts", [(24, 24), (9, 9, 9)])
def test_the_order_does_not_depend_on_rounding(counts):
    """The principal axes of a square or a cube are any: the last digits of the points must not choose them."""
    graph, points = grid_graph(*counts)
    order = dissect(graph, points).order
    for seed in range(3):
        noise = 1e-14 * np.random.default_rng(seed).normal(size=points.shape)
        assert np.array_equal(dissect(graph, points + noise).order, order)


@pytest.mark.parametrize(("with_points", "entries"), [(True, 16515), (False, 17574)])
def test_fill_in_is_known_to_the_entry(with_points, entries):
    """A cover does not depend on which of the largest matchings is found."""
    graph, points = grid_graph(28, 28)
    assert fill(graph, dissect(graph, points if with_points else None)) == entries
