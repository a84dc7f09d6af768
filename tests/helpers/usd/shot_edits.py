"""Edits of the arm of `small_shots`, each of which breaks something."""

from collections.abc import Callable

import posed_shots
import small_shots as shots
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdSkel, Vt
from small_shots import BASE, ELBOW, FORE, HAND, SHOULDER, TARGET_POSITION, UPPER, clear_mass, set_float

Edit = Callable[[Usd.Stage], None]
SKIN = f"{FORE}/skin"


def sample(path: str, value: object, code: float = 3.0) -> Edit:
    return lambda stage: stage.GetPrimAtPath(path).GetAttribute(TARGET_POSITION).Set(value, code)


def number(path: str, name: str, value: float) -> Edit:
    return lambda stage: set_float(stage, path, name, value)


def vector(path: str, name: str, *value: float) -> Edit:
    return lambda stage: stage.GetPrimAtPath(path).GetAttribute(name).Set(Gf.Vec3f(*value))


def attribute(path: str, name: str, kind: str, value: object) -> Edit:
    """An attribute authored anew, with whatever type."""

    def edit(stage: Usd.Stage) -> None:
        prim = stage.GetPrimAtPath(path)
        prim.RemoveProperty(name)
        spec = Sdf.AttributeSpec(stage.GetRootLayer().GetPrimAtPath(path), name, getattr(Sdf.ValueTypeNames, kind))
        spec.default = value

    return edit


def targets(path: str, name: str, *paths: str) -> Edit:
    return lambda stage: stage.GetPrimAtPath(path).GetRelationship(name).SetTargets(list(paths))


def transform(path: str, matrix: Gf.Matrix4d) -> Edit:
    def edit(stage: Usd.Stage) -> None:
        xform = UsdGeom.Xformable(stage.GetPrimAtPath(path))
        xform.ClearXformOpOrder()
        xform.AddTransformOp().Set(matrix)

    return edit


def applied(path: str, *schemas: str) -> Edit:
    def edit(stage: Usd.Stage) -> None:
        for schema in schemas:
            stage.GetPrimAtPath(path).AddAppliedSchema(schema)

    return edit


def both(*edits: Edit) -> Edit:
    def edit(stage: Usd.Stage) -> None:
        for one in edits:
            one(stage)

    return edit


def material(**values: float) -> Edit:
    return lambda stage: shots.make_flexible(stage, FORE, **values)


def flexible(edit: Edit) -> Edit:
    return both(lambda stage: shots.make_flexible(stage), edit)


def target(**weights: float) -> Edit:
    return lambda stage: shots.make_target(stage, HAND, **weights)


def retarget(name: str, kind: str, value: object) -> Edit:
    return both(applied("/Arm", "CalmRetargetAPI"), attribute("/Arm", f"calm:retarget:{name}", kind, value))


def unanimated(stage: Usd.Stage) -> None:
    for path in (SHOULDER, ELBOW):
        stage.GetPrimAtPath(path).GetAttribute(TARGET_POSITION).Clear()
        stage.GetPrimAtPath(path).AddAppliedSchema("CalmMotorAPI")


def undriven(stage: Usd.Stage) -> None:
    for path in (SHOULDER, ELBOW):
        stage.GetPrimAtPath(path).RemoveAppliedSchema("PhysicsDriveAPI:angular")
        stage.GetPrimAtPath(path).GetAttribute(TARGET_POSITION).Clear()


def no_bodies(stage: Usd.Stage) -> None:
    for path in (BASE, UPPER, FORE):
        stage.GetPrimAtPath(path).RemoveAppliedSchema("PhysicsRigidBodyAPI")


def massless(stage: Usd.Stage) -> None:
    clear_mass(stage, FORE)


def second_motor(stage: Usd.Stage) -> None:
    """A second motor between the same bodies, on the same axis, that wants something else."""
    layer = stage.GetRootLayer()
    Sdf.CopySpec(layer, ELBOW, layer, "/Arm/joints/elbow_again")
    attr = stage.GetPrimAtPath("/Arm/joints/elbow_again").GetAttribute(TARGET_POSITION)
    for frame in range(shots.FRAMES + 1):
        attr.Set(float(-30.0 * frame), frame)


def moving_root(stage: Usd.Stage) -> None:
    op = UsdGeom.Xformable(stage.GetPrimAtPath(BASE)).GetOrderedXformOps()[0]
    for frame in range(shots.FRAMES + 1):
        op.Set(Gf.Vec3d(0, 0.01 * frame, 1), frame)


def gear(leader: str) -> Edit:
    return lambda stage: stage.GetPrimAtPath(ELBOW).CreateRelationship("newton:mimicJoint").SetTargets([leader])


def gears_in_a_circle(stage: Usd.Stage) -> None:
    for one, other in ((SHOULDER, ELBOW), (ELBOW, SHOULDER)):
        stage.GetPrimAtPath(one).CreateRelationship("newton:mimicJoint").SetTargets([other])


def skel_joint(stage: Usd.Stage) -> None:
    unanimated(stage)
    stage.GetPrimAtPath(ELBOW).CreateAttribute("calm:motor:skelJoint", Sdf.ValueTypeNames.Token).Set("hips/arm")


def mesh(name: str, value: object) -> Edit:
    return flexible(lambda stage: stage.GetPrimAtPath(SKIN).GetAttribute(name).Set(value))


def mesh_file(path: str) -> Edit:
    return flexible(attribute(FORE, "calm:flexible:meshFile", "Asset", Sdf.AssetPath(path)))


def tet_mesh(points: list, tets: list) -> Edit:
    def edit(stage: Usd.Stage) -> None:
        tet = UsdGeom.TetMesh.Define(stage, f"{FORE}/tets")
        tet.CreatePointsAttr(points)
        tet.CreateTetVertexIndicesAttr([Gf.Vec4i(*t) for t in tets])

    return flexible(edit)


def a_foreign_joint(stage: Usd.Stage) -> None:
    layer = stage.GetRootLayer()
    layer.GetPrimAtPath(ELBOW).typeName = "PhysicsDistanceJoint"


def stage_metadata(name: str, value: float) -> Edit:
    return lambda stage: stage.GetRootLayer().pseudoRoot.SetInfo(name, value)


def times(start: float, end: float) -> Edit:
    def edit(stage: Usd.Stage) -> None:
        stage.SetStartTimeCode(start)
        stage.SetEndTimeCode(end)

    return edit


def one_sample(stage: Usd.Stage) -> None:
    for path in (SHOULDER, ELBOW):
        stage.GetPrimAtPath(path).GetAttribute(TARGET_POSITION).Clear()
        stage.GetPrimAtPath(path).GetAttribute(TARGET_POSITION).Set(1.0, 3.0)
    for name in ("startTimeCode", "endTimeCode"):
        stage.GetRootLayer().pseudoRoot.ClearInfo(name)


def half_turns(stage: Usd.Stage) -> None:
    for frame in range(shots.FRAMES + 1):
        stage.GetPrimAtPath(SHOULDER).GetAttribute(TARGET_POSITION).Set(float(9e7 * (frame % 2)), frame)


def close_samples(stage: Usd.Stage) -> None:
    attr = stage.GetPrimAtPath(SHOULDER).GetAttribute(TARGET_POSITION)
    attr.Set(float(attr.Get(12.0)) + 1e-4, 12.0 + 1e-10)


def kinematic(*paths: str) -> Edit:
    return lambda stage: [
        UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath(path)).CreateKinematicEnabledAttr(True) for path in paths
    ]


def without_order(stage: Usd.Stage) -> None:
    posed_shots.posed(stage)
    for path in (UPPER, FORE):
        stage.GetPrimAtPath(path).RemoveProperty("xformOpOrder")


def connected(stage: Usd.Stage) -> None:
    source = stage.DefinePrim("/Arm/control").CreateAttribute("angle", Sdf.ValueTypeNames.Float)
    own = stage.GetPrimAtPath(ELBOW).GetAttribute(TARGET_POSITION)
    own.Clear()
    own.SetConnections([source.GetPath()])


def rotations(change: Callable[[list[Gf.Quatf]], list[Gf.Quatf]]) -> Edit:
    """A skeleton of which the rotations at a frame are changed."""

    def edit(stage: Usd.Stage) -> None:
        posed_shots.skeletal(stage)
        own = UsdSkel.Animation(stage.GetPrimAtPath(posed_shots.ANIMATION)).GetRotationsAttr()
        own.Set(Vt.QuatfArray(change(list(own.Get(5)))), 5)

    return edit
