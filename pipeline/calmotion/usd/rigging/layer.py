"""Materials of robots, authored with the schemas that the reader takes them from."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.catalogs.materials import Material
from calmotion.mesh.moments import surface_moments
from calmotion.model import MassProperties, Provenance
from calmotion.rigging.links import Link, tip_of
from calmotion.usd import gf
from calmotion.usd.reading.skeletons import BoundSkeleton
from calmotion.usd.stages import RIG
from calmotion.usd.transforms import Pose, pose_from_matrix, quaternion_from_rotation
from calmotion.usd.units import StageUnits, units_of
from calmotion.usd.writing.metadata import author_origin, author_stage_metadata
from calmotion.usd.writing.root import relative_asset

if TYPE_CHECKING:
    from pxr import Usd, UsdPhysics, UsdShade


def author_material(stage: Usd.Stage, path: str, material: Material, units: StageUnits) -> UsdShade.Material:
    """Define an elastic material.

    Args:
        stage: Where it is authored.
        material: The material, SI.
    """
    from pxr import Sdf, UsdPhysics, UsdShade

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


_STILL = 1e-6  # a root whose matrix changes by less, relative to its size, does not move
_SERVO = 0.1  # radius of gyration of a servo, over the size of the link that it turns


class RobotLayer:
    """A robot that is authored into an anonymous layer; everything is in stage units, in the world.

    Args:
        stage: The skinned character.
        skeleton: Its skeleton.
        codes: Time codes of the animation, the first frame first.
        links: What to make bodies of.
        material: What they are made of.
        name: Name of that material.
    """

    def __init__(
        self,
        stage: Usd.Stage,
        skeleton: BoundSkeleton,
        codes: Array,
        links: Sequence[Link],
        material: Material,
        name: str,
    ) -> None:
        from pxr import Sdf, Usd

        self.layer = Sdf.Layer.CreateAnonymous(".usda")
        # author in a stage of its own; the layer is later put over the shot
        self._stage = Usd.Stage.CreateInMemory()
        self._stage.GetRootLayer().TransferContent(self.layer)
        self._units, self._skeleton, self._codes, self._links = units_of(stage), skeleton, codes, links
        self._material, self._material_name = material, name
        default = stage.GetDefaultPrim()
        top = str(default.GetPath()) if default else ""
        taken = {str(child.GetName()) for child in (default or stage.GetPseudoRoot()).GetAllChildren()}
        self.robot = f"{top}/{next(n for n in _names('Robot') if n not in taken)}"
        # world matrices of the skeleton's joints at each time code
        self._worlds: list[Array] = [
            skeleton.placement(code) @ skeleton.in_skeleton(skeleton.locals_at(code)) for code in map(float, codes)
        ]
        self._poses = [self._pose(link, 0) for link in links]
        self.motors: list[str] = []
        self.motors_of: list[list[str]] = [[] for _ in links]
        self.targets: list[str] = []
        self.body_count, self.mass = 0, 0.0

    def body(self, link: int) -> str:
        """Path of the body of a link."""
        return f"{self.robot}/{self._links[link].name}"

    def _pose(self, link: Link, n: int) -> Pose:
        return pose_from_matrix(self._worlds[n][link.joint], str(self._skeleton.prim.GetPath()))

    def author(self, servo_share: float, flexible: Sequence[str], targets: Sequence[int]) -> None:
        """Author the robot.

        Args:
            servo_share: Mass of a servo between two hinges, over that of the link that they turn.
            flexible: Names of the flexible links.
            targets: The links whose tips are targets.
        """
        from pxr import UsdGeom

        for path in _above(self.robot):
            self._stage.OverridePrim(path)
        robot = UsdGeom.Xform.Define(self._stage, self.robot)
        robot.SetResetXformStack(True)
        # only the skin is rendered; the bodies have the purpose guide
        robot.CreatePurposeAttr(UsdGeom.Tokens.guide)
        UsdGeom.Scope.Define(self._stage, f"{self.robot}/joints")
        self._author_material()
        masses = [self._mass_of(k) for k in range(len(self._links))]
        lightest = min(m.mass for m in masses if m is not None)
        for k, link in enumerate(self._links):
            known = masses[k]
            load = known.mass if known is not None else lightest
            self._author_link(k, known or self._servo(k, servo_share * load), link.name in flexible)
            if link.parent < 0:
                self._attach_root(k)
            else:
                self._hinge(k, servo_share * load)
        for k in targets:
            self._author_target(k)

    def _author_material(self) -> None:
        path = f"{self.robot}/materials/{self._material_name}"
        self._solid = author_material(self._stage, path, self._material, self._units)

    def _mass_of(self, k: int) -> MassProperties | None:
        """Mass properties of a link in its own frame, stage units; None for one without geometry."""
        piece = self._links[k].piece
        if piece is None:
            return None
        density = self._material.density / self._units.density(1.0)
        return surface_moments(self._poses[k].to_local(piece[0]), piece[1]).mass_properties(density)

    def _servo(self, k: int, mass: float) -> MassProperties:
        """Mass properties of a servo at its joint."""
        near = [self._links[k], *(link for link in self._links if link.parent == k)]
        size = max((float(np.max(np.ptp(link.piece[0], axis=0))) for link in near if link.piece), default=1.0)
        return MassProperties(mass, np.zeros(3), mass * (_SERVO * size) ** 2 * np.eye(3))

    def _author_link(self, k: int, mass: MassProperties, flexible: bool) -> None:
        from pxr import UsdPhysics, UsdShade

        prim = self._author_body(self.body(k), self._poses[k], None if flexible else mass)
        self.mass += self._units.mass(mass.mass) if flexible else 0.0
        piece = self._links[k].piece
        if piece is not None:
            self._author_mesh(f"{self.body(k)}/skin", self._poses[k].to_local(piece[0]), piece[1])
            UsdShade.MaterialBindingAPI.Apply(prim).Bind(self._solid, materialPurpose="physics")
        if flexible:
            prim.AddAppliedSchema("CalmFlexibleBodyAPI")
        if self._links[k].parent < 0 and self._moves(k):
            UsdPhysics.RigidBodyAPI(prim).CreateKinematicEnabledAttr(True)

    def _author_body(self, path: str, pose: Pose, mass: MassProperties | None) -> Usd.Prim:
        from pxr import Gf, UsdGeom, UsdPhysics

        xform = UsdGeom.Xform.Define(self._stage, path)
        rigid = pose.matrix()
        rigid[:3, :3] = pose.rotation
        xform.AddTransformOp().Set(gf.to_matrix(rigid))
        prim = xform.GetPrim()
        UsdPhysics.RigidBodyAPI.Apply(prim)
        self.body_count += 1
        if mass is not None:
            moments, axes = np.linalg.eigh(mass.inertia)
            axes[:, 0] *= np.linalg.det(axes)
            api = UsdPhysics.MassAPI.Apply(prim)
            api.CreateMassAttr(mass.mass)
            api.CreateCenterOfMassAttr(Gf.Vec3f(*mass.center.tolist()))
            api.CreateDiagonalInertiaAttr(Gf.Vec3f(*moments.tolist()))
            api.CreatePrincipalAxesAttr(gf.to_quaternion(quaternion_from_rotation(axes)))
            self.mass += self._units.mass(mass.mass)
        return prim

    def _author_mesh(self, path: str, points: Array, triangles: IntArray) -> None:
        from pxr import UsdGeom, Vt

        mesh = UsdGeom.Mesh.Define(self._stage, path)
        mesh.CreatePointsAttr(gf.to_points(points))
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray(len(triangles), 3))
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(triangles.ravel(), np.int32)))
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        mesh.CreateExtentAttr(gf.to_points(np.stack([points.min(axis=0), points.max(axis=0)])))

    def _moves(self, k: int) -> bool:
        """Whether the animation moves a root."""
        joint = self._links[k].joint
        first = self._worlds[0][joint]
        size = max(1.0, float(np.max(np.abs(first))))
        return any(np.max(np.abs(world[joint] - first)) > _STILL * size for world in self._worlds)

    def _attach_root(self, k: int) -> None:
        """Fix a root to the world, or animate its transform."""
        from pxr import UsdGeom, UsdPhysics

        if not self._moves(k):
            joint = UsdPhysics.FixedJoint.Define(self._stage, f"{self.robot}/joints/{self._links[k].name}")
            joint.CreateBody1Rel().SetTargets([self.body(k)])
            self._place(joint, Pose(np.eye(3), np.zeros(3), np.ones(3)), self._poses[k], self._poses[k])
            return
        op = UsdGeom.Xformable(self._stage.GetPrimAtPath(self.body(k))).GetOrderedXformOps()[0]
        for n, code in enumerate(self._codes):
            pose = self._pose(self._links[k], n)
            op.Set(gf.to_matrix(Pose(pose.rotation, pose.position, np.ones(3)).matrix()), float(code))

    def _hinge(self, k: int, servo: float) -> None:
        """The hinges of a link, with a servo between each two."""
        from pxr import Sdf, UsdPhysics

        link, pose = self._links[k], self._poses[k]
        above = self._skeleton.parent(link.joint)
        carrier = pose_from_matrix(self._worlds[0][above], str(self._skeleton.prim.GetPath())).rotation
        body0, pose0 = self.body(link.parent), self._poses[link.parent]
        for number, axis in enumerate(link.hinges.axes):
            last = number == len(link.hinges.axes) - 1
            body1 = self.body(k) if last else f"{self.body(k)}_servo{number + 1}"
            if not last:
                self._author_body(body1, pose, self._servo(k, servo))
            frame = Pose(_turned_to(carrier @ axis), pose.position, np.ones(3))
            name = link.name if len(link.hinges.axes) == 1 else f"{link.name}_{number + 1}"
            path = f"{self.robot}/joints/{name}"
            joint = UsdPhysics.RevoluteJoint.Define(self._stage, path)
            joint.CreateAxisAttr("Z")
            joint.CreateBody0Rel().SetTargets([body0])
            joint.CreateBody1Rel().SetTargets([body1])
            self._place(joint, pose0, pose, frame)
            prim = joint.GetPrim()
            UsdPhysics.DriveAPI.Apply(prim, "angular")
            prim.AddAppliedSchema("CalmMotorAPI")
            for attribute, value in (("skelJoint", self._skeleton.joints[link.joint]), ("skelPose", "start")):
                created = prim.CreateAttribute(f"calm:motor:{attribute}", Sdf.ValueTypeNames.Token, custom=False)
                created.SetVariability(Sdf.VariabilityUniform)
                created.Set(value)
            self.motors.append(path)
            self.motors_of[k].append(path)
            body0, pose0 = body1, pose

    def _place(self, joint: UsdPhysics.Joint, pose0: Pose, pose1: Pose, frame: Pose) -> None:
        """Frames of a joint in both of its bodies, from that in the world."""
        from pxr import Gf

        for side, pose in ((0, pose0), (1, pose1)):
            at = pose.to_local(frame.position[None])[0]
            turn = gf.to_quaternion(quaternion_from_rotation(pose.rotation.T @ frame.rotation))
            (joint.CreateLocalPos0Attr, joint.CreateLocalPos1Attr)[side](Gf.Vec3f(*at.tolist()))
            (joint.CreateLocalRot0Attr, joint.CreateLocalRot1Attr)[side](turn)

    def _author_target(self, k: int) -> None:
        from pxr import Gf, UsdGeom

        piece, pose = self._links[k].piece, self._poses[k]
        assert piece is not None  # targets are links with geometry
        tip = pose.to_local(tip_of(piece, pose.position)[None])[0]
        path = f"{self.body(k)}/target"
        xform = UsdGeom.Xform.Define(self._stage, path)
        xform.AddTranslateOp().Set(Gf.Vec3d(*tip.tolist()))
        xform.GetPrim().AddAppliedSchema("CalmTargetAPI")
        self.targets.append(path)

    def finish(self, provenance: Provenance, output: str) -> None:
        """Move the authored robot into the layer, and sublayer the shot."""
        self.layer.TransferContent(self._stage.GetRootLayer())
        author_stage_metadata(self.layer, provenance)
        author_origin(self.layer, RIG, provenance)
        self.layer.subLayerPaths = [relative_asset(provenance.shot, os.path.dirname(os.path.realpath(output)))]
        self.layer.documentation = f"Makes a robot of the skinned character in {os.path.basename(provenance.shot)}."


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
