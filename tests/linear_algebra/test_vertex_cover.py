"""Fewest nodes that touch all edges across a cut."""

from itertools import combinations

import numpy as np
import pytest
from calmotion.linear_algebra.vertex_cover import vertex_cover
from scipy.sparse import csr_matrix


def random_cut(rng, left, right, edges):
    i, j = rng.integers(left, size=edges), left + rng.integers(right, size=edges)
    n = left + right
    graph = csr_matrix((np.ones(2 * edges), (np.concatenate([i, j]), np.concatenate([j, i]))), shape=(n, n))
    order = rng.permutation(n)
    return graph[order][:, order].tocsr(), (np.arange(n) < left)[order]


def edges_across(graph, left):
    i, j = graph.nonzero()
    keep = left[i] & ~left[j]
    return set(zip(i[keep].tolist(), j[keep].tolist(), strict=True))


@pytest.mark.parametrize("seed", range(12))
def test_it_touches_every_edge_and_no_smaller_set_does(seed):
    rng = np.random.default_rng(seed)
    graph, left = random_cut(rng, *rng.integers(2, 8, size=2), edges=int(rng.integers(1, 16)))
    edges = edges_across(graph, left)
    cover = vertex_cover(graph, left).tolist()
    assert len(set(cover)) == len(cover)
    assert all(i in cover or j in cover for i, j in edges)
    nodes = sorted({i for edge in edges for i in edge})
    for smaller in combinations(nodes, len(cover) - 1):
        assert not all(i in smaller or j in smaller for i, j in edges)


def test_a_large_cut_has_a_cover_as_small_as_the_largest_matching():
    from networkx import Graph
    from networkx.algorithms.bipartite import hopcroft_karp_matching

    graph, left = random_cut(np.random.default_rng(7), 700, 500, 1200)
    edges = edges_across(graph, left)
    cover = set(vertex_cover(graph, left).tolist())
    assert all(i in cover or j in cover for i, j in edges)
    both = Graph(edges)
    matching = hopcroft_karp_matching(both, [i for i in both if left[i]])
    assert len(cover) == len(matching) // 2


def test_a_graph_without_edges_across_needs_no_separator():
    assert len(vertex_cover(csr_matrix((4, 4)), np.array([True, True, False, False]))) == 0
