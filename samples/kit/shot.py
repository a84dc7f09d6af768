"""A performance of a character that stands in a layer of its own: a layer that references it, poses and animates it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from . import author, robot
from .character import JOINTS, MATERIALS, Character, author_scenery
from .skeleton import Bone, author_rig


@dataclass(frozen=True)
class Shot:
    """A character's performance, and what the shot adds to the character.

    Attributes:
        name: Of the root prim.
        note: The comment of the layer.
        asset: The character's layer, relative to that of the shot.
        character: What is written there.
        joints: The character's, in its order, with tracks that have a value for each frame; then those of the props.
        props: Bodies that the shot adds.
        looks: Materials of props and scenery, by name.
        scenery: Name of a group of parts, and the parts; they have no physics.
        frames, rate: Time codes, and how many of them a second.
        bones: The skeleton that carries the animation; without one the drives do.
    """

    name: str
    note: str
    asset: str
    character: Character
    joints: Sequence[robot.JointSpec]
    props: Sequence[robot.BodySpec]
    looks: Mapping[str, author.Look]
    scenery: tuple[str, Sequence[robot.Part]]
    frames: Sequence[int]
    rate: float
    bones: Sequence[Bone] = ()


def write(shot: Shot, path: str | Path) -> None:
    """Write it; the same shot always gives the same bytes."""
    root, character = f"/{shot.name}", shot.character
    stage = author.new_stage(shot.name, shot.frames, shot.rate, character.up, character.unit)
    stage.GetRootLayer().comment = shot.note
    author.author_looks(stage, f"{root}/{MATERIALS}", shot.looks)
    poses = [robot.pose_bodies(shot.joints, k) for k in range(len(shot.frames) if shot.bones else 1)]
    rest = robot.pose_bodies(character.joints, 0)
    for body in character.bodies:
        _stand(stage, f"{root}/{body.name}", rest[body.name], poses[0][body.name])
    for body in shot.props:
        author.author_body(
            stage, root, body, poses[0][body.name], shot.looks, f"{root}/{MATERIALS}", character.plastic
        )  # fmt: skip
    added = len(character.joints)
    for joint in shot.joints[added:]:
        author.author_joint(stage, root, f"{root}/{JOINTS}", joint)
    if shot.bones:
        author_rig(stage, root, f"{root}/{JOINTS}", shot.bones, shot.joints, poses, shot.frames)
    else:
        for joint in shot.joints[:added]:
            if joint.drive:
                author.author_track(stage.OverridePrim(f"{root}/{JOINTS}/{joint.name}"), joint.drive, shot.frames)
    author_scenery(stage, shot.name, *shot.scenery, shot.looks)
    # The asset's path holds where the layer will be, so no stage may see it before.
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.TransferContent(stage.GetRootLayer())
    layer.GetPrimAtPath(root).referenceList.Prepend(Sdf.Reference(shot.asset))
    author.save(layer, Path(path))


def _stand(stage: Usd.Stage, path: str, rest: robot.Pose, first: robot.Pose) -> None:
    """Put a body of the character where it is at the first frame."""
    if not (np.allclose(rest.position, first.position) and np.allclose(rest.rotation, first.rotation)):
        author.author_pose(UsdGeom.Xformable(stage.OverridePrim(path)), first, author.per_metre(stage))
