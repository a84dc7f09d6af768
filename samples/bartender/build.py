"""Builds bartender.usda: `python samples/bartender/build.py [FILE]`. The same script always writes the same bytes."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
if str(HERE.parent) not in sys.path:
    sys.path.insert(0, str(HERE.parent))

from bartender import model, motion  # noqa: E402
from kit import author, robot  # noqa: E402
from pxr import UsdGeom  # noqa: E402

ROOT = "/Bartender"
MATERIALS = f"{ROOT}/Materials"
TOLERANCE = 0.001
NOTE = "A serving robot with two slender plastic links, drawn for Calmotion. Built by samples/bartender/build.py."


def build(path: str | Path) -> None:
    """Write the sample to a .usda file, whole or not at all."""
    joints = model.joints(motion.tracks())
    poses = robot.pose_bodies(joints, 0)
    stage = author.new_stage(ROOT.strip("/"), (motion.FIRST, motion.LAST), motion.RATE)
    stage.GetRootLayer().comment = NOTE
    root = stage.GetDefaultPrim()
    root.AddAppliedSchema("CalmRetargetAPI")
    author.create(root, "calm:retarget:tolerance", TOLERANCE)
    author.author_looks(stage, MATERIALS, model.LOOKS)
    author.author_plastic(stage, MATERIALS, model.NYLON)
    for body in model.bodies():
        author.author_body(stage, ROOT, body, poses[body.name], model.LOOKS, MATERIALS, model.NYLON)
    UsdGeom.Scope.Define(stage, f"{ROOT}/Joints")
    for joint in joints:
        author.author_joint(stage, ROOT, f"{ROOT}/Joints", joint, motion.FRAMES)
    UsdGeom.Xform.Define(stage, f"{ROOT}/Bar")
    for part in model.scenery():
        author.author_part(stage, f"{ROOT}/Bar/{part.name}", part, model.LOOKS, MATERIALS)
    author.save(stage.GetRootLayer(), Path(path))


if __name__ == "__main__":
    build(sys.argv[1] if len(sys.argv) > 1 else HERE / "bartender.usda")
