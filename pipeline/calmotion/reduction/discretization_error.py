"""What a mesh costs in accuracy: the error of its frequencies, estimated from that mesh alone by recovered strains."""

from __future__ import annotations

import numpy as np

from calmotion.geometry.tetrahedra import Indices
from calmotion.reduction.basis.natural_modes import lowest_modes, vector_mass
from calmotion.reduction.elements.assembly import FEModel, QuadraticMesh
from calmotion.shot.character import Array, ElasticMaterial

_PATCH = 30  # elements; fewer around a corner, and the neighbours' elements join
_EDGES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])  # of the midpoints 4..9
# a degree-2 rule: at these points the strains of quadratic elements are better than elsewhere
_GAUSS = np.full((4, 4), 0.1381966011250105) + 0.4472135954999579 * np.eye(4)


def frequency_errors(
    model: FEModel, material: ElasticMaterial, count: int = 3, clamped: Indices | None = None
) -> tuple[Array, Array]:
    """Lowest elastic frequencies of a mesh, and how much too high the mesh makes each of them, as estimated.

    Args:
        model: Its matrices.
        material: That they were assembled with.
        count: Number of frequencies; the six of a free body that are zero come on top.
        clamped: Nodes that are held; None for a free body, which has no singular edge of a clamp.

    Returns:
        Frequencies [Hz] and relative errors, both of shape [count].

    A Rayleigh quotient is too high by the energy of the error: (omega_h^2 - omega^2) / omega^2 = |u - u_h|^2 / |u_h|^2.
    Source: Zienkiewicz and Zhu 1992 (superconvergent patch recovery); Strang and Fix 1973, 6.3, for the eigenvalue.
    """
    n = len(model.mesh.nodes)
    M = vector_mass(model.mass)
    free = np.ones(n, dtype=bool)
    rigid, shift = 6, 1e-4 * float(model.stiffness.diagonal().sum() / M.diagonal().sum())
    if clamped is not None and len(clamped):
        free[clamped] = False
        rigid, shift = 0, 0.0
    dofs = np.flatnonzero(np.repeat(free, 3))
    values, vectors = lowest_modes(model.stiffness[dofs][:, dofs], M[dofs][:, dofs], rigid + count, shift=shift)
    modes = np.zeros((3 * n, vectors.shape[1]))
    modes[dofs] = vectors
    modes = modes.reshape(n, 3, -1)[:, :, rigid:]
    return np.sqrt(np.maximum(values[rigid:], 0.0)) / (2.0 * np.pi), 0.5 * energy_errors(model.mesh, material, modes)


def energy_errors(mesh: QuadraticMesh, material: ElasticMaterial, u: Array) -> Array:
    """Estimated strain energy of the error of displacements, relative to theirs, shape [k].

    Args:
        mesh: Straight-sided.
        material: Only Poisson's ratio matters.
        u: Displacements [m], shape [n, 3, k].
    """
    x = mesh.nodes[mesh.tets[:, :4]]
    slope = _slopes(x)
    volume = np.abs(np.linalg.det(x[:, 1:] - x[:, :1])) / 6.0
    samples = _strains(mesh, slope, u, _GAUSS)
    recovered = _recovered(mesh, samples)
    # both fields at the points of a degree-4 rule; strains of the elements are linear, the recovered ones quadratic
    bary, weights = _degree_four()
    exact = np.einsum("aq,eack->eqck", _shapes(bary), recovered[mesh.tets], optimize=True)
    found = _strains(mesh, slope, u, bary)
    lame = material.poissons_ratio / (1.0 - 2.0 * material.poissons_ratio)

    def energy(e: Array) -> Array:
        # mu = 1: 2 e:e + lambda tr(e)^2, shear strains being doubled
        dense = 2.0 * (e[:, :, :3] ** 2).sum(axis=2) + (e[:, :, 3:] ** 2).sum(axis=2)
        dense += 2.0 * lame * e[:, :, :3].sum(axis=2) ** 2
        return np.einsum("e,q,eqk->k", volume, weights, dense)

    return energy(exact - found) / energy(found)


def _slopes(x: Array) -> Array:
    """Gradients of the four corner functions [1/m], shape [e, 4, 3]."""
    inverse = np.linalg.inv(x[:, 1:] - x[:, :1]).transpose(0, 2, 1)
    return np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)


def _strains(mesh: QuadraticMesh, slope: Array, u: Array, bary: Array) -> Array:
    """Strains of displacements at the same points of every element, shape [e, q, 6, k] (xx yy zz 2yz 2xz 2xy)."""
    i, j = _EDGES.T
    out = np.empty((len(slope), len(bary), 6, u.shape[2]))
    for q, L in enumerate(bary):
        corner = (4.0 * L - 1.0)[None, :, None] * slope
        middle = 4.0 * (L[i][None, :, None] * slope[:, j] + L[j][None, :, None] * slope[:, i])
        F = np.einsum("eaj,eaik->eijk", np.concatenate([corner, middle], axis=1), u[mesh.tets], optimize=True)
        for c in range(3):
            a, b = (c + 1) % 3, (c + 2) % 3
            out[:, q, c] = F[:, c, c]
            out[:, q, 3 + c] = F[:, a, b] + F[:, b, a]
    return out


def _recovered(mesh: QuadraticMesh, samples: Array) -> Array:
    """Strains at the nodes, shape [n, 6, k]: a quadratic fitted around each corner; at midpoints the mean of two."""
    from scipy.sparse import csr_matrix

    corners, e = mesh.tets[:, :4], len(mesh.tets)
    count = int(corners.max()) + 1
    x = mesh.nodes[corners]
    at = np.einsum("qa,eai->eqi", _GAUSS, x)
    touch = csr_matrix((np.ones(4 * e, np.int8), (corners.ravel(), np.repeat(np.arange(e), 4))), shape=(count, e))
    wider = (touch @ touch.T @ touch).tocsr()
    flat = samples.reshape(*samples.shape[:2], -1)
    fitted = np.empty((len(mesh.nodes), flat.shape[2]))
    for node in range(count):
        near = touch.indices[touch.indptr[node] : touch.indptr[node + 1]]
        if len(near) < _PATCH:
            near = wider.indices[wider.indptr[node] : wider.indptr[node + 1]]
        d = (at[near] - mesh.nodes[node]).reshape(-1, 3)
        d /= np.abs(d).max()
        P = np.column_stack([np.ones(len(d)), d, d * d, d[:, 0] * d[:, 1], d[:, 1] * d[:, 2], d[:, 0] * d[:, 2]])
        # a patch one element thick may not tell all coefficients apart: the smallest fit is taken then
        fitted[node] = np.linalg.lstsq(P, flat[near].reshape(len(d), -1), rcond=1e-6)[0][0]
    i, j = _EDGES.T
    fitted[mesh.tets[:, 4:]] = 0.5 * (fitted[corners[:, i]] + fitted[corners[:, j]])
    return fitted.reshape(len(fitted), 6, -1)


def _shapes(bary: Array) -> Array:
    """The ten shape functions, shape [10, q]."""
    L = bary.T
    i, j = _EDGES.T
    return np.concatenate([L * (2.0 * L - 1.0), 4.0 * L[i] * L[j]])


def _degree_four() -> tuple[Array, Array]:
    """Barycentric points [q, 4] and weights [q] (their sum is one) of a rule of degree four on a tetrahedron."""
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefTet

    points, weights = get_quadrature(RefTet, 4)
    return np.column_stack([1.0 - points.sum(axis=0), points.T]), 6.0 * weights
