"""Mass and stiffness matrices of quadratic tetrahedra, with scikit-fem's element and quadrature."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..shot.character import Array, ElasticMaterial, IntArray
from .tetrahedra import boundary_triangles, tet_volumes, without_unused_points


@dataclass(frozen=True, eq=False)
class QuadraticMesh:
    """Straight-sided ten-node tetrahedra.

    Attributes:
        nodes: [m], shape [n, 3]: the corners in the order of the linear mesh, then the edge midpoints.
        tets: Shape [m, 10], nodes in the order of scikit-fem's ElementTetP2: corners 0..3, then the midpoints of
            edges 01, 12, 02, 03, 13, 23.
        surface: Outward boundary triangles, shape [k, 6]: three corners, then the midpoints of edges 01, 12, 20.
        basis: scikit-fem's scalar basis.
    """

    nodes: Array
    tets: IntArray
    surface: IntArray
    basis: Any

    @property
    def surface_nodes(self) -> IntArray:
        """Nodes on the boundary, ascending."""
        return np.unique(self.surface)


@dataclass(frozen=True, eq=False)
class FEModel:
    """The full model of a body.

    Attributes:
        mesh: Its nodes and elements.
        mass: Scalar mass matrix m_ab = int rho N_a N_b [kg], sparse, shape [n, n]; the vector one is m (x) E.
        stiffness: [N/m], sparse, shape [3n, 3n]; degree of freedom 3a + i is component i of node a.
    """

    mesh: QuadraticMesh
    mass: Any
    stiffness: Any


def quadratic_mesh(points: Array, tets: IntArray) -> QuadraticMesh:
    """The ten-node tetrahedra of a linear mesh.

    Args:
        points: Corners [m], shape [n, 3], every one used.
        tets: Shape [m, 4], positive volumes.
    """
    from skfem import Basis, ElementTetP2, MeshTet

    mesh = MeshTet(np.ascontiguousarray(points.T, dtype=float), np.ascontiguousarray(tets.T, dtype=np.int64))
    # degree 4: products of two quadratic fields; this rule of scikit-fem is exact to rounding (tested)
    basis = Basis(mesh, ElementTetP2(), intorder=4)
    corners = boundary_triangles(tets)
    edge_nodes = {tuple(edge): len(points) + k for k, edge in enumerate(np.sort(mesh.edges, axis=0).T.tolist())}
    middle = [[edge_nodes[min(a, b), max(a, b)] for a, b in ((i, j), (j, k), (k, i))] for i, j, k in corners.tolist()]
    surface = np.hstack([corners, np.array(middle).reshape(-1, 3)])
    return QuadraticMesh(
        nodes=np.ascontiguousarray(basis.doflocs.T),
        tets=basis.element_dofs.T.astype(np.int32),
        surface=surface.astype(np.int32),
        basis=basis,
    )


def assemble_mass(mesh: QuadraticMesh, density: float) -> Any:
    """Scalar consistent mass matrix [kg], CSR, shape [n, n]; density in kg/m^3."""
    from skfem.models.poisson import mass

    return (density * mass.assemble(mesh.basis)).tocsr()


def assemble_stiffness(mesh: QuadraticMesh, youngs_modulus: float, poissons_ratio: float) -> Any:
    """Stiffness of linear isotropic elasticity [N/m], CSR, shape [3n, 3n].

    int lambda div(u) div(v) + 2 mu e(u):e(v) needs D[i,a,j,b] = int d_a N_i d_b N_j alone; one product for all
    elements is ten times faster than a form called for each of the 30 x 30 pairs.
    """
    from scipy.sparse import coo_matrix
    from skfem import Basis, ElementTetP2
    from skfem.models.elasticity import lame_parameters

    lame, mu = lame_parameters(youngs_modulus, poissons_ratio)
    basis = Basis(mesh.basis.mesh, ElementTetP2(), intorder=2)  # gradients are linear on straight-sided elements
    gradient = np.stack([np.asarray(field[0].grad) for field in basis.basis])  # [10, 3, e, q]
    dofs = (3 * mesh.tets.astype(np.int64)[:, :, None] + np.arange(3)).reshape(-1, 30)
    n = 3 * len(mesh.nodes)
    g = np.ascontiguousarray(gradient.transpose(2, 0, 1, 3))  # [e, 10, 3, q]
    flat = g.reshape(len(g), 30, -1)
    D = ((flat * basis.dx[:, None, :]) @ flat.transpose(0, 2, 1)).reshape(-1, 10, 3, 10, 3)
    K = lame * D + mu * D.transpose(0, 1, 4, 3, 2)
    trace = np.einsum("eicjc->eij", D)
    for a in range(3):
        K[:, :, a, :, a] += mu * trace
    K = K.reshape(-1, 30, 30)
    rows, columns = np.repeat(dofs, 30, axis=1).ravel(), np.tile(dofs, (1, 30)).ravel()
    matrix = coo_matrix((K.ravel(), (rows, columns)), shape=(n, n)).tocsr()
    return 0.5 * (matrix + matrix.T)  # symmetric to the last bit, whatever the order of summation


def assemble(points: Array, tets: IntArray, material: ElasticMaterial, mass: float | None = None) -> FEModel:
    """The full model of a body.

    Args:
        points: Corners [m], shape [n, 3].
        tets: Shape [m, 4], positive volumes.
        material: Young's modulus [Pa], Poisson's ratio, density [kg/m^3].
        mass: Total mass [kg] that the density is scaled to; None keeps the material's density.
    """
    mesh = quadratic_mesh(*without_unused_points(points, tets))
    density = material.density
    if mass is not None:
        density = mass / float(tet_volumes(points, tets).sum())
    return FEModel(
        mesh=mesh,
        mass=assemble_mass(mesh, density),
        stiffness=assemble_stiffness(mesh, material.youngs_modulus, material.poissons_ratio),
    )
