"""The layer over a converted robot: its motors with their motion, flexible links, masses and targets."""

import os
from collections.abc import Iterable

import numpy as np
from calmotion.errors import ShotError, raise_all
from calmotion.support import nearest
from calmotion.usd import StageUnits, author_material, is_rigid_body, open_stage, prims_of, quiet, units_of
from pxr import Sdf, Usd, UsdGeom, UsdPhysics, UsdShade

from .joints import (
    author_frames,
    author_locks,
    author_springs,
    passive_joints,
    shift_limits,
    urdf_placements,
)
from .masses import MUJOCO_DENSITY, author_masses
from .options import RobotOptions, carried_by, geoms_of, is_named
from .robot_motors import author_motors, named, narrow_limits

_TURN = 6.5  # more than one [rad]
_THICKNESS = "calm:flexible:wallThickness"


def robot_layer(converted: str, asset: str, options: RobotOptions) -> tuple[Sdf.Layer, tuple[str, ...]]:
    """The layer over a converted robot, and notes for the user.

    Args:
        converted: The USD file of the robot.
        asset: The same as the layer names it, relative to where the layer will be.
        options: What to author.

    Raises:
        ShotError: A name that nothing has, or a link without mass.
    """
    robot = open_stage(converted)
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.subLayerPaths = [os.path.abspath(converted)]
    with quiet():
        author = _Author(Usd.Stage.Open(layer), robot, options)
        author.metadata()
        problems: list[ShotError] = []
        for step in (author.masses, author.motors, author.links, author.targets):
            try:
                step()
            except ShotError as error:
                problems.append(error)
        raise_all(problems)
        notes = tuple(author.notes)
        # otherwise the stage would look for the robot where it will be
        del author, step
        layer.subLayerPaths = [asset]
    return layer, notes


class _Author:
    """Authors over a robot.

    Args:
        stage: Where it is authored; the robot is a sublayer of its root layer.
        robot: The robot alone.
        options: What to author.
    """

    def __init__(self, stage: Usd.Stage, robot: Usd.Stage, options: RobotOptions) -> None:
        self._stage, self._robot, self._options = stage, robot, options
        self._units: StageUnits = units_of(robot)
        self._bodies = [prim for prim in prims_of(stage) if is_rigid_body(prim)]
        self._frames: list[Usd.Prim] = []
        self.notes: list[str] = []

    def metadata(self) -> None:
        """Units, axes, default prim and clock: a layer does not inherit them from its sublayers."""
        root, options = self._stage.GetRootLayer(), self._options
        default = self._robot.GetDefaultPrim()
        root.defaultPrim = default.GetName() if default else ""
        UsdGeom.SetStageMetersPerUnit(self._stage, UsdGeom.GetStageMetersPerUnit(self._robot))
        UsdGeom.SetStageUpAxis(self._stage, UsdGeom.GetStageUpAxis(self._robot))
        UsdPhysics.SetStageKilogramsPerUnit(self._stage, UsdPhysics.GetStageKilogramsPerUnit(self._robot))
        own = self._robot.GetRootLayer()
        if options.frames_per_second is None:
            root.timeCodesPerSecond, root.framesPerSecond = own.timeCodesPerSecond, own.framesPerSecond
            if self._robot.HasAuthoredTimeCodeRange():
                root.startTimeCode, root.endTimeCode = own.startTimeCode, own.endTimeCode
        else:
            root.timeCodesPerSecond = root.framesPerSecond = options.frames_per_second
        if options.motion is not None:
            root.startTimeCode = 0.0
            frames = float(options.motion.times[-1]) * self._rate
            root.endTimeCode = float(np.floor(frames + 1e-3))  # times may be rounded

    @property
    def _rate(self) -> float:
        return float(self._options.frames_per_second or self._robot.GetTimeCodesPerSecond())

    def masses(self) -> None:
        """Masses of all links, see `masses`."""
        notes, self._frames = author_masses(self._stage, self._units, self._options)
        self.notes += notes

    def motors(self) -> None:
        """Drives, see `robot_motors`."""
        shift_limits(self._stage)
        options = self._options
        author_frames(self._units, urdf_placements(self._stage, options.robot.frames))
        far = [name for name, frame in options.robot.frames.items() if max(map(abs, frame.angles)) > _TURN]
        if far:
            self.notes.append(f"rpy of joints goes beyond a turn; degrees taken for radians? {', '.join(far)}")
        self.notes += narrow_limits(self._stage, self._units, options.robot.soft_limits)
        self.notes += author_motors(
            self._stage, self._units, options.motion, self._rate, options.robot.efforts, options.motors
        )
        self.notes += author_springs(self._stage, self._units)
        self.notes += author_locks(self._stage, self._units, options.robot.locks)
        self.notes += passive_joints(self._stage, bool(options.motors or options.motion))

    def links(self) -> None:
        """Flexible links with their materials."""
        root = self._stage.GetDefaultPrim()
        flexible: set[str] = set()
        for given in self._options.flexible:
            path = f"{root.GetPath()}/CalmMaterials/{given.name}"
            meant = self._matching(given.pattern, self._bodies, "--flexible")
            bodies = [prim for prim in meant if prim not in self._frames]
            if not bodies:
                raise ShotError(
                    "a link without mass is a frame, which does not bend",
                    path=str(meant[0].GetPath()),
                    attribute="--flexible",
                    found=given.pattern,
                    remedy="Name a link that has mass, or write the <inertial> of this one",
                )
            shader = author_material(self._stage, path, given.material, self._units)
            for prim in bodies:
                if str(prim.GetPath()) in flexible:
                    raise ShotError(
                        "two patterns of flexible links name this one",
                        path=str(prim.GetPath()),
                        attribute="--flexible",
                        found=given.pattern,
                        remedy="Make one of them narrower",
                    )
                flexible.add(str(prim.GetPath()))
                self._leave_out_default_density(prim)
                prim.AddAppliedSchema("CalmFlexibleBodyAPI")
                UsdShade.MaterialBindingAPI.Apply(prim).Bind(shader, materialPurpose="physics")
                if given.thickness is not None:
                    thickness = prim.CreateAttribute(
                        _THICKNESS, Sdf.ValueTypeNames.Float, False, Sdf.VariabilityUniform
                    )
                    thickness.Set(given.thickness / self._units.length(1.0))

    def _leave_out_default_density(self, body: Usd.Prim) -> None:
        """A density that MuJoCo assumes is not one that the file states: the material has a better one."""
        for prim in geoms_of(body):
            density = prim.GetAttribute("physics:density")
            if density and density.HasAuthoredValue() and self._units.density(density.Get()) == MUJOCO_DENSITY:
                density.Block()

    def targets(self) -> None:
        """Targets at links, or at frames that links carry."""
        carried = [
            prim
            for body in self._bodies
            for prim in carried_by(body)
            if prim.IsA(UsdGeom.Xformable) and not prim.IsA(UsdGeom.Gprim) and not prim.IsInstance()
        ]
        for pattern in self._options.targets:
            for prim in self._matching(pattern, carried, "--target"):
                if is_rigid_body(prim):
                    prim = UsdGeom.Xform.Define(self._stage, prim.GetPath().AppendChild("CalmTarget")).GetPrim()
                prim.AddAppliedSchema("CalmTargetAPI")

    def _matching(self, pattern: str, prims: Iterable[Usd.Prim], option: str) -> list[Usd.Prim]:
        candidates = list(prims)
        found = [prim for prim in candidates if is_named(prim, pattern)]
        if not found:
            names = sorted({named(prim) for prim in self._bodies})
            raise ShotError(
                "no link of the robot has such a name",
                attribute=option,
                found=pattern,
                remedy=f"{nearest(pattern.strip('*'), names)}Its links are {', '.join(names)}",
            )
        return found
