"""The robot of a shot whose rigid parts are animated: these are its bodies, and their motion is that of its motors."""

import os
from collections.abc import Sequence

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdPhysics
from scipy.spatial.transform import Rotation

from calmotion.arrays import Array
from calmotion.catalogs.materials import Material
from calmotion.mesh.mass import joined_surfaces
from calmotion.model import MassProperties
from calmotion.rigging.hinge_rows import HingeRow
from calmotion.rigging.links import Link, Piece, targets_of, tip_of
from calmotion.rigging.part_joints import FIXED, FREE, PRISMATIC
from calmotion.rigging.part_trees import PartMotions
from calmotion.usd.reading.bodies.mass import mass_of
from calmotion.usd.reading.bodies.shapes import shapes_of
from calmotion.usd.reading.context import Reading, is_rigid_body, prims_of
from calmotion.usd.rigging.layer import WORLD, RobotLayer, rigid
from calmotion.usd.rigging.parts import Parts
from calmotion.usd.rigging.posed_bodies import PosedBody
from calmotion.usd.transforms import Pose

_NO_HINGES = HingeRow(np.zeros((0, 3)), np.zeros((0, 0)), np.zeros(0))


class PosedRobot(RobotLayer):
    """Args:
    stage: The shot.
    path: Its file.
    parts: Its moving parts.
    motions: Of these.
    bodies: Carriers first.
    material, name: As of a RobotLayer.
    """

    def __init__(
        self,
        stage: Usd.Stage,
        path: str,
        parts: Parts,
        motions: PartMotions,
        bodies: Sequence[PosedBody],
        material: Material,
        name: str,
    ) -> None:
        layer = Sdf.Layer.CreateAnonymous(".usda")
        layer.timeCodesPerSecond = stage.GetTimeCodesPerSecond()
        layer.subLayerPaths = [os.path.abspath(path)]
        super().__init__(stage, Usd.Stage.Open(layer), material, name)
        self._parts, self._motions, self._bodies = parts, motions, bodies
        self._meters = self._units.length(1.0)
        self.motors_of: list[list[str]] = [[] for _ in bodies]

    def author(self, servo_share: float, flexible: Sequence[str]) -> None:
        """Author the robot.

        Args:
            servo_share: Mass of a part without geometry, and of a servo between two hinges, over that of the lightest
                part.
            flexible: Names of the flexible bodies.
        """
        self._author_robot()
        prims = [self._editable(body.path) for body in self._bodies]
        others = [prim for prim in prims_of(self._stage) if is_rigid_body(prim) and prim not in prims]
        for prim in others:  # which no joint connects
            UsdPhysics.RigidBodyAPI(self._editable(str(prim.GetPath()))).CreateRigidBodyEnabledAttr(False)
        for prim, body in zip(prims, self._bodies, strict=True):
            if prim.HasAPI(UsdPhysics.RigidBodyAPI):  # often kinematic, as it has keys
                UsdPhysics.RigidBodyAPI(prim).CreateRigidBodyEnabledAttr(True)
                UsdPhysics.RigidBodyAPI(prim).CreateKinematicEnabledAttr(False)
            UsdPhysics.RigidBodyAPI.Apply(prim)
            self._author_solid(prim, body.name in flexible)
        self.body_count += len(prims)
        reading = Reading(self._stage, self._units, float(self._parts.codes[0]))
        prims = [self._stage.GetPrimAtPath(body.path) for body in self._bodies]
        poses = [reading.pose(prim) for prim in prims]
        shapes = [shapes_of(reading, prim, pose) for prim, pose in zip(prims, poses, strict=True)]
        masses = [mass_of(reading, *of) for of in zip(prims, poses, shapes, strict=True)]
        known = [mass.mass for mass in masses if mass is not None]
        servo = servo_share * min(known, default=1.0) / self._units.mass(1.0)
        self.mass += sum(known)
        solids = [[shape.surface for shape in found if len(shape.surface.triangles)] for found in shapes]
        pieces = [joined_surfaces(surfaces) if surfaces else None for surfaces in solids]
        size = max((float(np.ptp(piece[0], axis=0).max()) for piece in pieces if piece), default=1.0)
        light = self._servo_of(servo, size / self._meters)
        for k, (prim, mass) in enumerate(zip(prims, masses, strict=True)):
            if mass is None:
                self._author_mass(prim, light)
            self._attach(k, poses, light)
        for k in targets_of(self._links(pieces), [*(body.path for body in self._bodies), ""]):
            piece = pieces[k]
            if piece is not None:
                away = self._meters * poses[k].to_local(self._point(k)[None])[0]
                tip = tip_of(piece, away) / self._meters
                self._author_target(self._bodies[k].path, tip / poses[k].scale)

    def _links(self, pieces: Sequence[Piece | None]) -> list[Link]:
        """The bodies as links whose tips may be targets, and the world as the last one: it carries what has a joint to
        it. What is fixed to another body counts as a part of it, without a tip of its own."""
        fixed = [body.joint is not None and body.joint.kind == FIXED for body in self._bodies]
        links = []
        for k, body in enumerate(self._bodies):
            carrier = body.carrier
            while carrier >= 0 and fixed[carrier]:
                carrier = self._bodies[carrier].carrier
            if carrier < 0 and body.joint is not None and body.joint.kind != FREE:
                carrier = len(self._bodies)
            links.append(Link(k, body.name, -1 if fixed[k] else carrier, _NO_HINGES, None if fixed[k] else pieces[k]))
        return [*links, Link(len(links), "", -1, _NO_HINGES, None)]

    def _editable(self, path: str) -> Usd.Prim:
        """A prim, no longer in an instance or one itself, so that it and those below it can be edited."""
        prim = self._stage.GetPrimAtPath(path)
        while prim.IsInstanceProxy() or prim.IsInstance():
            shared = prim
            while not shared.IsInstance() or shared.IsInstanceProxy():
                shared = shared.GetParent()
            shared.SetInstanceable(False)
            prim = self._stage.GetPrimAtPath(path)
        return prim

    def _point(self, k: int) -> Array:
        """A point on the joint of a body at the first frame, world, stage units."""
        body = self._bodies[k]
        if body.joint is None:
            return np.zeros(3)
        point: Array = (self._motions.p[body.on][0] + self._motions.R[body.on][0] @ body.joint.point) / self._meters
        return point

    def _attach(self, k: int, poses: Sequence[Pose], servo: MassProperties) -> None:
        """The joint of a body, as hinges with a servo between each two, or a slide; none for a root that moves."""
        body, joint = self._bodies[k], self._bodies[k].joint
        side0 = (self._bodies[body.carrier].path, poses[body.carrier]) if body.carrier >= 0 else ("", WORLD)
        side1 = (body.path, poses[k])
        if joint is not None and joint.kind == FREE:
            UsdPhysics.RigidBodyAPI(self._stage.GetPrimAtPath(body.path)).CreateKinematicEnabledAttr(True)
            return
        if joint is None or joint.kind == FIXED:
            self._fix(body.name, side0, side1)
            return
        point, turn = self._point(k), self._motions.R[body.on][0]
        for number, axis in enumerate(joint.axes):
            end = side1
            if number < len(joint.axes) - 1:
                end = self._servo_between(k, number, servo)
            name = body.name if len(joint.axes) == 1 else f"{body.name}_{number + 1}"
            prim = self._motor(name, turn @ axis, point, side0, end, joint.kind == PRISMATIC)
            self.motors_of[k].append(str(prim.GetPath()))
            side0 = end

    def _servo_between(self, k: int, number: int, mass: MassProperties) -> tuple[str, Pose]:
        """A servo that turns about the axes of a joint up to one of them: its path, and pose at the first frame."""
        body = self._bodies[k]
        assert body.joint is not None
        R, p = self._motions.R[body.on], self._motions.p[body.on]
        origins = (p + R @ body.joint.point) / self._meters
        for axis, angle in zip(body.joint.axes[: number + 1], body.joint.values.T, strict=False):
            R = R @ Rotation.from_rotvec(angle[:, None] * axis).as_matrix()
        path = f"{self.robot}/{body.name}_servo{number + 1}"
        poses = [Pose(turn, origin, np.ones(3)) for turn, origin in zip(R, origins, strict=True)]
        op = UsdGeom.Xformable(self._author_body(path, poses[0], mass)).GetOrderedXformOps()[0]
        for pose, code in zip(poses, self._parts.codes, strict=True):
            op.Set(rigid(pose), float(code))
        return path, poses[0]
