"""The layer over a converted robot: its motors with their motion, flexible links, masses and targets."""

from __future__ import annotations

import fnmatch
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from calmotion.errors import ShotError, raise_all
from calmotion.model import MotorTracks
from calmotion.rigging import Material
from calmotion.support import nearest
from calmotion.usd import StageUnits, author_material, is_applied, is_rigid_body, open_stage, prims_of, quiet, units_of

from .frames import refuse_moving_frames
from .robot_motors import author_motors, named, shift_limits
from .springs import author_springs

if TYPE_CHECKING:
    from pxr import Sdf, Usd

_FRAME_MASS, _FRAME_INERTIA = 1e-6, 1e-10  # of links without mass [kg], [kg m^2]
_SMALLEST_MOMENT, _RAISED = 1e-6, 1e-2  # of the largest moment of inertia of a link
_WEIGHTLESS = 1e-9  # of a geom of mass 0 [kg]: UsdPhysics reads 0 as not authored
_MUJOCO_DENSITY = 1000.0  # which the converter writes where the file states none [kg/m^3]
_THICKNESS = "calm:flexible:wallThickness"


@dataclass(frozen=True)
class FlexibleLinks:
    """Links that bend.

    Attributes:
        pattern: Of their names, with `*` and `?`.
        name: Of the material.
        material: The material.
        thickness: Of their walls [m]; None for solid links.
    """

    pattern: str
    name: str
    material: Material
    thickness: float | None = None


@dataclass(frozen=True, eq=False)
class RobotOptions:
    """What becomes of a converted robot.

    Attributes:
        flexible: Which links bend.
        targets: Patterns of names of links or frames that are targets.
        efforts: Largest effort by name of a joint [N m or N].
        without_mass: Names of links with geometry and without inertia.
        massless: Names of links whose mass is 0.
        solid: Material from which links without inertia get their mass, or None.
        motion: Of its joints, or None.
        frames_per_second: Of the shot; None where no motion is given: that of the robot.
        motors: Patterns of names of joints that motors drive; none: see `robot_motors`.
        mjcf: Whether the robot is MJCF, for which the converter authors the mass of every link that has one.
    """

    flexible: tuple[FlexibleLinks, ...] = ()
    targets: tuple[str, ...] = ()
    efforts: Mapping[str, float] = field(default_factory=dict)
    without_mass: tuple[str, ...] = ()
    massless: tuple[str, ...] = ()
    solid: Material | None = None
    motion: MotorTracks | None = None
    frames_per_second: float | None = 60.0
    motors: tuple[str, ...] = ()
    mjcf: bool = False


def robot_layer(converted: str, asset: str, options: RobotOptions) -> tuple[Sdf.Layer, tuple[str, ...]]:
    """The layer over a converted robot, and notes for the user.

    Args:
        converted: The USD file of the robot.
        asset: The same as the layer names it, relative to where the layer will be.
        options: What to author.

    Raises:
        ShotError: A name that nothing has, or a link without mass.
    """
    from pxr import Sdf, Usd

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
        self.notes: list[str] = []

    def metadata(self) -> None:
        """Units, axes, default prim and clock: a layer does not inherit them from its sublayers."""
        from pxr import UsdGeom, UsdPhysics

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
            root.endTimeCode = float(np.floor(frames + 1e-6))

    @property
    def _rate(self) -> float:
        return float(self._options.frames_per_second or self._robot.GetTimeCodesPerSecond())

    def masses(self) -> None:
        """Densities of the links that have no inertia, and a milligram for those that have no mass."""
        from pxr import Gf, UsdPhysics

        frames = [prim for prim in self._bodies if self._is_frame(prim)]
        if self._options.mjcf:
            refuse_moving_frames(self._stage, frames)
        for prim in frames:
            api = UsdPhysics.MassAPI.Apply(prim)
            api.CreateMassAttr(_FRAME_MASS / self._units.mass(1.0))
            api.CreateCenterOfMassAttr(Gf.Vec3f(0.0))
            api.CreateDiagonalInertiaAttr(Gf.Vec3f(_FRAME_INERTIA / self._units.inertia(1.0)))
        if frames:
            names = ", ".join(map(named, frames))
            self.notes.append(f"links of mass 0 are frames, and get {1e6 * _FRAME_MASS:g} mg each: {names}")
        self._raise_moments()
        without = [prim for prim in self._bodies if named(prim) in self._options.without_mass]
        if self._options.solid is not None:
            without += [prim for prim in self._bodies if prim not in (*without, *frames) and _has_no_mass(prim)]
        bending = [prim for prim in without if self._is_flexible(prim)]
        if bending:
            self.notes.append(f"links without inertia have that of their material: {', '.join(map(named, bending))}")
        without = [prim for prim in without if prim not in bending]
        if not without:
            return
        names = ", ".join(map(named, without))
        solid = self._options.solid
        if solid is None:
            raise ShotError(
                "links have geometry and no inertia", path=str(without[0].GetPath()), attribute="inertial", found=names,
                remedy="Write their <inertial>, or name the material that they are made of: --solid abs",
            )  # fmt: skip
        for prim in without:
            api = UsdPhysics.MassAPI.Apply(prim)
            api.CreateDensityAttr(solid.density / self._units.density(1.0))
        self.notes.append(f"links without inertia have that of their geometry as solid parts: {names}")

    def _is_frame(self, body: Usd.Prim) -> bool:
        """Whether a link has no mass, nor gets that of a material."""
        without = self._options.mjcf and _has_no_mass(body) and not self._is_flexible(body)
        return without or named(body) in self._options.massless or self._weighs_nothing(body)

    def _weighs_nothing(self, body: Usd.Prim) -> bool:
        """Whether all geoms of a rigid link of an MJCF are of mass 0; where some are, they are made weightless."""
        from pxr import UsdPhysics

        geoms = list(_geoms(body))
        weightless = [prim for prim in geoms if _weight(prim) == 0.0]
        if not weightless or _weight(body):
            return False
        if len(weightless) == len(geoms):  # a flexible one weighs what its material does
            return not self._is_flexible(body)
        for prim in weightless:
            UsdPhysics.MassAPI.Apply(prim).CreateMassAttr(_WEIGHTLESS / self._units.mass(1.0))
        return False

    def _raise_moments(self) -> None:
        """Dummy links often have inertias that no body has, with all products as large as the moments."""
        from pxr import Gf

        raised: list[str] = []
        missing: list[str] = []
        negative: list[str] = []
        for prim in self._bodies:
            attribute = prim.GetAttribute("physics:diagonalInertia")
            moments = np.array(attribute.Get() if attribute and attribute.HasAuthoredValue() else (1.0, 1.0, 1.0))
            if moments.max() <= 0.0:
                attribute.Block()  # the reader takes that of the geometry, or of a ball
                missing.append(named(prim))
            elif moments.min() <= _SMALLEST_MOMENT * moments.max():
                attribute.Set(Gf.Vec3f(*np.maximum(moments, _RAISED * moments.max()).tolist()))
                (negative if moments.min() < -_RAISED * moments.max() else raised).append(named(prim))
        if missing:
            self.notes.append(f"links with an inertia of 0 have that of their geometry or a ball: {', '.join(missing)}")
        if negative:
            self.notes.append(
                f"negative moments of inertia, which no body has, are replaced by {_RAISED:g} of the largest; correct "
                f"the <inertia> of {', '.join(negative)}"
            )
        if raised:
            self.notes.append(
                f"moments of inertia that are 0 are raised to {_RAISED:g} of the largest: {', '.join(raised)}"
            )

    def motors(self) -> None:
        """Drives, see `robot_motors`."""
        shift_limits(self._stage)
        options = self._options
        self.notes += author_motors(
            self._stage, self._units, options.motion, self._rate, options.efforts, options.motors
        )
        self.notes += author_springs(self._stage, self._units)

    def links(self) -> None:
        """Flexible links with their materials."""
        from pxr import Sdf, UsdShade

        root = self._stage.GetDefaultPrim()
        flexible: set[str] = set()
        for given in self._options.flexible:
            path = f"{root.GetPath()}/CalmMaterials/{given.name}"
            bodies = self._matching(given.pattern, self._bodies, "--flexible")
            shader = author_material(self._stage, path, given.material, self._units)
            for prim in bodies:
                if str(prim.GetPath()) in flexible:
                    raise ShotError(
                        "two patterns of flexible links name this one", path=str(prim.GetPath()),
                        attribute="--flexible", found=given.pattern, remedy="Make one of them narrower",
                    )  # fmt: skip
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
        for prim in _geoms(body):
            density = prim.GetAttribute("physics:density")
            if density and density.HasAuthoredValue() and self._units.density(density.Get()) == _MUJOCO_DENSITY:
                density.Block()

    def targets(self) -> None:
        """Targets at links, or at frames that links carry."""
        from pxr import UsdGeom

        carried = [
            prim
            for body in self._bodies
            for prim in _below(body)
            if prim.IsA(UsdGeom.Xformable) and not prim.IsA(UsdGeom.Gprim) and not prim.IsInstance()
        ]
        for pattern in self._options.targets:
            for prim in self._matching(pattern, carried, "--target"):
                if is_rigid_body(prim):
                    prim = UsdGeom.Xform.Define(self._stage, prim.GetPath().AppendChild("CalmTarget")).GetPrim()
                prim.AddAppliedSchema("CalmTargetAPI")

    def _is_flexible(self, body: Usd.Prim) -> bool:
        """Whether a pattern of flexible links names a link, whose material then gives its mass."""
        return any(_is_named(body, given.pattern) for given in self._options.flexible)

    def _matching(self, pattern: str, prims: Iterable[Usd.Prim], option: str) -> list[Usd.Prim]:
        candidates = list(prims)
        found = [prim for prim in candidates if _is_named(prim, pattern)]
        if not found:
            names = sorted({named(prim) for prim in self._bodies})
            raise ShotError(
                "no link of the robot has such a name", attribute=option, found=pattern,
                remedy=f"{nearest(pattern.strip('*'), names)}Its links are {', '.join(names)}",
            )  # fmt: skip
        return found


def _is_named(prim: Usd.Prim, pattern: str) -> bool:
    return fnmatch.fnmatchcase(named(prim).lower(), pattern.lower())


def _has_no_mass(body: Usd.Prim) -> bool:
    """Whether neither a mass nor a density is authored on a body or what it carries, and nothing collides."""
    authored = (
        attribute
        for prim in _below(body)
        for name in ("physics:mass", "physics:density")
        if (attribute := prim.GetAttribute(name)) and attribute.HasAuthoredValue()
    )
    return not any(attribute.Get() for attribute in authored) and not any(
        is_applied(prim, "PhysicsCollisionAPI") for prim in _below(body)
    )


def _geoms(body: Usd.Prim) -> Iterable[Usd.Prim]:
    """The colliders of a link of an MJCF."""
    return (prim for prim in _below(body) if is_applied(prim, "MjcCollisionAPI"))


def _weight(prim: Usd.Prim) -> float | None:
    """What is authored of the mass of a prim, else of its density; None where nothing is."""
    attributes = (prim.GetAttribute(f"physics:{what}") for what in ("mass", "density"))
    return next((float(a.Get()) for a in attributes if a and a.HasAuthoredValue()), None)


def _below(body: Usd.Prim) -> Iterable[Usd.Prim]:
    """A body and what it carries, without the bodies below it."""
    yield body
    for child in body.GetChildren():
        if not is_rigid_body(child):
            yield from _below(child)
