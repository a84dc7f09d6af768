"""Which joints of a skeleton become links of a robot, how each turns, and which of them matter."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calmotion.rigging.cutting import cut_skin
from calmotion.rigging.hinge_rows import HingeRow, hinges_for
from calmotion.shot.character import Array, IntArray

Piece = tuple[Array, IntArray]  # points [n, 3] and triangles [m, 3]
_WORDS = re.compile(r"hand|wrist|palm|foot|ankle|head", re.IGNORECASE)
_TIP = 0.1  # share of a link's length that is its tip


@dataclass(frozen=True, eq=False)
class Link:
    """A link of the robot.

    Attributes:
        joint: Index of the joint of the skeleton that it turns with.
        name: Unique among the links.
        parent: Index of the link that carries it, -1 for one that the world or the animation carries.
        hinges: How it turns on that.
        piece: Its geometry, in the world, as the shot begins, or None.
    """

    joint: int
    name: str
    parent: int
    hinges: HingeRow
    piece: Piece | None


def make_links(
    joints: Sequence[str], parents: Sequence[int], turns: Array, skin: Piece, weights: Array, tolerance: float
) -> list[Link]:
    """Links, each after the one that carries it.

    A joint that rests is part of the link above it; one that turns, but has no geometry and carries none, is left out.

    Args:
        joints: Names, `Hip/Knee` and so on, parents first.
        parents: Index of the joint above each, -1 for none.
        turns: Rotation of each joint in its parent's axes since the first frame, shape [n, j, 3, 3].
        skin: Of all joints.
        weights: How much each joint moves each point of it, shape [points, j].
        tolerance: What hinges may leave of a rotation [rad].
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
            row = hinges_for(turns[:, joint], tolerance) if parents[joint] >= 0 else HingeRow(*_none(len(turns)))
            if parents[joint] < 0 or len(row.axes):
                link_of[joint] = len(links)
                links.append(Link(joint, _unique(name, names), above, row, None))
    # what rests together is cut as one
    together = np.zeros((len(weights), len(links)))
    for joint, link in enumerate(link_of):
        if link >= 0:
            together[:, link] += weights[:, joint]
    pieces = cut_skin(*skin, together)
    return [replace(link, piece=pieces.get(k)) for k, link in enumerate(links)]


def _none(count: int) -> tuple[Array, Array, Array]:
    return np.zeros((0, 3)), np.zeros((count, 0)), np.zeros(count)


def _unique(joint: str, taken: set[str]) -> str:
    stem = re.sub(r"\W", "_", joint.split("/")[-1])
    stem = f"_{stem}" if stem[:1].isdigit() or not stem else stem
    name, number = stem, 1
    while name in taken:
        number += 1
        name = f"{stem}_{number}"
    taken.add(name)
    return name


def targets_of(links: Sequence[Link], joints: Sequence[str]) -> list[int]:
    """The links whose motion matters: hands, feet and head by their names, else the outermost of each limb."""
    carried = {link.parent for link in links}
    named = [k for k, link in enumerate(links) if _WORDS.search(joints[link.joint].split("/")[-1]) and link.piece]
    outer = [k for k in range(len(links)) if k not in carried and links[k].piece and links[k].parent >= 0]
    found = []
    for k in outer:
        chain = _chain(links, k)
        # the fingers of a hand are as good as the hand
        found.append(next((above for above in chain if above in named), k))
    return sorted(dict.fromkeys(found)) or [k for k, link in enumerate(links) if link.piece][-1:]


def _chain(links: Sequence[Link], k: int) -> list[int]:
    chain = []
    while k >= 0:
        chain.append(k)
        k = links[k].parent
    return chain


def tip_of(piece: Piece, origin: Array) -> Array:
    """The middle of the end of a link that is farthest from where it turns, world, shape [3]."""
    points, _ = piece
    away = np.linalg.norm(points - origin, axis=1)
    return np.asarray(points[away >= (1.0 - _TIP) * away.max()].mean(axis=0), dtype=np.float64)
