"""Which bodies belong to the character, in what order, and how far each is from the world."""

from __future__ import annotations

from collections import deque

from calmotion.usd.reading.joints import JointPrim


def components(bodies: list[str], joints: list[JointPrim]) -> list[list[str]]:
    """The groups of bodies that joints connect, the world not counting as a connection."""
    neighbours = _neighbours(bodies, joints)
    seen: set[str] = set()
    groups = []
    for start in bodies:
        if start in seen:
            continue
        seen.add(start)
        group, queue = [], deque([start])
        while queue:
            body = queue.popleft()
            group.append(body)
            for other in neighbours[body]:
                if other not in seen:
                    seen.add(other)
                    queue.append(other)
        groups.append(group)
    return groups


def distances(bodies: list[str], joints: list[JointPrim]) -> dict[str, int]:
    """Number of joints between each body and the world; the bodies from near to far."""
    neighbours = _neighbours(bodies, joints)
    roots = [j.body1 for j in joints if j.body0 == ""]
    depths = {body: 1 for body in roots}
    queue = deque(depths)
    while queue:
        body = queue.popleft()
        for other in neighbours[body]:
            if other not in depths:
                depths[other] = depths[body] + 1
                queue.append(other)
    return depths


def leaves(bodies: list[str], joints: list[JointPrim]) -> list[str]:
    """The outermost bodies: those all of whose neighbours are nearer to the world; where there is none, as in a closed
    chain of which two bodies are equally far, the first of the farthest."""
    far = distances(bodies, joints)
    neighbours = _neighbours(bodies, joints)
    found = [b for b in bodies if all(far[n] < far[b] for n in neighbours[b])]
    return found or [max(bodies, key=lambda body: far[body])]


def common_path(paths: list[str]) -> str:
    """The deepest prim path that holds all the given ones (itself, for one)."""
    split = [p.split("/") for p in paths]
    shared = [names[0] for names in zip(*split, strict=False) if len(set(names)) == 1]
    return "/".join(shared) or "/"


def _neighbours(bodies: list[str], joints: list[JointPrim]) -> dict[str, list[str]]:
    out: dict[str, list[str]] = {body: [] for body in bodies}
    for joint in joints:
        if joint.body0 and joint.body1:
            out[joint.body0].append(joint.body1)
            out[joint.body1].append(joint.body0)
    return out
