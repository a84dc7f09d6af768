"""Mass of a body filled with linear tetrahedra."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.mesh.parts.makeup import Makeup
from calmotion.mesh.tetrahedra import tet_volumes
from calmotion.model.character import MassProperties


def mass_of_tets(
    points: Array, tets: IntArray, density: float, mass: float | None = None, makeup: Makeup | None = None
) -> MassProperties:  # fmt: skip
    """Mass properties of homogeneous tetrahedra, exact.

    Args:
        points: [m], shape [n, 3].
        tets: Shape [m, 4], of either orientation.
        density: [kg/m^3].
        mass: Total mass to which the density is scaled [kg]; None keeps the density.
        makeup: Of a body of several materials; each tetrahedron has its mean density.

    Source: int x x^T over a tetrahedron is V (sum x_i x_i^T + (sum x_i)(sum x_i)^T) / 20.
    """
    volume = np.abs(tet_volumes(points, tets))
    if makeup is not None:
        volume = volume * makeup.density
    if mass is not None:
        density = mass / float(volume.sum())
    weight = density * volume
    total = float(weight.sum())
    corners = points[tets]
    center = weight @ corners.mean(axis=1) / total
    arms = corners - center
    sums = arms.sum(axis=1)
    second = np.einsum("e,eki,ekj->ij", weight, arms, arms) + np.einsum("e,ei,ej->ij", weight, sums, sums)
    second /= 20.0
    return MassProperties(total, center, np.trace(second) * np.eye(3) - second)
