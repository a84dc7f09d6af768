"""Hostile scenes: composition, splines, schemas and bodies as animators and converters of robots author them."""

from pathlib import Path

import numpy as np
import posed_shots
from hostile import DONE, Case, Edit, arm, simulate
from pxr import Gf, Ts, Usd, UsdGeom, UsdPhysics, Vt
from shot_edits import applied, attribute, both, flexible
from small_shots import BASE, ELBOW, FORE, UPPER, make_flexible

HEAD = """#usda 1.0
(
    defaultPrim = "Arm"
    metersPerUnit = 1
    upAxis = "Z"
    timeCodesPerSecond = 24
    startTimeCode = %g
    endTimeCode = %g
%s)
"""


def above(body: str, metadata: str = "", start: float = 0.0, end: float = 24.0, *edits: Edit, target: bool = True):
    """The arm in robot.usda, and a shot above it."""

    def make(folder: Path) -> None:
        arm(*edits, name="robot.usda", target=target)(folder)
        (folder / "shot.usda").write_text(HEAD % (start, end, metadata) + body)

    return make


def spline(path: str, name: str, *knots: tuple[float, float]) -> Edit:
    """An attribute by a spline."""

    def edit(stage: Usd.Stage) -> None:
        own = stage.GetPrimAtPath(path).GetAttribute(name)
        own.Clear()
        curve = Ts.Spline(str(own.GetTypeName()))
        for code, value in knots:
            curve.SetKnot(Ts.Knot(typeName=str(own.GetTypeName()), time=code, value=value, nextInterp=Ts.InterpCurve))
        own.SetSpline(curve)

    return edit


def moved_base(stage: Usd.Stage) -> None:
    stage.RemovePrim("/Arm/joints/stand")
    UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath(BASE)).CreateKinematicEnabledAttr(True)
    UsdGeom.Xformable(stage.GetPrimAtPath(BASE)).AddTranslateXOp()
    spline(BASE, "xformOp:translateX", (0.0, 0.0), (24.0, 0.2))(stage)


def schema_elsewhere(path: str) -> Edit:
    return both(
        make_flexible,
        lambda stage: stage.GetPrimAtPath(FORE).RemoveAppliedSchema("CalmFlexibleBodyAPI"),
        applied(path, "CalmFlexibleBodyAPI"),
    )


def second_drive(stage: Usd.Stage) -> None:
    drive = UsdPhysics.DriveAPI.Apply(stage.GetPrimAtPath(ELBOW), "linear").CreateTargetPositionAttr()
    for code in (0.0, 24.0):
        drive.Set(0.01 * code, code)


def unbound(stage: Usd.Stage) -> None:
    posed_shots.skeletal(stage)
    stage.GetPrimAtPath(posed_shots.SKELETON).RemoveProperty("skel:animationSource")


def unit_cube(stage: Usd.Stage) -> None:
    """The forearm by a scale that differs by axis on its body, as Isaac has it."""
    scale = np.array([0.4, 0.04, 0.04])
    UsdGeom.Xformable(stage.GetPrimAtPath(FORE)).AddScaleOp().Set(Gf.Vec3f(*map(float, scale)))
    points = UsdGeom.Mesh(stage.GetPrimAtPath(f"{FORE}/skin")).GetPointsAttr()
    points.Set(Vt.Vec3fArray.FromNumpy((np.array(points.Get()) / scale).astype(np.float32)))


def swapped(stage: Usd.Stage) -> None:
    """The elbow's bodies in the other order."""
    joint = UsdPhysics.Joint(stage.GetPrimAtPath(ELBOW))
    joint.GetBody0Rel().SetTargets([FORE])
    joint.GetBody1Rel().SetTargets([UPPER])
    joint.GetLocalPos1Attr().Set(joint.GetLocalPos0Attr().Get())
    joint.GetLocalPos0Attr().Set(Gf.Vec3f(0.0))


REFERENCE = 'def "Arm" (\n    references = @./robot.usda@</Arm>%s\n)\n{\n}\n'
OVER = 'over "Arm"\n{\n    over "fore" (\n        %s\n    )\n    {\n    }\n}\n'
BELOW = "    subLayers = [@./robot.usda@]\n"

CASES: dict[str, Case] = {
    # composition
    "a robot in another time behind a reference": simulate(
        DONE, make=above(REFERENCE % " (offset = 10; scale = 2)", start=10.0, end=58.0)
    ),
    "joints that are relocated": simulate(
        DONE, make=above(REFERENCE % "", "    relocates = { </Arm/joints>: </Arm/motors> }\n")
    ),
    # animation
    "a base that a spline moves": simulate(DONE, moved_base, "moves the root"),
    "a limit by a spline": simulate(DONE, spline(ELBOW, "physics:upperLimit", (0, 50), (24, 90)), "it is animated"),
    "a second drive that moves nothing": simulate(DONE, second_drive, "drive:linear"),
    "a skeleton without its animation": simulate(DONE, unbound, "has no animation"),
    # bodies and joints
    "bodies of a joint in the other order": simulate(DONE, swapped),
    "a body that is a unit cube": simulate(DONE, flexible(unit_cube)),
    "a body that gravity does not pull": simulate(
        DONE, attribute(FORE, "physxRigidBody:disableGravity", "Bool", True), "gravity acts on the body"
    ),
    # schemas
    "the schema of flexible bodies on a mesh": simulate(
        DONE, schema_elsewhere(f"{FORE}/skin"), f"{FORE}/skin", "no effect"
    ),
    "the schema of flexible bodies on the robot": simulate(DONE, schema_elsewhere("/Arm"), "no effect"),
    "a flexible mesh that is subdivided": simulate(
        DONE,
        flexible(
            lambda stage: (
                UsdGeom.Mesh(stage.GetPrimAtPath(f"{FORE}/skin")).GetSubdivisionSchemeAttr().Set("catmullClark")
            )
        ),
        "catmullClark",
    ),
}
