"""One character as a build script gives it, written to its .usda file: whole or not at all."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pxr import Usd, UsdGeom, UsdPhysics

from . import author, robot

MATERIALS = "Materials"
JOINTS = "Joints"


@dataclass(frozen=True)
class Character:
    """A robot with its performance, or at rest.

    Attributes:
        name: Of the root prim.
        note: The comment of the layer.
        bodies, joints: Parents before children; tracks have a value for each frame, and one without frames.
        looks: Materials by name.
        plastic: What the flexible bodies are made of.
        scenery: Name of a group of parts, and the parts; they have no physics.
        frames, rate: Time codes, and how many of them a second. Without frames nothing is animated.
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
    rate: float
    tolerance: float
    frames: Sequence[int] = ()
    scenery: tuple[str, Sequence[robot.Part]] | None = None
    up: str = "Z"
    unit: float = 1.0
    posed: bool = False


def destination(folder: Path) -> Path:
    """Where a build script writes: to the file named on its command line, else beside itself."""
    return Path(sys.argv[1]) if len(sys.argv) > 1 else folder / f"{folder.name}.usda"


def write(character: Character, path: str | Path) -> None:
    """Write it; the same character always gives the same bytes."""
    root, frames = f"/{character.name}", character.frames
    scope = f"{root}/{MATERIALS}"
    stage = author.new_stage(character.name, frames, character.rate, character.up, character.unit)
    stage.GetRootLayer().comment = character.note
    prim = stage.GetDefaultPrim()
    UsdPhysics.ArticulationRootAPI.Apply(prim)
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
        author.author_joint(stage, root, f"{root}/{JOINTS}", joint)
        if joint.drive and not character.posed:
            author.author_track(stage.GetPrimAtPath(f"{root}/{JOINTS}/{joint.name}"), joint.drive, frames)
    if character.scenery:
        author_scenery(stage, character.name, *character.scenery, character.looks)
    author.save(stage.GetRootLayer(), Path(path))


def author_scenery(
    stage: Usd.Stage, name: str, group: str, parts: Sequence[robot.Part], looks: Mapping[str, author.Look]
) -> None:
    """Parts in a group below the root prim `name`."""
    UsdGeom.Xform.Define(stage, f"/{name}/{group}")
    for part in parts:
        author.author_part(stage, f"/{name}/{group}/{part.name}", part, looks, f"/{name}/{MATERIALS}")
