"""UsdSkel skeletons: their joints, poses at rest, and the animation that is bound to them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pxr import Gf, Tf, Usd, UsdGeom, UsdSkel

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.support.naming import nearest
from calmotion.usd import gf
from calmotion.usd.reading.context import prims_of
from calmotion.usd.transforms import pose_from_matrix

_UNIT = 1e-2  # how far the length of a quaternion may be off 1: half precision and interpolation


@dataclass(frozen=True, eq=False)
class BoundSkeleton:
    """A skeleton with its animation.

    Attributes:
        prim: The Skeleton.
        query: Its UsdSkel.SkeletonQuery.
        animation: The SkelAnimation, or None.
        joints: Its joints, `Hip/Knee` and so on.
        rest: Local transforms at rest, stage units, mapping column vectors, shape [j, 4, 4].
    """

    prim: Any
    query: Any
    animation: Any
    joints: tuple[str, ...]
    rest: Array
    _posed: dict[float, Array] = field(default_factory=dict)
    _placed: dict[float, Array] = field(default_factory=dict)

    def parent(self, joint: int) -> int:
        """Index of the joint above one, -1 for none."""
        return int(self.query.GetTopology().GetParent(joint))

    def codes(self) -> Array:
        """Time codes of the samples of its animation."""
        query = self.query.GetAnimQuery()
        return np.array(query.GetJointTransformTimeSamples() if query else [], dtype=np.float64)

    def locals_at(self, code: float) -> Array:
        """Local transforms of all joints, shape [j, 4, 4]."""
        if code not in self._posed:
            self._posed[code] = np.array([gf.matrix(m) for m in self._computed(code)])
        return self._posed[code]

    def spaces_at(self, code: float) -> Array:
        """Transforms of all joints in the skeleton's space, shape [j, 4, 4]."""
        if code not in self._placed:
            self._placed[code] = self.in_skeleton(self.locals_at(code))
        return self._placed[code]

    def _computed(self, code: float) -> Sequence[Gf.Matrix4d]:
        try:
            complete = self._has_all(code)
            transforms: Sequence[Gf.Matrix4d] = self.query.ComputeJointLocalTransforms(code)
        except Tf.ErrorException:
            complete, transforms = False, ()
        if not complete or len(transforms) != len(self.joints):
            raise ShotError(
                "its animation cannot be evaluated: translations, rotations and scales must be as many as its joints",
                path=(self.animation or self.prim).GetPath(),
                attribute="rotations",
                found=f"at time code {code:g}",
                remedy="Author one of each for every joint it names, and restTransforms of its Skeleton for others",
            )
        return transforms

    def _has_all(self, code: float) -> bool:
        """Whether the animation has a value of each kind for all of its joints: else USD takes the rest pose.

        Raises:
            ShotError: A rotation that is not of unit length.
        """
        query = self.query.GetAnimQuery()
        if not query:
            return True
        places, rotations, scales = query.ComputeJointLocalTransformComponents(code)
        lengths = np.array([q.GetLength() for q in rotations])
        if np.any(np.abs(lengths - 1.0) > _UNIT):
            worst = int(np.argmax(np.abs(lengths - 1.0)))
            raise ShotError(
                "a rotation of the animation is not of unit length",
                path=query.GetPrim().GetPath(),
                attribute="rotations",
                found=f"{rotations[worst]} at time code {code:g}",
                remedy="Normalise the quaternions",
            )
        return len(places) == len(rotations) == len(scales) == len(query.GetJointOrder())

    def placement(self, code: float) -> Array:
        """From the skeleton's space to the world, shape [4, 4]."""
        return gf.matrix(UsdGeom.XformCache(code).GetLocalToWorldTransform(self.prim))

    def in_skeleton(self, local: Array) -> Array:
        """Transforms in the skeleton's space out of local ones, shape [j, 4, 4]."""
        transforms = np.empty_like(local)
        with np.errstate(invalid="ignore", over="ignore"):  # pose_from_matrix refuses values that are not finite
            for joint in range(len(local)):
                above = self.parent(joint)
                transforms[joint] = local[joint] if above < 0 else transforms[above] @ local[joint]
        return transforms

    def local_rotations(self, joint: int, codes: Array) -> Array:
        """Rotations of a joint in its parent's axes, shape [n, 3, 3]."""
        place = f"{self.prim.GetPath()} ({self.joints[joint]})"
        return np.array([pose_from_matrix(self.locals_at(float(c))[joint], place).rotation for c in codes])


def bound_skeletons(stage: Usd.Stage) -> list[BoundSkeleton]:
    """All skeletons of a stage, bound or not.

    Raises:
        ShotError: One whose joints are no tree, or without a rest pose.
    """
    cache, found = UsdSkel.Cache(), []
    for prim in prims_of(stage):
        if prim.IsA(UsdSkel.Root):
            cache.Populate(UsdSkel.Root(prim), Usd.TraverseInstanceProxies())
    for prim in prims_of(stage):
        if not prim.IsA(UsdSkel.Skeleton):
            continue
        query = cache.GetSkelQuery(UsdSkel.Skeleton(prim))
        if not query:
            raise ShotError(
                "the skeleton cannot be read: its joints are no tree, or lists of different lengths belong to them",
                path=prim.GetPath(),
                attribute="joints",
                remedy="Name every joint after the one above it (Hip, Hip/Knee), with one transform each",
            )
        found.append(_bound(prim, query))
    return found


def _bound(prim: Usd.Prim, query: UsdSkel.SkeletonQuery) -> BoundSkeleton:
    animation = query.GetAnimQuery()
    joints = tuple(str(joint) for joint in query.GetJointOrder())
    rest = query.ComputeJointLocalTransforms(0.0, True)  # at rest
    if len(rest) != len(joints):
        bind = query.GetJointWorldBindTransforms()
        if len(bind) != len(joints):
            raise ShotError(
                "a skeleton without a rest pose",
                path=prim.GetPath(),
                attribute="restTransforms",
                found=f"{len(rest)} transforms for {len(joints)} joints",
                remedy="Author restTransforms or bindTransforms, one for each joint",
            )
        topology = query.GetTopology()
        rest = [
            bind[k] * bind[topology.GetParent(k)].GetInverse() if topology.GetParent(k) >= 0 else bind[k]
            for k in range(len(joints))
        ]
    return BoundSkeleton(
        prim, query, animation.GetPrim() if animation else None, joints, np.array([gf.matrix(m) for m in rest])
    )


def skeleton_with(skeletons: list[BoundSkeleton], token: str, path: str, attribute: str) -> tuple[BoundSkeleton, int]:
    """The skeleton that has a joint, and its index there.

    Args:
        token: The joint, as the skeleton names it, or the last part of that where it is unique; of several skeletons
            that have it, the one with an animation is meant.
        path, attribute: What names it, for the message.

    Raises:
        ShotError: None has it, or several do.
    """
    places = [(s, k) for s in skeletons for k, joint in enumerate(s.joints) if joint == token]
    if not places:
        places = [(s, k) for s in skeletons for k, joint in enumerate(s.joints) if joint.split("/")[-1] == token]
    if len(places) > 1:  # of characters side by side, the one that moves
        places = [(s, k) for s, k in places if len(s.codes())] or places
    if len(places) != 1:
        joints = [joint for s in skeletons for joint in s.joints]
        remedy = "Bind a Skeleton with an animation, or remove the attribute"
        if joints:
            remedy = f"{'' if places else nearest(token, joints)}Name one of {', '.join(joints)}"
        raise ShotError(
            "several joints of skeletons have this name" if places else "no skeleton of the shot has this joint",
            path=path,
            attribute=attribute,
            found=token,
            remedy=remedy,
        )
    return places[0]
