"""A reduced body in fewer coordinates: a subspace of its own, such as the one that a motion stays in.

Every term of a reduced body is a polynomial in its coordinates, or a sum over points of gradients linear in them, so
nothing is approximated but the motion: the body is the same one, held to u = T w.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from calmotion.reduction.reduced_body import Elasticity, Invariants, ReducedBody
from calmotion.shot.character import Array


def principal_subspace(body: ReducedBody, motion: Array, missing: float) -> Array:
    """The fewest directions that hold a motion but for a share of its strain energy.

    Proper orthogonal decomposition by the energy of the linear body. As a body that is held to a subspace is one whose
    energy is least there, what is missing shifts its frequencies by the square of what is left out of the motion.

    Args:
        body: Of r elastic coordinates.
        motion: These at some instants, shape [n, r].
        missing: Square root of the share that may be missing.

    Returns:
        Directions of which mass and stiffness are diagonal, the lowest first, shape [r, s].

    Source: Sirovich, Turbulence and the dynamics of coherent structures, 1987; Kerschen et al., The method of proper
    orthogonal decomposition for dynamical characterization and order reduction of mechanical systems, 2005.
    """
    root = np.sqrt(body.stiffness)
    _, size, directions = np.linalg.svd(motion * root, full_matrices=False)
    left = np.sqrt(np.cumsum(size[::-1] ** 2)[::-1])  # without the direction and those after it
    return _diagonal(body, directions[left > missing * left[:1]].T / root[:, None])


def _diagonal(body: ReducedBody, T: Array) -> Array:
    """The same subspace in directions of unit mass and diagonal stiffness."""
    from scipy.linalg import eigh

    K, M = T.T @ (body.stiffness[:, None] * T), T.T @ body.invariants.M @ T
    T = T @ eigh(K, M)[1]
    return T * np.where(T[np.abs(T).argmax(axis=0), np.arange(T.shape[1])] < 0.0, -1.0, 1.0)


def within(body: ReducedBody, T: Array) -> ReducedBody:
    """The body held to a subspace.

    Args:
        body: Of r elastic coordinates.
        T: Directions of which mass and stiffness are diagonal, shape [r, s].
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
        elasticity=None if body.elasticity is None else _law_within(body.elasticity, T),
    )  # fmt: skip


def _law_within(law: Elasticity, T: Array) -> Elasticity:
    r, s = T.shape
    if law.law == "stvk":
        turns = T if law.seen is None else law.seen @ T
        kept = s <= len(turns) or law.seen is None  # or fewer directions are seen still
        pairs = _pairs_within(turns) if kept else np.eye(len(turns) * (len(turns) + 1) // 2)
        L = np.zeros((r + len(pairs), s + pairs.shape[1]))
        L[:r, :s], L[r:, s:] = T, pairs
        gram = np.asarray(law.data).reshape(len(L), len(L))
        return replace(law, data=(L.T @ gram @ L).ravel(), seen=None if kept else turns)
    correction, points = law.data[: r * r].reshape(r, r), law.data[r * r :].reshape(law.points, 1 + 9 * r)
    gradients = points[:, 1:].reshape(law.points, 9, r) @ T
    packed = np.hstack([points[:, :1], gradients.reshape(law.points, 9 * s)])
    return replace(law, data=np.concatenate([(T.T @ correction @ T).ravel(), packed.ravel()]))


def _pairs_within(T: Array) -> Array:
    """Pairs of T w (u_k u_l for k <= l, as of `elastic_forms.strain_gram`) from those of w."""
    r, s = T.shape
    (k, l), (a, b) = np.triu_indices(r), np.triu_indices(s)
    L = T[k][:, a] * T[l][:, b]
    both = a != b
    L[:, both] += T[k][:, b[both]] * T[l][:, a[both]]
    return L
