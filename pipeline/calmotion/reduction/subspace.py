"""Projection of a reduced body onto a subspace, such as the POD subspace of a motion.

Every term of a reduced body is a polynomial in its coordinates, or a sum over points of gradients linear in them. The
projection u = T w therefore approximates the motion only.
"""

from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

from calmotion.arrays import Array
from calmotion.reduction.reduced_body import Elasticity, Invariants, ReducedBody


def principal_subspace(body: ReducedBody, motion: Array, missing: float) -> Array:
    """The smallest POD subspace of a motion that contains all but a share of its strain energy.

    Proper orthogonal decomposition in the energy norm of the linear body. A projected body minimises its energy in the
    subspace, so the error of its frequencies is the square of the error of the motion.

    Args:
        body: Of r elastic coordinates.
        motion: Elastic coordinates at n instants, shape [n, r].
        missing: Square root of the share of the energy that may be missing.

    Returns:
        Basis T with diagonal mass and stiffness, ascending in frequency, shape [r, s].

    Source: Sirovich, Turbulence and the dynamics of coherent structures, 1987; Kerschen et al., The method of proper
    orthogonal decomposition for dynamical characterization and order reduction of mechanical systems, 2005.
    """
    root = np.sqrt(body.stiffness)
    _, size, directions = np.linalg.svd(motion * root, full_matrices=False)
    left = np.sqrt(np.cumsum(size[::-1] ** 2)[::-1])  # without this direction and those after it
    return _diagonal(body, directions[left > missing * left[:1]].T / root[:, None])


def _diagonal(body: ReducedBody, T: Array) -> Array:
    """A basis of the same subspace with unit mass and diagonal stiffness."""
    K, M = T.T @ (body.stiffness[:, None] * T), T.T @ body.invariants.M @ T
    T = T @ eigh(K, M)[1]
    return T * np.where(T[np.abs(T).argmax(axis=0), np.arange(T.shape[1])] < 0.0, -1.0, 1.0)


def projected_body(body: ReducedBody, T: Array) -> ReducedBody:
    """The body projected onto a subspace.

    Args:
        body: Of r elastic coordinates.
        T: Basis with diagonal mass and stiffness, shape [r, s].
    """
    inertia = body.invariants
    return replace(
        body,
        invariants=Invariants(
            inertia.mass, inertia.s, inertia.Z, T.T @ inertia.M @ T, T.T @ inertia.M3,
            np.einsum("jk,jab->kab", T, inertia.M4), np.einsum("ik,jl,ijab->klab", T, T, inertia.S, optimize=True),
        ),
        stiffness=np.einsum("jk,j,jk->k", T, body.stiffness, T),
        damping=T.T @ body.damping @ T,
        markers=tuple(replace(marker, Phi=marker.Phi @ T, Psi=marker.Psi @ T) for marker in body.markers),
        skin=tuple(field @ T for field in body.skin),
        elasticity=None if body.elasticity is None else projected_law(body.elasticity, T),
    )  # fmt: skip


def projected_law(law: Elasticity, T: Array) -> Elasticity:
    """The law of `projected_body`: its energy for coordinates T w, shape of T [r, s]."""
    r, s = T.shape
    if law.law == "stvk":
        projection = T if law.strain_projection is None else law.strain_projection @ T
        all_coordinates = s <= len(projection) or law.strain_projection is None
        pairs = (
            _projected_pairs(projection) if all_coordinates else np.eye(len(projection) * (len(projection) + 1) // 2)
        )
        L = np.zeros((r + len(pairs), s + pairs.shape[1]))
        L[:r, :s], L[r:, s:] = T, pairs
        gram = np.asarray(law.data).reshape(len(L), len(L))
        return replace(law, data=(L.T @ gram @ L).ravel(), strain_projection=None if all_coordinates else projection)
    correction, points = law.data[: r * r].reshape(r, r), law.data[r * r :].reshape(law.points, 1 + 9 * r)
    gradients = points[:, 1:].reshape(law.points, 9, r) @ T
    packed = np.hstack([points[:, :1], gradients.reshape(law.points, 9 * s)])
    return replace(law, data=np.concatenate([(T.T @ correction @ T).ravel(), packed.ravel()]))


def _projected_pairs(T: Array) -> Array:
    """Pairs of T w (u_k u_l for k <= l, as of `elastic_forms.strain_gram`) from those of w."""
    r, s = T.shape
    (k, l), (a, b) = np.triu_indices(r), np.triu_indices(s)
    L = T[k][:, a] * T[l][:, b]
    both = a != b
    L[:, both] += T[k][:, b[both]] * T[l][:, a[both]]
    return L
