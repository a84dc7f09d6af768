"""Boxes of tetrahedra, and quadrature that is not the one under test."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.fem.tetrahedra import measure_quality, oriented_tets
from calmotion.shot import ElasticMaterial, FEMesh, Frame

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def box_tets(counts, size, origin=(0.0, 0.0, 0.0)):
    """Points [n, 3] and tetrahedra [m, 4] of a box cut into bricks of six tetrahedra each."""
    from skfem import MeshTet

    mesh = MeshTet.init_tensor(*(o + np.linspace(0.0, s, n + 1) for n, s, o in zip(counts, size, origin, strict=True)))
    points = np.ascontiguousarray(mesh.p.T)
    return points, oriented_tets(points, mesh.t.T)[0]


def conical_quadrature(points, tets, order=4):
    """Gauss points of a collapsed cube on every element: barycentric [q, 4], weights [m, q] (volume included).

    Exact for degree 2 `order` - 3 and more; built from one-dimensional rules alone, so that it shares nothing with
    the tables of the element library.
    """
    x, w = np.polynomial.legendre.leggauss(order)
    x, w = 0.5 * (x + 1.0), 0.5 * w
    a, b, c = (g.ravel() for g in np.meshgrid(x, x, x, indexing="ij"))
    wa, wb, wc = (g.ravel() for g in np.meshgrid(w, w, w, indexing="ij"))
    r, s, t = a, b * (1.0 - a), c * (1.0 - a) * (1.0 - b)
    weight = wa * wb * wc * (1.0 - a) ** 2 * (1.0 - b)
    bary = np.stack([1.0 - r - s - t, r, s, t], axis=1)
    e = points[tets]
    jacobian = np.einsum("ij,ij->i", np.cross(e[:, 1] - e[:, 0], e[:, 2] - e[:, 0]), e[:, 3] - e[:, 0])
    return bary, jacobian[:, None] * weight


def frame(*position):
    return Frame(np.array(position, dtype=float), IDENTITY)


def fe_mesh(points, tets):
    return FEMesh(0, points, tets, measure_quality(points, tets))


@pytest.fixture(scope="session")
def steel():
    return ElasticMaterial("/Looks/Steel", 2.1e11, 0.3, 7850.0)


@pytest.fixture(scope="session")
def plastic():
    """Of the swung arm, evidence 8."""
    return ElasticMaterial("/Looks/Plastic", 1.8e9, 0.35, 1200.0)


@pytest.fixture(scope="session")
def helpers():
    """The functions of this file, for tests that cannot import it."""

    class Helpers:
        box = staticmethod(box_tets)
        quadrature = staticmethod(conical_quadrature)
        frame = staticmethod(frame)
        mesh = staticmethod(fe_mesh)

    return Helpers
