"""Discretisation error of a mesh: the error of its frequencies, estimated by recovered strains."""

from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from calmotion.arrays import Array, Indices, IntArray
from calmotion.mesh.quadratic import QuadraticMesh
from calmotion.model.character import ElasticMaterial
from calmotion.reduction.basis.natural_modes import clamped_modes
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.elements.elastic_forms import GradientRule
from calmotion.support.compilation import kernel

_AT_ONCE = 2000  # nodes whose fits, or elements whose strains, are in memory
_DETERMINED = 1e-12  # least eigenvalue of the normal equations of a fit, of the largest
_PATCH = 30  # least number of elements around a corner for a fit; else those of its neighbours are added


def frequency_errors(
    model: FEModel, material: ElasticMaterial, count: int = 3, clamped: Indices | None = None
) -> tuple[Array, Array]:
    """Lowest elastic frequencies of a mesh, and the estimated relative error of each.

    Args:
        material: Material of the matrices.
        count: Number of elastic frequencies; the six rigid modes of a free body are not counted.
        clamped: Clamped nodes; None for a free body, which has no singularity at the edge of a clamp.

    Returns:
        Frequencies [Hz] and relative errors, both of shape [count].

    The relative error of a Rayleigh quotient is the energy of the error:
    (omega_h^2 - omega^2) / omega^2 = |u - u_h|^2 / |u_h|^2.
    Source: Zienkiewicz and Zhu 1992 (superconvergent patch recovery); Strang and Fix 1973, 6.3, for the eigenvalue.
    """
    frequencies, modes = clamped_modes(model, count, clamped)
    return frequencies, 0.5 * energy_errors(model.mesh, material, modes)


def energy_errors(mesh: QuadraticMesh, material: ElasticMaterial, u: Array) -> Array:
    """Estimated strain energy of the error of displacements, relative to theirs, shape [k].

    Args:
        mesh: Straight-sided.
        material: Only Poisson's ratio matters.
        u: Displacements [m], shape [n, 3, k].
    """
    return np.asarray(element_errors(mesh, material, u).sum(axis=0))


def element_errors(mesh: QuadraticMesh, material: ElasticMaterial, u: Array) -> Array:
    """The part of each element in `energy_errors`, shape [m, k]; arguments as there.

    Source: Zienkiewicz and Zhu 1992.
    """
    # at the points of the degree-2 rule the strains of quadratic elements are better than elsewhere
    sampling = GradientRule(mesh, 2, solid=True)
    recovered = _recovered(mesh, sampling.points, _strains(sampling, u))
    # both fields at the points of a degree-4 rule; strains of the elements are linear, the recovered ones quadratic
    integration = GradientRule(mesh, 4, solid=True)
    shapes = np.stack([mesh.basis.elem.lbasis(integration.points, a)[0] for a in range(10)])
    strains = _strains(integration, u)
    weights = integration.weights
    if mesh.filling is not None:
        weights = weights * mesh.filling.weights.sum(axis=1)[:, None]
    # mu = 1: 2 e:e + lambda tr(e)^2, shear strains being doubled
    law = np.diag([2.0, 2.0, 2.0, 1.0, 1.0, 1.0])
    law[:3, :3] += 2.0 * material.poissons_ratio / (1.0 - 2.0 * material.poissons_ratio)
    own, parts = np.zeros(u.shape[2]), np.empty((len(mesh.tets), u.shape[2]))
    for first in range(0, len(mesh.tets), _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        weight, strain = weights[some, :, None, None], strains[some]
        off = np.einsum("aq,eack->eqck", shapes, recovered[mesh.tets[some]], optimize=True) - strain
        for field, energy in ((off, parts[some]), (strain, None)):
            density = np.einsum("eqik,eqik->ek", weight * np.einsum("ij,eqjk->eqik", law, field, optimize=True), field)
            if energy is None:
                own += density.sum(axis=0)
            else:
                energy[:] = density
    return parts / own


def _strains(rule: GradientRule, u: Array) -> Array:
    """Strains of displacements at the points of a rule, shape [m, q, 6, k] (xx yy zz 2yz 2xz 2xy)."""
    gradients = rule.gradients(u)
    a, b = [1, 2, 0], [2, 0, 1]
    stretch = np.diagonal(gradients, axis1=-2, axis2=-1)
    return np.concatenate([stretch, gradients[..., a, b] + gradients[..., b, a]], axis=-1).transpose(1, 2, 3, 0)


def _recovered(mesh: QuadraticMesh, points: Array, samples: Array) -> Array:
    """Strains at the nodes, shape [n, 6, k]: a quadratic fitted around each corner; at midpoints the mean of two.

    Args:
        mesh: Straight-sided, m elements.
        points: Sampling points in the reference tetrahedron, shape [3, q].
        samples: Strains there, shape [m, q, 6, k].
    """
    corners, e = mesh.tets[:, :4], len(mesh.tets)
    count = int(corners.max()) + 1
    at = mesh.basis.mapping.F(points).transpose(1, 2, 0)
    touch = csr_matrix((np.ones(4 * e, np.int8), (corners.ravel(), np.repeat(np.arange(e), 4))), shape=(count, e))
    wider = (touch @ touch.T @ touch).tocsr()
    few = np.diff(touch.indptr) < _PATCH
    flat = samples.reshape(e * samples.shape[1], -1)
    fitted = np.empty((len(mesh.nodes), flat.shape[1]))
    for near, own in ((touch, np.flatnonzero(~few)), (wider, np.flatnonzero(few))):
        for nodes in np.split(own, np.arange(_AT_ONCE, len(own), _AT_ONCE)):
            fitted[nodes] = _weights(near[nodes], at, mesh.nodes[nodes]) @ flat
    first, second = mesh.basis.mesh.edges
    fitted[mesh.basis.edge_dofs[0]] = 0.5 * (fitted[first] + fitted[second])
    return fitted.reshape(len(fitted), 6, -1)


def _weights(near: Any, at: Array, places: Array) -> Any:
    """Weights of samples in the value at a node of the quadratic that is fitted to them by least squares.

    Args:
        near: The elements with the samples of each of the k nodes, sparse CSR, shape [k, m].
        at: Where the samples are [m], shape [m, q, 3].
        places: Where the nodes are [m], shape [k, 3].

    Returns:
        Sparse, shape [k, m q].
    """
    q = at.shape[1]
    begin = q * near.indptr
    P, normal = np.empty((begin[-1], 10)), np.zeros((len(places), 10, 10))
    _sample(near.indptr, near.indices, at, places, P, normal)
    # elements in one layer may not determine all coefficients: then the solution of least norm
    size, vectors = np.linalg.eigh(normal)
    inverse = np.where(size > _DETERMINED * size[:, -1:], 1.0 / np.maximum(size, np.finfo(float).tiny), 0.0)
    value = np.einsum("kab,kb->ka", vectors, inverse * vectors[:, 0])
    row = np.repeat(np.arange(len(places)), np.diff(begin))
    columns = (q * near.indices[:, None] + np.arange(q)).ravel()
    weights = np.einsum("ra,ra->r", P, value[row])
    return csr_matrix((weights, columns, begin), shape=(len(places), q * len(at)))


@kernel
def _sample(indptr: IntArray, indices: IntArray, at: Array, places: Array, P: Array, normal: Array) -> None:
    """Monomials at the samples of each node, relative to its place and to the farthest of them, and their products.

    Args:
        indptr, indices, at, places: As of `_weights`.
        P: For 1, x, y, z, x^2, y^2, z^2, x y, y z, z x of each sample, shape [samples, 10].
        normal: Zero, for their products, summed over the samples of each node, shape [k, 10, 10].
    """
    for k in range(len(places)):
        size = 0.0
        for e in indices[indptr[k] : indptr[k + 1]]:
            for q in range(at.shape[1]):
                for i in range(3):
                    size = max(size, abs(at[e, q, i] - places[k, i]))
        row = at.shape[1] * indptr[k]
        for e in indices[indptr[k] : indptr[k + 1]]:
            for q in range(at.shape[1]):
                P[row, 0] = 1.0
                for i in range(3):
                    P[row, 1 + i] = (at[e, q, i] - places[k, i]) / size
                for i in range(3):
                    P[row, 4 + i] = P[row, 1 + i] * P[row, 1 + i]
                    P[row, 7 + i] = P[row, 1 + i] * P[row, 1 + (i + 1) % 3]
                for a in range(10):
                    for b in range(10):
                        normal[k, a, b] += P[row, a] * P[row, b]
                row += 1
