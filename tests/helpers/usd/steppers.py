"""A robot on two legs that takes two steps: a torso on legs of a hip, a telescope and an ankle, with wide soles.

At rest hips are at z = 0.7 m above feet whose soles are at z = 0. The right foot steps forward in the first half of the
shot, the left one in the second half, and the torso goes with them; each foot lands at rest. Angles are those of the
pose on flat feet, so that the motion of the rigid robot follows from its motors and contacts alone.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from calmotion.usd import schemas
from pxr import Gf, Usd, UsdGeom, UsdPhysics

schemas.register()

ROBOT, TORSO = "/Stepper", "/Stepper/Torso"
LEGS = {"left": 1.0, "right": -1.0}
HIP, ANKLE = 0.7, 0.04  # heights at rest [m]
REST = HIP - ANKLE
FRAMES, RATE = 25, 24.0
STRIDE, LIFT = 0.1, 0.03  # of a step [m]
LANDING = 12  # frame at which the right foot lands and the left one leaves the ground


def ease(s):
    """From 0 to 1 with zero rates and accelerations at the ends."""
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def walk(frames, stride=STRIDE, lift=LIFT):
    """Places of the torso, and of each foot with its height, at frames, as fractions of the shot; shape [n] each."""
    s = np.asarray(frames, float) / (FRAMES - 1)
    torso = stride * ease(s)
    right, left = 2.0 * s, 2.0 * s - 1.0
    bump = [lift * 64.0 * (np.clip(part, 0, 1) * (1 - np.clip(part, 0, 1))) ** 3 for part in (right, left)]
    return torso, {"right": (stride * ease(right), bump[0]), "left": (stride * ease(left), bump[1])}


def leg_values(ahead, height):
    """Hip angle [rad], telescope [m] and ankle angle [rad] for a foot so far ahead of the hip and above ground."""
    angle = np.arctan2(-ahead, REST - height)
    return angle, REST - np.hypot(ahead, REST - height), -angle


def write_stepper(
    path: Path, edit: Callable[[Usd.Stage], None] | None = None, *, walking=walk, width=0.3, landing=LANDING,
    kind: str = "sole",
) -> Path:  # fmt: skip
    """Write the shot.

    Args:
        edit: Changes the stage before it is saved.
        walking: As `walk`.
        width: Of the soles [m].
        landing: Frame at which the right foot lands and the left one leaves the ground.
        kind: Of the contacts.
    """
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(RATE)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(FRAMES - 1)
    root = UsdGeom.Xform.Define(stage, ROBOT)
    stage.SetDefaultPrim(root.GetPrim())
    UsdPhysics.Scene.Define(stage, "/Physics")
    torso = _body(stage, TORSO, (0, 0, 0.8), 6.0, (0.16, 0.24, 0.2))
    mark = UsdGeom.Xform.Define(stage, f"{TORSO}/Head")
    mark.AddTranslateOp().Set(Gf.Vec3d(0, 0, 0.2))
    mark.GetPrim().ApplyAPI("CalmTargetAPI")
    frames = np.arange(FRAMES)
    x, feet = walking(frames)
    for side, sign in LEGS.items():
        y, base = 0.05 * sign, f"{ROBOT}/{side}"
        UsdGeom.Xform.Define(stage, base)
        thigh = _body(stage, f"{base}/Thigh", (0, y, HIP), 1.0, (0.05, 0.05, 0.3), (0, 0, -0.15))
        shank = _body(stage, f"{base}/Shank", (0, y, ANKLE), 0.5, (0.04, 0.04, 0.36), (0, 0, 0.18))
        foot = _body(stage, f"{base}/Foot", (0, y, ANKLE), 0.3, (0.24, width, 0.04), (0, 0, -0.02))
        sole = UsdGeom.Xform.Define(stage, f"{base}/Foot/Sole")
        sole.AddTranslateOp().Set(Gf.Vec3d(0, 0, -ANKLE))
        prim = sole.GetPrim()
        prim.ApplyAPI("CalmContactAPI")
        prim.GetAttribute("calm:contact:kind").Set(kind)
        active = prim.GetAttribute("calm:contact:active")
        active.Set(side == "left", 0)
        active.Set(side == "right", landing)
        hip, slide, ankle = leg_values(feet[side][0] - x, feet[side][1])
        _joint(stage, UsdPhysics.RevoluteJoint, f"{base}/hip", torso, thigh, (0, y, HIP - 0.8), (0, 0, 0), "Y", hip)
        _joint(stage, UsdPhysics.PrismaticJoint, f"{base}/knee", thigh, shank, (0, 0, -0.3), (0, 0, 0.36), "Z", slide)
        _joint(stage, UsdPhysics.RevoluteJoint, f"{base}/ankle", shank, foot, (0, 0, 0), (0, 0, 0), "Y", ankle)
    if edit is not None:
        edit(stage)
    stage.GetRootLayer().Save()
    return path


def giving(stage):
    """An edit: drives in the place of ideal motors."""
    for side in LEGS:
        for name, kind in (("hip", "angular"), ("knee", "linear"), ("ankle", "angular")):
            prim = stage.GetPrimAtPath(f"{ROBOT}/{side}/{name}")
            drive = UsdPhysics.DriveAPI(prim, kind)
            drive.CreateStiffnessAttr(2e4 if kind == "linear" else 10.0)
            drive.CreateDampingAttr(200.0 if kind == "linear" else 0.1)
            prim.ApplyAPI("CalmMotorAPI")
            prim.GetAttribute("calm:motor:model").Set("drive")


def _body(stage, path, place, mass, size, center=(0, 0, 0)):
    body = UsdGeom.Xform.Define(stage, path)
    body.AddTranslateOp().Set(Gf.Vec3d(*place))
    UsdPhysics.RigidBodyAPI.Apply(body.GetPrim())
    UsdPhysics.MassAPI.Apply(body.GetPrim()).CreateMassAttr(mass)
    box = UsdGeom.Cube.Define(stage, f"{path}/box")
    box.CreateSizeAttr(1.0)
    box.AddTranslateOp().Set(Gf.Vec3d(*center))
    box.AddScaleOp().Set(Gf.Vec3f(*size))
    UsdPhysics.CollisionAPI.Apply(box.GetPrim())
    return path


def _joint(stage, kind, path, body0, body1, place0, place1, axis, values):
    joint = kind.Define(stage, path)
    joint.CreateBody0Rel().SetTargets([body0])
    joint.CreateBody1Rel().SetTargets([body1])
    joint.CreateLocalPos0Attr(Gf.Vec3f(*place0))
    joint.CreateLocalPos1Attr(Gf.Vec3f(*place1))
    joint.CreateAxisAttr(axis)
    linear = kind is UsdPhysics.PrismaticJoint
    drive = UsdPhysics.DriveAPI.Apply(joint.GetPrim(), "linear" if linear else "angular")
    target = drive.CreateTargetPositionAttr()
    for frame, value in enumerate(values):
        target.Set(float(value if linear else np.degrees(value)), frame)
