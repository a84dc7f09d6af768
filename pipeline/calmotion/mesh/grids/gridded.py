"""Tetrahedra of a grid, in place of those that follow the surface and take too long."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from calmotion.errors import ShotError
from calmotion.mesh.element_sizes import Shape, expected_nodes, smallest_size
from calmotion.mesh.grids.boundary_fit import fitted
from calmotion.mesh.grids.grid_tets import GRID, grid_tets
from calmotion.mesh.repair.closed_solid import Solid
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.mesh.tetrahedra import measure_quality
from calmotion.mesh.tetrahedralize.tetwild import ProcessorTime
from calmotion.model import Body, FEMesh

# Largest number of nodes of ten-node tetrahedra: twice as many where walls are thin, for some ten seconds (with 16,000,
# links took 21 to 34 s and were no more exact); walls that are thinner than the spacing have gaps. A longer limit of
# time allows more.
_GRID_NODES, _GRID_TIME = 10_000, 60.0
_GRID_WALL = 0.8  # of the thinner walls: spacing with which they have none
# Factor of the spacing while the volume error is larger than that; largest way of a corner to the surface
_FINER, _NEAR_VOLUME, _MOVED = 0.8, 0.02, 0.5


def gridded(
    index: int, body: Body, solid: Solid, shape: Shape, size: float, reason: ShotError, time: ProcessorTime,
    lost: float,
) -> FEMesh | None:  # fmt: skip
    """The tetrahedra of a grid, for a reason; None where it does not resolve thin walls; arguments as of `on_grid`.

    Args:
        reason: Why the surface is not followed.
        time: Of the body; its limit decides how many nodes there may be.
        lost: Largest error of the volume, which is reported.
    """
    nodes = int(_GRID_NODES * max(time.limit / _GRID_TIME, 1.0))
    mesh = on_grid(index, body, solid, shape, size, nodes)
    if mesh is None or mesh.quality.volume_error > lost:
        return None
    followed = expected_nodes(shape, size) <= nodes
    note = _note(mesh, f"{reason.problem} ({reason.found})", followed)
    return replace(mesh, quality=replace(mesh.quality, repairs=(*mesh.quality.repairs, note)))


def on_grid(index: int, body: Body, solid: Solid, shape: Shape, size: float, nodes: int) -> FEMesh | None:
    """A mesh of a grid, as close to a solid as a number of nodes allows; None where no grid is fine enough for any.

    Args:
        index: Of the body in its character.
        body: For the path in messages.
        solid: Closed.
        shape: Of the solid.
        size: Wanted edge length of the elements [m].
        nodes: Of ten-node tetrahedra at most, on walls that are not thin.
    """
    least = smallest_size(shape, nodes) / GRID
    spacing = max(min(size / GRID, _GRID_WALL * shape.thickness), least)
    best: FEMesh | None = None
    while True:
        try:
            points, tets = grid_tets(solid.points, solid.triangles, spacing)
            near = NearbyTriangles(solid.points, solid.triangles, _MOVED * spacing)
            points = fitted(points, tets, near)  # with its edges
        except ValueError:
            pass
        else:
            quality = measure_quality(points, tets, surface_volume=solid.volume, repairs=solid.repairs)
            if best is None or quality.volume_error < best.quality.volume_error:
                best = FEMesh(index, points, tets, quality)
        if spacing <= least or (best is not None and best.quality.volume_error <= _NEAR_VOLUME):
            return best
        spacing = max(_FINER * spacing, least)


def _note(mesh: FEMesh, reason: str, followed: bool) -> str:
    """Message about a mesh of a grid; `followed`: whether elements of the wanted size were possible."""
    edges = mesh.points[mesh.tets[:, [0, 0, 0, 1, 1, 2]]] - mesh.points[mesh.tets[:, [1, 2, 3, 2, 3, 3]]]
    length = float(np.median(np.linalg.norm(edges, axis=2)))
    finer = "; author a smaller calm:flexible:elementSize to follow more" if followed else ""
    return (
        f"meshed on a grid with elements of {1e3 * length:.2g} mm, since {reason}: details and walls that are thinner "
        f"are missing, {100.0 * mesh.quality.volume_error:.2g}% of its volume{finer}"
    )
