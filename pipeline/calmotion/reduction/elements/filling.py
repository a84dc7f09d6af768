"""Finite elements across the skin and the core of a printed part.

Elements need not follow the thin skin. Their stiffness is integrated over the material that is in them: a rule of four
points for each element, with points and weights of its own, is exact for strains that are linear in it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.geometry.print_core import SkinShare
from calmotion.shot.character import Array
from calmotion.shot.materials.printed import Core


@dataclass(frozen=True, eq=False)
class Filling:
    """The material in the elements of a printed part.

    Attributes:
        core: Of the part.
        skin: The skin in its elements, e of them.
        points: Barycentric coordinates of the rule, shape [e, 4, 4].
        weights: Of the rule, relative to the volume of the element in solid material, shape [e, 4], positive.
    """

    core: Core
    skin: SkinShare
    points: Array
    weights: Array


def filling_of(core: Core, skin: SkinShare) -> Filling:
    """The rules of the elements.

    With S the mean of g x x^T, where x are barycentric coordinates and g the relative modulus, any factor S = L L^T is
    a rule: the columns of L, divided by their sums, are its points, and the squares of these sums its weights. The
    symmetric root gives the usual rule of four points where g is constant.
    """
    n = round(skin.shares.shape[1] ** (1.0 / 3.0))
    whole = (np.eye(4) + 1.0) / 20.0
    within = (np.eye(4) / 20.0 - 1.0 / 80.0) / n**2  # of a part about its center
    squares = np.einsum("pa,pb->pab", skin.places, skin.places) + within
    skinned = np.tensordot(skin.shares, squares, 1) / skin.shares.shape[1]
    S = core.stiffness * whole + (1.0 - core.stiffness) * skinned
    values, vectors = np.linalg.eigh(S)
    root = np.einsum("eij,ej,ekj->eik", vectors, np.sqrt(values), vectors)
    sums = root.sum(axis=1)
    return Filling(core, skin, np.swapaxes(root, 1, 2) / sums[:, :, None], sums**2)


def element_masses(filling: Filling, shapes: Array, exact: Array) -> Array:
    """Mass matrices of ten-node tetrahedra relative to that of their volume in solid material, shape [e, 10, 10].

    Args:
        filling: Of the elements.
        shapes: The ten shape functions at the places of the skin, shape [p, 10].
        exact: The matrix of a homogeneous element of volume and density 1, shape [10, 10].
    """
    infill = filling.core.infill
    products = np.einsum("pa,pb->pab", shapes, shapes)
    # products that are sampled have another sum than exact ones: the skin takes the share that is right for all of it
    sampled = products.mean(axis=0)
    skinned = np.tensordot(filling.skin.shares, products, 1) / len(shapes)
    share = filling.skin.shares.mean(axis=1)[:, None, None]
    return np.asarray(infill * exact + (1.0 - infill) * (skinned + share * (exact - sampled)))
