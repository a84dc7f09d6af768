"""What a servo has between its controller and the joint: rotor, gear, friction, limits of speed, delay, backlash.

Each value is the one that is authored in Calmotion's attribute, else that of the named motor, else that of another
dialect.
"""

import math
from dataclasses import fields, replace

from calmotion.errors import ShotError
from calmotion.model.motor import FRICTION_LAWS, PRESCRIBED, SERVO, Coulomb, Rotor
from calmotion.support.naming import nearest
from calmotion.usd import schemas
from calmotion.usd.dialects import ARMATURE, FRICTION, VISCOUS_FRICTION, number_of, spelled_law
from calmotion.usd.reading.actuators.described_motors import CALMOTION, SCHEMA, DescribedMotor, ToSI

_LAW = "calm:motor:frictionModel"
_COEFFICIENT = "physxJoint:jointFriction"


def friction_law(motor: DescribedMotor) -> Coulomb:
    """The law of the friction of a servo's rotor; that of the named motor where none is authored.

    Raises:
        ShotError: A law that does not exist, or a value that the law does not have.
    """
    prim, kind = motor.joint.prim, motor.kind
    known = {law.name: law for law in FRICTION_LAWS}
    name = str(schemas.value(prim, SCHEMA, _LAW) or kind.law or Coulomb.name)
    remedy = f"{nearest(name, known)}Use {', '.join(known)}"
    schemas.require(name in known, prim, _LAW, name, "names a friction that does not exist", remedy)
    own = {spelled_law(item.name): item.name for item in fields(known[name])}
    given = [prop.GetName() for prop in prim.GetAuthoredPropertiesInNamespace("calm:motor:friction")]
    for other in (name for name in given if name.startswith(spelled_law(""))):
        problem = f"the friction {name} has no such value"
        remedy = f"Remove it, or set {_LAW} to the friction that has it ({', '.join(known)})"
        schemas.require(other in own, prim, other, prim.GetAttribute(other).Get(), problem, remedy)
    to_si: dict[str, ToSI] = {
        "stribeck": motor.effort,
        "stribeck_speed": motor.length,
        "motor_quadratic": lambda value: value / motor.effort(1.0),
        "joint_quadratic": lambda value: value / motor.effort(1.0),
    }
    values = {quantity: kind.values[quantity] for quantity in own.values() if quantity in kind.values}
    for attribute, quantity in own.items():
        if (found := number_of(prim, attribute)) is not None:
            values[quantity] = float(to_si.get(quantity, float)(found))
    law = known[name](**values)
    lost = law.terms().joint_load + law.terms().stribeck_joint_load
    problem = "the friction takes all torque on the joint's side of the gear"
    remedy = "Let friction:load and friction:stribeckLoad, or the jointLoad of both, have a sum below 1"
    schemas.require(lost < 1.0, prim, _LAW, lost, problem, remedy)
    return law


def read_delay(motor: DescribedMotor) -> float:
    """Delay of the motor's command [s]; an ideal motor does not use it.

    Raises:
        ShotError: It is negative or not finite, and used.
    """
    other = motor.newton.delay if motor.newton is not None else 0.0
    try:
        return motor.own_or_named("delay", "delay", float, other)
    except ShotError:
        if motor.model != PRESCRIBED:
            raise
        return 0.0


def read_rotor(motor: DescribedMotor) -> Rotor:
    """The rotor of a servo, SI; of an ideal motor the one that it would have as a servo, and of a drive an empty one.

    Raises:
        ShotError: A value out of its range, of a servo or a motor whose type is named.
    """
    if motor.model == SERVO or motor.kind.values:
        return _with_back_emf(_rotor(motor), motor)
    try:
        found = _rotor(replace(motor, notes=[]))
    except ShotError:
        return Rotor()  # it is not used
    if motor.model == PRESCRIBED:
        return found
    if found != Rotor():
        motor.notes.append(
            f"{motor.joint.path}: a drive is simulated without the rotor inertia, friction and limits of speed that "
            f"the file has; calm:motor:model = {SERVO} has them"
        )
    return Rotor()


def _with_back_emf(rotor: Rotor, motor: DescribedMotor) -> Rotor:
    """The rotor with its back-EMF, which is a part of the viscous friction of a named motor, and of one that is
    authored where no voltage and no back-EMF are."""
    authored, values, induced = motor.own("backEmf"), motor.kind.values, 0.0
    if "resistance" in values and motor.own("viscousFriction") is None:
        induced = min(values["torque_constant"] ** 2 / values["resistance"], rotor.viscous_friction)
        rotor = replace(rotor, viscous_friction=rotor.viscous_friction - induced)
    if motor.current is not None:
        induced = motor.current.back_emf
    return replace(rotor, back_emf=induced if authored is None else motor.stiffness(authored))


def _rotor(motor: DescribedMotor) -> Rotor:
    units, path, notes, empty = motor.units, motor.joint.path, motor.notes, Rotor()
    inertia = units.mass if motor.linear else units.inertia
    armature = motor.of_dialects(ARMATURE, "armature", inertia)
    if not armature and motor.model == SERVO:
        notes.append(f"{path}: a servo without calm:motor:armature has a rotor without inertia")
    speed, knee = empty.no_load_speed, empty.knee
    if (newton := motor.newton) is not None:
        speed, knee = units.length(newton.velocity) if motor.linear else newton.velocity, newton.knee
        notes.extend(f"{path}: {what} of {newton.path} is not simulated" for what in newton.unread)
    friction = motor.of_dialects(FRICTION, "friction", motor.effort)
    if not friction and number_of(motor.joint.prim, _COEFFICIENT):
        notes.append(f"{path}: {_COEFFICIENT} is a coefficient, not a torque: author calm:motor:friction instead")
    in_degrees = dict.fromkeys((CALMOTION, "Newton", "PhysX"), motor.stiffness)
    return Rotor(
        armature=armature,
        gear_stiffness=motor.own_or_named("gearStiffness", "gear_stiffness", motor.stiffness, math.inf),
        gear_damping=motor.own_or_named("gearDamping", "gear_damping", motor.stiffness, 0.0),
        viscous_friction=motor.of_dialects(VISCOUS_FRICTION, "viscous_friction", motor.by_radian, in_degrees),
        friction=friction,
        friction_speed=motor.own_or_named("frictionSpeed", "friction_speed", motor.length, empty.friction_speed),
        no_load_speed=motor.own_or_named("noLoadSpeed", "no_load_speed", motor.length, speed),
        knee=motor.own_or_named("torqueSpeedKnee", "torque_speed_knee", float, knee),
        law=friction_law(motor),
    )
