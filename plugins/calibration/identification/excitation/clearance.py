"""How near the bodies of a robot come to each other in a motion, where no joint connects them.

Surfaces are points, no farther apart than a share of the body. The distance of two bodies is at least that of their
nearest points less what lies between points, and less half of what one moves relative to the other between two
instants: a motion that is called clear is so at all times. Poses are those of the rigid robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from calmotion.arrays import Array
from calmotion.mesh import triangle_parts
from calmotion.model import Body, Character, RunSettings
from calmotion.multibody import Tree, moves_freely, rigid_poses
from calmotion.simulation import CompiledShot, prepare, sample_tracks
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

SPACING = 1.0 / 30.0  # of a body's diagonal, between points of its surface
COVERED = 2.0 / 3.0  # of the spacing: no point of a triangle is farther from the centre of its part
NEAREST, SHARE = 0.02, 0.5  # what bodies keep between them [m], or this share of what they have in the first pose
FAR = 0.05  # distances are not told beyond this [m]
RATE = 50.0  # instants in a second


@dataclass(frozen=True, eq=False)
class Points:
    """The surface of a body as points.

    Attributes:
        points: [m], body frame, shape [n, 3].
        tree: Of these.
        between: No point of the surface is farther from one of them [m].
        corners: Of the box around them, shape [8, 3].
    """

    points: Array
    tree: cKDTree
    between: float
    corners: Array

    @classmethod
    def of(cls, body: Body) -> Points | None:
        """The points of all surfaces of a body; None without any."""
        triangles = [s.points[s.triangles] for s in body.surfaces if len(s.triangles)]
        if not triangles:
            return None
        corners = np.concatenate(triangles)
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        spacing = SPACING * float(np.linalg.norm(high - low))
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        parts = np.maximum(np.ceil(longest / spacing), 1.0).astype(int)
        points = np.concatenate(
            [(triangle_parts(count) @ corners[parts == count]).reshape(-1, 3) for count in np.unique(parts)]
        )
        box = np.array([[(low, high)[k][axis] for axis, k in enumerate(ends)] for ends in product((0, 1), repeat=3)])
        return cls(points, cKDTree(points), COVERED * float((longest / parts).max()), box)


@dataclass(frozen=True)
class Pair:
    """Two bodies that no joint connects.

    Attributes:
        first, second: Their paths.
        apart: Distance in the first pose, at least [m].
    """

    first: str
    second: str
    apart: float


class Clearance:
    """The bodies of a robot that may collide with one another; `pairs` has those that are watched, and `together` the
    paths of those that are not: they touch in the first pose, or are too near to tell. Of a robot whose motors do not
    determine its motion, none is watched.

    Args:
        shot: The robot.
        options: With the step.
    """

    def __init__(self, shot: CompiledShot, options: RunSettings):
        self._options, bodies = options, [shot.character.bodies[body] for body in shot.tree.body]
        self._surfaces = [Points.of(body) for body in bodies]
        known = [k for k, points in enumerate(self._surfaces) if points is not None]
        joined = _joined(shot.character, shot.tree)
        every = [(a, b) for a in known for b in known if a < b and (a, b) not in joined]
        apart = self._distances(shot, every, 1) if every else np.zeros(0)
        self.watches = apart is not None
        found = np.zeros(len(every)) if apart is None else apart
        self._pairs = [pair for pair, own in zip(every, found, strict=True) if own > 0.0]
        paths = [body.path for body in bodies]
        self.pairs = tuple(
            Pair(paths[a], paths[b], float(own)) for (a, b), own in zip(every, found, strict=True) if own > 0.0
        )
        self.together = tuple((paths[a], paths[b]) for (a, b), own in zip(every, found, strict=True) if own <= 0.0)

    def least(self, shot: CompiledShot) -> Array:
        """Smallest distances of the pairs in the motion of a shot, at least [m], shape [pairs]."""
        found = self._distances(shot, self._pairs)
        return np.zeros(0) if found is None else found

    def kept(self, shot: CompiledShot) -> bool:
        """Whether all pairs stay as far apart as they should."""
        wanted = np.minimum(NEAREST, SHARE * np.array([pair.apart for pair in self.pairs]))
        if not self._pairs:
            return True
        found = self._distances(shot, self._pairs, most=wanted)
        return found is not None and bool(np.all(found >= wanted))

    def _distances(
        self, shot: CompiledShot, pairs: Sequence[tuple[int, int]], count: int | None = None, most: Array | float = FAR
    ) -> Array | None:
        """The distances of pairs of components, at the most so much, in a motion or in its first instants; None where
        its motion is not known."""
        prepared = prepare(shot, self._options)
        model, grid = prepared.model, prepared.grid
        if shot.tree.closing or np.any(moves_freely(model)):
            return None
        angles = model.joint_angles(sample_tracks(shot.animation.current, grid)[0])
        every = max(1, round(1.0 / (RATE * grid.h)))
        c, q = (part[::every][:count] for part in rigid_poses(model, angles, prepared.world))
        turns = [Rotation.from_quat(q[:, k], scalar_first=True) for k in range(q.shape[1])]
        return np.array(
            [
                self._distance(a, b, c, turns, far)
                for (a, b), far in zip(pairs, np.broadcast_to(most, len(pairs)).tolist(), strict=True)
            ]
        )

    def _distance(self, a: int, b: int, c: Array, turns: Sequence[Rotation], far: float) -> float:
        """The smallest distance of two components, at least, and at most so far."""
        one, other = self._surfaces[a], self._surfaces[b]
        assert one is not None and other is not None
        back = turns[a].inv()
        matrices, away = (back * turns[b]).as_matrix(), back.apply(c[:, b] - c[:, a])
        boxes = np.einsum("tij,kj->tki", matrices, other.corners) + away[:, None]
        steps = np.linalg.norm(np.diff(boxes, axis=0), axis=2).max(axis=1, initial=0.0)
        moved = np.maximum(np.append(steps, 0.0), np.insert(steps, 0, 0.0))
        lost, nearest = 0.5 * moved + one.between + other.between, far
        low, high = one.corners[0], one.corners[-1]
        for box, R, x, less in zip(boxes, matrices, away, lost, strict=True):
            reach = nearest + less  # what is farther does not count
            if np.any(box.max(axis=0) < low - reach) or np.any(box.min(axis=0) > high + reach):
                continue
            points = other.points @ R.T + x
            points = points[np.all((points > low - reach) & (points < high + reach), axis=1)]
            if len(points):
                nearest = min(nearest, float(one.tree.query(points, distance_upper_bound=reach)[0].min()) - less)
        return nearest


def _joined(character: Character, tree: Tree) -> set[tuple[int, int]]:
    """Pairs of components that a joint connects; parts between the axes of a joint of several axes do not count."""
    component = {body: k for k, body in enumerate(tree.body)}
    beside: dict[int, set[int]] = {k: set() for k in component.values()}
    for joint in character.joints:
        if joint.body0 in component and joint.body1 in component:
            a, b = component[joint.body0], component[joint.body1]
            beside[a].add(b)
            beside[b].add(a)
    for k, body in enumerate(tree.body):
        if character.bodies[body].between:
            for other in beside[k]:
                beside[other] |= beside[k] - {other}
    return {(min(k, other), max(k, other)) for k, near in beside.items() for other in near}
