"""Hostile scenes: composition, splines, schemas and bodies as animators and converters of robots author them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import posed_shots
from hostile import DONE, Case, Edit, arm, simulate
from pxr import Gf, Sdf, Ts, Usd, UsdGeom, UsdPhysics, UsdSkel, Vt
from shot_edits import applied, attribute, both, flexible, targets
from small_shots import BASE, ELBOW, FORE, PLASTIC, SHOULDER, TARGET_POSITION, UPPER, make_flexible

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


def kinematic(*paths: str) -> Edit:
    return lambda stage: [
        UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath(path)).CreateKinematicEnabledAttr(True) for path in paths
    ]


def schema_elsewhere(path: str) -> Edit:
    return both(
        make_flexible,
        lambda stage: stage.GetPrimAtPath(FORE).RemoveAppliedSchema("CalmFlexibleBodyAPI"),
        applied(path, "CalmFlexibleBodyAPI"),
    )


def without_order(stage: Usd.Stage) -> None:
    posed_shots.posed(stage)
    for path in (UPPER, FORE):
        stage.GetPrimAtPath(path).RemoveProperty("xformOpOrder")


def second_drive(stage: Usd.Stage) -> None:
    drive = UsdPhysics.DriveAPI.Apply(stage.GetPrimAtPath(ELBOW), "linear").CreateTargetPositionAttr()
    for code in (0.0, 24.0):
        drive.Set(0.01 * code, code)


def connected(stage: Usd.Stage) -> None:
    source = stage.DefinePrim("/Arm/control").CreateAttribute("angle", Sdf.ValueTypeNames.Float)
    own = stage.GetPrimAtPath(ELBOW).GetAttribute(TARGET_POSITION)
    own.Clear()
    own.SetConnections([source.GetPath()])


def fore_beside(stage: Usd.Stage) -> None:
    layer = stage.GetRootLayer()
    Sdf.CopySpec(layer, FORE, layer, "/Fore")
    stage.RemovePrim(FORE)
    targets(ELBOW, "physics:body1", "/Fore")(stage)


def rotations(change: Callable[[list[Gf.Quatf]], list[Gf.Quatf]]) -> Edit:
    """A skeleton of which the rotations at a frame are changed."""

    def edit(stage: Usd.Stage) -> None:
        posed_shots.skeletal(stage)
        own = UsdSkel.Animation(stage.GetPrimAtPath(posed_shots.ANIMATION)).GetRotationsAttr()
        own.Set(Vt.QuatfArray(change(list(own.Get(5)))), 5)

    return edit


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
        make=above(REFERENCE % " (offset = 10; scale = 2)", start=10.0, end=58.0), statuses=DONE
    ),
    "joints that are relocated": simulate(
        make=above(REFERENCE % "", "    relocates = { </Arm/joints>: </Arm/motors> }\n"), statuses=DONE
    ),
    "a body that a reference does not reach": simulate(
        ELBOW, "outside of what is referenced", make=above(REFERENCE % "", "", 0.0, 24.0, fore_beside, target=False)
    ),
    "schemas that a stronger layer lists anew": simulate(
        FORE, "no rigid body", make=above(OVER % 'apiSchemas = ["PhysicsMassAPI"]', BELOW, target=False)
    ),
    "a body that a stronger layer takes away": simulate(
        f"{FORE}/hand", make=above(OVER % 'delete apiSchemas = ["PhysicsRigidBodyAPI"]', BELOW)
    ),
    "a target position by a connection": simulate(ELBOW, "connection", make=arm(connected)),
    # animation
    "a base that a spline moves": simulate("moves the root", make=arm(moved_base), statuses=DONE),
    "a limit by a spline": simulate(
        "it is animated", make=arm(spline(ELBOW, "physics:upperLimit", (0, 50), (24, 90))), statuses=DONE
    ),
    "animated bodies without an order of operations": simulate("xformOpOrder", make=arm(without_order)),
    "a second drive that moves nothing": simulate("drive:linear", make=arm(second_drive), statuses=DONE),
    "a skeleton with too few rotations": simulate(
        posed_shots.ANIMATION, "time code 5", make=arm(rotations(lambda own: own[:1]))
    ),
    "rotations of length two": simulate("unit length", make=arm(rotations(lambda own: [2.0 * one for one in own]))),
    "a skeleton without its animation": simulate("has no animation", make=arm(unbound), statuses=DONE),
    # bodies and joints
    "all bodies kinematic and animated": simulate(
        "physics:kinematicEnabled", make=arm(posed_shots.posed, kinematic(BASE, UPPER, FORE))
    ),
    "a kinematic forearm": simulate(FORE, "physics:kinematicEnabled", make=arm(kinematic(FORE))),
    "a joint on a material": simulate(
        PLASTIC, "no transform", make=arm(flexible(targets(ELBOW, "physics:body1", PLASTIC)))
    ),
    "a joint on another joint": simulate("no transform", make=arm(targets(ELBOW, "physics:body1", SHOULDER))),
    "bodies of a joint in the other order": simulate(make=arm(swapped), statuses=DONE),
    "a body that is a unit cube": simulate(make=arm(flexible(unit_cube)), statuses=DONE),
    "a body that gravity does not pull": simulate(
        "gravity acts on the body",
        make=arm(attribute(FORE, "physxRigidBody:disableGravity", "Bool", True)),
        statuses=DONE,
    ),
    # schemas
    "the schema of flexible bodies on a mesh": simulate(
        f"{FORE}/skin", "no effect", make=arm(schema_elsewhere(f"{FORE}/skin")), statuses=DONE
    ),
    "the schema of flexible bodies on the robot": simulate(
        "no effect", make=arm(schema_elsewhere("/Arm")), statuses=DONE
    ),
    "a flexible mesh that is subdivided": simulate(
        "catmullClark",
        make=arm(flexible(lambda stage: UsdGeom.Mesh(stage.GetPrimAtPath(f"{FORE}/skin"))
                          .GetSubdivisionSchemeAttr().Set("catmullClark"))),
        statuses=DONE,
    ),
}  # fmt: skip
