"""Where joints take hold of a flexible body: patches of its surface that move as rigid ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calmotion.errors import ShotError
from calmotion.geometry.distances import closest_on_triangles
from calmotion.reduction.elements.assembly import QuadraticMesh
from calmotion.reduction.interfaces.automatic_patch import automatic_radius, end_face, nodes_of_area
from calmotion.reduction.interfaces.named_patch import named_patch
from calmotion.shot.character import Array, Frame, IntArray, InterfaceSurface

_GROWTH = 1.25
_SPREAD = 0.2  # second largest over largest extent below which a patch is a line and cannot carry a moment


@dataclass(frozen=True, eq=False)
class Anchor:
    """A place on a body that the dynamics asks for.

    Attributes:
        path: Prim path of the joint or target, for errors.
        frame: Its frame in the body frame, undeformed.
        kind: `interface` (a joint: a patch of the surface moves rigidly with it) or `point` (a target).
        surface: The part of the surface that the shot says it holds, or None.
    """

    path: str
    frame: Frame
    kind: str
    surface: InterfaceSurface | None = None


@dataclass(frozen=True, eq=False)
class Patch:
    """A rigid patch: surface nodes, ascending, and the indices of the anchors that it carries (same position)."""

    nodes: IntArray
    anchors: tuple[int, ...]
    radius: float


def interface_patches(mesh: QuadraticMesh, anchors: Sequence[Anchor], radius: float, body: str) -> list[Patch]:
    """The rigid patches of a body, in the order of the anchors that first name them.

    Anchors of kind `interface` at one position share a patch, unless they name their surfaces. Nodes on a named
    surface belong to it alone; any other within reach of two patches goes to the nearer anchor.

    Args:
        mesh: Of the body.
        anchors: All anchors; those of kind `point` are passed over.
        radius: [m], or negative: chosen for each anchor (`automatic_radius`).
        body: Prim path of the body, for errors.

    Raises:
        ShotError: An anchor touches no surface, or its patch cannot carry a moment, or two named ones overlap.
    """
    size = float(np.linalg.norm(np.ptp(mesh.nodes, axis=0)))
    groups: list[list[int]] = []
    for index, anchor in enumerate(anchors):
        if anchor.kind != "interface":
            continue
        at = anchor.frame.position
        for group in groups:
            if (
                anchor.surface is None
                and anchors[group[0]].surface is None
                and np.linalg.norm(anchors[group[0]].frame.position - at) < 1e-6 * size
            ):
                group.append(index)
                break
        else:
            groups.append([index])
    centers = np.array([anchors[group[0]].frame.position for group in groups]).reshape(-1, 3)
    triangles = mesh.nodes[mesh.surface[:, :3]]
    surface = mesh.surface_nodes
    distance = np.linalg.norm(mesh.nodes[surface][None] - centers[:, None], axis=-1)
    nearest = distance.argmin(axis=0)
    named = _named_patches(mesh, anchors, groups, body)
    taken = np.isin(surface, np.concatenate([np.zeros(0, np.int32), *named.values()]))
    patches = []
    for k, group in enumerate(groups):
        if k in named:
            extent = float(np.linalg.norm(mesh.nodes[named[k]] - centers[k], axis=1).max())
            patches.append(Patch(nodes=named[k], anchors=tuple(group), radius=extent))
            continue
        own = surface[(nearest == k) & ~taken]
        others = np.delete(centers, k, axis=0)
        room = float(np.linalg.norm(others - centers[k], axis=1).min()) if len(others) else np.inf
        patches.append(_patch(mesh, triangles, own, anchors, group, radius, room, size, body))
    return patches


def _named_patches(
    mesh: QuadraticMesh, anchors: Sequence[Anchor], groups: list[list[int]], body: str
) -> dict[int, IntArray]:
    """Nodes of the patches whose surface the shot names, by group."""
    found: dict[int, IntArray] = {}
    for k, group in enumerate(groups):
        surface = anchors[group[0]].surface
        if surface is None:
            continue
        nodes = named_patch(mesh, surface.triangles)
        if not spans_a_plane(mesh.nodes[nodes]):
            raise ShotError(
                f"this interface of {anchors[group[0]].path} is too small to hold a joint",
                path=surface.path, attribute="indices", found=f"{len(nodes)} nodes of the mesh of {body} on it",
                remedy="Add faces to it, or author a smaller calm:flexible:elementSize",
            )  # fmt: skip
        for other, taken in found.items():
            if np.intersect1d(nodes, taken).size:
                raise ShotError(
                    f"this interface overlaps that of {anchors[groups[other][0]].path}",
                    path=surface.path, attribute="indices", remedy="Leave a face between the two, or join them by one",
                )  # fmt: skip
        found[k] = nodes
    return found


def _patch(
    mesh: QuadraticMesh, triangles: Array, own: IntArray, anchors: Sequence[Anchor], group: list[int],
    radius: float, room: float, size: float, body: str,
) -> Patch:  # fmt: skip
    center, path = anchors[group[0]].frame.position, anchors[group[0]].path
    closest = closest_on_triangles(center, triangles)
    gaps = np.linalg.norm(closest - center, axis=1)
    gap = float(gaps.min())
    automatic = radius < 0.0
    if automatic:
        reach = 0.5 * size if _inside_hull(mesh, center, 0.05 * size) else 0.0
        radius = automatic_radius(center, triangles, closest, gaps, room)
    else:
        reach = radius
    if gap > reach:
        raise ShotError(
            f"the anchor of {path} touches no surface of this flexible body: it is {gap:.4g} m away",
            path=body, attribute="calm:flexible:interfaceRadius",
            found=f"anchor at {np.array2string(center, precision=4)} m, radius {radius:.4g} m",
            remedy="Move the joint's frame onto the body, or author an interfaceRadius larger than that distance",
        )  # fmt: skip
    if automatic:
        face = np.intersect1d(end_face(mesh, center, triangles, closest, gaps, room), own)
        if spans_a_plane(mesh.nodes[face]):
            extent = float(np.linalg.norm(mesh.nodes[face] - center, axis=1).max())
            return Patch(nodes=face.astype(np.int32), anchors=tuple(group), radius=extent)
    nodes = nodes_of_area(mesh, own, center, radius)
    if not spans_a_plane(mesh.nodes[nodes]):
        # a mesh coarser than the radius: the surface triangle that is touched is the least that holds a moment
        touched = np.intersect1d(mesh.surface[gaps <= gap + 1e-9 * size].ravel(), own)
        nodes = np.union1d(nodes, touched)
    while automatic and not spans_a_plane(mesh.nodes[nodes]) and radius < min(0.5 * size, room):
        radius *= _GROWTH
        nodes = nodes_of_area(mesh, own, center, radius)
    if not spans_a_plane(mesh.nodes[nodes]):
        raise ShotError(
            f"the surface near the anchor of {path} is too small to hold a joint",
            path=body, attribute="calm:flexible:interfaceRadius", found=f"{len(nodes)} nodes within {radius:.4g} m",
            remedy="Author a larger interfaceRadius or a smaller elementSize, or move the joints apart",
        )  # fmt: skip
    return Patch(nodes=nodes.astype(np.int32), anchors=tuple(group), radius=radius)


def spans_a_plane(points: Array) -> bool:
    """Whether points are three or more, and not (nearly) on one line."""
    if len(points) < 3:
        return False
    extent = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(extent[1] > _SPREAD * extent[0])


def _inside_hull(mesh: QuadraticMesh, point: Array, margin: float) -> bool:
    from scipy.spatial import ConvexHull

    equations = ConvexHull(mesh.nodes[mesh.surface_nodes]).equations
    return bool((equations[:, :3] @ point + equations[:, 3]).max() <= margin)
