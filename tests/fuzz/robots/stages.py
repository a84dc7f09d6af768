"""Writes a robot to USD in the way of a telling."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from calmotion.usd.schemas import register
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics
from robots import WORLD, Joint, Robot, placed
from scipy.spatial.transform import Rotation
from solids import Solids, quaternion, vector
from tellings import Telling, reframed, welded

# Onto which axis of the joint's frame z goes
AXES = {
    "X": np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]]).T,
    "Y": np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]]).T,
    "Z": np.eye(3),
}


def write(robot: Robot, telling: Telling, folder: Path) -> Path:
    """Write it; the file to open."""
    register()
    if telling.welded:
        robot = welded(robot)
    if telling.cubes:
        robot = reframed(robot)
    if telling.held == "fixed" and robot.kind == "free base":
        robot = replace(robot, joints=[*robot.joints, Joint("fixed", WORLD, 0, robot.rest[0], np.eye(4))])
    folder.mkdir(parents=True, exist_ok=True)
    return _Writer(robot, telling, folder).file


class _Writer(Solids):
    def __init__(self, robot: Robot, telling: Telling, folder: Path):
        self.robot, self.t, m = robot, telling, telling.meters
        self.root = "/_Robot" if telling.composed == "inherit" else "/Robot"
        file = folder / "robot.usda"
        file.unlink(missing_ok=True)
        self.stage = Usd.Stage.CreateNew(str(file))
        self.head(self.stage)
        prim = UsdGeom.Xform.Define(self.stage, self.root).GetPrim()
        prim.AddAppliedSchema("CalmRetargetAPI")
        UsdPhysics.ArticulationRootAPI.Apply(prim)
        self.stage.SetDefaultPrim(prim)
        for name, value in robot.retarget.items():
            kind = {bool: "bool", str: "token", float: "float"}[type(value)]
            value = value / m if name in ("tolerance", "goal") else value
            prim.CreateAttribute(f"calm:retarget:{name}", getattr(Sdf.ValueTypeNames, kind.title())).Set(value)
        self.top = telling.world @ placed(np.eye(3) * telling.scale)
        self.transform(prim, self.top)
        self.inner = self.root
        if telling.scoped:
            self.inner = f"{self.root}/Geo"
            UsdGeom.Scope.Define(self.stage, self.inner)
        if telling.place is not None and not np.allclose(telling.place[:3, :3], np.eye(3)):
            scene = UsdPhysics.Scene.Define(self.stage, f"{self.root}/Scene")
            scene.CreateGravityDirectionAttr(vector(telling.world[:3, :3] @ [0, 0, -1]))
            scene.CreateGravityMagnitudeAttr(9.81 / m)
        self.paths: list[str] = []
        for k in range(len(robot.solids)):
            self.body(k)
        for k in range(len(robot.joints)):
            self.joint(k)
        for k, (body, place, weight, rotation) in enumerate(robot.targets):
            target = self.mark(body, f"Tip{k}", place, "CalmTargetAPI")
            target.CreateAttribute("calm:target:positionWeight", Sdf.ValueTypeNames.Float).Set(weight)
            target.CreateAttribute("calm:target:rotationWeight", Sdf.ValueTypeNames.Float).Set(rotation)
        for k, (body, place, kind, active) in enumerate(robot.feet):
            foot = self.mark(body, f"Foot{k}", place, "CalmContactAPI")
            foot.CreateAttribute("calm:contact:kind", Sdf.ValueTypeNames.Token).Set(kind)
            if active:
                self.samples(foot.CreateAttribute("calm:contact:active", Sdf.ValueTypeNames.Bool), active.items())
        self.stage.GetRootLayer().Save()
        self.file = self.compose(folder, file)

    def head(self, stage) -> None:
        """Metadata of a root layer."""
        t = self.t
        UsdGeom.SetStageMetersPerUnit(stage, t.meters)
        UsdPhysics.SetStageKilogramsPerUnit(stage, t.kilograms)
        UsdGeom.SetStageUpAxis(stage, t.up)
        stage.SetTimeCodesPerSecond(t.rate)
        stage.SetFramesPerSecond(24.0)
        stage.SetStartTimeCode(t.start)
        stage.SetEndTimeCode(t.start + t.rate * self.robot.seconds)

    def compose(self, folder: Path, file: Path) -> Path:
        """What stands between the robot and the shot."""
        how = self.t.composed
        offset = Sdf.LayerOffset(10.0, 2.0) if self.t.shifted else Sdf.LayerOffset()
        if how == "flat":
            return file
        (folder / "shot.usda").unlink(missing_ok=True)
        stage = Usd.Stage.CreateNew(str(folder / "shot.usda"))
        self.head(stage)
        path = "/World/Show"
        if how in ("sublayer", "inherit"):
            stage.GetRootLayer().subLayerPaths.append("robot.usda")
            stage.GetRootLayer().subLayerOffsets[0] = offset
            if how == "inherit":
                self.stage.GetRootLayer().GetPrimAtPath(self.root).specifier = Sdf.SpecifierClass
                self.stage.GetRootLayer().Save()
                UsdGeom.Xform.Define(stage, path).GetPrim().GetInherits().AddInherit(self.root)
        else:
            prim = UsdGeom.Xform.Define(stage, path).GetPrim()
            if how == "payload":
                prim.GetPayloads().AddPayload(Sdf.Payload("robot.usda", layerOffset=offset))
            elif how == "variant":
                variants = prim.GetVariantSets().AddVariantSet("model")
                for name in ("full", "none"):
                    variants.AddVariant(name)
                variants.SetVariantSelection("full")
                with variants.GetVariantEditContext():
                    prim.GetReferences().AddReference(Sdf.Reference("robot.usda", layerOffset=offset))
            else:
                prim.GetReferences().AddReference(Sdf.Reference("robot.usda", layerOffset=offset))
                prim.SetInstanceable(how == "instance")
        stage.GetRootLayer().Save()
        return folder / "shot.usda"

    def mark(self, k: int, name: str, place, schema: str):
        """A frame on a body."""
        prim = UsdGeom.Xform.Define(self.stage, f"{self.paths[k]}/{name}").GetPrim()
        prim.AddAppliedSchema(schema)
        turned = (
            np.eye(3) if self.t.cubes and not self.robot.solids[k].modulus else place[:3, :3]
        )  # else it would shear
        self.transform(prim, placed(turned, place[:3, 3] / self.scale(k)))
        return prim

    def body(self, k: int) -> None:
        robot, solid = self.robot, self.robot.solids[k]
        carrier = next((j.body0 for j in robot.joints if j.body1 == k and not j.closes), WORLD)
        inside = self.t.nested and carrier != WORLD and carrier < k
        path = f"{self.paths[carrier] if inside else self.inner}/B{k}"
        cube = self.t.cubes and not solid.modulus
        prim = (UsdGeom.Cube if cube else UsdGeom.Xform).Define(self.stage, path).GetPrim()
        self.paths.append(path)
        own = placed(np.diag(self.scale(k)))

        def local(poses):
            above = self.top if not inside else self.t.world @ poses[carrier] @ placed(np.eye(3) * self.t.scale)
            return np.linalg.inv(above) @ self.t.world @ poses[k] @ own

        self.transform(prim, local(robot.rest))
        if self.t.posed:
            UsdGeom.Xformable(prim).ClearXformOpOrder()
            for name in list(prim.GetAuthoredPropertyNames()):
                if name.startswith("xformOp:"):
                    prim.RemoveProperty(name)
            op = UsdGeom.Xformable(prim).AddTransformOp(opSuffix="moved")
            for n in range(round(24 * robot.seconds) + 1):
                whole = local(self.poses(n / 24))
                whole[:3, 3] /= self.t.meters
                op.Set(Gf.Matrix4d(*whole.T.ravel()), self.code(n / 24))
        if self.t.held == "kinematic" and robot.kind == "free base" and k == 0:
            UsdPhysics.RigidBodyAPI.Apply(prim).CreateKinematicEnabledAttr(True)
        if cube:
            UsdGeom.Cube(prim).CreateSizeAttr(1.0)
        UsdPhysics.RigidBodyAPI.Apply(prim)
        if solid.modulus:
            self.flexible(prim, solid, k)
        else:
            self.rigid(prim, solid, k)

    def poses(self, seconds: float):
        """Poses of the bodies of an open chain at a frame, at which all curves have keys."""
        poses = list(self.robot.rest)
        for joint in sorted(self.robot.joints, key=lambda joint: joint.body1):
            q = 0.0 if joint.keys is None else float(np.interp(seconds, *joint.keys))
            moved = placed(at=(0, 0, q)) if joint.linear else placed(Rotation.from_rotvec([0, 0, q]).as_matrix())
            carrier = np.eye(4) if joint.body0 == WORLD else poses[joint.body0]
            poses[joint.body1] = carrier @ joint.frame0 @ moved @ np.linalg.inv(joint.frame1)
        return poses

    def samples(self, attribute, items) -> None:
        """Time samples from seconds."""
        for seconds, value in items:
            attribute.Set(value, self.code(seconds))

    def code(self, seconds: float) -> float:
        """The time code in the robot's own layer."""
        code = self.t.start + seconds * self.t.rate
        return (code - 10.0) / 2.0 if self.t.shifted else code

    def joint(self, k: int) -> None:
        t, joint = self.t, self.robot.joints[k]
        kind = {"revolute": "Revolute", "prismatic": "Prismatic", "fixed": "Fixed", "spherical": "Spherical"}[
            joint.kind
        ]
        moving = joint.kind in ("revolute", "prismatic")
        several = t.several and moving
        prim = getattr(UsdPhysics, "Joint" if several else f"{kind}Joint").Define(self.stage, f"{self.inner}/J{k}")
        sign, zero, roll = 1.0, 0.0, np.eye(4)
        if t.rolled and moving:
            roll = (
                placed(at=(0, 0, t.rolled))
                if joint.linear
                else placed(Rotation.from_rotvec([0, 0, t.rolled]).as_matrix())
            )
            zero = -t.rolled
        twist = placed(AXES[t.axes]) if moving else np.eye(4)
        ends = [(joint.body0, joint.frame0 @ roll @ twist), (joint.body1, joint.frame1 @ twist)]
        if k in t.exchanged:
            ends, sign, zero = ends[::-1], -1.0, -zero
        for n, (body, frame) in enumerate(ends):
            self.end(prim, k, n, body, frame)
        if joint.closes:
            prim.CreateExcludeFromArticulationAttr(True)
        if not moving:
            return
        unit = 1 / t.meters if joint.linear else np.degrees(1.0)
        span = sorted(unit * (sign * x + zero) for x in joint.limits) if joint.limits else (-np.inf, np.inf)
        name = "linear" if joint.linear else "angular"
        if several:
            name = f"{'trans' if joint.linear else 'rot'}{t.axes}"
            for axis in (f"{what}{x}" for what in ("trans", "rot") for x in "XYZ"):
                limit = UsdPhysics.LimitAPI.Apply(prim.GetPrim(), axis)
                low, high = span if axis == name else (1.0, -1.0)
                limit.CreateLowAttr(low)
                limit.CreateHighAttr(high)
        else:
            prim.CreateAxisAttr(t.axes)
            if joint.limits:
                prim.CreateLowerLimitAttr(span[0])
                prim.CreateUpperLimitAttr(span[1])
        if joint.motor is None:
            return
        drive = UsdPhysics.DriveAPI.Apply(prim.GetPrim(), name)
        target = drive.CreateTargetPositionAttr()
        times, values = joint.keys
        values = unit * (sign * values + zero)
        if t.posed:
            prim.GetPrim().RemoveProperty(target.GetName())
        elif len(times) == 1:
            target.Set(float(values[0]))
        else:
            self.samples(target, zip(times.tolist(), values.tolist(), strict=True))
        for name, value in joint.drive.items():
            attribute = getattr(drive, f"Create{name[0].upper()}{name[1:]}Attr")()
            attribute.Set(
                value
                if name == "type"
                else t.number(name, value * (sign if name == "targetVelocity" else 1.0), joint.linear)
            )
        if not joint.motor:
            return
        prim.GetPrim().AddAppliedSchema("CalmMotorAPI")
        for name, value in joint.motor.items():
            kind = Sdf.ValueTypeNames
            if isinstance(value, dict):
                self.samples(prim.GetPrim().CreateAttribute(f"calm:motor:{name}", kind.Bool), value.items())
            elif isinstance(value, (bool, str)):
                prim.GetPrim().CreateAttribute(
                    f"calm:motor:{name}", kind.Token if isinstance(value, str) else kind.Bool
                ).Set(value)
            else:
                prim.GetPrim().CreateAttribute(f"calm:motor:{name}", kind.Float).Set(
                    t.number(name, value, joint.linear)
                )

    def end(self, prim, k: int, n: int, body: int, frame) -> None:
        """Body n of a joint, and the joint's frame in it."""
        t = self.t
        at = t.world @ frame if body == WORLD else frame
        position = at[:3, 3] / t.meters if body == WORLD else self.local(at[:3, 3], body)
        if body == WORLD and t.rooted:
            at = np.linalg.inv(t.world) @ at
            position = at[:3, 3] / (t.meters * t.scale)
            getattr(prim, f"CreateBody{n}Rel")().SetTargets([self.root])
        if body != WORLD:
            path = self.paths[body]
            if t.anchored and not t.cubes:
                anchor = placed(Rotation.from_rotvec([0.4, 0.2, -0.3]).as_matrix(), (0.05, 0.1, -0.02))
                path += f"/Anchor{k}{n}"
                self.transform(
                    UsdGeom.Xform.Define(self.stage, path).GetPrim(), placed(anchor[:3, :3], anchor[:3, 3] / t.scale)
                )
                at = np.linalg.inv(anchor) @ at
                position = self.local(at[:3, 3], body)
            getattr(prim, f"CreateBody{n}Rel")().SetTargets([path])
        getattr(prim, f"CreateLocalPos{n}Attr")(vector(position))
        getattr(prim, f"CreateLocalRot{n}Attr")(quaternion(at[:3, :3]))
