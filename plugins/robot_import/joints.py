"""Joints of an imported robot beside their motors: actuators and limits as MuJoCo compiles them, springs (`stiffness`,
`springref`), those that an equality holds, free ones."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from calmotion.errors import ShotError
from calmotion.usd import (
    ARMATURE,
    DAMPING_ON,
    FRICTION,
    VISCOUS_FRICTION,
    StageUnits,
    authored,
    body_on,
    is_rigid_body,
    joint_prims,
    prims_of,
)
from pxr import Gf, Sdf, Usd, UsdPhysics

from .description.repairs import JointFrame
from .robot_motors import LIMITS, Axis, axes_of, free_axes, is_driven, named

_AXES = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}
_SLOW = 1e5  # time in which the spring beside a damper alone would pull a joint back [s]
_REVOLUTE = "PhysicsRevoluteJoint"
_KINDS = (_REVOLUTE, "PhysicsPrismaticJoint")
_ACTUATOR = "MjcActuator"


@dataclass(frozen=True)
class Placement:
    """Where a body is in the one that carries it, as the robot's file says.

    Attributes:
        body: Its prim.
        parent: Path of the body that carries it; empty for the world.
        joint: Between the two, of which the body is the second one; None: there is none.
        position: Of the body in its parent [m].
        rotation: Likewise, a quaternion w, x, y, z.
        axis: Of the joint, in the body; None where it has none.
        direct: Whether no frame is between the two.
    """

    body: Usd.Prim
    parent: str
    joint: Usd.Prim | None
    position: Sequence[float]
    rotation: Sequence[float]
    axis: Sequence[float] | None = None
    direct: bool = True


def author_frames(units: StageUnits, placements: Iterable[Placement]) -> None:
    """Author poses of bodies and frames of their joints. The converters find angles from their cosine in single
    precision, by which those of calibrated robots are lost: 0.02 degrees, 0.1 mm on a forearm."""
    for place in placements:
        turn = Gf.Quatd(*place.rotation).GetNormalized()
        at = Gf.Vec3d(*place.position) / units.length(1.0)
        above = place.body.GetParent()
        carried = str(above.GetPath()) == place.parent or (not place.parent and not is_rigid_body(above))
        if carried and place.direct:
            _set_precisely(place.body, "xformOp:translate", at)
            _set_precisely(place.body, "xformOp:orient", turn)
        if place.joint is None:
            continue
        own, anchor = (place.joint.GetAttribute(f"physics:local{what}1").Get() for what in ("Rot", "Pos"))
        own = Gf.Quatd(own)
        if place.axis is not None and (token := str(place.joint.GetAttribute("physics:axis").Get())) in _AXES:
            own = _between(own.Transform(Gf.Vec3d(*_AXES[token])), Gf.Vec3d(*place.axis).GetNormalized()) * own
            _set_precisely(place.joint, "physics:localRot1", own)
        _set_precisely(place.joint, "physics:localRot0", turn * own)
        _set_precisely(place.joint, "physics:localPos0", at + turn.Transform(Gf.Vec3d(anchor)))


def urdf_placements(stage: Usd.Stage, frames: Mapping[str, JointFrame]) -> Iterator[Placement]:
    """Those of the joints of a URDF, by their names; each is where its child is. A converter leaves out links that are
    frames, and ties a joint to the body that carries its parent: fixed joints are in between."""
    fixed_at = {frame.child: frame for frame in frames.values()}
    for prim in joint_prims(stage):
        body, carrier = (stage.GetPrimAtPath(body_on(stage, prim, side) or "/") for side in (1, 0))
        if named(prim) not in frames or not is_rigid_body(body):
            continue
        own = frames[named(prim)]
        at, turn = Gf.Vec3d(*own.position), _turn(own.angles)
        link: str | None = own.parent
        while link != named(carrier) and (frame := fixed_at.get(link or "")) is not None:
            above = _turn(frame.angles)
            at, turn, link = Gf.Vec3d(*frame.position) + above.Transform(at), above * turn, frame.parent
        if link == named(carrier) or carrier.IsPseudoRoot():
            rotation = (turn.GetReal(), *turn.GetImaginary())
            direct = link == own.parent
            yield Placement(body, body_on(stage, prim, 0), prim, tuple(at), rotation, own.axis, direct)


def _turn(angles: Iterable[float]) -> Any:
    """The rotation by roll, pitch and yaw, which are about the axes of the parent, x first."""
    turn = Gf.Quatd(1.0)
    for angle, unit in zip(angles, _AXES.values(), strict=True):
        turn = Gf.Quatd(float(np.cos(0.5 * angle)), Gf.Vec3d(*unit) * float(np.sin(0.5 * angle))) * turn
    return turn


def _between(start: Any, end: Any) -> Any:
    """The smallest rotation from one direction to another one, which is not opposite to it."""
    return Gf.Quatd(1.0 + start * end, Gf.Cross(start, end)).GetNormalized()


def _set_precisely(prim: Usd.Prim, name: str, value: Any) -> None:
    """A vector or rotation in the type of its attribute."""
    attribute = prim.GetAttribute(name)
    if attribute:
        attribute.Set(attribute.GetTypeName().type.pythonClass(value))


def author_actuators(stage: Usd.Stage, values: Mapping[str, Any], joints: Sequence[Usd.Prim | None]) -> None:
    """Author compiled gains and ranges of the actuators; those that are off go, and those that the converter has not
    written, as it does not know their kind or how they act on their joint, are added.

    Args:
        stage: Where they are authored, over the conversion.
        values: As `converters.compiled_values` gives them.
        joints: Of each body, in the order of the values; None where it has none.
    """
    known = {str(p.GetDisplayName() or p.GetName()): p for p in prims_of(stage) if p.GetTypeName() == _ACTUATOR}
    for number, (name, found) in enumerate(values["actuators"].items()):
        prim, body = known.get(name), found["body"]
        joint = None if body is None else joints[body]
        if prim is None and joint is not None and name not in values["off"]:
            prim = stage.DefinePrim(f"{stage.GetDefaultPrim().GetPath()}/Physics/CalmActuator_{number}", _ACTUATOR)
            prim.SetDisplayName(name)
        if prim is None:
            continue
        if joint is not None and not prim.GetRelationship("mjc:target"):
            prim.CreateRelationship("mjc:target").SetTargets([joint.GetPath()])
        if name in values["off"]:
            prim.SetActive(False)
        for attribute, value in found["attributes"].items():
            author(prim, attribute, value)


def author(prim: Usd.Prim, name: str, value: Any) -> None:
    """Author an attribute of a schema that usd-core does not have; what is not there and 0 stays as it is."""
    attribute = prim.GetAttribute(name)
    if not attribute.IsDefined() and value:
        kinds = {float: Sdf.ValueTypeNames.Double, str: Sdf.ValueTypeNames.Token}
        attribute = prim.CreateAttribute(name, kinds.get(type(value), Sdf.ValueTypeNames.DoubleArray))
    if attribute.IsDefined():
        attribute.Set(value)


def shift_limits(stage: Usd.Stage) -> None:
    """Count limits, springs and commands of MuJoCo joints from the pose of the file, where their value is `ref` and
    becomes 0."""
    radians = any(prim.GetAttribute("mjc:compiler:angle").Get() == "radian" for prim in prims_of(stage))
    for prim in joint_prims(stage):
        attribute = prim.GetAttribute("mjc:ref")
        ref = attribute.Get() if attribute else None
        if not ref or prim.GetTypeName() not in _KINDS:
            continue
        shift = np.degrees(ref) if radians and prim.GetTypeName() == _REVOLUTE else ref
        for name in LIMITS:
            limit = prim.GetAttribute(name)
            if limit and limit.HasAuthoredValue():
                limit.Set(float(limit.Get() - shift))
        spring = prim.GetAttribute("mjc:springref")
        if spring:
            spring.Set(float((spring.Get() or 0.0) - ref))
        _shift_commands(stage, prim, np.radians(ref) if prim.GetTypeName() == _REVOLUTE and not radians else ref)
        attribute.Set(0.0)


def _shift_commands(stage: Usd.Stage, joint: Usd.Prim, ref: float) -> None:
    """Count a joint from where its value is `ref` [rad or m] in the biases of its actuators: gain ctrl + b_0 +
    b_1 g (q + ref)."""
    for prim in prims_of(stage):
        targets = prim.GetRelationship("mjc:target") if prim.GetTypeName() == _ACTUATOR else None
        bias = prim.GetAttribute("mjc:biasPrm")
        if not targets or joint.GetPath() not in targets.GetTargets() or not (bias and len(bias.Get() or ()) > 1):
            continue
        gear = prim.GetAttribute("mjc:gear")
        ratio = gear.Get()[0] if gear and gear.Get() else 1.0
        offset, slope, *others = bias.Get()
        bias.Set([offset + slope * ratio * ref, slope, *others])


def author_springs(stage: Usd.Stage, units: StageUnits) -> list[str]:
    """Make drives of the springs and dampers of joints that no motor drives and that are in no closed chain.

    The torque of such a drive, k (springref - theta) - d theta', is that of MuJoCo's joint. In a closed chain a rigid
    robot could not hold all springs where they pull to. A damper alone gets a spring that hardly pulls within a shot.

    Args:
        stage: Where they are authored; motors are there already.
        units: Of the stage.

    Returns:
        Notes for the user.
    """
    radians = any(prim.GetAttribute("mjc:compiler:angle").Get() == "radian" for prim in prims_of(stage))
    joints = list(joint_prims(stage))
    free = {axis.prim for axis in free_axes([axis for prim in joints for axis in axes_of(prim)])}
    made: list[str] = []
    damped: list[str] = []
    driven: list[str] = []
    others: list[str] = []
    for prim in joints:
        spring, damping = (_number(prim, name) for name in ("mjc:stiffness", "newton:damping"))
        held = bool(axes_of(prim)) and is_driven(axes_of(prim)[0])
        if held and spring:
            driven.append(named(prim))
        elif held or not (spring or damping) or (axes_of(prim) and prim not in free):
            continue
        elif prim.GetTypeName() not in _KINDS or _in_closed_chain(stage, prim, joints):
            others.append(named(prim))
        else:
            _author(prim, radians, units)
            (made if spring else damped).append(named(prim))
    notes = []
    if made:
        notes.append(f"springs of joints are drives that hold one value and are not optimised: {', '.join(made)}")
    if damped:
        notes.append(f"dampers of joints without motors are drives that are not optimised: {', '.join(damped)}")
    if driven:
        notes.append(
            "springs of joints with motors are not read: efforts, and commands of compliant motors, are without them: "
            f"{', '.join(driven)}"
        )
    if others:
        notes.append(
            f"springs and dampers of ball joints and of joints in closed chains are not read: {', '.join(others)}"
        )
    return notes


def _number(prim: Usd.Prim, name: str) -> float:
    attribute = prim.GetAttribute(name)
    return float(attribute.Get() or 0.0) if attribute else 0.0


def author_locks(stage: Usd.Stage, units: StageUnits, locks: Mapping[str, float]) -> list[str]:
    """Make drives that hold the joints which an equality holds at one value.

    Args:
        stage: Where they are authored; motors are there already.
        units: Of the stage.
        locks: That value by the name of the joint [rad or m].

    Returns:
        Notes for the user.

    Raises:
        ShotError: The motion moves one.
    """
    held = [axis for prim in joint_prims(stage) if named(prim) in locks for axis in axes_of(prim)]
    for axis in held:
        target = UsdPhysics.DriveAPI.Apply(axis.prim, axis.drive).CreateTargetPositionAttr()
        if target.GetNumTimeSamples():
            raise ShotError(
                "the motion moves a joint that an equality holds",
                path=axis.path,
                attribute=target.GetName(),
                found=f"{locks[axis.name]:g}",
                remedy="Leave it out of the motion, or remove the equality",
            )
        target.Set(locks[axis.name] / units.length(1.0) if axis.linear else float(np.degrees(locks[axis.name])))
        axis.prim.AddAppliedSchema("CalmMotorAPI")
        axis.prim.CreateAttribute("calm:motor:optimize", Sdf.ValueTypeNames.Bool).Set(False)
    return [f"joints that an equality holds: {', '.join(axis.name for axis in held)}"] if held else []


def passive_joints(stage: Usd.Stage, chosen: bool) -> list[str]:
    """Notes about joints that nothing drives, nor a spring or an equality holds.

    Args:
        stage: The robot with its motors.
        chosen: Whether the user has named motors, or given a motion.
    """
    axes = [axis for prim in joint_prims(stage) for axis in axes_of(prim)]
    free = [axis for axis in free_axes(axes) if not is_driven(axis)]
    notes = []
    if free and not chosen:
        names = ", ".join(axis.name for axis in free)
        notes.append(f"joints that nothing in the file drives move freely: {names}; --motors all makes motors of them")
    rough = [axis.name for axis in free if _is_rough(axis)]
    if rough:
        notes.append(f"damping, friction and rotors of joints without motors are not simulated: {', '.join(rough)}")
    return notes


def _is_rough(axis: Axis) -> bool:
    spellings = (*ARMATURE, *FRICTION, *VISCOUS_FRICTION)
    found = (authored(axis.prim, spelling, axis.drive) for spelling in spellings)
    return any(value is not None and value[1] > 0.0 for value in found)


def _author(prim: Usd.Prim, radians: bool, units: StageUnits) -> None:
    axis, damping = axes_of(prim)[0], _number(prim, "newton:damping")
    stiffness, at = _number(prim, "mjc:stiffness"), _number(prim, "mjc:springref")
    drive = UsdPhysics.DriveAPI.Apply(prim, axis.drive)
    if axis.linear:
        stiffness *= units.length(1.0) / units.force(1.0)
        drive.CreateTargetPositionAttr(at / units.length(1.0))
    else:
        stiffness *= np.radians(1.0) / units.torque(1.0)
        drive.CreateTargetPositionAttr(float(np.degrees(at)) if radians else at)
    drive.CreateStiffnessAttr(stiffness or damping / _SLOW)
    drive.CreateDampingAttr(damping)
    if damping:
        prim.GetAttribute("newton:damping").Block()  # a servo would add it
    prim.AddAppliedSchema("CalmMotorAPI")
    for name, kind, value in (
        ("calm:motor:model", Sdf.ValueTypeNames.Token, "drive"),
        (DAMPING_ON, Sdf.ValueTypeNames.Token, "joint"),
        ("calm:motor:optimize", Sdf.ValueTypeNames.Bool, False),
    ):
        prim.CreateAttribute(name, kind).Set(value)


def _in_closed_chain(stage: Usd.Stage, prim: Usd.Prim, joints: Sequence[Usd.Prim]) -> bool:
    """Whether the other joints connect the two bodies of a joint."""
    pairs = [{body_on(stage, other, side) for side in (0, 1)} for other in joints if other != prim]
    start, end = (body_on(stage, prim, side) for side in (0, 1))
    reached = {start}
    while True:
        more = {body for pair in pairs if pair & reached for body in pair} - reached
        if not more:
            return end in reached
        reached |= more
