"""The spanning tree of a character's bodies and joints, rooted at the world."""

from collections.abc import Sequence
from dataclasses import dataclass

from calmotion.arrays import IntArray
from calmotion.errors import ShotError
from calmotion.model.character import WORLD, Character

_FREEDOM = {"fixed": 1, "revolute": 2, "spherical": 3, "prismatic": 4, "floating": 6}


@dataclass(frozen=True)
class Tree:
    """Components in an order in which parents come before children; component k is body `body[k]`.

    Attributes:
        body: Body index of each component.
        parent: Parent component of each, -1 for the world.
        joint: Joint that carries each component.
        flipped: Whether the component is `body0` of that joint, so that its angle runs backwards.
        closing: Joints that are not in the tree, each of which closes a chain; without redundant ones.
    """

    body: tuple[int, ...]
    parent: tuple[int, ...]
    joint: tuple[int, ...]
    flipped: tuple[bool, ...]
    closing: tuple[int, ...] = ()


def span_tree(character: Character) -> Tree:
    """Order the bodies of a character from the world outwards.

    Where joints form a closed chain, one of them is not in the tree: the one that constrains least, so that motors and
    welds are in it.

    Raises:
        ShotError: A body that no chain of joints connects to the world.
    """
    inside, closing = _spanning(character)
    touching: dict[int, list[int]] = {}
    for index in inside:
        joint = character.joints[index]
        touching.setdefault(joint.body0, []).append(index)
        touching.setdefault(joint.body1, []).append(index)
    body: list[int] = []
    parent: list[int] = []
    joint_of: list[int] = []
    flipped: list[bool] = []
    component_of = {WORLD: -1}
    queue = [WORLD]
    for current in queue:
        for index in touching.get(current, ()):
            joint = character.joints[index]
            other = joint.body1 if joint.body0 == current else joint.body0
            if other in component_of:
                continue  # the joint to the parent
            component_of[other] = len(body)
            body.append(other)
            parent.append(component_of[current])
            joint_of.append(index)
            flipped.append(joint.body0 == other)
            queue.append(other)
    for index, unconnected in enumerate(character.bodies):
        if index not in component_of:
            raise ShotError(
                "no chain of joints connects this body to the world",
                path=unconnected.path,
                remedy="Add a joint to its neighbour, or a PhysicsFixedJoint with an empty body0.",
            )
    needed = tuple(index for index in closing if not character.joints[index].redundant)
    return Tree(tuple(body), tuple(parent), tuple(joint_of), tuple(flipped), needed)


def chain_members(parent: Sequence[int] | IntArray, ends: Sequence[int] | IntArray) -> set[int]:
    """Components of the closed chain that a joint between two of them closes.

    Args:
        parent: Of each component, -1 for the world.
        ends: The two components, -1 for the world.
    """
    paths = []
    for end in ends:
        path, b = set(), int(end)
        while b >= 0:
            path.add(b)
            b = int(parent[b])
        paths.append(path)
    return paths[0] ^ paths[1]


def _spanning(character: Character) -> tuple[list[int], list[int]]:
    """Joints of a spanning tree, and those that close chains (Kruskal's algorithm, most constraining joints first)."""
    driven = {motor.joint for motor in character.motors}

    def freedom(index: int) -> tuple[int, int]:
        joint = character.joints[index]
        # a free slider has no stiffness at rest, which the joints of the tree need
        kind = 0 if index in driven else _FREEDOM[joint.kind]
        # a part between the axes of a joint weighs almost nothing, and must not end in a chain that is closed there
        if any(end != WORLD and character.bodies[end].between for end in (joint.body0, joint.body1)):
            return min(kind, 1), index
        return (5 if joint.closes_chain else kind), index

    group = {index: index for index in range(WORLD, len(character.bodies))}

    def leader(body: int) -> int:
        while group[body] != body:
            group[body] = group[group[body]]
            body = group[body]
        return body

    inside, closing = [], []
    for index in sorted(range(len(character.joints)), key=freedom):
        joint = character.joints[index]
        if joint.contact is not None:  # it comes and goes, and the tree does not
            closing.append(index)
            continue
        one, other = leader(joint.body0), leader(joint.body1)
        if one == other:
            closing.append(index)
        else:
            group[one] = other
            inside.append(index)
    return sorted(inside), sorted(closing)
