# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys of bones and objects in copies of their actions; the animator's own actions are kept, and known from these."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import bpy
from mathutils import Matrix, Quaternion

CHANGED = 2e-5  # a smaller difference counts as unchanged [rad or m]
_PATHS = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}
_SOURCE, _REST = "calmotion_source", "calmotion_rest"  # of a result: the action it is of, and values that had no keys
_OBJECT = "."  # in place of the name of a bone

Target = bpy.types.PoseBone | bpy.types.Object
Kept = list[tuple[bpy.types.Object, bpy.types.Action, str | None]]


def basis_of(armature: bpy.types.Object, posed: Mapping[str, bpy.types.PoseBone], name: str) -> Matrix:
    """The transform of a bone from its rest, by the rests of the armature and bones in a pose, by their names in it."""
    bone = armature.data.bones[name]
    if bone.parent is None:
        return bone.matrix_local.inverted() @ posed[name].matrix
    rest = bone.parent.matrix_local.inverted() @ bone.matrix_local
    return rest.inverted() @ posed[bone.parent.name].matrix.inverted() @ posed[name].matrix


def apart(one: Quaternion, other: Quaternion) -> float:
    """Angle between two rotations; exact also where it is small."""
    difference = one.rotation_difference(other)
    return 2.0 * math.atan2(math.sqrt(sum(c * c for c in difference[1:])), abs(difference[0]))


def copied_action(obj: bpy.types.Object) -> tuple[bpy.types.AnimData, bpy.types.Action]:
    """A copy of an object's action, which takes its place; a new one where it had none."""
    data = obj.animation_data or obj.animation_data_create()
    slot = _slot(data)
    if data.action is not None:
        action = data.action.copy()
        action.name = f"{data.action.name}_calm"
        action[_SOURCE] = data.action
        data.action.use_fake_user = True
    else:
        action = bpy.data.actions.new(f"{obj.name}_calm")
    action[_REST] = {}
    _assign(data, action, slot)
    return data, action


def take_off(objects: Iterable[bpy.types.Object]) -> Kept:
    """Give objects the animator's own actions in the place of the results of earlier runs; returns these."""
    kept: Kept = []
    for obj in objects:
        data = obj.animation_data
        action = data.action if data else None
        if action is None or _REST not in action or (_SOURCE in action and action[_SOURCE] is None):
            continue  # no result, or one whose animation the animator has deleted
        slot = _slot(data)
        kept.append((obj, action, slot))
        _assign(data, action.get(_SOURCE), slot)
        for name, values in action[_REST].to_dict().items():
            target = obj if name == _OBJECT else obj.pose.bones.get(name)
            for path, value in values.items() if target is not None else ():
                setattr(target, path, value)
    return kept


def put_on(kept: Kept) -> None:
    """Give objects the results again that `take_off` took."""
    for obj, action, slot in kept:
        _assign(obj.animation_data, action, slot)


def discard(kept: Kept) -> None:
    """Remove results that `take_off` took; new ones get their names."""
    names = [(obj, action.name) for obj, action, _ in kept]
    for action in {action.name: action for _, action, _ in kept}.values():
        if action.users == 0:
            bpy.data.actions.remove(action)
    for obj, name in names:
        action = obj.animation_data.action
        if action is not None and _REST in action and name not in bpy.data.actions:
            action.name = name


def _slot(data: bpy.types.AnimData) -> str | None:
    """From Blender 4.4 on, an action holds the curves of several things."""
    return getattr(getattr(data, "action_slot", None), "identifier", None)


def _assign(data: bpy.types.AnimData, action: bpy.types.Action | None, slot: str | None) -> None:
    data.action = action
    if slot is not None and action is not None:
        data.action_slot = next((s for s in action.slots if s.identifier == slot), None)


def key_motion(target: Target, old: list[Matrix], new: list[Matrix], frames: range, few: float) -> bool:
    """Key what differs of the transform of an object or a bone from its rest; whether that is anything.

    Args:
        old, new: Those transforms, at each frame.
        few: A smaller difference counts as none.
    """
    pairs = list(zip(old, new, strict=True))
    turned = max(apart(a.to_quaternion(), b.to_quaternion()) for a, b in pairs) > few
    shifted = max((a.translation - b.translation).length for a, b in pairs) > few
    if turned or shifted:
        obj = target.id_data
        data = obj.animation_data
        if data is None or data.action is None or _REST not in data.action:
            data, _ = copied_action(obj)
        place = "" if target is obj else target.path_from_id()
        if turned:
            key_rotations(target, data, data.action, place, [matrix.to_quaternion() for matrix in new], frames)
        if shifted:
            _forget(target, data, data.action, place, "location")
            for frame, matrix in zip(frames, new, strict=True):
                target.location = matrix.translation
                target.keyframe_insert("location", frame=frame)
    return turned or shifted


def key_rotations(
    target: Target, data: bpy.types.AnimData, action: bpy.types.Action, place: str,
    turns: list[Quaternion], frames: range,
) -> None:  # fmt: skip
    """Key the rotation of a bone or an object at every frame, in place of the curves that it had.

    Args:
        place: Path of the bone within the armature; empty for an object.
    """
    name = _PATHS.get(target.rotation_mode, "rotation_euler")
    _forget(target, data, action, place, name)
    previous = None
    for frame, turn in zip(frames, turns, strict=True):
        previous = _set(target, name, turn, previous)
        target.keyframe_insert(name, frame=frame)


def _set(bone: Target, path: str, turn: Quaternion, previous: object) -> object:
    """Set the rotation of a bone in its rotation mode, near the previous value; returns the value."""
    if path == "rotation_quaternion":
        value = turn.copy()
        if previous is not None:
            value.make_compatible(previous)
        bone.rotation_quaternion = value
        return value
    if path == "rotation_axis_angle":
        axis, angle = turn.to_axis_angle()
        bone.rotation_axis_angle = (angle, *axis)
        return None
    euler = turn.to_euler(bone.rotation_mode, previous) if previous is not None else turn.to_euler(bone.rotation_mode)
    bone.rotation_euler = euler
    return euler


def _forget(target: Target, data: bpy.types.AnimData, action: bpy.types.Action, place: str, name: str) -> None:
    """Remove the curves of a property from an action, which remembers its value."""
    rest = action[_REST].to_dict()
    rest.setdefault(target.name if place else _OBJECT, {})[name] = list(getattr(target, name))
    action[_REST] = rest
    path = f"{place}.{name}".lstrip(".")
    if hasattr(action, "layers"):
        bags = [bag for layer in action.layers for strip in layer.strips for bag in strip.channelbags]
        bags = [bag for bag in bags if bag.slot == data.action_slot]
    else:
        bags = [action]
    for bag in bags:
        for curve in [curve for curve in bag.fcurves if curve.data_path == path]:
            bag.fcurves.remove(curve)
