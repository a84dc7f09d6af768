"""The layer of a robot: its prims for materials and joints, and what is authored on bodies."""

import os
from collections.abc import Iterator

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade

from calmotion.arrays import Array
from calmotion.catalogs.materials import Material
from calmotion.model import MassProperties, Provenance
from calmotion.support.rotations import quaternion_from_rotation
from calmotion.usd import gf
from calmotion.usd.stages import RIG
from calmotion.usd.transforms import Pose
from calmotion.usd.units import StageUnits, units_of
from calmotion.usd.writing.metadata import author_origin, author_stage_metadata
from calmotion.usd.writing.root import relative_asset


def author_material(stage: Usd.Stage, path: str, material: Material, units: StageUnits) -> UsdShade.Material:
    """Define an elastic material.

    Args:
        stage: Where it is authored.
        material: The material, SI.
    """
    shader = UsdShade.Material.Define(stage, path)
    prim = shader.GetPrim()
    UsdPhysics.MaterialAPI.Apply(prim).CreateDensityAttr(material.density / units.density(1.0))
    prim.AddAppliedSchema("PhysicsVolumeDeformableMaterialAPI")
    prim.AddAppliedSchema("CalmDampingAPI")
    for name, value in (
        ("physics:youngsModulus", material.youngs_modulus / units.pressure(1.0)),
        ("physics:poissonsRatio", material.poissons_ratio),
        ("calm:damping:ratio", material.damping_ratio),
    ):
        prim.CreateAttribute(name, Sdf.ValueTypeNames.Float, custom=False).Set(value)
    return shader


WORLD = Pose(np.eye(3), np.zeros(3), np.ones(3))
ANGULAR, LINEAR = "angular", "linear"
_SERVO = 0.1  # radius of gyration of a servo, over the size of the link that it turns


class RobotLayer:
    """A robot that is authored into a layer over its shot; everything is in stage units, in the world.

    Args:
        stage: The shot.
        over: A stage to author in; the content of its root layer is what is written.
        material: What the robot is made of.
        name: Name of that material.
    """

    def __init__(self, stage: Usd.Stage, over: Usd.Stage, material: Material, name: str) -> None:
        self._stage, self._units, self._material = over, units_of(stage), material
        default = stage.GetDefaultPrim()
        if default and default.IsInstance():  # below it nothing can be added
            default = Usd.Prim()
        top = str(default.GetPath()) if default else ""
        taken = {str(child.GetName()) for child in (default or stage.GetPseudoRoot()).GetAllChildren()}
        self.robot = f"{top}/{next(n for n in _names('Robot') if n not in taken)}"
        self._material_path = f"{self.robot}/materials/{name}"
        self.motors: list[str] = []
        self.targets: list[str] = []
        self.body_count, self.mass = 0, 0.0

    def _author_robot(self) -> None:
        """Author the prims for all that is no body."""
        for path in _above(self.robot):
            self._stage.OverridePrim(path)
        robot = UsdGeom.Xform.Define(self._stage, self.robot)
        robot.SetResetXformStack(True)
        # only the shot is rendered; what is added has the purpose guide
        robot.CreatePurposeAttr(UsdGeom.Tokens.guide)
        UsdGeom.Scope.Define(self._stage, f"{self.robot}/joints")
        self._solid = author_material(self._stage, self._material_path, self._material, self._units)

    def _servo_of(self, mass: float, size: float) -> MassProperties:
        """Mass properties of a servo at its joint."""
        return MassProperties(mass, np.zeros(3), mass * (_SERVO * size) ** 2 * np.eye(3))

    def _author_solid(self, prim: Usd.Prim, flexible: bool) -> None:
        """Make a body of the material."""
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(self._solid, materialPurpose="physics")
        if flexible:
            prim.AddAppliedSchema("CalmFlexibleBodyAPI")

    def _author_body(self, path: str, pose: Pose, mass: MassProperties | None) -> Usd.Prim:
        """Define a body that the shot does not have."""
        xform = UsdGeom.Xform.Define(self._stage, path)
        xform.AddTransformOp().Set(rigid(pose))
        prim = xform.GetPrim()
        UsdPhysics.RigidBodyAPI.Apply(prim)
        self.body_count += 1
        if mass is not None:
            self._author_mass(prim, mass)
        return prim

    def _author_mass(self, prim: Usd.Prim, mass: MassProperties) -> None:
        moments, axes = np.linalg.eigh(mass.inertia)
        axes[:, 0] *= np.linalg.det(axes)
        api = UsdPhysics.MassAPI.Apply(prim)
        api.CreateMassAttr(mass.mass)
        api.CreateCenterOfMassAttr(Gf.Vec3f(*mass.center.tolist()))
        api.CreateDiagonalInertiaAttr(Gf.Vec3f(*moments.tolist()))
        api.CreatePrincipalAxesAttr(gf.to_quaternion(quaternion_from_rotation(axes)))
        self.mass += self._units.mass(mass.mass)

    def _fix(self, name: str, side0: tuple[str, Pose], side1: tuple[str, Pose]) -> None:
        """Fix a body to another one, or to the world, whose path is empty."""
        joint = UsdPhysics.FixedJoint.Define(self._stage, f"{self.robot}/joints/{name}")
        self._place(joint, side0, side1, side1[1])

    def _motor(
        self,
        name: str,
        axis: Array,
        point: Array,
        side0: tuple[str, Pose],
        side1: tuple[str, Pose],
        linear: bool = False,
    ) -> Usd.Prim:
        """Author a hinge, or a slide, with a motor.

        Args:
            axis, point: In the world.
            side0, side1: Path and pose of the bodies.
        """
        path = f"{self.robot}/joints/{name}"
        joint = (UsdPhysics.PrismaticJoint if linear else UsdPhysics.RevoluteJoint).Define(self._stage, path)
        joint.CreateAxisAttr("Z")
        self._place(joint, side0, side1, Pose(_turned_to(axis), point, np.ones(3)))
        prim = joint.GetPrim()
        UsdPhysics.DriveAPI.Apply(prim, LINEAR if linear else ANGULAR)
        prim.AddAppliedSchema("CalmMotorAPI")
        self.motors.append(path)
        return prim

    def _place(self, joint: UsdPhysics.Joint, side0: tuple[str, Pose], side1: tuple[str, Pose], frame: Pose) -> None:
        """The bodies of a joint, and its frames in both of them, from that in the world."""
        for side, (body, pose) in enumerate((side0, side1)):
            if body:
                (joint.CreateBody0Rel, joint.CreateBody1Rel)[side]().SetTargets([body])
            at = pose.to_local(frame.position[None])[0] / pose.scale
            turn = gf.to_quaternion(quaternion_from_rotation(pose.rotation.T @ frame.rotation))
            (joint.CreateLocalPos0Attr, joint.CreateLocalPos1Attr)[side](Gf.Vec3f(*at.tolist()))
            (joint.CreateLocalRot0Attr, joint.CreateLocalRot1Attr)[side](turn)

    def _author_target(self, body: str, tip: Array) -> None:
        """Author a target on a body.

        Args:
            tip: In the body's own axes.
        """
        path = f"{body}/target"
        xform = UsdGeom.Xform.Define(self._stage, path)
        xform.AddTranslateOp().Set(Gf.Vec3d(*tip.tolist()))
        xform.GetPrim().AddAppliedSchema("CalmTargetAPI")
        self.targets.append(path)

    def finish(self, provenance: Provenance, output: str, what: str) -> Sdf.Layer:
        """The robot in a layer that has the shot as its sublayer.

        Args:
            what: It was made of, for people.
        """
        layer = Sdf.Layer.CreateAnonymous(".usda")
        layer.TransferContent(self._stage.GetRootLayer())
        author_stage_metadata(layer, provenance)
        author_origin(layer, RIG, provenance)
        layer.subLayerPaths = [relative_asset(provenance.shot, os.path.dirname(os.path.realpath(output)))]
        layer.documentation = f"Makes a robot of {what} in {os.path.basename(provenance.shot)}."
        return layer


def rigid(pose: Pose) -> Gf.Matrix4d:
    """The matrix of a pose without its scale."""
    return gf.to_matrix(Pose(pose.rotation, pose.position, np.ones(3)).matrix())


def _names(stem: str) -> Iterator[str]:
    yield stem
    yield from (f"{stem}_{k}" for k in range(2, 1000))


def _above(path: str) -> list[str]:
    parts = path.strip("/").split("/")[:-1]
    return ["/" + "/".join(parts[: k + 1]) for k in range(len(parts))]


def _turned_to(axis: Array) -> Array:
    """A rotation that takes z to a unit axis, shape [3, 3]."""
    side = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = np.cross(side, axis)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(axis, x), axis], axis=1)
