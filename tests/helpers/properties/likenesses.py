"""The same shot told in another way: bodies in another order, elsewhere in the world, in units of another size."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from calmotion.model import WORLD, Animation, Character, FEMeshes, Frame, Motion, Track
from random_shots import Shot, beyond, rotation_of

BESIDE = 1e-3  # share of what a joint bears, below which its motor's effort is next to nothing


@dataclass(frozen=True)
class Units:
    """Sizes of the units of length, mass and time, as powers of two, so that numbers keep all their digits."""

    length: float
    mass: float
    time: float

    def of(self, length: int = 0, mass: int = 0, time: int = 0) -> float:
        """The factor of a quantity with these exponents."""
        return self.length**length * self.mass**mass * self.time**time


def reordered(shot: Shot, bodies: Sequence[int], joints: Sequence[int], motors: Sequence[int]) -> Shot:
    """Entry k of the new lists is entry `bodies[k]`, `joints[k]`, `motors[k]` of the old ones."""
    old = shot.character
    body_of = {b: k for k, b in enumerate(bodies)} | {WORLD: WORLD}
    joint_of = {j: k for k, j in enumerate(joints)}
    tracks = tuple(shot.animation.tracks[k] for k in motors)
    character = replace(
        old,
        bodies=tuple(old.bodies[b] for b in bodies),
        joints=tuple(
            replace(old.joints[j], body0=body_of[old.joints[j].body0], body1=body_of[old.joints[j].body1])
            for j in joints
        ),
        motors=tuple(replace(old.motors[m], joint=joint_of[old.motors[m].joint]) for m in motors),
        targets=tuple(replace(target, body=body_of[target.body]) for target in old.targets),
    )
    meshes = FEMeshes(tuple(replace(mesh, body=body_of[mesh.body]) for mesh in shot.meshes.meshes))
    return Shot(character, replace(shot.animation, tracks=tracks, current=tracks), meshes)


def moved(shot: Shot, by: Frame) -> Shot:
    """The shot, gravity included, as a whole at another place in the world."""
    old = shot.character
    character = replace(
        old,
        bodies=tuple(replace(body, rest=beyond(by, body.rest)) for body in old.bodies),
        joints=tuple(
            replace(
                joint,
                frame0=beyond(by, joint.frame0) if joint.body0 == WORLD else joint.frame0,
                frame1=beyond(by, joint.frame1) if joint.body1 == WORLD else joint.frame1,
            )
            for joint in old.joints
        ),
        gravity=rotation_of(by).apply(old.gravity),
    )
    return replace(shot, character=character)


def in_units(shot: Shot, units: Units) -> Shot:
    """The shot of a robot that is larger, heavier and slower by the units."""
    old, far = shot.character, units.length

    def frame(item: Frame) -> Frame:
        return Frame(far * item.position, item.rotation)

    bodies = []
    for body in old.bodies:
        mass, flexible = body.mass, body.flexible
        if mass is not None:
            inertia = units.of(length=2, mass=1) * mass.inertia
            mass = replace(mass, mass=units.mass * mass.mass, center=far * mass.center, inertia=inertia)
        if flexible is not None:
            stuff = replace(
                flexible.material,
                youngs_modulus=units.of(length=-1, mass=1, time=-2) * flexible.material.youngs_modulus,
                density=units.of(length=-3, mass=1) * flexible.material.density,
            )
            flexible = replace(flexible, material=stuff)
        bodies.append(replace(body, rest=frame(body.rest), mass=mass, flexible=flexible))
    character = replace(
        old,
        bodies=tuple(bodies),
        joints=tuple(replace(joint, frame0=frame(joint.frame0), frame1=frame(joint.frame1)) for joint in old.joints),
        targets=tuple(replace(target, frame=frame(target.frame)) for target in old.targets),
        gravity=units.of(length=1, time=-2) * old.gravity,
    )
    tracks = tuple(
        Track(units.time * track.times, (far if motor.linear else 1.0) * track.values)
        for motor, track in zip(old.motors, shot.animation.tracks, strict=True)
    )
    animation = Animation(units.time * shot.animation.frame_times, tracks, tracks)
    meshes = FEMeshes(tuple(replace(mesh, points=far * mesh.points) for mesh in shot.meshes.meshes))
    return Shot(character, animation, meshes)


def reach(character: Character) -> float:
    """What lengths of a character are measured by [m]: all arms of its joints together."""
    frames = [frame for joint in character.joints for frame in (joint.frame0, joint.frame1)]
    return max(sum(float(np.linalg.norm(frame.position)) for frame in frames), 0.1)


def apart(
    character: Character, one: Motion, other: Motion, size: float, motors: Sequence[int] | None = None
) -> dict[str, float]:
    """Largest differences of two motions: of the targets' positions over a length, of their rotations [rad], and of
    each motor's effort over the largest of that motor.

    An effort that is next to nothing beside what its joint bears is compared with that.

    Args:
        character: What performs the first.
        motors: Which motor of `one` each of `other` is; None: the same.
    """
    dots = np.sum(one.target_rotations * other.target_rotations, axis=-1, keepdims=True)
    turned = one.target_rotations - np.sign(dots) * other.target_rotations
    order = list(range(len(character.motors)) if motors is None else motors)
    worst = 0.0
    for k, motor in enumerate(order):
        driven = character.motors[motor]
        loads = one.joint_forces if driven.linear else one.joint_moments
        effort = one.motor_efforts[:, motor]
        largest = max(np.abs(effort).max(), BESIDE * np.linalg.norm(loads[:, driven.joint], axis=1).max())
        worst = max(worst, float(np.abs(effort - other.motor_efforts[:, k]).max()) / max(largest, np.finfo(float).tiny))
    return {
        "position": float(np.abs(one.target_positions - other.target_positions).max()) / size,
        "rotation": 2.0 * float(np.abs(turned).max()),
        "effort": worst,
    }
