"""Unions of solids with manifold3d."""

from collections.abc import Sequence
from typing import Any

import manifold3d
import numpy as np

from calmotion.mesh.repair.closing import Part


class NotManifold(Exception):
    """A part is not a manifold, not even with directed edges."""


def united(parts: Sequence[Part]) -> Part:
    """The union of parts. Intersections of a part with itself are not resolved.

    Args:
        parts: Closed and outward, cavities inward.

    Raises:
        NotManifold: manifold3d refuses a part.
    """
    return part_of(manifold3d.Manifold.batch_boolean([manifold_of(part) for part in parts], manifold3d.OpType.Add))


def without_detail(part: Part, tolerance: float) -> Part:
    """A closed surface without detail below a distance; the same one where manifold3d refuses it."""
    try:
        coarse = manifold_of(part).simplify(tolerance)
    except NotManifold:  # closed only with directed edges counted: the tetrahedraliser takes the original surface
        return part
    return part if coarse.is_empty() else part_of(coarse)


def manifold_of(part: Part) -> Any:
    """The manifold3d.Manifold of a closed surface."""
    made = manifold3d.Manifold(manifold3d.Mesh64(part.points, part.triangles.astype(np.uint64)))
    if made.status() != manifold3d.Error.NoError:
        raise NotManifold(str(made.status()))
    return made


def part_of(manifold: Any) -> Part:
    """The surface of a manifold3d.Manifold."""
    mesh = manifold.to_mesh64()
    return Part(np.array(mesh.vert_properties, dtype=float)[:, :3], np.array(mesh.tri_verts, dtype=np.int64))
