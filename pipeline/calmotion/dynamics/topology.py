"""The tree of a character's bodies and joints, seen from the world."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import ShotError
from ..shot.character import WORLD, Character


@dataclass(frozen=True)
class Tree:
    """Components in an order in which parents come before children; component k is body `body[k]`.

    Attributes:
        body: Body index of each component.
        parent: Parent component of each, -1 for the world.
        joint: Joint that carries each component.
        flipped: Whether the component is `body0` of that joint, so that its angle runs backwards.
    """

    body: tuple[int, ...]
    parent: tuple[int, ...]
    joint: tuple[int, ...]
    flipped: tuple[bool, ...]


def span_tree(character: Character) -> Tree:
    """Order the bodies of a character from the world outwards.

    Raises:
        ShotError: A body that no chain of joints connects to the world, or joints that close a loop.
    """
    touching: dict[int, list[int]] = {}
    for index, joint in enumerate(character.joints):
        touching.setdefault(joint.body0, []).append(index)
        touching.setdefault(joint.body1, []).append(index)
    body: list[int] = []
    parent: list[int] = []
    joint_of: list[int] = []
    flipped: list[bool] = []
    component_of = {WORLD: -1}
    used: set[int] = set()
    queue = [WORLD]
    for current in queue:
        for index in touching.get(current, ()):
            if index in used:
                continue
            used.add(index)
            joint = character.joints[index]
            other = joint.body1 if joint.body0 == current else joint.body0
            if other in component_of:
                raise ShotError(
                    "this joint closes a loop of bodies, which cannot be simulated yet",
                    path=joint.path,
                    attribute="physics:body1",
                    remedy="Disable the joint (physics:jointEnabled = false) or remove one joint of the loop.",
                )
            component_of[other] = len(body)
            body.append(other)
            parent.append(component_of[current])
            joint_of.append(index)
            flipped.append(joint.body0 == other)
            queue.append(other)
    for index, item in enumerate(character.bodies):
        if index not in component_of:
            raise ShotError(
                "no chain of joints connects this body to the world",
                path=item.path,
                remedy="Add a joint to its neighbour, or a PhysicsFixedJoint with an empty body0.",
            )
    return Tree(tuple(body), tuple(parent), tuple(joint_of), tuple(flipped))
