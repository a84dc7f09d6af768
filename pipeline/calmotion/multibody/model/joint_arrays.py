"""The joints of a character as flat arrays: those of the tree, by component, then those that close chains."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.model.character import WORLD, Character, Frame, switched_motors
from calmotion.multibody.model.system import SERVO_COLUMNS
from calmotion.multibody.model.topology import Tree
from calmotion.reduction.reduced_body import Marker, ReducedBody
from calmotion.support.rotations import rotation_from_quaternion

# constraint rows of a joint without a motor
_ROWS = {"fixed": 6, "revolute": 5, "spherical": 3, "prismatic": 5, "floating": 0}


@dataclass(frozen=True, eq=False)
class BodyAnchors:
    """The frames of a body that joints and targets use, in this order; `root` is the joint to its parent."""

    joints: tuple[int, ...]
    targets: tuple[int, ...]
    frames: tuple[Frame, ...]
    root: int


def body_anchors(character: Character, tree: Tree) -> list[BodyAnchors]:
    """For each body, which frames its reduction must provide markers for."""
    carrier = dict(zip(tree.body, tree.joint, strict=True))
    result = []
    for index in range(len(character.bodies)):
        joints = [k for k, joint in enumerate(character.joints) if index in (joint.body0, joint.body1)]
        targets = [k for k, target in enumerate(character.targets) if target.body == index]
        frames = [_side(character, k, index) for k in joints] + [character.targets[k].frame for k in targets]
        result.append(BodyAnchors(tuple(joints), tuple(targets), tuple(frames), joints.index(carrier[index])))
    return result


def _side(character: Character, joint: int, body: int) -> Frame:
    ends = character.joints[joint]
    return ends.frame0 if ends.body0 == body else ends.frame1


@dataclass(frozen=True, eq=False)
class JointArrays:
    """Entries of `System` and `Model` for the joints."""

    arrays: dict[str, Any]
    motor: IntArray
    sign: Array
    rest: Array


def joint_arrays(
    character: Character, tree: Tree, bodies: Sequence[ReducedBody], anchors: list[BodyAnchors], r_max: int,
    moving: Sequence[int] = (),
) -> JointArrays:  # fmt: skip
    """Joints of the tree, by component, then those that close chains.

    Args:
        moving: Joints whose world-side frame has a prescribed motion, in the order of `work.Work.world`, which
            contacts follow, and after them the motors that are switched.
    """
    component_of = {WORLD: -1} | {b: k for k, b in enumerate(tree.body)}
    order = [*tree.joint, *tree.closing]
    count = len(order)
    side, rows = np.zeros((count, 2), np.int32), np.zeros(count, np.int32)
    sliding, motor, sign = np.zeros(count, np.int32), np.full(count, -1, np.int32), np.ones(count)
    moved, contact = np.full(count, -1, np.int32), np.zeros(count, np.int32)
    contacts = [k for k in order if character.joints[k].contact is not None]
    moving = [*moving, *contacts]
    switched = switched_motors(character)
    position, rotation = np.zeros((count, 2, 3)), np.zeros((count, 2, 3, 3))
    Phi, Psi = np.zeros((count, 2, 3, r_max)), np.zeros((count, 2, 3, r_max))
    rest = np.zeros(count)
    switch = np.full(count, -1, np.int32)
    motor_of = {motor.joint: k for k, motor in enumerate(character.motors)}
    for k, index in enumerate(order):
        joint = character.joints[index]
        # a joint that closes a chain has the world on its first side, too, or on none
        flipped = tree.flipped[k] if k < len(tree.body) else joint.body1 == WORLD
        ends = [(joint.body0, joint.frame0), (joint.body1, joint.frame1)]
        if flipped:
            ends.reverse()
        bodies_of = [body for body, _ in ends]
        for end, (body, frame) in enumerate(ends):
            side[k, end] = component_of[body]
            none = np.zeros((3, 0))
            marker = Marker(frame.position, frame.rotation, none, none)
            if body != WORLD:
                marker = bodies[body].markers[anchors[body].joints.index(index)]
            r = marker.Phi.shape[1]
            position[k, end], rotation[k, end] = marker.position, rotation_from_quaternion(marker.rotation)
            Phi[k, end, :, :r], Psi[k, end, :, :r] = marker.Phi, marker.Psi
        if joint.kind == "spherical":
            # a ball joint has no axes: those of its second side are chosen so that the authored pose has zero rotation
            turns = [
                np.eye(3) if b == WORLD else rotation_from_quaternion(character.bodies[b].rest.rotation)
                for b in bodies_of
            ]
            rotation[k, 1] = turns[1].T @ turns[0] @ rotation[k, 0]
        sign[k] = -1.0 if flipped else 1.0
        motor[k] = motor_of.get(index, -1)
        if motor[k] in switched:
            switch[k] = len(moving) + switched.index(motor[k])
        sliding[k] = joint.kind == "prismatic"
        moved[k] = moving.index(index) if index in moving else -1
        rows[k] = _ROWS[joint.kind] if motor[k] < 0 else 6
        if joint.contact is not None:
            contact[k], rows[k] = rows[k], rows[k] if joint.contact.holds_at(0.0) else 0
        rest[k] = _rest_value(character, bodies_of, position[k], rotation[k], joint.kind == "prismatic")
    arrays = {
        "side": side, "rows": rows, "servos": np.zeros(0, np.int32), "rotor": np.full(count, -1, np.int32),
        "servo": np.zeros((count, SERVO_COLUMNS)), "sliding": sliding, "moving": moved, "switch": switch,
        "contact": contact, "position": position, "rotation": rotation, "Phi": Phi, "Psi": Psi,
    }  # fmt: skip
    return JointArrays(arrays, motor, sign, rest)


def _rest_value(character: Character, ends: Sequence[int], position: Array, rotation: Array, sliding: bool) -> float:
    """Angle (or length) of a joint in the pose in which the shot was authored; parent's side first."""
    frames = []
    for body, x, R in zip(ends, position, rotation, strict=True):
        rest = None if body == WORLD else character.bodies[body].rest
        turn = np.eye(3) if rest is None else rotation_from_quaternion(rest.rotation)
        frames.append((turn @ x + (np.zeros(3) if rest is None else rest.position), turn @ R))
    if sliding:
        return float((frames[1][0] - frames[0][0]) @ frames[0][1][:, 2])
    Q = frames[0][1].T @ frames[1][1]
    return float(np.arctan2(Q[1, 0] - Q[0, 1], Q[0, 0] + Q[1, 1]))
