"""Boxes of tetrahedra, and quadrature that is not the one under test."""

import numpy as np
from calmotion.mesh.tetrahedra import measure_quality, oriented_tets
from calmotion.model import FEMesh


def box_tets(counts, size, origin=(0.0, 0.0, 0.0)):
    """Points [n, 3] and tetrahedra [m, 4] of a box cut into bricks of six tetrahedra each."""
    from skfem import MeshTet

    mesh = MeshTet.init_tensor(*(o + np.linspace(0.0, s, n + 1) for n, s, o in zip(counts, size, origin, strict=True)))
    points = np.ascontiguousarray(mesh.p.T)
    return points, oriented_tets(points, mesh.t.T)[0]


def hollow_shaft(radius, length, counts):
    """Points and tetrahedra of a shaft along z, hollow up to half of its radius; counts across, around and along."""
    points, tets = box_tets(counts, (1.0, 2.0 * np.pi, length))
    r = radius * (0.5 + 0.5 * points[:, 0])
    points = np.column_stack([r * np.cos(points[:, 1]), r * np.sin(points[:, 1]), points[:, 2]])
    _, first, same = np.unique(np.round(points / (1e-9 * radius)), axis=0, return_index=True, return_inverse=True)
    return points[first], oriented_tets(points[first], same.ravel()[tets])[0]


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


def quadratic_shapes(bary):
    """The ten shape functions at barycentric coordinates, [q, 4] -> [q, 10], written out for comparison."""
    first, second = np.array([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]).T
    return np.hstack([bary * (2.0 * bary - 1.0), 4.0 * bary[:, first] * bary[:, second]])


def fe_mesh(points, tets):
    return FEMesh(0, points, tets, measure_quality(points, tets))
