"""The robot of a skinned character: bodies of their own, cut from the skin, that stand as its skeleton does."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdPhysics, Vt

from calmotion.arrays import Array, IntArray
from calmotion.catalogs.materials import Material
from calmotion.mesh.moments import surface_moments
from calmotion.model import MassProperties
from calmotion.rigging.links import Link, tip_of
from calmotion.usd import gf
from calmotion.usd.reading.motors.posed_motors import GAP_TOLERANCE
from calmotion.usd.reading.skeletons import BoundSkeleton
from calmotion.usd.rigging.layer import WORLD, RobotLayer, rigid
from calmotion.usd.rigging.reproduction import Motion
from calmotion.usd.transforms import Pose, pose_from_matrix

_STILL = 1e-6  # a root whose matrix changes by less, relative to its size, does not move


class SkinnedRobot(RobotLayer):
    """Args:
    stage: The skinned character.
    skeleton: Its skeleton.
    codes: Time codes of the animation, the first frame first.
    links: What to make bodies of.
    material, name: As of a RobotLayer.
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
        super().__init__(stage, Usd.Stage.CreateInMemory(), material, name)
        self._skeleton, self._codes, self._links = skeleton, codes, links
        # world matrices of the skeleton's joints at each time code
        self._worlds: list[Array] = [skeleton.placement(code) @ skeleton.spaces_at(code) for code in map(float, codes)]
        self._poses = [self._pose(link, 0) for link in links]
        self.motors_of: list[list[str]] = [[] for _ in links]

    def body(self, link: int) -> str:
        """Path of the body of a link."""
        return f"{self.robot}/{self._links[link].name}"

    def _pose(self, link: Link, n: int) -> Pose:
        """That of the body, which has no scale: its skin is in the world's lengths."""
        return replace(
            pose_from_matrix(self._worlds[n][link.joint], str(self._skeleton.prim.GetPath())), scale=np.ones(3)
        )

    def motions(self) -> dict[str, Motion]:
        """What the skeleton does with the body of each link, by its path."""
        found = {}
        for k, link in enumerate(self._links):
            worlds = np.array([world[link.joint] for world in self._worlds])
            sides = worlds[:, :3, :3] * np.sign(np.linalg.det(worlds[:, :3, :3]))[:, None, None]
            u, _, vt = np.linalg.svd(sides / np.linalg.norm(sides, axis=1, keepdims=True))
            found[self.body(k)] = u @ vt, self._units.length(worlds[:, :3, 3])
        return found

    def marks(self, joints: Sequence[int]) -> list[tuple[str, Array]]:
        """The body that each of some joints moves with, and where the skeleton has it [m], shape [n, 3]."""
        return [(self.body(self._link_of(joint)), self._positions(joint)) for joint in joints]

    def _link_of(self, joint: int) -> int:
        of = {link.joint: k for k, link in enumerate(self._links)}
        while joint not in of:
            joint = self._skeleton.parent(joint)
        return of[joint]

    def _positions(self, joint: int) -> Array:
        return self._units.length(np.array([world[joint, :3, 3] for world in self._worlds]))

    def stretched(self, joints: Sequence[int], motions: Mapping[str, Motion]) -> tuple[str, ...]:
        """A note on the joint that the animation moves farthest on the link that carries it."""
        worst = (GAP_TOLERANCE, "")
        for joint in joints:
            if (above := self._skeleton.parent(joint)) >= 0:
                R, p = motions[self.body(self._link_of(above))]
                local = np.einsum("nji,nj->ni", R, self._positions(joint) - p)
                moved = np.linalg.norm(local - local[0], axis=1)
                n = int(np.argmax(moved))
                where = f"{self._skeleton.joints[joint]} by {1e3 * moved[n]:.3g} mm at time code {self._codes[n]:g}"
                worst = max(worst, (float(moved[n]), where))
        if not worst[1]:
            return ()
        return (
            f"{self._skeleton.prim.GetPath()}: its animation moves joints on the links that carry them, which the "
            f"robot does not follow (most of all {worst[1]}); remove translations and scales from the animation where "
            "this matters",
        )

    def author(self, servo_share: float, flexible: Sequence[str], targets: Sequence[int]) -> None:
        """Author the robot.

        Args:
            servo_share: Mass of a servo between two hinges, over that of the link that they turn.
            flexible: Names of the flexible links.
            targets: The links whose tips are targets.
        """
        self._author_robot()
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
            self._author_target(self.body(k), self._tip(k))

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
        return self._servo_of(mass, size)

    def _author_link(self, k: int, mass: MassProperties, flexible: bool) -> None:
        prim = self._author_body(self.body(k), self._poses[k], None if flexible else mass)
        self.mass += self._units.mass(mass.mass) if flexible else 0.0
        piece = self._links[k].piece
        if piece is not None:
            self._author_mesh(f"{self.body(k)}/skin", self._poses[k].to_local(piece[0]), piece[1])
        self._author_solid(prim, flexible)
        if self._links[k].parent < 0 and self._moves(k):
            UsdPhysics.RigidBodyAPI(prim).CreateKinematicEnabledAttr(True)

    def _author_mesh(self, path: str, points: Array, triangles: IntArray) -> None:
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
        if not self._moves(k):
            self._fix(self._links[k].name, ("", WORLD), (self.body(k), self._poses[k]))
            return
        op = UsdGeom.Xformable(self._stage.GetPrimAtPath(self.body(k))).GetOrderedXformOps()[0]
        for n, code in enumerate(self._codes):
            op.Set(rigid(self._pose(self._links[k], n)), float(code))

    def _hinge(self, k: int, servo: float) -> None:
        """The hinges of a link, with a servo between each two."""
        link, pose = self._links[k], self._poses[k]
        above = self._skeleton.parent(link.joint)
        carrier = pose_from_matrix(self._worlds[0][above], str(self._skeleton.prim.GetPath())).rotation
        side0 = (self.body(link.parent), self._poses[link.parent])
        for number, axis in enumerate(link.hinges.axes):
            last = number == len(link.hinges.axes) - 1
            side1 = (self.body(k) if last else f"{self.body(k)}_servo{number + 1}", pose)
            if not last:
                self._author_body(*side1, self._servo(k, servo))
            name = link.name if len(link.hinges.axes) == 1 else f"{link.name}_{number + 1}"
            prim = self._motor(name, carrier @ axis, pose.position, side0, side1)
            for attribute, value in (("skelJoint", self._skeleton.joints[link.joint]), ("skelPose", "start")):
                created = prim.CreateAttribute(f"calm:motor:{attribute}", Sdf.ValueTypeNames.Token, custom=False)
                created.SetVariability(Sdf.VariabilityUniform)
                created.Set(value)
            self.motors_of[k].append(str(prim.GetPath()))
            side0 = side1

    def _tip(self, k: int) -> Array:
        piece, pose = self._links[k].piece, self._poses[k]
        assert piece is not None  # targets are links with geometry
        tip: Array = pose.to_local(tip_of(piece, pose.position)[None])[0]
        return tip
