"""Which bodies belong to the character, in what order, and how far each is from the world."""

from collections import deque
from collections.abc import Sequence

from calmotion.usd.reading.joints.joint_prims import JointPrim


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


def bridges(joints: Sequence[JointPrim]) -> list[JointPrim]:
    """The joints that are in no closed chain, the world being a body: the only connection of their two sides."""
    ends: dict[str, list[tuple[str, int]]] = {}
    for k, joint in enumerate(joints):
        ends.setdefault(joint.body0, []).append((joint.body1, k))
        ends.setdefault(joint.body1, []).append((joint.body0, k))
    found, order, low = [], dict[str, int](), dict[str, int]()  # low: the earliest body that a closed chain leads to
    for start in ends:
        if start in order:
            continue
        order[start] = low[start] = len(order)
        stack = [(start, -1, iter(ends[start]))]
        while stack:
            body, by, left = stack[-1]
            step = next(left, None)
            if step is not None:
                other, k = step
                if k != by and other in order:
                    low[body] = min(low[body], order[other])
                elif k != by:
                    order[other] = low[other] = len(order)
                    stack.append((other, k, iter(ends[other])))
                continue
            stack.pop()
            if stack:
                before = stack[-1][0]
                low[before] = min(low[before], low[body])
                if low[body] > order[before]:
                    found.append(by)
    return [joints[k] for k in sorted(found)]


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
