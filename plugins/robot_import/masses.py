"""What the links of an imported robot weigh; those without mass are frames of cameras and sites, or mounts."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from calmotion.errors import ShotError, raise_all
from calmotion.model import Character
from calmotion.usd import StageUnits, body_on, is_applied, is_rigid_body, joint_prims, prims_of
from pxr import Gf, Usd, UsdPhysics

from .ellipsoids import author_ellipsoids
from .joints import Placement, author, author_actuators, author_frames
from .options import RobotOptions, carried_by, geoms_of
from .robot_motors import named

_HEAVIEST = 1e5  # of a robot [kg]
_FRAME_MASS, _FRAME_INERTIA = 1e-6, 1e-10  # of links without mass [kg], [kg m^2]
_SMALLEST_MOMENT, _RAISED = 1e-6, 1e-2  # of the largest moment of inertia of a link
_WEIGHTLESS = 1e-9  # of a geom of mass 0 [kg]: UsdPhysics reads 0 as not authored
MUJOCO_DENSITY = 1000.0  # which the converter writes where the file states none [kg/m^3]
_LIGHTEST = 1e-9  # mass of what is fixed and no frame [kg]; what moves has any mass that MuJoCo takes
_FIXED = "PhysicsFixedJoint"


def author_masses(stage: Usd.Stage, units: StageUnits, options: RobotOptions) -> tuple[list[str], list[Usd.Prim]]:
    """Author masses: those of MuJoCo, of frames, and of links without inertia.

    Args:
        stage: The robot, where they are authored.
        units: Of the stage.
        options: What the user and the robot's file say.

    Returns:
        Notes for the user, and the links that are frames.

    Raises:
        ShotError: A link that has geometry and no mass, or one without mass that moves by itself.
    """
    author = _Author(stage, units, options)
    author.masses()
    return author.notes, author.frames


def too_heavy(character: Character) -> tuple[str, ...]:
    """A sentence for the user about a robot that weighs more than any."""
    masses = {body.path: body.mass.mass for body in character.bodies if body.mass is not None}
    if sum(masses.values()) < _HEAVIEST:
        return ()
    heaviest = max(masses, key=masses.__getitem__)
    return (
        f"the robot weighs {1e-3 * sum(masses.values()):.4g} t, most of it {heaviest}: meshes in millimetres need "
        'scale="0.001 0.001 0.001" where the file names them',
    )


def _author_values(
    stage: Usd.Stage, units: StageUnits, values: Mapping[str, Any], keeps: Callable[[Usd.Prim], bool]
) -> list[Usd.Prim]:
    """Author compiled masses, springs, dampers, gains and what is limited; actuators that are off go.

    Args:
        stage: Where they are authored, over the conversion.
        units: Of the stage.
        values: As `converters.compiled_values` gives them.
        keeps: Whether a body keeps the mass that it has in the conversion.

    Returns:
        Bodies that weigh nothing.

    Raises:
        ShotError: The conversion has other bodies than MuJoCo.
    """
    bodies = [prim for prim in prims_of(stage) if is_rigid_body(prim)]
    if len(bodies) != len(values["bodies"]):
        raise ShotError(
            "the converter and MuJoCo find different bodies",
            path=str(stage.GetDefaultPrim().GetPath()),
            found=f"{len(bodies)} and {len(values['bodies'])}",
            remedy="Write the robot without <replicate> and <attach>",
        )
    joints: dict[Any, Usd.Prim] = {}
    for prim in joint_prims(stage):
        joints.setdefault(prim.GetPath().GetParentPath(), prim)
    weightless = []
    for prim, body in zip(bodies, values["bodies"], strict=True):
        if keeps(prim):
            pass
        elif body["mass"] <= (values["least"] if body["joints"] else _LIGHTEST):
            weightless.append(prim)
        else:
            _author_mass(prim, body, units)
        for joint in body["joints"]:
            _author_joint(joints[prim.GetPath()], joint)
    author_actuators(stage, values, [joints.get(prim.GetPath()) for prim in bodies])
    author_frames(units, _placements(bodies, values["bodies"], joints))
    author_ellipsoids(stage, units, bodies, values["ellipsoids"])
    return weightless


def _placements(
    bodies: Sequence[Usd.Prim], values: Sequence[Mapping[str, Any]], joints: Mapping[Any, Usd.Prim]
) -> Iterator[Placement]:
    for prim, body in zip(bodies, values, strict=True):
        parent = str(bodies[body["parent"]].GetPath()) if body["parent"] >= 0 else ""
        axis = body["joints"][0]["axis"] if len(body["joints"]) == 1 else None
        yield Placement(prim, parent, joints.get(prim.GetPath()), body["position"], body["rotation"], axis)


def _author_mass(prim: Usd.Prim, body: Mapping[str, Any], units: StageUnits) -> None:
    api = UsdPhysics.MassAPI.Apply(prim)
    api.CreateMassAttr(body["mass"] / units.mass(1.0))
    api.CreateCenterOfMassAttr(Gf.Vec3f(*(np.array(body["center"]) / units.length(1.0)).tolist()))
    if max(body["moments"]) > 0.0:
        api.CreateDiagonalInertiaAttr(Gf.Vec3f(*(np.array(body["moments"]) / units.inertia(1.0)).tolist()))
        api.CreatePrincipalAxesAttr(Gf.Quatf(*body["axes"]))


def _author_joint(prim: Usd.Prim, joint: Mapping[str, Any]) -> None:
    """A damper of Newton's attribute counts degrees."""
    damping = joint["newton:damping"] * (np.radians(1.0) if joint["angle"] else 1.0)
    author(prim, "newton:damping", float(damping))
    for name in ("mjc:stiffness", "mjc:actuatorfrclimited"):
        author(prim, name, joint[name])


class _Author:
    def __init__(self, stage: Usd.Stage, units: StageUnits, options: RobotOptions) -> None:
        self._stage, self._units, self._options = stage, units, options
        self._bodies = [prim for prim in prims_of(stage) if is_rigid_body(prim)]
        self.notes: list[str] = []
        self.frames: list[Usd.Prim] = []

    def masses(self) -> None:
        """Densities of the links that have no inertia, and a milligram for those that have no mass."""
        weightless: list[Usd.Prim] = []
        if self._options.compiled is not None:
            weightless = _author_values(self._stage, self._units, self._options.compiled, self._keeps_mass)
        self.frames = frames = [prim for prim in self._bodies if prim in weightless or self._is_frame(prim)]
        if self._options.mjcf:
            _refuse_moving_frames(self._stage, frames)
        for prim in frames:
            api = UsdPhysics.MassAPI.Apply(prim)
            api.CreateMassAttr(_FRAME_MASS / self._units.mass(1.0))
            api.CreateCenterOfMassAttr(Gf.Vec3f(0.0))
            api.CreateDiagonalInertiaAttr(Gf.Vec3f(_FRAME_INERTIA / self._units.inertia(1.0)))
        if frames:
            names = ", ".join(map(named, frames))
            self.notes.append(f"links of mass 0 are frames, and get {1e6 * _FRAME_MASS:g} mg each: {names}")
        for prim in self._bodies:
            if named(prim) in self._options.robot.centred:  # else the reader takes the centre of its geometry
                UsdPhysics.MassAPI.Apply(prim).CreateCenterOfMassAttr(Gf.Vec3f(0.0))
        self._raise_moments()
        without = [prim for prim in self._bodies if named(prim) in self._options.robot.without_mass]
        if self._options.solid is not None:
            without += [prim for prim in self._bodies if prim not in (*without, *frames) and _has_no_mass(prim)]
        bending = [prim for prim in without if self._options.is_flexible(prim)]
        if bending:
            self.notes.append(f"links without inertia have that of their material: {', '.join(map(named, bending))}")
        without = [prim for prim in without if prim not in bending]
        if not without:
            return
        names = ", ".join(map(named, without))
        solid = self._options.solid
        if solid is None:
            raise ShotError(
                "links have geometry and no inertia",
                path=str(without[0].GetPath()),
                attribute="inertial",
                found=names,
                remedy="Write their <inertial>, or name the material that they are made of: --solid abs",
            )
        for prim in without:
            api = UsdPhysics.MassAPI.Apply(prim)
            api.CreateDensityAttr(solid.density / self._units.density(1.0))
        self.notes.append(f"links without inertia have that of their geometry as solid parts: {names}")

    def _is_frame(self, body: Usd.Prim) -> bool:
        """Whether a link has no mass, nor gets that of a material."""
        without = self._options.mjcf and _has_no_mass(body) and not self._options.is_flexible(body)
        return without or named(body) in self._options.robot.massless or self._weighs_nothing(body)

    def _keeps_mass(self, body: Usd.Prim) -> bool:
        """Whether the material of a flexible link gives its mass: the file states none of its own."""
        densities = (self._units.density(value) for prim in geoms_of(body) if (value := _weight(prim)) is not None)
        stated = _weight(body) is not None or any(density != MUJOCO_DENSITY for density in densities)
        totalled = self._options.compiled is not None and self._options.compiled["totalled"]
        return self._options.is_flexible(body) and not (stated or totalled)

    def _weighs_nothing(self, body: Usd.Prim) -> bool:
        """Whether all geoms of a rigid link of an MJCF are of mass 0; where some are, they are made weightless."""
        geoms = list(geoms_of(body))
        weightless = [prim for prim in geoms if _weight(prim) == 0.0]
        if not weightless or _weight(body):
            return False
        if len(weightless) == len(geoms):  # a flexible one weighs what its material does
            return not self._options.is_flexible(body)
        for prim in weightless:
            UsdPhysics.MassAPI.Apply(prim).CreateMassAttr(_WEIGHTLESS / self._units.mass(1.0))
        return False

    def _raise_moments(self) -> None:
        """Dummy links often have inertias that no body has, with all products as large as the moments."""
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


def _has_no_mass(body: Usd.Prim) -> bool:
    """Whether neither a mass nor a density is authored on a body or what it carries, and nothing collides."""
    authored = (
        attribute
        for prim in carried_by(body)
        for name in ("physics:mass", "physics:density")
        if (attribute := prim.GetAttribute(name)) and attribute.HasAuthoredValue()
    )
    return not any(attribute.Get() for attribute in authored) and not any(
        is_applied(prim, "PhysicsCollisionAPI") for prim in carried_by(body)
    )


def _weight(prim: Usd.Prim) -> float | None:
    """What is authored of the mass of a prim, else of its density; None where nothing is."""
    attributes = (prim.GetAttribute(f"physics:{what}") for what in ("mass", "density"))
    return next((float(a.Get()) for a in attributes if a and a.HasAuthoredValue()), None)


def _refuse_moving_frames(stage: Usd.Stage, frames: Sequence[Usd.Prim]) -> None:
    """Refuse links without mass that move by themselves, as MuJoCo does: fixed joints tie no mass to them.

    Args:
        stage: The robot.
        frames: Its links without mass.

    Raises:
        ShotError: There is one.
    """
    ends = [(prim, body_on(stage, prim, 0), body_on(stage, prim, 1)) for prim in joint_prims(stage)]
    welds = [{first, second} for prim, first, second in ends if prim.GetTypeName() == _FIXED]
    moved = {second: prim for prim, _, second in ends if prim.GetTypeName() != _FIXED}
    massless = {str(prim.GetPath()) for prim in frames}
    raise_all(
        [
            ShotError(
                "a body without mass moves, and carries none",
                path=frame,
                attribute="inertial",
                found=f"the joint {moved[frame].GetName()}",
                remedy="Write its <inertial>, or a geom with a mass, as MuJoCo demands",
            )
            for frame in sorted(massless & moved.keys())
            if _welded_to(frame, welds) <= massless
        ]
    )


def _welded_to(body: str, welds: Sequence[set[str]]) -> set[str]:
    """A body and those that fixed joints tie to it, directly or not; the world is the empty name."""
    found = {body}
    while more := set().union(*(ends for ends in welds if ends & found)) - found:
        found |= more
    return found
