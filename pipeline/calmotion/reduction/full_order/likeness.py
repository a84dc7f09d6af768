"""Whether a body is another one, moved or mirrored: then both have the same factors and modes."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array
from calmotion.reduction.basis.natural_modes import vector_mass
from calmotion.reduction.reduce import FullBody

_SAME = 1e-9  # of the size: distance of nodes that are the same
_EQUAL = 1e-9  # relative difference of products with matrices that are the same


def turn_between(one: FullBody, other: FullBody) -> Array | None:
    """The matrix that turns (or mirrors) one body to another, shape [3, 3]; None where it is another body.

    Both must have their nodes, elements and interfaces in the same order, as meshes have that are made once and moved.
    """
    supports = ((one.support.root, other.support.root), *zip(one.support.patches, other.support.patches, strict=False))
    if len(one.support.patches) != len(other.support.patches):
        return None
    if one.model.mesh.nodes.shape != other.model.mesh.nodes.shape or not all(
        np.array_equal(*pair) for pair in supports
    ):
        return None
    nodes, moved = (body.model.mesh.nodes - body.model.mesh.nodes.mean(axis=0) for body in (one, other))
    # Schoenemann, A generalized solution of the orthogonal Procrustes problem, 1966
    left, _, right = np.linalg.svd(moved.T @ nodes)
    turn = np.asarray(left @ right)
    if np.abs(nodes @ turn.T - moved).max() > _SAME * float(np.linalg.norm(np.ptp(moved, axis=0))):
        return None
    probe = np.random.default_rng(0).standard_normal(nodes.shape)
    for matrix, same in (
        (one.model.stiffness, other.model.stiffness),
        (vector_mass(one.model.mass), vector_mass(other.model.mass)),
    ):
        expected = (matrix @ (probe @ turn).ravel()).reshape(-1, 3) @ turn.T
        found = (same @ probe.ravel()).reshape(-1, 3)
        if np.linalg.norm(found - expected) > _EQUAL * np.linalg.norm(found):
            return None
    return turn
