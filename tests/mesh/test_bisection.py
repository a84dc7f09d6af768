"""Bisected tetrahedra: the same solid, conforming, smaller where marked."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.mesh.bisection import bisected
from calmotion.mesh.tetrahedra import boundary_triangles, min_dihedral_deg, surface_area, tet_volumes


@pytest.mark.parametrize("seed", [0, 1])
def test_the_solid_stays_and_marked_tetrahedra_become_smaller(helpers, seed):
    points, tets = helpers.box((6, 2, 2), (0.3, 0.1, 0.1))
    points, tets = np.asarray(points, dtype=float), np.asarray(tets)
    marked = np.random.default_rng(seed).choice(len(tets), 10, replace=False)
    new, split, parents = bisected(points, tets, marked)
    assert np.array_equal(new[: len(points)], points) and len(split) > len(tets)
    volumes = tet_volumes(new, split)
    assert (volumes > 0.0).all() and volumes.sum() == pytest.approx(0.3 * 0.1 * 0.1)
    assert np.bincount(parents, volumes) == pytest.approx(tet_volumes(points, tets)), "parts fill what they are part of"
    # hanging nodes would make inner faces count as boundary
    assert surface_area(new, boundary_triangles(split)) == pytest.approx(2 * (2 * 0.3 * 0.1 + 0.1 * 0.1))
    kept = {tuple(sorted(tet)) for tet in split.tolist()}
    assert not any(tuple(sorted(tets[k].tolist())) in kept for k in marked)


def test_repeated_bisection_at_one_place_keeps_angles(helpers):
    points, tets = helpers.box((4, 2, 2), (0.2, 0.1, 0.1))
    points, tets = np.asarray(points, dtype=float), np.asarray(tets)
    before = min_dihedral_deg(points, tets)
    for _ in range(6):
        near = np.linalg.norm(points[tets].mean(axis=1), axis=1)
        points, tets, _ = bisected(points, tets, np.argsort(near)[:8])
    assert min_dihedral_deg(points, tets) > 0.3 * before
