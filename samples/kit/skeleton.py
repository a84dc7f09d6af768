"""Writes a UsdSkel skeleton that carries the animation of a robot: its motors read their angles from its joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pxr import Gf, Sdf, Usd, UsdSkel, Vt

from .author import per_metre
from .robot import Array, JointSpec, Pose, multiply, turn

RIG = "Rig"


@dataclass(frozen=True)
class Bone:
    """A joint of a skeleton: its name, the one above it (or none), and the motors that perform it, inner ones first."""

    name: str
    parent: str
    motors: tuple[str, ...]


@dataclass(frozen=True)
class _Link:
    """A bone on its robot: the path of its joint, the bodies it hangs from and turns, and the anchor [m]."""

    path: str
    above: str
    body: str
    parent_body: str
    anchor: Array

    def world(self, poses: Mapping[str, Pose]) -> Pose:
        """Its place in the world: the anchor in the body that it turns."""
        body = poses[self.body]
        return Pose(body.position + turn(body.rotation, self.anchor), body.rotation)

    def local(self, poses: Mapping[str, Pose], above: Array) -> Pose:
        """Its transform in the bone above, whose anchor in its own body is given."""
        parent, here = poses[self.parent_body], self.world(poses)
        inverse = parent.rotation * np.array([1.0, -1.0, -1.0, -1.0])
        return Pose(turn(inverse, here.position - parent.position) - above, multiply(inverse, here.rotation))


def author_rig(
    stage: Usd.Stage, root: str, scope: str, bones: Sequence[Bone], joints: Sequence[JointSpec],
    poses: Sequence[Mapping[str, Pose]], frames: Sequence[int],
) -> None:  # fmt: skip
    """A skeleton with its animation, and the motors' word which of its joints they perform.

    It is at rest as at the first frame, where the bodies of the shot stand.

    Args:
        stage, root, scope: The stage, the character's root prim, and the one that holds its joints.
        bones: Parents before children.
        joints: The robot's.
        poses: Of its bodies at the frames.
        frames: Time codes.
    """
    links = _links(bones, joints)
    anchors = {"": np.zeros(3)} | {link.path: link.anchor for link in links}
    paths = [link.path for link in links]

    def local(there: Mapping[str, Pose]) -> list[Pose]:
        return [link.local(there, anchors[link.above]) for link in links]

    UsdSkel.Root.Define(stage, f"{root}/{RIG}")
    skeleton = UsdSkel.Skeleton.Define(stage, f"{root}/{RIG}/Skeleton")
    skeleton.CreateJointsAttr(paths)
    scale, rest = per_metre(stage), local(poses[0])
    skeleton.CreateRestTransformsAttr([_matrix(pose, scale) for pose in rest])
    skeleton.CreateBindTransformsAttr([_matrix(link.world(poses[0]), scale) for link in links])
    animation = UsdSkel.Animation.Define(stage, f"{root}/{RIG}/Animation")
    animation.CreateJointsAttr(paths)
    animation.CreateTranslationsAttr([Gf.Vec3f(*_rounded(scale * pose.position)) for pose in rest])
    animation.CreateScalesAttr(Vt.Vec3hArray([Gf.Vec3h(1.0)] * len(links)))
    rotations = animation.CreateRotationsAttr()
    for frame, there in zip(frames, poses, strict=True):
        rotations.Set(Vt.QuatfArray([Gf.Quatf(*_rounded(pose.rotation)) for pose in local(there)]), frame)
    binding = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    binding.CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    for bone, link in zip(bones, links, strict=True):
        for motor in bone.motors:
            attribute = stage.OverridePrim(f"{scope}/{motor}").CreateAttribute(
                "calm:motor:skelJoint", Sdf.ValueTypeNames.Token, False, Sdf.VariabilityUniform
            )
            attribute.Set(link.path)


def _links(bones: Sequence[Bone], joints: Sequence[JointSpec]) -> list[_Link]:
    named = {joint.name: joint for joint in joints}
    found = {"": _Link("", "", "", "", np.zeros(3))}
    for bone in bones:
        above, outer = found[bone.parent], named[bone.motors[-1]]
        path = f"{above.path}/{bone.name}" if above.path else bone.name
        found[bone.name] = _Link(path, above.path, outer.child, above.body, np.array(outer.anchor_child))
    return list(found.values())[1:]


def _matrix(pose: Pose, scale: float) -> Gf.Matrix4d:
    turned = np.column_stack([turn(pose.rotation, axis) for axis in np.eye(3)])
    rows = np.eye(4)
    rows[:3, :3], rows[3, :3] = turned.T, scale * pose.position
    return Gf.Matrix4d(*(_rounded(rows.ravel())))


def _rounded(values: Array) -> list[float]:
    """So that every machine writes the same; adding 0 turns a negative zero into zero."""
    return (np.round(values, 8) + 0.0).tolist()
