"""Builds dancer.usda: `python samples/dancer/build.py [FILE]`. The same script always writes the same bytes.

Unlike the other samples it is y up, and animated by the transforms of its bodies: the motors follow from them.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
if str(HERE.parent) not in sys.path:
    sys.path.insert(0, str(HERE.parent))

from dancer import model, motion  # noqa: E402
from kit import author, robot  # noqa: E402
from pxr import UsdGeom  # noqa: E402

ROOT = "/Dancer"
MATERIALS = f"{ROOT}/Materials"
TOLERANCE = 0.001
NOTE = "A dancer that waves two slender arms, drawn for Calmotion. Built by samples/dancer/build.py."


def build(path: str | Path) -> None:
    """Write the sample to a .usda file, whole or not at all."""
    joints = model.joints(motion.tracks())
    poses = [robot.pose_bodies(joints, sample) for sample in range(len(motion.FRAMES))]
    stage = author.new_stage(ROOT.strip("/"), (motion.FIRST, motion.LAST), motion.RATE, up="Y")
    stage.GetRootLayer().comment = NOTE
    root = stage.GetDefaultPrim()
    root.AddAppliedSchema("CalmRetargetAPI")
    author.create(root, "calm:retarget:tolerance", TOLERANCE)
    author.author_looks(stage, MATERIALS, model.LOOKS)
    author.author_plastic(stage, MATERIALS, model.NYLON)
    for body in model.bodies():
        motion_of = None
        if body.name != "Figure":
            motion_of = {frame: pose[body.name] for frame, pose in zip(motion.FRAMES, poses, strict=True)}
        author.author_body(stage, ROOT, body, poses[0][body.name], model.LOOKS, MATERIALS, model.NYLON, motion_of)
    UsdGeom.Scope.Define(stage, f"{ROOT}/Joints")
    for joint in joints:
        author.author_joint(stage, ROOT, f"{ROOT}/Joints", joint, ())
    UsdGeom.Xform.Define(stage, f"{ROOT}/Set")
    for part in model.scenery():
        author.author_part(stage, f"{ROOT}/Set/{part.name}", part, model.LOOKS, MATERIALS)
    author.save(stage.GetRootLayer(), Path(path))


if __name__ == "__main__":
    build(sys.argv[1] if len(sys.argv) > 1 else HERE / "dancer.usda")
