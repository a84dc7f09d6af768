"""Interface patches of a flexible body: parts of its surface to which joints are attached, and which stay rigid."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import Array, IntArray, box_diagonal
from calmotion.errors import ShotError
from calmotion.mesh.patches.automatic_patch import (
    ROOM,
    Skin,
    automatic_radius,
    end_face,
    least_radius,
    nodes_of_area,
    radius_alike,
)
from calmotion.mesh.patches.contact_place import contact_place
from calmotion.mesh.patches.joint_places import TIE, Ball, balls_between, cut_at, nearest_apart, reached_by, within
from calmotion.mesh.patches.named_patch import named_patch
from calmotion.mesh.patches.seats import other_cheek, seat_radius
from calmotion.mesh.quadratic import QuadraticMesh
from calmotion.mesh.surfaces.distances import closest_on_triangles
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.model.character import Frame, InterfaceSurface
from calmotion.model.meshes import CutPatch

_GROWTH = 1.25
_FEWEST = 6  # nodes of a triangle
_ON = 1e-7  # of the diagonal: distance of a node from the triangle that it is on
LEAST = 0.01  # of the size of a body: radius of a patch, which is then a fiftieth of the body across
_SPREAD = 1e-3  # second largest over largest extent below which nodes are on a line; the end of a thin strip is not


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
        attachments: Indices of the attachment frames that it carries, all at one place.
        radius: Largest distance of its nodes from the first, or the radius that it was made with [m].
        center: Of the sphere with this radius that it lies in [m], shape [3]; None where it is no such part.
        balls: That it lies in as well, see `balls_between`; those that contain the sphere are left out.
        opposite: Center of a second sphere of this radius that it lies in, at the other cheek of a fork, or None.
    """

    nodes: IntArray
    attachments: tuple[int, ...]
    radius: float
    center: Array | None = None
    balls: tuple[Ball, ...] = ()
    opposite: Array | None = None

    @property
    def centers(self) -> tuple[Array, ...]:
        """Of its spheres [m]."""
        return tuple(center for center in (self.center, self.opposite) if center is not None)


def interface_patches(
    mesh: QuadraticMesh, attachments: Sequence[AttachmentFrame], radius: float, body: str,
    cut: Sequence[CutPatch] = (), meshed: Skin | None = None,
) -> list[InterfacePatch]:  # fmt: skip
    """The interface patches of a body, in the order of their first attachment frames.

    A frame that does not touch the body holds it at its contact place (`contact_place`), one with a given radius that
    nothing is in at the nearest place. Attachment frames of kind `interface` at one place (`nearest_apart`) share a
    patch, unless they name their surfaces. A node on a named surface belongs to the patch of that surface; between two
    other patches surface is left (`balls_between`).

    Args:
        attachments: All attachment frames; those of kind `point` are ignored.
        radius: Radius of the patches [m]; negative: chosen for each attachment frame (`automatic_radius`).
        body: Prim path of the body, for errors.
        cut: Patches along whose rims the mesh is cut; they are as they are.
        meshed: The surface that was meshed, by which places and radii do not depend on the elements; None: that of the
            mesh.

    Raises:
        ShotError: A patch carries no moment, two named patches overlap, or patches of a given radius hold all of the
            surface.
    """
    size = box_diagonal(mesh.nodes)
    if radius >= size:
        raise _nothing_left(body, radius, size)
    skin = meshed or mesh
    measured = skin.nodes[skin.surface[:, :3]]
    groups = at_one_place(attachments, nearest_apart(measured, radius))
    least = min(LEAST * size, least_radius(measured)) if radius < 0.0 else 0.0
    one = max(least / ROOM, TIE * size)  # places that are nearer to each other divide what is there
    surface = mesh.surface_nodes
    named = _named_patches(mesh, attachments, groups, body)
    frames = [attachments[group[0]].frame for group in groups]
    contacts = [
        None
        if k in named or radius >= 0.0
        else contact_place(frame.position, frame.axis, measured, measured.reshape(-1, 3))
        for k, frame in enumerate(frames)
    ]
    centers = np.array([f.position if c is None else c.position for f, c in zip(frames, contacts, strict=True)])
    centers = centers.reshape(-1, 3)
    distance = np.linalg.norm(mesh.nodes[surface][None] - centers[:, None], axis=-1)
    # where frames away from the body have one contact place, the surface there is divided by their own positions
    origins = np.array([frame.position for frame in frames]).reshape(-1, 3)
    distance += TIE * np.linalg.norm(mesh.nodes[surface][None] - origins[:, None], axis=-1)
    nearest = distance.argmin(axis=0)
    taken = np.isin(surface, np.concatenate([np.zeros(0, np.int32), *named.values()]))
    patches: list[InterfacePatch] = []
    for k, group in enumerate(groups):
        if k in named:
            extent = float(np.linalg.norm(mesh.nodes[named[k]] - centers[k], axis=1).max())
            patches.append(InterfacePatch(nodes=named[k], attachments=tuple(group), radius=extent))
            continue
        free = surface[~taken]
        candidates = surface[(nearest == k) & ~taken]
        known = cut_at(frames[k].position, cut, size)
        patch = None if known is None else _cut_patch(mesh, candidates, known, group, size, least)
        if patch is None:
            balls = balls_between(centers, k, one)
            candidates = candidates[within(mesh.nodes[candidates], balls)]
            others = np.linalg.norm(np.delete(centers, k, axis=0) - centers[k], axis=1)
            room = float(others.min(initial=np.inf, where=others > one))
            place = Place(centers[k], frames[k].axis, skin, measured, room, least)
            patch = _patch(mesh, candidates, free, place, attachments[group[0]].path, group, radius, body)
            patch = replace(patch, balls=reached_by(balls, patch.centers, patch.radius))
        taken |= np.isin(surface, patch.nodes)
        patches.append(patch)
    if patches and radius >= 0.0 and np.all(taken | (distance.min(axis=0) <= radius)):
        raise _nothing_left(body, radius, size)
    return patches


def at_one_place(attachments: Sequence[AttachmentFrame], apart: float) -> list[list[int]]:
    """Indices of the attachment frames of kind `interface`: those that share a patch together.

    Args:
        attachments: All attachment frames; a surface that the shot names has one frame.
        apart: Of `nearest_apart` [m].
    """
    groups: list[list[int]] = []
    for index, attachment in enumerate(attachments):
        if attachment.kind != "interface":
            continue
        for group in groups:
            first = attachments[group[0]]
            away = np.linalg.norm(first.frame.position - attachment.frame.position)
            if attachment.surface is None and first.surface is None and away < apart:
                group.append(index)
                break
        else:
            groups.append([index])
    return groups


def _cut_patch(
    mesh: QuadraticMesh, candidates: IntArray, cut: CutPatch, group: list[int], size: float, least: float
) -> InterfacePatch | None:
    """The patch of the nodes on the triangles of a cut patch; None where nearer joints have too many of them."""
    corners = np.arange(3 * len(cut.triangles)).reshape(-1, 3)
    near = NearbyTriangles(cut.triangles.reshape(-1, 3), corners, _ON * size)
    nodes = candidates[np.isfinite(near.closest(mesh.nodes[candidates])[:, 0])]
    if not carries(mesh.nodes[nodes], least):
        return None
    extent = float(np.linalg.norm(mesh.nodes[nodes] - cut.origin, axis=1).max())
    return InterfacePatch(nodes=nodes.astype(np.int32), attachments=tuple(group), radius=extent)


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
                path=surface.path,
                attribute="indices",
                found=f"{len(nodes)} nodes of the mesh of {body} on it",
                remedy="Add faces to it, or author a smaller calm:flexible:elementSize",
            )
        for other, taken in patches.items():
            if np.intersect1d(nodes, taken).size:
                raise overlapping(surface, attachments[groups[other][0]].path)
        patches[k] = nodes
    return patches


def overlapping(surface: InterfaceSurface, joint: str) -> ShotError:
    """The error about a named interface that overlaps that of another joint."""
    return ShotError(
        f"this interface overlaps that of {joint}",
        path=surface.path,
        attribute="indices",
        remedy="Leave a face between the two, or join them by one",
    )


def _nothing_left(body: str, radius: float, size: float) -> ShotError:
    return ShotError(
        "the interfaces of the joints are so large that nothing of the body is left to bend",
        path=body,
        attribute="calm:flexible:interfaceRadius",
        found=f"{radius:.4g} m, on a body of {size:.4g} m",
        remedy="Author a smaller radius, in the units of the stage; or remove it: it is then measured",
    )


@dataclass(frozen=True, eq=False)
class Place:
    """Where a joint takes hold of a body.

    Attributes:
        center: [m], shape [3].
        axis: Of the joint, unit vector, shape [3].
        skin: The surface that is measured.
        triangles: Of it [m], shape [k, 3, 3].
        room: Distance to the next place [m].
        least: Least radius of what is held there [m]; what is smaller gives way to the next larger seat.
    """

    center: Array
    axis: Array
    skin: Skin
    triangles: Array
    room: float
    least: float

    def end_and_radius(self) -> tuple[bool, float]:
        """Whether the joint holds an end face, and the radius of what it holds [m]."""
        closest = closest_on_triangles(self.center, self.triangles)
        gaps = np.linalg.norm(closest - self.center, axis=1)
        face = end_face(self.skin, self.center, self.triangles, closest, gaps, self.room)
        if carries(self.skin.nodes[face], self.least):
            return True, float(np.linalg.norm(self.skin.nodes[face] - self.center, axis=1).max())
        seat = seat_radius(self.center, self.axis, self.triangles)
        if seat is None:
            radius = automatic_radius(self.center, self.triangles, closest, gaps, self.room)
            if spans_a_plane(self.skin.nodes[face]):  # the end of a detail: what carries it is not measured there
                radius = max(radius, min(radius_alike(self.triangles), ROOM * self.room))
            return False, radius
        return False, min(seat, max(ROOM * self.room, 1.25 * float(gaps.min())))


def _patch(
    mesh: QuadraticMesh, candidates: IntArray, free: IntArray, place: Place, path: str, group: list[int],
    radius: float, body: str,
) -> InterfacePatch:  # fmt: skip
    size = box_diagonal(mesh.nodes)
    center, triangles = place.center, mesh.nodes[mesh.surface[:, :3]]
    closest = closest_on_triangles(center, triangles)
    gaps = np.linalg.norm(closest - center, axis=1)
    gap = float(gaps.min())
    automatic = radius < 0.0
    if not automatic and gap > radius:  # nothing of the surface is inside: the radius counts from the nearest place
        center = closest[int(gaps.argmin())]
        closest = closest_on_triangles(center, triangles)
        gaps = np.linalg.norm(closest - center, axis=1)
        gap = float(gaps.min())
    if automatic:
        is_end, radius = place.end_and_radius()
        radius = max(radius, 1.25 * gap)
        face = np.zeros(0, dtype=np.int32)
        if is_end:
            face = np.intersect1d(end_face(mesh, center, triangles, closest, gaps, place.room), candidates)
        if carries(mesh.nodes[face], place.least):
            extent = float(np.linalg.norm(mesh.nodes[face] - center, axis=1).max())
            return InterfacePatch(nodes=face.astype(np.int32), attachments=tuple(group), radius=extent)
    nodes = nodes_of_area(mesh, candidates, center, radius, place.axis, given=not automatic)
    if not spans_a_plane(mesh.nodes[nodes]):
        # elements larger than the radius: the nearest surface triangle is the smallest patch that carries a moment
        touched = np.intersect1d(mesh.surface[gaps <= gap + 1e-9 * size].ravel(), candidates)
        nodes = np.union1d(nodes, touched)
    while automatic and not carries(mesh.nodes[nodes], place.least) and radius < size:
        radius *= _GROWTH
        nodes = nodes_of_area(mesh, candidates, center, radius, place.axis)
    if automatic and not carries(mesh.nodes[nodes], place.least):
        # frames so near to each other that one has hardly any surface
        nodes = _nearest_spanning(mesh, free, center, place.least)
    if not spans_a_plane(mesh.nodes[nodes]):
        raise ShotError(
            f"the surface near the attachment frame of {path} is too small to carry a joint",
            path=body,
            attribute="calm:flexible:interfaceRadius",
            found=f"{len(nodes)} nodes within {radius:.4g} m",
            remedy="Move the joints apart, or author a smaller elementSize or another interfaceRadius",
        )
    opposite = other_cheek(place.skin, center, radius, place.axis) if automatic else None
    if opposite is not None:
        nodes = np.union1d(nodes, nodes_of_area(mesh, candidates, opposite, radius, place.axis))
    return InterfacePatch(nodes.astype(np.int32), tuple(group), radius, center, opposite=opposite)


def _nearest_spanning(mesh: QuadraticMesh, free: IntArray, center: Array, least: float) -> IntArray:
    """The nearest nodes that carry a moment, of those that no other patch has."""
    order = free[np.argsort(np.linalg.norm(mesh.nodes[free] - center, axis=1), kind="stable")]
    for count in range(_FEWEST, len(order) + 1):
        if carries(mesh.nodes[order[:count]], least):
            return np.sort(order[:count])
    return order


def spans_a_plane(points: Array) -> bool:
    """Whether points are three or more, and not on one line, so that they carry a moment about every axis."""
    if len(points) < 3:
        return False
    extent = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(extent[1] > _SPREAD * extent[0])


def carries(points: Array, least: float) -> bool:
    """Whether points span a plane and are as far from their mean as a patch must be wide, `least` [m]."""
    return spans_a_plane(points) and float(np.linalg.norm(points - points.mean(axis=0), axis=1).max()) >= least
