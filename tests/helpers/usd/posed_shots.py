"""The arm of `small_shots`, animated by the transforms of its bodies or by a skeleton instead of its drives."""

from pxr import Gf, Sdf, UsdGeom, UsdSkel, Vt
from small_shots import ELBOW, FORE, FRAMES, LENGTH, SHOULDER, TARGET_POSITION, UPPER, angles

SKELETON, ANIMATION = "/Arm/skel/Skeleton", "/Arm/skel/Animation"
ROOT, ARM, FOREARM = "root", "root/arm", "root/arm/fore"


def still_drives(stage) -> None:
    """Take the animation from the drives."""
    for path in (SHOULDER, ELBOW):
        stage.GetPrimAtPath(path).GetAttribute(TARGET_POSITION).Clear()


def about_y(degrees: float) -> Gf.Quatd:
    return Gf.Rotation(Gf.Vec3d(0, 1, 0), float(degrees)).GetQuat()


def pose(frame: float, meters: float, turn=angles):
    """World matrices of both links."""
    shoulder, elbow = (float(a) for a in turn(frame))
    upper = Gf.Matrix4d().SetRotate(about_y(shoulder)) * Gf.Matrix4d().SetTranslate(Gf.Vec3d(0, 0, 1.0 / meters))
    hang = Gf.Matrix4d().SetTranslate(Gf.Vec3d(LENGTH / meters, 0, 0))
    fore = Gf.Matrix4d().SetRotate(about_y(elbow)) * hang * upper
    return upper, fore


def posed(stage, scale=None, frames=range(FRAMES + 1), turn=angles) -> None:
    """Animate both links by matrices."""
    still_drives(stage)
    meters = UsdGeom.GetStageMetersPerUnit(stage)
    for k, path in enumerate((UPPER, FORE)):
        xform = UsdGeom.Xformable(stage.GetPrimAtPath(path))
        xform.ClearXformOpOrder()
        op = xform.AddTransformOp()
        for frame in frames:
            op.Set(pose(frame, meters, turn)[k], frame)


def posed_by_pivots(stage) -> None:
    """Animate both links by rotations about pivots, the forearm in a space of its own."""
    still_drives(stage)
    upper = UsdGeom.Xformable(stage.GetPrimAtPath(UPPER))
    upper.ClearXformOpOrder()
    upper.AddTranslateOp().Set(Gf.Vec3d(0, 0, 1))
    pivot = Gf.Vec3d(0.1, 0.0, 0.2)
    upper.AddTranslateOp(opSuffix="pivot").Set(pivot)
    turn = upper.AddRotateXYZOp()
    # a turn about a pivot moves the origin as well: the rest of the motion takes that back
    back = upper.AddTranslateOp(opSuffix="back")
    upper.AddTranslateOp(opSuffix="pivot", isInverseOp=True)
    fore = UsdGeom.Xformable(stage.GetPrimAtPath(FORE))
    fore.ClearXformOpOrder()
    fore.SetResetXformStack(True)
    place, bend = fore.AddTranslateOp(), fore.AddOrientOp(UsdGeom.XformOp.PrecisionDouble)
    for frame in range(FRAMES + 1):
        shoulder, elbow = (float(a) for a in angles(frame))
        turn.Set(Gf.Vec3f(0, shoulder, 0), frame)
        rotate = Gf.Matrix4d().SetRotate(about_y(shoulder))
        back.Set(-rotate.GetInverse().Transform(pivot) + pivot, frame)
        _, world = pose(frame, 1.0)
        place.Set(world.ExtractTranslation(), frame)
        bend.Set(about_y(shoulder + elbow), frame)


def skeletal(stage, sparse: bool = False, turn=angles, off_axis: float = 0.0) -> None:
    """Animate both motors by a skeleton that has a root joint of its own and stands elsewhere.

    Args:
        sparse: Whether the animation has the forearm alone.
        off_axis: Turn about x of the forearm [deg], which its hinge cannot do.
    """
    still_drives(stage)
    meters = UsdGeom.GetStageMetersPerUnit(stage)
    root = UsdSkel.Root.Define(stage, "/Arm/skel")
    root.AddTranslateOp().Set(Gf.Vec3d(0, 3.0 / meters, 0))
    root.AddRotateXOp().Set(-90.0)  # a y-up skeleton in a z-up shot
    skeleton = UsdSkel.Skeleton.Define(stage, SKELETON)
    joints = [ROOT, ARM, FOREARM]
    # at rest the joints' axes lie oblique
    rests = [
        Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(1, 2, 3).GetNormalized(), 40.0)),
        Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(0, 1, 1).GetNormalized(), -70.0))
        * Gf.Matrix4d().SetTranslate(Gf.Vec3d(0, 0.2, 0)),
        Gf.Matrix4d().SetTranslate(Gf.Vec3d(LENGTH / meters, 0, 0)),
    ]
    worlds = [rests[0], rests[1] * rests[0], rests[2] * rests[1] * rests[0]]
    skeleton.CreateJointsAttr(joints)
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray(rests))
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray(worlds))
    animation = UsdSkel.Animation.Define(stage, ANIMATION)
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets([ANIMATION])
    moved = [2] if sparse else [1, 2]
    animation.CreateJointsAttr([joints[k] for k in moved])
    animation.CreateTranslationsAttr([Gf.Vec3f(rests[k].ExtractTranslation()) for k in moved])
    animation.CreateScalesAttr([Gf.Vec3h(1, 1, 1) for _ in moved])
    rotations = animation.CreateRotationsAttr()
    # the motors' axis is y of the world: in the axes of each joint's parent at rest
    placed = UsdGeom.XformCache().GetLocalToWorldTransform(skeleton.GetPrim())
    parents = [Gf.Matrix4d(1.0), rests[0] * placed, rests[1] * rests[0] * placed]
    for frame in range(FRAMES + 1):
        found = []
        for k in moved:
            axis = parents[k].GetInverse().TransformDir(Gf.Vec3d(0, 1, 0)).GetNormalized()
            side = parents[k].GetInverse().TransformDir(Gf.Vec3d(1, 0, 0)).GetNormalized()
            turned = Gf.Matrix4d().SetRotate(Gf.Rotation(axis, float(turn(frame)[k - 1])))
            tilted = Gf.Matrix4d().SetRotate(Gf.Rotation(side, off_axis if k == 2 else 0.0))
            local = Gf.Matrix4d().SetRotate(rests[k].ExtractRotation()) * tilted * turned
            found.append(Gf.Quatf(local.ExtractRotationQuat()))
        rotations.Set(Vt.QuatfArray(found), frame)
    for path, joint in ((SHOULDER, ARM), (ELBOW, FOREARM)):
        prim = stage.GetPrimAtPath(path)
        prim.AddAppliedSchema("CalmMotorAPI")
        prim.CreateAttribute("calm:motor:skelJoint", Sdf.ValueTypeNames.Token).Set(joint)
