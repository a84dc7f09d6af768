"""Interface patches of a flexible body: parts of its surface to which joints are attached, and which stay rigid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calmotion.errors import ShotError
from calmotion.geometry.distances import closest_on_triangles
from calmotion.reduction.elements.assembly import QuadraticMesh
from calmotion.reduction.interfaces.automatic_patch import automatic_radius, end_face, nodes_of_area
from calmotion.reduction.interfaces.far_frames import LARGEST_GAP, OUTSIDE, far_frame, inside_hull
from calmotion.reduction.interfaces.named_patch import named_patch
from calmotion.shot.character import Array, Frame, IntArray, InterfaceSurface

_GROWTH = 1.25
_SPREAD = 0.2  # second largest over largest extent below which a patch is a line and cannot carry a moment


@dataclass(frozen=True, eq=False)
class AttachmentFrame:
    """A frame on a body to which a joint is attached, or at which a target is measured.

    Attributes:
        path: Prim path of the joint or target, for errors.
        frame: Its frame in the body frame, undeformed.
        kind: `interface` (a joint: an interface patch moves rigidly with the frame) or `point` (a target).
        surface: The part of the surface that the shot names as interface of the joint, or None.
    """

    path: str
    frame: Frame
    kind: str
    surface: InterfaceSurface | None = None


@dataclass(frozen=True, eq=False)
class InterfacePatch:
    """A part of the surface that moves as a rigid body.

    Attributes:
        nodes: Surface nodes, ascending.
        attachments: Indices of the attachment frames that it carries, all at one position.
        radius: Largest distance of its nodes from them, or the radius that it was made with [m].
    """

    nodes: IntArray
    attachments: tuple[int, ...]
    radius: float


def interface_patches(
    mesh: QuadraticMesh, attachments: Sequence[AttachmentFrame], radius: float, body: str
) -> list[InterfacePatch]:
    """The interface patches of a body, in the order of their first attachment frames.

    Attachment frames of kind `interface` at one position share a patch, unless they name their surfaces. A node on a
    named surface belongs to the patch of that surface; a node that two patches could take belongs to the patch of the
    nearer attachment frame.

    Args:
        mesh: Of the body.
        attachments: All attachment frames; those of kind `point` are ignored.
        radius: Radius of the patches [m]; negative: chosen for each attachment frame (`automatic_radius`).
        body: Prim path of the body, for errors.

    Raises:
        ShotError: An attachment frame touches no surface, its patch carries no moment, or two named patches overlap.
    """
    size = float(np.linalg.norm(np.ptp(mesh.nodes, axis=0)))
    groups: list[list[int]] = []
    for index, attachment in enumerate(attachments):
        if attachment.kind != "interface":
            continue
        at = attachment.frame.position
        for group in groups:
            if (
                attachment.surface is None
                and attachments[group[0]].surface is None
                and np.linalg.norm(attachments[group[0]].frame.position - at) < 1e-6 * size
            ):
                group.append(index)
                break
        else:
            groups.append([index])
    centers = np.array([attachments[group[0]].frame.position for group in groups]).reshape(-1, 3)
    triangles = mesh.nodes[mesh.surface[:, :3]]
    surface = mesh.surface_nodes
    distance = np.linalg.norm(mesh.nodes[surface][None] - centers[:, None], axis=-1)
    nearest = distance.argmin(axis=0)
    named = _named_patches(mesh, attachments, groups, body)
    taken = np.isin(surface, np.concatenate([np.zeros(0, np.int32), *named.values()]))
    patches = []
    for k, group in enumerate(groups):
        if k in named:
            extent = float(np.linalg.norm(mesh.nodes[named[k]] - centers[k], axis=1).max())
            patches.append(InterfacePatch(nodes=named[k], attachments=tuple(group), radius=extent))
            continue
        candidates = surface[(nearest == k) & ~taken]
        others = np.delete(centers, k, axis=0)
        room = float(np.linalg.norm(others - centers[k], axis=1).min()) if len(others) else np.inf
        patches.append(_patch(mesh, triangles, candidates, attachments, group, radius, room, size, body))
    return patches


def _named_patches(
    mesh: QuadraticMesh, attachments: Sequence[AttachmentFrame], groups: list[list[int]], body: str
) -> dict[int, IntArray]:
    """Nodes of the patches whose surface the shot names, by group."""
    patches: dict[int, IntArray] = {}
    for k, group in enumerate(groups):
        surface = attachments[group[0]].surface
        if surface is None:
            continue
        nodes = named_patch(mesh, surface.triangles)
        if not spans_a_plane(mesh.nodes[nodes]):
            raise ShotError(
                f"this interface of {attachments[group[0]].path} is too small to carry a joint",
                path=surface.path, attribute="indices", found=f"{len(nodes)} nodes of the mesh of {body} on it",
                remedy="Add faces to it, or author a smaller calm:flexible:elementSize",
            )  # fmt: skip
        for other, taken in patches.items():
            if np.intersect1d(nodes, taken).size:
                raise ShotError(
                    f"this interface overlaps that of {attachments[groups[other][0]].path}",
                    path=surface.path, attribute="indices", remedy="Leave a face between the two, or join them by one",
                )  # fmt: skip
        patches[k] = nodes
    return patches


def _patch(
    mesh: QuadraticMesh, triangles: Array, candidates: IntArray, attachments: Sequence[AttachmentFrame],
    group: list[int], radius: float, room: float, size: float, body: str,
) -> InterfacePatch:  # fmt: skip
    center, path = attachments[group[0]].frame.position, attachments[group[0]].path
    closest = closest_on_triangles(center, triangles)
    gaps = np.linalg.norm(closest - center, axis=1)
    gap = float(gaps.min())
    automatic = radius < 0.0
    if automatic:
        inside = inside_hull(mesh.nodes[mesh.surface_nodes], center, OUTSIDE * size)
        largest_gap = LARGEST_GAP * size if inside else 0.0
        radius = automatic_radius(center, triangles, closest, gaps, room)
    else:
        largest_gap = radius
    if gap > largest_gap:
        raise far_frame(path, body, gap, center, radius)
    if automatic:
        face = np.intersect1d(end_face(mesh, center, triangles, closest, gaps, room), candidates)
        if spans_a_plane(mesh.nodes[face]):
            extent = float(np.linalg.norm(mesh.nodes[face] - center, axis=1).max())
            return InterfacePatch(nodes=face.astype(np.int32), attachments=tuple(group), radius=extent)
    nodes = nodes_of_area(mesh, candidates, center, radius)
    if not spans_a_plane(mesh.nodes[nodes]):
        # elements larger than the radius: the nearest surface triangle is the smallest patch that carries a moment
        touched = np.intersect1d(mesh.surface[gaps <= gap + 1e-9 * size].ravel(), candidates)
        nodes = np.union1d(nodes, touched)
    while automatic and not spans_a_plane(mesh.nodes[nodes]) and radius < min(0.5 * size, room):
        radius *= _GROWTH
        nodes = nodes_of_area(mesh, candidates, center, radius)
    if not spans_a_plane(mesh.nodes[nodes]):
        raise ShotError(
            f"the surface near the attachment frame of {path} is too small to carry a joint",
            path=body, attribute="calm:flexible:interfaceRadius", found=f"{len(nodes)} nodes within {radius:.4g} m",
            remedy="Author a larger interfaceRadius or a smaller elementSize, or move the joints apart",
        )  # fmt: skip
    return InterfacePatch(nodes=nodes.astype(np.int32), attachments=tuple(group), radius=radius)


def spans_a_plane(points: Array) -> bool:
    """Whether points are three or more, and not (nearly) on one line."""
    if len(points) < 3:
        return False
    extent = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(extent[1] > _SPREAD * extent[0])
