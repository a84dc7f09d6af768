"""One character as a build script gives it, written to its .usda file: whole or not at all."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pxr import UsdGeom

from . import author, robot

MATERIALS = "Materials"
JOINTS = "Joints"


@dataclass(frozen=True)
class Character:
    """A robot with its performance.

    Attributes:
        name: Of the root prim.
        note: The comment of the layer.
        bodies, joints: Parents before children; tracks have a value for each frame.
        looks: Materials by name.
        plastic: What the flexible bodies are made of.
        scenery: Name of a group of parts, and the parts; they have no physics.
        frames, rate: Time codes, and how many of them a second.
        tolerance: Of the retargeting [m].
        up, unit: Up axis, and metres in a unit of the stage.
        posed: Whether the transforms of the bodies are animated instead of the drives.
    """

    name: str
    note: str
    bodies: Sequence[robot.BodySpec]
    joints: Sequence[robot.JointSpec]
    looks: Mapping[str, author.Look]
    plastic: author.Plastic
    scenery: tuple[str, Sequence[robot.Part]]
    frames: Sequence[int]
    rate: float
    tolerance: float
    up: str = "Z"
    unit: float = 1.0
    posed: bool = False


def main(character: Character, folder: Path) -> None:
    """What a build script does: write to the file named on its command line, else beside itself."""
    write(character, sys.argv[1] if len(sys.argv) > 1 else folder / f"{folder.name}.usda")


def write(character: Character, path: str | Path) -> None:
    """Write it; the same character always gives the same bytes."""
    root, frames = f"/{character.name}", character.frames
    scope = f"{root}/{MATERIALS}"
    stage = author.new_stage(character.name, (frames[0], frames[-1]), character.rate, character.up, character.unit)
    stage.GetRootLayer().comment = character.note
    prim = stage.GetDefaultPrim()
    prim.AddAppliedSchema("CalmRetargetAPI")
    author.create(prim, "calm:retarget:tolerance", character.tolerance * author.per_metre(stage))
    author.author_looks(stage, scope, character.looks)
    author.author_plastic(stage, scope, character.plastic)
    poses = [robot.pose_bodies(character.joints, k) for k in range(len(frames) if character.posed else 1)]
    standing = {joint.child for joint in character.joints if not joint.parent}
    for body in character.bodies:
        motion = None
        if character.posed and body.name not in standing:
            motion = {frame: pose[body.name] for frame, pose in zip(frames, poses, strict=True)}
        pose = poses[0][body.name]
        author.author_body(stage, root, body, pose, character.looks, scope, character.plastic, motion)
    UsdGeom.Scope.Define(stage, f"{root}/{JOINTS}")
    for joint in character.joints:
        author.author_joint(stage, root, f"{root}/{JOINTS}", joint, () if character.posed else frames)
    group, parts = character.scenery
    UsdGeom.Xform.Define(stage, f"{root}/{group}")
    for part in parts:
        author.author_part(stage, f"{root}/{group}/{part.name}", part, character.looks, scope)
    author.save(stage.GetRootLayer(), Path(path))
