"""Tetrahedra of a regular grid in place of those that would take too long."""

from __future__ import annotations

import numpy as np
from calmotion.accuracy.element_size import Shape, expected_nodes, smallest_size
from calmotion.geometry.grid_tets import GRID, grid_tets
from calmotion.geometry.tetrahedra import measure_quality
from calmotion.shot import Body, FEMesh

from .repair import Solid

# Largest number of nodes of ten-node tetrahedra: twice as many where walls are
# thin, for some ten seconds; walls that are thinner than the spacing have gaps
_NODES = 16_000
_WALL = 0.8  # of the thinner walls: spacing with which they have none
_FINER, _GOOD = 0.8, 0.01  # factor of the spacing while the volume error is not good


def on_grid(index: int, body: Body, solid: Solid, shape: Shape, size: float) -> FEMesh | None:
    """A mesh of a grid, as close to a solid as a number of nodes allows; None where no grid is fine enough for any.

    Args:
        index: Of the body in its character.
        body: For the path in messages.
        solid: Closed.
        shape: Of the solid.
        size: Wanted edge length of the elements [m].
    """
    least = smallest_size(shape, _NODES) / GRID
    spacing = max(min(size / GRID, _WALL * shape.thickness), least)
    best: FEMesh | None = None
    while True:
        try:
            points, tets = grid_tets(solid.points, solid.triangles, spacing)
        except ValueError:
            pass
        else:
            quality = measure_quality(points, tets, surface_volume=solid.volume, repairs=solid.repairs)
            if best is None or quality.volume_error < best.quality.volume_error:
                best = FEMesh(index, points, tets, quality)
        if spacing <= least or (best is not None and best.quality.volume_error <= _GOOD):
            return best
        spacing = max(_FINER * spacing, least)


def grid_note(mesh: FEMesh, shape: Shape, size: float, reason: str) -> str:
    """Message about a mesh of a grid."""
    edges = mesh.points[mesh.tets[:, [0, 0, 0, 1, 1, 2]]] - mesh.points[mesh.tets[:, [1, 2, 3, 2, 3, 3]]]
    length = float(np.median(np.linalg.norm(edges, axis=2)))
    finer = "" if expected_nodes(shape, size) > _NODES else "; author a smaller calm:flexible:elementSize to follow more"
    return (
        f"meshed on a grid with elements of {1e3 * length:.2g} mm, since {reason}: details and walls that are thinner "
        f"are missing, {100.0 * mesh.quality.volume_error:.2g}% of its volume{finer}"
    )
