"""A flexible body by beams and sections: rough, and in half a second without a mesh.

Its first frequency is within a factor of two of that of a mesh for nine of ten links of robots, see
docs/evidence/meshing.md. Not seen are walls that bend by themselves, sections that do not stay plane, as at junctions,
and detail below a cell.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import diags
from scipy.sparse.linalg import eigsh, splu
from scipy.spatial import cKDTree

from calmotion.arrays import Array, Indices, box_diagonal
from calmotion.errors import ShotError
from calmotion.mesh.mass import joined_surfaces
from calmotion.mesh.mesh_file import read_mesh_file
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.tetrahedra import boundary_triangles
from calmotion.model.character import Body, Frame, TetGeometry
from calmotion.reduction.damping import damped
from calmotion.reduction.inertia import inertia_integrals
from calmotion.reduction.reduced_body import Marker, ReducedBody
from calmotion.reduction.sections.bands import Bands, bands_of
from calmotion.reduction.sections.cells import Cells, cells_of
from calmotion.reduction.sections.frame import BeamFrame, carried, frame_of
from calmotion.reduction.sections.held import Outside, held_cells

_WELD = 1e-5  # of the size of a body: distance of corners that are one
_MODES, _SOUGHT = 8, 16  # coordinates of a body, and modes of its frame that are looked at
# Of the mass that moves, or turns, with a mode: scraps of surface that swing by themselves are no modes of the body
_PART = 0.02


def estimated_body(body: Body, attachments: Sequence[AttachmentFrame], root: int) -> tuple[ReducedBody, float]:
    """The reduced body of a frame of beams, without skin, nodes and elements, and its volume [m^3].

    Args:
        body: With `flexible` settings. A `mass` scales the density to that total mass.
        attachments: Frames of its joints and targets, body frame.
        root: Index of the frame of the joint to the parent.

    Raises:
        ShotError: It has no geometry, or its surfaces enclose no volume.
    """
    assert body.flexible is not None
    settings, frames = body.flexible, [a.frame for a in attachments]
    order = [root, *(k for k, a in enumerate(attachments) if k != root and a.kind == "interface")]
    cells, points, triangles = _filled(body, [frames[k] for k in order])
    outside = Outside(points, triangles[~cells.buried(points[triangles].mean(axis=1))])
    held = held_cells(cells, outside, list(attachments), root, settings.interface_radius)
    bands = bands_of(cells, held)
    mass = None if body.mass is None else body.mass.mass
    frame = frame_of(cells, bands, settings.material, mass)
    at = _carriers(cells, bands, frames)
    omega_squared, modes = _modes(frame, sorted({at[k] for k in order} - {0}))
    weights = np.repeat(frame.point_mass, 6)
    r = len(omega_squared)
    reduced = ReducedBody(
        invariants=inertia_integrals(frame.points.reshape(-1, 3), _diagonal(weights), frame.displacements(modes)),
        stiffness=omega_squared,
        damping=np.zeros((r, r)),
        markers=tuple(_marker(own, frame, modes, node) for own, node in zip(frames, at, strict=True)),
    )
    return damped(reduced, settings.material), cells.volume


def _filled(body: Body, frames: Sequence[Frame]) -> tuple[Cells, Array, Indices]:
    """The cells of a body, and the surface that they are in.

    Raises:
        ShotError: There is none, or it encloses no volume.
    """
    assert body.flexible is not None
    for points, triangles in _surfaces(body):
        cells = cells_of(points, triangles, body.flexible)
        if cells is not None:
            return cells, points, triangles
    from calmotion.mesh.sources.beam import equivalent_beam  # loads manifold3d, which surfaces do without

    solid = equivalent_beam(body, frames)
    cells = cells_of(solid.points, solid.triangles, body.flexible)
    if cells is None:
        raise ShotError(
            "its surfaces enclose no volume",
            path=body.path,
            found="no cell of a grid is inside",
            remedy="Add a closed Mesh below it, or name a mesh file in calm:flexible:meshFile",
        )
    return cells, solid.points, solid.triangles


def _surfaces(body: Body) -> list[tuple[Array, Indices]]:
    """Points and triangles of what the solid of a body may be made of, the best first."""
    settings = body.flexible
    assert settings is not None
    if settings.geometry == "beam":
        return []
    tets, surfaces = body.tets, body.surfaces
    if tets is None and settings.mesh_file:
        geometry, _ = read_mesh_file(settings.mesh_file, settings.mesh_scale, body.path)
        if isinstance(geometry, TetGeometry):
            tets = geometry
        else:
            surfaces = geometry
    if tets is not None:
        return [(np.asarray(tets.points, dtype=float), boundary_triangles(np.asarray(tets.tets)))]
    filled = [surface for surface in surfaces if len(surface.triangles)]
    groups = [[s for s in filled if s.visible], [s for s in filled if not s.visible]]
    if settings.geometry == "collision":
        groups.reverse()
    joined = (joined_surfaces(group) for group in groups if group)
    return [_welded(*found) for found in joined if found is not None and np.isfinite(found[0]).all()]


def _welded(points: Array, triangles: Indices) -> tuple[Array, Indices]:
    """A surface whose triangles share their corners, which tells what is one part."""
    size = box_diagonal(points[triangles.ravel()])
    if not size > 0.0:
        return points, triangles
    places = np.round((points - points[triangles.ravel()].min(axis=0)) / (_WELD * size)).astype(np.int64)
    _, first, into = np.unique(places @ (1 << np.array([40, 20, 0])), return_index=True, return_inverse=True)
    return points[first], into[triangles]


def _carriers(cells: Cells, bands: Bands, frames: Sequence[Frame]) -> list[int]:
    """The section that carries each frame: that of the nearest cell at the surface."""
    outside = np.flatnonzero(cells.outside)
    nearest = cKDTree(cells.places[outside]).query(np.array([f.position for f in frames]).reshape(-1, 3))[1]
    return [int(k) for k in bands.section[outside[nearest]]]


def _diagonal(weights: Array) -> Any:
    return diags(weights)


def _modes(frame: BeamFrame, loaded: Sequence[int]) -> tuple[Array, Array]:
    """The lowest modes in the span of natural modes and of what loads on some nodes cause.

    Returns:
        omega^2 [1/s^2], ascending, shape [r], and motions of the nodes, mass-orthonormal, shape [s, 6, r].
    """
    free = 6 * (len(frame.nodes) - 1)
    if free == 0:
        return np.zeros(0), np.zeros((len(frame.nodes), 6, 0))
    mass, stiffness = frame.mass(), frame.stiffness
    if free <= 2 * _SOUGHT:
        natural = eigh(stiffness.toarray(), mass.toarray())[1][:, :_SOUGHT]
    else:
        values, natural = eigsh(stiffness, _SOUGHT, mass, sigma=0.0)
        natural = natural[:, np.argsort(values)]
    natural = natural[:, _moves_the_body(frame, mass, natural)][:, :_MODES]
    loads = np.zeros((free, 6 * len(loaded)))
    for k, node in enumerate(loaded):
        loads[6 * (node - 1) : 6 * node, 6 * k : 6 * k + 6] = np.eye(6)
    columns = np.hstack([natural, splu(stiffness).solve(loads)]) if len(loaded) else natural
    columns /= np.sqrt(np.einsum("ij,ij->j", columns, mass @ columns))
    size, directions = eigh(columns.T @ (mass @ columns))
    kept = size > 1e-9 * size[-1]
    columns = columns @ (directions[:, kept] / np.sqrt(size[kept]))
    omega_squared, turned = eigh(columns.T @ (stiffness @ columns))
    modes = np.vstack([np.zeros((6, columns.shape[1])), columns @ turned])
    return omega_squared[:_MODES], modes.reshape(len(frame.nodes), 6, -1)[..., :_MODES]


def _moves_the_body(frame: BeamFrame, mass: Any, modes: Array) -> Any:
    """Which modes move more than a small part of the body."""
    center = np.average(frame.nodes, axis=0, weights=frame.point_mass)
    turns = np.hstack([np.zeros((3, 3)), np.eye(3)])
    rigid = np.vstack([np.vstack([carried(node - center), turns]) for node in frame.nodes[1:]])
    moved = mass @ rigid
    part = ((modes.T @ moved) ** 2 / np.einsum("ij,ij->j", rigid, moved)).sum(axis=1)
    large = part > _PART
    return large if large.any() else np.ones(len(part), bool)


def _marker(own: Frame, frame: BeamFrame, modes: Array, node: int) -> Marker:
    motion = modes[node]
    return Marker(own.position, own.rotation, carried(own.position - frame.nodes[node]) @ motion, motion[3:])
