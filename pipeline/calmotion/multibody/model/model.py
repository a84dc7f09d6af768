"""From a character and its reduced bodies to the compiled system, its motors and its targets."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.model.character import Body, Character
from calmotion.model.motor import PRESCRIBED, Motor
from calmotion.multibody.model.joint_arrays import BodyAnchors, JointArrays, body_anchors, joint_arrays
from calmotion.multibody.model.system import LINEAR, NEOHOOKEAN, STVK, System, components, coordinate_units
from calmotion.multibody.model.topology import Tree, span_tree
from calmotion.multibody.motors.couplings import Coupling, couplings
from calmotion.multibody.motors.drives import add_motors, giving_motors
from calmotion.reduction.reduced_body import Marker, ReducedBody, rigid_invariants
from calmotion.support.rotations import rotation_from_quaternion


@dataclass(frozen=True, eq=False)
class Targets:
    """Target markers, one row each (K targets): component, marker (see `fem.Marker`), weights."""

    component: IntArray
    position: Array
    rotation: Array
    Phi: Array
    Psi: Array
    position_weight: Array
    rotation_weight: Array


@dataclass(frozen=True, eq=False)
class Model:
    """A character compiled for simulation.

    Attributes:
        system: The flat arrays.
        tree: Order of the components.
        motor: Motor that drives each joint, -1 for none, shape [J]: the joints of the tree, by component, then
            those that close chains.
        sign: +1, or -1 where the joint's angle runs against the tree, shape [J].
        targets: The target markers.
        rest_angles: Angle [rad] (or length [m]) of each joint in the pose the shot was authored in, shape [J].
        delays: Of the motors' commands [s]; empty where there are none.
        coupled: The motors that other joints turn too.
    """

    system: System
    tree: Tree
    motor: IntArray
    sign: Array
    targets: Targets
    rest_angles: Array
    delays: tuple[float, ...] = ()
    coupled: tuple[Coupling, ...] = ()

    def joint_angles(self, motor_values: Array) -> Array:
        """What the motors of the joints follow, shape [..., J], from values of the motors, shape [..., M]: angles (or
        lengths) of the joints, but of a servo that another joint turns too those of its rotor."""
        out = self._of_joints(motor_values)
        for own in self.coupled:
            if own.compliant:
                out[..., own.joint] += own.ratio * out[..., own.other]
        return out

    def by_inputs(self, by_joint: Array) -> Array:
        """The transpose of `joint_angles`: shape [..., J] to [..., M]."""
        found = by_joint.copy()
        for own in self.coupled:
            if own.compliant:
                found[..., own.other] += own.ratio * found[..., own.joint]
        return self.motor_values(found)

    def turned(self, followed: Array) -> Array:
        """Angles (or lengths) of the joints where their motors are at what they follow, shape [..., J]."""
        found = followed.copy() if self.coupled else followed
        for own in self.coupled:
            if own.compliant:
                found[..., own.joint] -= own.ratio * found[..., own.other]
        return found

    def motor_values(self, joint_values: Array) -> Array:
        """Values of the motors, shape [..., M], from those of the joints, shape [..., J]."""
        out = np.zeros(joint_values.shape[:-1] + (int(self.motor.max(initial=-1)) + 1,))
        for joint, motor in enumerate(self.motor):
            if motor >= 0:
                out[..., motor] += self.sign[joint] * joint_values[..., joint]
        return out

    def motor_efforts(self, joint_efforts: Array, through_gears: bool = False) -> Array:
        """Efforts of the motors, shape [..., M], from those along the axes of the joints, shape [..., J].

        Args:
            through_gears: Whether those of servos are what their joints transmit, as in sweeps, not what acts on
                their rotors.
        """
        found = joint_efforts.copy()
        for own in self.coupled:
            if through_gears or not own.compliant:
                found[..., own.other] -= own.ratio * found[..., own.joint]
        return self.motor_values(found)

    def by_efforts(self, by_motor: Array) -> Array:
        """The transpose of `motor_efforts` through gears: shape [..., M] to [..., J]."""
        out = self._of_joints(by_motor)
        for own in self.coupled:
            out[..., own.joint] -= own.ratio * out[..., own.other]
        return out

    def _of_joints(self, motor_values: Array) -> Array:
        out = np.zeros(motor_values.shape[:-1] + (len(self.motor),))
        driven = self.motor >= 0
        out[..., driven] = motor_values[..., self.motor[driven]] * self.sign[driven]
        return out

    @property
    def dof(self) -> int:
        """Position coordinates of all components."""
        return int(np.sum(6 + self.system.elastic))


def rigid_body(body: Body, anchors: BodyAnchors) -> ReducedBody:
    """A rigid body with its markers."""
    assert body.mass is not None
    none = np.zeros((3, 0))
    markers = tuple(Marker(frame.position, frame.rotation, none, none) for frame in anchors.frames)
    return ReducedBody(rigid_invariants(body.mass), np.zeros(0), np.zeros((0, 0)), markers)


def compile_model(character: Character, tree: Tree, bodies: Sequence[ReducedBody], moving: Sequence[int] = ()) -> Model:
    """Compile a character whose bodies are given reduced, with the markers of `body_anchors`.

    Args:
        moving: Joints to the world whose frame there has a prescribed motion (moving roots).
    """
    anchors = body_anchors(character, tree)
    count = len(tree.body)
    r_max = max((len(body.stiffness) for body in bodies), default=0)

    def zeros(*shape: int) -> Array:
        return np.zeros((count,) + shape)

    mass, s, Z, M3, M4 = zeros(), zeros(3), zeros(3, 3), zeros(r_max, 3), zeros(r_max, 3, 3)
    S, axial, axial0 = zeros(r_max, r_max, 3, 3), zeros(r_max, r_max, 3), zeros(r_max, 3)
    stiffness, damping = zeros(r_max), zeros(r_max, r_max)
    elastic = np.zeros(count, np.int64)
    for k, b in enumerate(tree.body):
        body = bodies[b]
        integrals = body.invariants
        r = elastic[k] = len(body.stiffness)
        mass[k], s[k], Z[k] = integrals.mass, integrals.s, integrals.Z
        M3[k, :r], M4[k, :r], S[k, :r, :r] = integrals.M3, integrals.M4, integrals.S
        for i in range(3):
            j, m = (i + 1) % 3, (i + 2) % 3
            axial[k, :r, :r, i] = integrals.S[:, :, j, m] - integrals.S[:, :, m, j]
            axial0[k, :r, i] = integrals.M4[:, j, m] - integrals.M4[:, m, j]
        damping[k, :r, :r] = body.damping
        if body.elasticity is None:
            stiffness[k, :r] = body.stiffness
    joints = joint_arrays(character, tree, bodies, anchors, r_max, moving)
    nonrotating = np.array([character.bodies[b].non_rotating for b in tree.body], bool)
    system = System(
        parent=np.array(tree.parent, np.int32), elastic=elastic, modes=elastic.copy(), mass=mass, s=s, Z=Z, M3=M3,
        M4=M4, S=S, axial=axial, axial0=axial0, rotating=components(~nonrotating), nonrotating=components(nonrotating),
        inertia=np.where(np.arange(r_max) < elastic[:, None], 1.0, 0.0), stiffness=stiffness, damping=damping,
        gravity=np.asarray(character.gravity, dtype=float),
        held=_held(character, tree, mass, Z, joints),
        unit=coordinate_units(mass, Z, joints.arrays["side"], joints.arrays["position"], r_max),
        **_elastic_laws([bodies[b] for b in tree.body]), **joints.arrays,
    )  # fmt: skip
    targets = _targets(character, tree, bodies, anchors, r_max)
    return with_drives(Model(system, tree, joints.motor, joints.sign, targets, joints.rest), character.motors)


def _held(character: Character, tree: Tree, mass: Array, Z: Array, joints: JointArrays) -> Array:
    """`System.held`; a part between the axes of a joint is held as the body beyond it."""
    held, child = np.zeros(len(tree.body)), {parent: b for b, parent in enumerate(tree.parent)}
    for b in range(len(held)):
        own = b
        while character.bodies[tree.body[own]].between and own in child:
            own = child[own]
        inertia, axis = np.trace(Z[own]) * np.eye(3) - Z[own], joints.arrays["rotation"][b, 1, :, 2]
        if joints.arrays["sliding"][b]:
            held[b] = mass[own]
        elif joints.arrays["rows"][b] == 5 and own == b:
            held[b] = axis @ inertia @ axis
        else:
            held[b] = np.trace(inertia) / 3.0
    return held


def with_drives(model: Model, motors: Sequence[Motor]) -> Model:
    """The model with the coordinates of its compliant motors, see `drives`; itself where motors are ideal."""
    coupled = couplings(model.system, model.motor, model.sign, motors)
    found = giving_motors(model.system, model.motor, motors)
    if not found:
        return replace(model, coupled=coupled)
    system, t = add_motors(model.system, found, coupled), model.targets
    more = [(0, 0), (0, 0), (0, system.size - model.system.size)]
    targets = replace(t, Phi=np.pad(t.Phi, more), Psi=np.pad(t.Psi, more))
    delays = tuple(0.0 if motor.model == PRESCRIBED else motor.delay for motor in motors)
    return replace(model, system=system, targets=targets, delays=delays, coupled=coupled)


def _elastic_laws(bodies: Sequence[ReducedBody]) -> dict[str, Any]:
    """Entries of `System` for the elastic laws, bodies in the order of the components."""
    count = len(bodies)
    law, points, start = np.full(count, LINEAR, np.int32), np.zeros(count, np.int64), np.zeros(count, np.int64)
    retardation, lame = np.zeros(count), np.zeros((count, 2))
    arrays: list[Array] = []
    size = 0
    for k, body in enumerate(bodies):
        elasticity = body.elasticity
        if elasticity is None:
            continue
        law[k] = {"stvk": STVK, "neohookean": NEOHOOKEAN}[elasticity.law]
        retardation[k], lame[k], start[k] = elasticity.retardation, elasticity.lame, size
        points[k] = elasticity.points if elasticity.law == "neohookean" else len(body.stiffness)
        data, projection = elasticity.data, elasticity.strain_projection
        if projection is not None:
            points[k], data = len(projection), np.concatenate([data, projection.ravel()])
        arrays.append(data)
        size += data.size
    data = np.concatenate(arrays) if arrays else np.zeros(0)
    return {
        "law": law, "stvk": components(law == STVK), "neohookean": components(law == NEOHOOKEAN),
        "retardation": retardation, "lame": lame, "points": points, "data_start": start, "data": data,
    }  # fmt: skip


def _targets(
    character: Character, tree: Tree, bodies: Sequence[ReducedBody], anchors: list[BodyAnchors], r_max: int
) -> Targets:
    count = len(character.targets)
    component_of = {b: k for k, b in enumerate(tree.body)}
    Phi, Psi = np.zeros((count, 3, r_max)), np.zeros((count, 3, r_max))
    position, rotation = np.zeros((count, 3)), np.zeros((count, 3, 3))
    for k, target in enumerate(character.targets):
        frames = anchors[target.body]
        marker = bodies[target.body].markers[len(frames.joints) + frames.targets.index(k)]
        r = marker.Phi.shape[1]
        position[k], rotation[k] = marker.position, rotation_from_quaternion(marker.rotation)
        Phi[k, :, :r], Psi[k, :, :r] = marker.Phi, marker.Psi
    return Targets(
        component=np.array([component_of[target.body] for target in character.targets], np.int32),
        position=position,
        rotation=rotation,
        Phi=Phi,
        Psi=Psi,
        position_weight=np.array([target.position_weight for target in character.targets]),
        rotation_weight=np.array([target.rotation_weight for target in character.targets]),
    )


def rigid_model(model: Model) -> Model:
    """The same character with every body rigid, and every motor ideal."""
    system = model.system
    none = 0
    rigid = system._replace(
        elastic=np.zeros_like(system.elastic),
        servos=system.servos[:none],
        rotor=np.full_like(system.rotor, -1),
        modes=np.zeros_like(system.modes),
        inertia=np.ascontiguousarray(system.inertia[:, :none]),
        M3=np.ascontiguousarray(system.M3[:, :none]),
        M4=np.ascontiguousarray(system.M4[:, :none]),
        S=np.ascontiguousarray(system.S[:, :none, :none]),
        axial=np.ascontiguousarray(system.axial[:, :none, :none]),
        axial0=np.ascontiguousarray(system.axial0[:, :none]),
        stiffness=np.ascontiguousarray(system.stiffness[:, :none]),
        damping=np.ascontiguousarray(system.damping[:, :none, :none]),
        law=np.full_like(system.law, LINEAR),
        stvk=system.stvk[:none],
        neohookean=system.neohookean[:none],
        data=np.zeros(0),
        Phi=np.ascontiguousarray(system.Phi[..., :none]),
        Psi=np.ascontiguousarray(system.Psi[..., :none]),
        unit=np.ascontiguousarray(system.unit[:, : 6 + none]),
    )
    t = model.targets
    targets = Targets(
        t.component, t.position, t.rotation, np.ascontiguousarray(t.Phi[..., :none]),
        np.ascontiguousarray(t.Psi[..., :none]), t.position_weight, t.rotation_weight,
    )  # fmt: skip
    coupled = tuple(own._replace(compliant=False) for own in model.coupled)
    return Model(rigid, model.tree, model.motor, model.sign, targets, model.rest_angles, coupled=coupled)


def moves_freely(model: Model) -> BoolArray:
    """Which joints move freely: they have no motor and are neither welds nor contacts."""
    system = model.system
    return np.asarray((system.rows < 6) & (system.contact == 0))


def start_angles(model: Model, joint_angles: Array) -> Array:
    """Angles of all joints for the first pose: motors from their tracks, free joints as the shot was authored."""
    free = moves_freely(model)
    return np.where(free, model.rest_angles, joint_angles)


def with_damping(model: Model, ratio: float, frequency: float) -> Model:
    """A model with additional Kelvin-Voigt damping, which is proportional to the frequency.

    Args:
        ratio: Of critical, at the given frequency.
        frequency: [Hz], not zero.
    """
    system, retardation = model.system, ratio / (np.pi * frequency)
    added = retardation * system.stiffness[:, :, None] * np.eye(system.stiffness.shape[1])
    damped = system._replace(damping=system.damping + added, retardation=system.retardation + retardation)
    return replace(model, system=damped)


__all__ = [
    "BodyAnchors",
    "Model",
    "Targets",
    "body_anchors",
    "compile_model",
    "rigid_body",
    "rigid_model",
    "span_tree",
]
