"""The robot of a shot with other parameters: reduced bodies are scaled, never reduced anew."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array
from calmotion.model import Body, ElasticMaterial, Motor
from calmotion.reduction import (
    Invariants,
    ReducedBody,
    with_graded_stiffness,
    with_scaled_density,
    with_scaled_stiffness,
)
from calmotion.simulation import CompiledShot, compile_shot, with_material_damping

from ..model import kinds
from .parameters import Parameter

Values = Mapping[tuple[str, str, int], float]  # by kind, path and axis


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot with some values of its parameters.

    Attributes:
        shot: The compiled shot.
        offsets: Of the motors' encoders [rad or m], shape [M]: the joint stands at the command minus the offset.
    """

    shot: CompiledShot
    offsets: Array


def robot_at(shot: CompiledShot, parameters: Sequence[Parameter], x: Array) -> Robot:
    """The robot at values of its parameters, in standard deviations of their priors, shape [n]."""
    values: dict[tuple[str, str, int], float] = {}
    for p, v in zip(parameters, x, strict=True):
        values |= p.values(float(v))
    return robot_with(shot, values)


def robot_with(shot: CompiledShot, values: Values) -> Robot:
    """The robot with some values.

    A material's modulus and density scale the matrices of its bodies; damping is then as `reduce_bodies` would set it
    for these materials and masses, so that a shot with these values has the same robot.
    """
    character = shot.character
    offsets = np.array([values.get((kinds.ENCODER_OFFSET, motor.path, -1), 0.0) for motor in character.motors])
    if not any(kind != kinds.ENCODER_OFFSET for kind, _, _ in values):
        return Robot(shot, offsets)
    bodies = [_body(own, body, values) for own, body in zip(character.bodies, shot.bodies, strict=True)]
    changed = replace(
        character,
        bodies=tuple(_with_material(body, values) for body in character.bodies),
        motors=tuple(_motor(motor, values) for motor in character.motors),
    )
    if not {kind for kind, _, _ in values} <= set(kinds.MOTOR_KINDS):
        bodies = with_material_damping(changed, shot.tree, bodies)
    return Robot(compile_shot(changed, shot.animation, bodies), offsets)


def material_with(material: ElasticMaterial, values: Values) -> ElasticMaterial:
    """A material with some values; a damping scales both coefficients where they are Rayleigh's."""
    modulus, damping, density = (values.get((kind, material.path, -1)) for kind in kinds.MATERIAL_KINDS)
    rayleigh, ratio = material.rayleigh, material.damping_ratio
    if damping is not None and rayleigh is not None:
        rayleigh = (damping * rayleigh[0], damping * rayleigh[1])
    elif damping is not None:
        ratio = damping
    return replace(
        material,
        youngs_modulus=material.youngs_modulus if modulus is None else modulus,
        density=material.density if density is None else density,
        damping_ratio=ratio,
        rayleigh=rayleigh,
    )


def _with_material(body: Body, values: Values) -> Body:
    if body.flexible is None:
        return body
    return replace(body, flexible=replace(body.flexible, material=material_with(body.flexible.material, values)))


def _body(own: Body, body: ReducedBody, values: Values) -> ReducedBody:
    if own.flexible is not None and own.simulated_flexible:
        given = own.flexible.material
        material = material_with(given, values)
        body = with_scaled_stiffness(body, material.youngs_modulus / given.youngs_modulus)
        body = with_graded_stiffness(body, values.get((kinds.HIGHER_MODES, given.path, -1), 0.0))
        # a body whose mass is authored keeps it
        return with_scaled_density(body, material.density / given.density) if own.mass is None else body
    if own.mass is None:
        return body
    mass = values.get((kinds.MASS, own.path, -1), own.mass.mass)
    center = np.array([values.get((kinds.CENTRE, own.path, axis), own.mass.center[axis]) for axis in range(3)])
    return replace(body, invariants=_rigid(body.invariants, mass, center))


def _rigid(given: Invariants, mass: float, center: Array) -> Invariants:
    """The integrals of a rigid body of another mass, distributed alike, and about another centre."""
    about = given.Z / given.mass - np.outer(given.s, given.s) / given.mass**2
    return replace(given, mass=mass, s=mass * center, Z=mass * (about + np.outer(center, center)))


def _motor(motor: Motor, values: Values) -> Motor:
    def of(kind: str, own: float) -> float:
        return values.get((kind, motor.path, -1), own)

    motor = motor.with_gain(of(kinds.POSITION_GAIN, motor.position_gain))
    law = motor.rotor.law
    rotor = replace(
        motor.rotor,
        gear_stiffness=of(kinds.GEAR_STIFFNESS, motor.rotor.gear_stiffness),
        armature=of(kinds.ARMATURE, motor.rotor.armature),
        friction=of(kinds.FRICTION, motor.rotor.friction),
        viscous_friction=of(kinds.VISCOUS_FRICTION, motor.rotor.viscous_friction),
        law=law.with_share(of(kinds.LOAD_FRICTION, law.share)),
    )
    return replace(
        motor,
        max_torque=of(kinds.MAX_TORQUE, motor.max_torque),
        velocity_gain=of(kinds.VELOCITY_GAIN, motor.velocity_gain),
        delay=of(kinds.DELAY, motor.delay),
        rotor=rotor,
    )
