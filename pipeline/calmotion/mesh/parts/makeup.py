"""What the tetrahedra of a body are made of: skin and core of a printed part, or parts with their own materials."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, Indices, IntArray
from calmotion.mesh.parts.part_places import part_of_places
from calmotion.mesh.parts.print_core import places_of, skin_share
from calmotion.model.character import ElasticMaterial

_PARTS = 6  # along an edge of an element, of which each is in one part of the body


@dataclass(frozen=True, eq=False)
class Makeup:
    """The materials in the tetrahedra of a body, relative to the material of the body.

    Attributes:
        places: Barycentric coordinates of the centers of equal parts of a tetrahedron, shape [p, 4].
        moduli: Young's modulus there, shape [e, p].
        densities: Shape [e, p].
        damping: Fraction of critical damping there, absolute, shape [e, p]; None where it is that of the body.
        parts: Index of the part of the body there, shape [e, p]; None of a body without parts.
    """

    places: Array
    moduli: Array
    densities: Array
    damping: Array | None = None
    parts: Indices | None = None

    @property
    def density(self) -> Array:
        """Mean of each tetrahedron, shape [e]."""
        return np.asarray(self.densities.mean(axis=1))


def makeup_of(points: Array, tets: IntArray, material: ElasticMaterial) -> Makeup | None:
    """What tetrahedra are made of; None where all are of the material of the body.

    Args:
        points: Corners [m], shape [n, 3].
        tets: Shape [e, 4], positive volumes.
        material: Of the body, with its core or its parts.
    """
    if material.core is not None:
        core, skin = material.core, skin_share(points, tets, material.core)
        moduli, densities = (low + (1.0 - low) * skin.shares for low in (core.stiffness, core.infill))
        return Makeup(skin.places, moduli, densities)
    if not material.parts:
        return None
    places = places_of(_PARTS)
    part = part_of_places(points, tets, material.parts, places)
    moduli, densities, damping = np.array([(p.modulus, p.density, p.damping) for p in material.parts]).T
    return Makeup(places, moduli[part], densities[part], damping[part], part)
