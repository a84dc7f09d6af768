"""Mass of a body filled with linear tetrahedra."""

from __future__ import annotations

import numpy as np

from calmotion.geometry.print_core import skin_share
from calmotion.geometry.tetrahedra import tet_volumes
from calmotion.shot.character import Array, IntArray, MassProperties
from calmotion.shot.materials.printed import Core


def mass_of_tets(
    points: Array, tets: IntArray, density: float, mass: float | None = None, core: Core | None = None
) -> MassProperties:  # fmt: skip
    """Mass properties of homogeneous tetrahedra, exact.

    Args:
        points: [m], shape [n, 3].
        tets: Shape [m, 4], of either orientation.
        density: [kg/m^3].
        mass: Total mass to which the density is scaled [kg]; None keeps the density.
        core: Of a printed part; the density is then that of its skin, and each tetrahedron has its mean.

    Source: int x x^T over a tetrahedron is V (sum x_i x_i^T + (sum x_i)(sum x_i)^T) / 20.
    """
    volume = np.abs(tet_volumes(points, tets))
    if core is not None:
        volume = volume * skin_share(points, tets, core).relative(core.infill)
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
