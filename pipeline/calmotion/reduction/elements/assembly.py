"""Mass and stiffness matrices of quadratic tetrahedra, with scikit-fem's element and quadrature."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from calmotion.geometry.tetrahedra import boundary_triangles, tet_volumes, without_unused_points
from calmotion.shot.character import Array, ElasticMaterial, IntArray


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

    @property
    def volume(self) -> float:
        """[m^3]."""
        return float(self.basis.dx.sum())


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

    int lambda div(u) div(v) + 2 mu e(u):e(v) needs D[i,a,j,b] = int d_a N_i d_b N_j alone. It is summed over the
    elements for one (a, b) at a time, on the pattern of nodes: a tenth of the memory of all element matrices.
    """
    from scipy.sparse import bsr_matrix
    from skfem import Basis, ElementTetP2
    from skfem.models.elasticity import lame_parameters

    lame, mu = lame_parameters(youngs_modulus, poissons_ratio)
    basis = Basis(mesh.basis.mesh, ElementTetP2(), intorder=2)  # gradients are linear on straight-sided elements
    n, tets = len(mesh.nodes), mesh.tets.astype(np.int64)
    keys, place = np.unique((n * tets[:, :, None] + tets[:, None, :]).ravel(), return_inverse=True)
    gradient = [np.stack([np.asarray(field[0].grad[a]) for field in basis.basis], axis=1) for a in range(3)]
    blocks = np.zeros((len(keys), 3, 3))
    for a in range(3):
        weighted = gradient[a] * basis.dx[:, None, :]  # [e, 10, q]
        for b in range(3):
            D = weighted @ gradient[b].transpose(0, 2, 1)
            summed = np.bincount(place, weights=D.ravel(), minlength=len(keys))
            blocks[:, a, b] += lame * summed
            blocks[:, b, a] += mu * summed
            if a == b:
                for c in range(3):
                    blocks[:, c, c] += mu * summed
    indptr = np.searchsorted(keys, n * np.arange(n + 1))
    matrix = bsr_matrix((blocks, keys % n, indptr), shape=(3 * n, 3 * n)).tocsr()
    return 0.5 * (matrix + matrix.T)  # exactly symmetric, whatever the order of summation


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
