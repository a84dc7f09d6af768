"""Links of a robot from the joints of a skeleton, their hinges, and the targets among them."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.mesh.surfaces.closed_surfaces import close
from calmotion.mesh.tetrahedra import surface_volume
from calmotion.rigging.hinge_rows import HingeRow, hinges_for

Piece = tuple[Array, IntArray]  # points [n, 3] and triangles [m, 3]
_WORDS = re.compile(r"hand|wrist|palm|foot|ankle|head", re.IGNORECASE)
_TIP = 0.1  # length of the tip of a link, of the length of the link


@dataclass(frozen=True, eq=False)
class Link:
    """A link of the robot.

    Attributes:
        joint: Index of the joint of the skeleton whose rotation it has.
        name: Unique among the links.
        parent: Index of the link that carries it, -1 for a root.
        hinges: Its rotation relative to the parent.
        piece: Its geometry in the world at the first frame, or None.
    """

    joint: int
    name: str
    parent: int
    hinges: HingeRow
    piece: Piece | None


def make_links(
    joints: Sequence[str], parents: Sequence[int], rotations: Array, skin: Piece, weights: Array, tolerance: float
) -> list[Link]:
    """Links, parents first.

    A joint that does not rotate is part of the link of its parent. A joint without geometry that carries no geometry is
    omitted.

    Args:
        joints: Names such as `Hip/Knee`, parents first.
        parents: Index of the parent of each joint, -1 for none.
        rotations: Rotation of each joint since the first frame, axes of its parent, shape [n, j, 3, 3].
        skin: Points and triangles of the skin of all joints.
        weights: Skin weight of each joint at each point, shape [points, j].
        tolerance: Largest residual angle of the hinges [rad].
    """
    bearing = set(cut_skin(*skin, weights))
    for joint in reversed(range(len(joints))):
        if joint in bearing and parents[joint] >= 0:
            bearing.add(parents[joint])
    links: list[Link] = []
    link_of = np.full(len(joints), -1)
    names: set[str] = set()
    for joint, name in enumerate(joints):
        above = int(link_of[parents[joint]]) if parents[joint] >= 0 else -1
        link_of[joint] = above
        if joint in bearing:
            row = (
                hinges_for(rotations[:, joint], tolerance) if parents[joint] >= 0 else HingeRow(*_none(len(rotations)))
            )
            if parents[joint] < 0 or len(row.axes):
                link_of[joint] = len(links)
                links.append(Link(joint, unique_name(name, names), above, row, None))
    # the joints of one link are cut as one piece
    together = np.zeros((len(weights), len(links)))
    for joint, link in enumerate(link_of):
        if link >= 0:
            together[:, link] += weights[:, joint]
    pieces = cut_skin(*skin, together)
    return [replace(link, piece=pieces.get(k)) for k, link in enumerate(links)]


def _none(count: int) -> tuple[Array, Array, Array]:
    return np.zeros((0, 3)), np.zeros((count, 0)), np.zeros(count)


def unique_name(joint: str, taken: set[str]) -> str:
    """A name for a link from the last word of a path, and none of those that are taken; it is added to these."""
    stem = re.sub(r"\W", "_", joint.split("/")[-1])
    stem = f"_{stem}" if stem[:1].isdigit() or not stem else stem
    name, number = stem, 1
    while name in taken:
        number += 1
        name = f"{stem}_{number}"
    taken.add(name)
    return name


def targets_of(links: Sequence[Link], joints: Sequence[str]) -> list[int]:
    """The links with targets: hands, feet and head by their names, else the outermost link of each limb."""
    carried = {link.parent for link in links}
    named = [k for k, link in enumerate(links) if _WORDS.search(joints[link.joint].split("/")[-1]) and link.piece]
    outer = [k for k in range(len(links)) if k not in carried and links[k].piece and links[k].parent >= 0]
    targets = []
    for k in outer:
        chain = _chain(links, k)
        # the target of fingers is that of their hand
        targets.append(next((above for above in chain if above in named), k))
    return sorted(dict.fromkeys(targets)) or [k for k, link in enumerate(links) if link.piece][-1:]


def _chain(links: Sequence[Link], k: int) -> list[int]:
    chain = []
    while k >= 0:
        chain.append(k)
        k = links[k].parent
    return chain


def tip_of(piece: Piece, origin: Array) -> Array:
    """Center of the tip of a link, the part farthest from its origin [m], world, shape [3]; the farthest point of one
    that is around its origin."""
    points, _ = piece
    away = np.linalg.norm(points - origin, axis=1)
    tip = points[away >= (1.0 - _TIP) * away.max()].mean(axis=0)
    around = np.linalg.norm(tip - origin) < 0.5 * away.max()
    return np.asarray(points[int(np.argmax(away))] if around else tip, dtype=np.float64)


_FLAT = 1e-7  # volume of a negligible piece, of that of all pieces


def cut_skin(points: Array, triangles: IntArray, weights: Array) -> dict[int, tuple[Array, IntArray]]:
    """Cut a skin into closed pieces.

    Args:
        points: [m], shape [n, 3]; coincident points are merged.
        triangles: Shape [m, 3].
        weights: Skin weight of each joint at each point, shape [n, j].

    Returns:
        Points and outward triangles of the piece of each joint whose piece has a volume.
    """
    places, same = np.unique(np.round(points, 9), axis=0, return_inverse=True)
    same = same.reshape(-1)
    merged = np.zeros((len(places), weights.shape[1]))
    np.add.at(merged, same, weights)
    faces = same[triangles]
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    faces = faces[whole]
    owners = np.argmax(merged[faces].sum(axis=1), axis=1)
    pieces = {}
    for joint in np.unique(owners):
        used, corners = np.unique(faces[owners == joint], return_inverse=True)
        closure = close(places[used], corners.reshape(-1, 3))
        piece = closure.points, closure.triangles.astype(np.int32)
        volume = surface_volume(*piece)
        if volume < 0.0:
            piece = piece[0], piece[1][:, ::-1].copy()
        pieces[int(joint)] = (*piece, abs(volume))
    least = _FLAT * sum(volume for *_, volume in pieces.values())
    return {joint: (x, t) for joint, (x, t, volume) in pieces.items() if volume > least}
