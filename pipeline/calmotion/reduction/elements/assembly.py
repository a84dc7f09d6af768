"""Mass and stiffness matrices of quadratic tetrahedra, with scikit-fem's element and quadrature."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.sparse import bsr_matrix, coo_matrix, csr_matrix, identity, kron

from calmotion.arrays import Array, Indices, IntArray
from calmotion.mesh.parts import Filling, element_masses, filling_of, makeup_of
from calmotion.mesh.quadratic import QuadraticMesh, quadratic_mesh
from calmotion.mesh.tetrahedra import tet_volumes, without_unused_points
from calmotion.model.character import ElasticMaterial
from calmotion.support.compilation import inlined_kernel, kernel


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

    def momentum(self, columns: Array) -> Array:
        """The vector mass matrix times columns, both of shape [3n, k]."""
        return np.asarray((self.mass @ columns.reshape(len(self.mesh.nodes), -1)).reshape(columns.shape))

    def among(self, nodes: Indices) -> tuple[Any, Any]:
        """Stiffness and vector mass matrix of some of the nodes, the others fixed; sparse, shape [3k, 3k] each."""
        dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
        return self.stiffness[dofs][:, dofs], vector_mass(self.mass[nodes][:, nodes])

    def stiffened(self, factor: float) -> FEModel:
        """The same model with its stiffness times a factor."""
        own = self.stiffness
        return replace(self, stiffness=csr_matrix((factor * own.data, own.indices, own.indptr), shape=own.shape))


def vector_mass(mass: Any) -> Any:
    """m (x) E, sparse CSR, shape [3n, 3n], from the scalar mass matrix m, shape [n, n]."""
    return kron(mass, identity(3), format="csr")


def assemble_mass(mesh: QuadraticMesh, density: float) -> Any:
    """Scalar consistent mass matrix [kg], CSR, shape [n, n]; density (of the body's material) in kg/m^3."""
    from skfem import Basis, ElementTetP2
    from skfem.models.poisson import mass

    # degree 4: products of two quadratic fields; this rule of scikit-fem is exact to rounding (tested)
    basis = Basis(mesh.basis.mesh, ElementTetP2(), intorder=4)
    if mesh.filling is not None:
        return density * _mass_of_filling(mesh, basis, mesh.filling)
    return (density * mass.assemble(basis)).tocsr()


def _mass_of_filling(mesh: QuadraticMesh, basis: Any, filling: Filling) -> Any:
    """`assemble_mass` of a body of several materials, for a density of 1."""
    n, tets = len(mesh.nodes), mesh.tets.astype(np.int64)
    values = np.stack([basis.elem.lbasis(basis.X, a)[0] for a in range(10)])
    exact = np.einsum("aq,bq,q->ab", values, values, basis.W) / basis.W.sum()
    places = filling.makeup.places[:, 1:].T
    shapes = np.stack([basis.elem.lbasis(places, a)[0] for a in range(10)], axis=1)
    blocks = element_masses(filling, shapes, exact) * basis.dx.sum(axis=1)[:, None, None]
    rows, columns = np.repeat(tets, 10, axis=1), np.tile(tets, (1, 10))
    matrix = coo_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(n, n)).tocsr()
    return 0.5 * (matrix + matrix.T)


def corner_gradients(mesh: QuadraticMesh) -> Array:
    """Gradients of the shape functions at the corners of each element [1/m], shape [10, 3, m, 4].

    Gradients of quadratic shape functions are linear: those at a point follow with its barycentric coordinates.
    """
    from skfem import Basis, ElementTetP2

    corners = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    basis = Basis(mesh.basis.mesh, ElementTetP2(), quadrature=(corners, np.full(4, 1.0 / 24.0)))
    return np.stack([np.asarray(field[0].grad) for field in basis.basis])


def assemble_stiffness(mesh: QuadraticMesh, youngs_modulus: float, poissons_ratio: float) -> Any:
    """Stiffness of linear isotropic elasticity [N/m], CSR, shape [3n, 3n].

    int lambda div(u) div(v) + 2 mu e(u):e(v) needs D[i,a,j,b] = int d_a N_i d_b N_j alone. Elements are summed on the
    pattern of nodes, of which both halves get the same numbers in the same order: the matrix is exactly symmetric.
    """
    from skfem import Basis, ElementTetP2
    from skfem.models.elasticity import lame_parameters

    lame, mu = lame_parameters(youngs_modulus, poissons_ratio)
    basis = Basis(mesh.basis.mesh, ElementTetP2(), intorder=2)  # gradients are linear on straight-sided elements
    if mesh.filling is None:
        gradients = np.stack([np.asarray(field[0].grad) for field in basis.basis])  # [10, 3, e, q]
        weights = basis.dx
    else:
        gradients = np.einsum("ajec,eqc->ajeq", corner_gradients(mesh), mesh.filling.points, optimize=True)
        weights = basis.dx.sum(axis=1)[:, None] * mesh.filling.weights
    gradients = np.ascontiguousarray((gradients * np.sqrt(weights)).transpose(2, 0, 3, 1))  # [e, 10, q, 3]
    n, tets = len(mesh.nodes), mesh.tets
    touch = csr_matrix((np.ones(tets.size, np.int32), tets.ravel(), np.arange(0, tets.size + 1, 10)), (len(tets), n))
    pattern = (touch.T @ touch).tocsr()
    pattern.sort_indices()
    blocks = np.zeros((pattern.nnz, 3, 3))
    _add_elements(tets, gradients, lame, mu, pattern.indptr, pattern.indices, blocks)
    return bsr_matrix((blocks, pattern.indices, pattern.indptr), shape=(3 * n, 3 * n)).tocsr()


@kernel
def _add_elements(
    tets: IntArray, gradients: Array, lame: float, mu: float, indptr: IntArray, indices: IntArray, blocks: Array
) -> None:
    """Add the stiffness of elements, from gradients times roots of weights, to blocks on a pattern with sorted rows."""
    for e in range(len(tets)):
        for i in range(10):
            for j in range(i, 10):
                row, column = tets[e, i], tets[e, j]
                at = _place(indptr[row], indptr[row + 1], indices, column)
                opposite = _place(indptr[column], indptr[column + 1], indices, row)
                trace = 0.0
                for a in range(3):
                    for b in range(3):
                        d, t = 0.0, 0.0
                        for q in range(gradients.shape[2]):
                            d += gradients[e, i, q, a] * gradients[e, j, q, b]
                            t += gradients[e, i, q, b] * gradients[e, j, q, a]
                        value = lame * d + mu * t
                        blocks[at, a, b] += value
                        if i != j:
                            blocks[opposite, b, a] += value
                        if a == b:
                            trace += d
                for a in range(3):
                    blocks[at, a, a] += mu * trace
                    if i != j:
                        blocks[opposite, a, a] += mu * trace


@inlined_kernel
def _place(first: int, last: int, indices: IntArray, wanted: int) -> int:
    """Where a number is among ascending ones."""
    while last - first > 1:
        middle = (first + last) // 2
        if indices[middle] <= wanted:
            first = middle
        else:
            last = middle
    return first


def assemble(points: Array, tets: IntArray, material: ElasticMaterial, mass: float | None = None) -> FEModel:
    """The full model of a body.

    Args:
        points: Corners [m], shape [n, 3].
        tets: Shape [m, 4], positive volumes.
        material: Young's modulus [Pa], Poisson's ratio, density [kg/m^3]; that of the skin where it has a core, and
            what its parts refer to.
        mass: Total mass [kg] that the density is scaled to; None keeps the material's density.
    """
    mesh = quadratic_mesh(*without_unused_points(points, tets))
    density, volume = material.density, tet_volumes(points, tets)
    makeup = makeup_of(mesh.nodes, mesh.tets[:, :4], material)
    if makeup is not None:
        mesh = replace(mesh, filling=filling_of(makeup))
        volume = volume * makeup.density
    if mass is not None:
        density = mass / float(volume.sum())
    return FEModel(
        mesh=mesh,
        mass=assemble_mass(mesh, density),
        stiffness=assemble_stiffness(mesh, material.youngs_modulus, material.poissons_ratio),
    )
