"""Finite elements across several materials: skin and core of a printed part, or parts of an assembly.

Elements need not follow the thin skin, or the surfaces between parts. Their stiffness is integrated over the material
that is in them: a rule of four points for each element, with points and weights of its own, is exact for strains that
are linear in it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.mesh.parts.makeup import Makeup


@dataclass(frozen=True, eq=False)
class Filling:
    """The materials in the elements of a body.

    Attributes:
        makeup: Of its elements, e of them.
        points: Barycentric coordinates of the rule, shape [e, 4, 4].
        weights: Of the rule, relative to the volume of the element in the material of the body, shape [e, 4], positive.
    """

    makeup: Makeup
    points: Array
    weights: Array


def filling_of(makeup: Makeup) -> Filling:
    """The rules of the elements.

    With S the mean of g x x^T, where x are barycentric coordinates and g the relative modulus, any factor S = L L^T is
    a rule: the columns of L, divided by their sums, are its points, and the squares of these sums its weights. The
    symmetric root gives the usual rule of four points where g is constant.
    """
    places, least = makeup.places, makeup.moduli.min(axis=1)
    n = round(len(places) ** (1.0 / 3.0))
    whole = (np.eye(4) + 1.0) / 20.0
    within = (np.eye(4) / 20.0 - 1.0 / 80.0) / n**2  # of a part about its center
    squares = np.einsum("pa,pb->pab", places, places) + within
    S = least[:, None, None] * whole + np.tensordot(makeup.moduli - least[:, None], squares, 1) / len(places)
    values, vectors = np.linalg.eigh(S)
    root = np.einsum("eij,ej,ekj->eik", vectors, np.sqrt(values), vectors)
    sums = root.sum(axis=1)
    return Filling(makeup, np.swapaxes(root, 1, 2) / sums[:, :, None], sums**2)


def element_masses(filling: Filling, shapes: Array, exact: Array) -> Array:
    """Mass matrices of ten-node tetrahedra relative to that of their volume in the body's material, shape [e, 10, 10].

    Args:
        shapes: The ten shape functions at the places of the makeup, shape [p, 10].
        exact: The matrix of a homogeneous element of volume and density 1, shape [10, 10].
    """
    densities = filling.makeup.densities
    least = densities.min(axis=1)
    more = densities - least[:, None]
    products = np.einsum("pa,pb->pab", shapes, shapes)
    # products that are sampled have another sum than exact ones: what is denser takes the share that is right for all
    sampled = products.mean(axis=0)
    denser = np.tensordot(more, products, 1) / len(shapes)
    share = more.mean(axis=1)[:, None, None]
    return np.asarray(least[:, None, None] * exact + denser + share * (exact - sampled))
